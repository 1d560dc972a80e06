// Draws a mesh with smooth normals in WebGL 1 or 2, seen by a camera that turns around it. Knows nothing of models.
"use strict";

const MESH_VERTEX = `
  attribute vec3 position;
  attribute vec3 normal;
  attribute float hollow;
  uniform mat4 view, projection;
  uniform mediump float pointSize;
  varying vec3 seen, facing;
  varying float depth;
  void main() {
    vec4 point = view * vec4(position, 1.0);
    seen = point.xyz;
    facing = mat3(view[0].xyz, view[1].xyz, view[2].xyz) * normal;
    depth = hollow;
    gl_Position = projection * point;
    gl_PointSize = pointSize;
  }`;

// Lights stay with the camera: a warm one from above, a cool one opposite, sky and ground. Red light travels further in skin than blue, so it
// reaches a little around the edge of the shadow.
const MESH_FRAGMENT = `
  precision mediump float;
  varying vec3 seen, facing;
  varying float depth;
  uniform float sided;
  vec3 wrapped(float cosine, vec3 width) { return clamp((cosine + width) / (1.0 + width), 0.0, 1.0); }
  void main() {
    bool front = gl_FrontFacing || sided < 0.5;
    vec3 n = normalize(facing) * (front ? 1.0 : -1.0);
    vec3 v = normalize(-seen);
    vec3 skin = front ? vec3(0.62, 0.39, 0.295) : vec3(0.10, 0.026, 0.022);
    float hollowed = clamp(depth * 3.0, -0.25, 0.75);
    skin *= mix(vec3(1.0), vec3(0.55, 0.34, 0.30), max(hollowed, 0.0)) * (1.0 - 0.35 * min(hollowed, 0.0));
    vec3 key = normalize(vec3(-0.45, 0.62, 0.66)), fill = normalize(vec3(0.85, 0.05, 0.4));
    vec3 light = vec3(1.12, 1.04, 0.95) * wrapped(dot(n, key), vec3(0.30, 0.14, 0.09));
    light += vec3(0.17, 0.21, 0.27) * wrapped(dot(n, fill), vec3(0.25));
    light += mix(vec3(0.10, 0.075, 0.065), vec3(0.24, 0.26, 0.29), n.y * 0.5 + 0.5);
    vec3 h = normalize(key + v);
    float grazing = pow(1.0 - clamp(dot(n, v), 0.0, 1.0), 4.0);
    float shine = 0.055 * pow(clamp(dot(n, h), 0.0, 1.0), 18.0) + 0.035 * pow(clamp(dot(n, h), 0.0, 1.0), 70.0);
    vec3 colour = skin * light + (front ? vec3(shine * (1.0 - max(hollowed, 0.0)) + 0.10 * grazing * (0.4 + 0.6 * n.y)) : vec3(0.0));
    gl_FragColor = vec4(pow(clamp(colour, 0.0, 1.0), vec3(1.0 / 2.2)), 1.0);
  }`;

const POINT_VERTEX = `
  attribute vec3 position;
  uniform mat4 view, projection;
  uniform mediump float pointSize;
  void main() {
    vec4 point = view * vec4(position, 1.0);
    point.xyz *= 0.985;
    gl_Position = projection * point;
    gl_PointSize = pointSize;
  }`;

const POINT_FRAGMENT = `
  precision mediump float;
  uniform mediump float pointSize;
  void main() {
    float from = length(gl_PointCoord - 0.5) * 2.0;
    float soft = 3.0 / pointSize;
    float cover = 1.0 - smoothstep(1.0 - soft, 1.0, from);
    vec3 colour = mix(vec3(0.10, 0.42, 0.62), vec3(1.0), smoothstep(0.58, 0.58 + soft, from));
    gl_FragColor = vec4(colour * cover, cover);
  }`;

const FIELD_OF_VIEW = 0.42;

/** Largest pitch, radians: short of the pole, where turning means nothing. */
const MOST_PITCH = 1.4;

class Scene {
  #canvas;
  #gl;
  #programs;
  #buffers;
  #faces = new Uint32Array(0);
  #positions = new Float32Array(0);
  #normals = new Float32Array(0);
  #hollows = new Float32Array(0);
  #landmarks = new Uint32Array(0);
  /** Triangles that close the openings of the mesh from inside, and the loop around each. */
  #caps = new Uint32Array(0);
  #loops = [];
  #centre = [0, 0, 0];
  #radius = 1;
  #edge = 1;

  /** Where the camera is: angles in radians, and a factor of the distance from which the whole mesh is seen. */
  camera = { yaw: 0, pitch: 0, distance: 1 };
  showsLandmarks = false;

  constructor(canvas) {
    this.#canvas = canvas;
    const options = { antialias: true, alpha: true, premultipliedAlpha: true };
    this.#gl = canvas.getContext("webgl2", options) ?? canvas.getContext("webgl", options);
    if (this.#gl === null) throw new Error("This browser offers no WebGL, so the face cannot be drawn. Try another browser, or switch hardware acceleration on.");
    this.#setUp();
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => {
      this.#setUp();
      this.#uploadFaces();
      this.#uploadPositions();
      this.draw();
    });
  }

  /** Name of what draws. */
  get version() {
    return this.#gl.getParameter(this.#gl.VERSION);
  }

  /** A new mesh. `positions` are those that the camera looks at; without faces the vertices are drawn as points. */
  setMesh(faces, positions, landmarks) {
    this.#faces = faces;
    this.#landmarks = landmarks;
    const n = positions.length / 3;
    this.#loops = openings(faces, positions);
    this.#caps = Uint32Array.from(this.#loops.flatMap((loop, k) => loop.flatMap((vertex, at) => [vertex, loop[(at + 1) % loop.length], n + k])));
    this.#positions = new Float32Array(3 * (n + this.#loops.length));
    this.#normals = new Float32Array(this.#positions.length);
    this.#hollows = new Float32Array(n + this.#loops.length);
    const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
    positions.forEach((value, k) => {
      low[k % 3] = Math.min(low[k % 3], value);
      high[k % 3] = Math.max(high[k % 3], value);
    });
    this.#centre = low.map((value, axis) => (value + high[axis]) / 2);
    this.#radius = Math.max(1e-6, Math.hypot(...low.map((value, axis) => (high[axis] - value) / 2)));
    this.#edge = meanEdge(faces, positions) || 1;
    this.#uploadFaces();
    this.setPositions(positions);
  }

  /** The same mesh in another shape. */
  setPositions(positions) {
    this.#positions.set(positions);
    shade(this.#faces, this.#positions, this.#normals, this.#hollows, this.#edge);
    this.#loops.forEach((loop, k) => this.#positions.set(behind(loop, positions, this.#normals), positions.length + 3 * k));
    this.#uploadPositions();
  }

  draw() {
    const [gl, canvas] = [this.#gl, this.#canvas];
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [Math.max(1, Math.round(canvas.clientWidth * ratio)), Math.max(1, Math.round(canvas.clientHeight * ratio))];
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (this.#positions.length === 0) return;
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    const { view, projection } = this.#matrices();
    const mesh = this.#used("mesh", view, projection, 2 * ratio);
    gl.uniform1f(gl.getUniformLocation(mesh, "sided"), this.#faces.length > 0 ? 1 : 0);
    this.#attribute(mesh, "position", this.#buffers.positions, 3);
    this.#attribute(mesh, "normal", this.#buffers.normals, 3);
    this.#attribute(mesh, "hollow", this.#buffers.hollows, 1);
    if (this.#faces.length > 0) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.#buffers.faces);
      gl.drawElements(gl.TRIANGLES, this.#faces.length + this.#caps.length, this.#indexType(), 0);
    } else {
      gl.drawArrays(gl.POINTS, 0, this.#positions.length / 3);
    }
    if (this.showsLandmarks && this.#landmarks.length > 0) {
      const points = this.#used("points", view, projection, 11 * ratio);
      const found = Float32Array.from({ length: 3 * this.#landmarks.length }, (_, k) => this.#positions[3 * this.#landmarks[Math.floor(k / 3)] + (k % 3)]);
      gl.bindBuffer(gl.ARRAY_BUFFER, this.#buffers.points);
      gl.bufferData(gl.ARRAY_BUFFER, found, gl.DYNAMIC_DRAW);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      this.#attribute(points, "position", this.#buffers.points, 3);
      gl.drawArrays(gl.POINTS, 0, this.#landmarks.length);
    }
  }

  /** Where a vertex is in the picture, CSS pixels from its left upper corner, and whether it faces the camera. */
  seen(vertex) {
    const { view, projection } = this.#matrices();
    const point = applied(view, [...this.#positions.subarray(3 * vertex, 3 * vertex + 3), 1]);
    const normal = applied(view, [...this.#normals.subarray(3 * vertex, 3 * vertex + 3), 0]);
    const [x, y, , w] = applied(projection, point);
    const facing = normal[0] * point[0] + normal[1] * point[1] + normal[2] * point[2] < 0;
    return { x: ((x / w + 1) / 2) * this.#canvas.clientWidth, y: ((1 - y / w) / 2) * this.#canvas.clientHeight, facing };
  }

  /** Where a vertex would be after so many CSS pixels, moved in the plane of the picture. */
  pulled(vertex, dx, dy) {
    const { view } = this.#matrices();
    const point = Array.from(this.#positions.subarray(3 * vertex, 3 * vertex + 3));
    const perPixel = (-applied(view, [...point, 1])[2] * 2 * Math.tan(FIELD_OF_VIEW / 2)) / this.#canvas.clientHeight;
    // The first two rows of the view are the picture's axes.
    return point.map((value, axis) => value + perPixel * (dx * view[4 * axis] - dy * view[4 * axis + 1]));
  }

  #matrices() {
    const { yaw, pitch, distance } = this.camera;
    const aspect = this.#canvas.clientWidth / Math.max(1, this.#canvas.clientHeight);
    // In a narrow picture the width decides.
    const away = ((this.#radius * 1.02) / Math.sin(FIELD_OF_VIEW / 2) / Math.min(1, aspect * 1.22)) * 1.06 * distance;
    const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
    const rows = [[cy, 0, sy], [sp * sy, cp, -sp * cy], [-cp * sy, sp, cp * cy]];
    const shift = rows.map((row) => -row.reduce((sum, value, axis) => sum + value * this.#centre[axis], 0));
    shift[2] -= away;
    const view = new Float32Array(16);
    for (let column = 0; column < 3; column++) for (let row = 0; row < 3; row++) view[4 * column + row] = rows[row][column];
    view.set([...shift, 1], 12);
    const [near, far] = [Math.max(away - 2 * this.#radius, away * 0.02), away + 2 * this.#radius];
    const f = 1 / Math.tan(FIELD_OF_VIEW / 2);
    const projection = new Float32Array(16);
    projection.set([f / aspect], 0);
    projection.set([f], 5);
    projection.set([(far + near) / (near - far), -1], 10);
    projection.set([(2 * far * near) / (near - far)], 14);
    return { view, projection };
  }

  #setUp() {
    const gl = this.#gl;
    this.#programs = { mesh: linked(gl, MESH_VERTEX, MESH_FRAGMENT), points: linked(gl, POINT_VERTEX, POINT_FRAGMENT) };
    const names = ["positions", "normals", "hollows", "faces", "points"];
    this.#buffers = Object.fromEntries(names.map((name) => [name, gl.createBuffer()]));
  }

  #wide() {
    return this.#positions.length / 3 > 65536;
  }

  #indexType() {
    return this.#wide() ? this.#gl.UNSIGNED_INT : this.#gl.UNSIGNED_SHORT;
  }

  #uploadFaces() {
    const gl = this.#gl;
    const wideKnown = typeof WebGL2RenderingContext === "function" && gl instanceof WebGL2RenderingContext;
    if (this.#wide() && !wideKnown && gl.getExtension("OES_element_index_uint") === null) {
      throw new Error("This browser's WebGL draws no more than 65536 vertices.");
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.#buffers.faces);
    const indices = new (this.#wide() ? Uint32Array : Uint16Array)(this.#faces.length + this.#caps.length);
    indices.set(this.#faces);
    indices.set(this.#caps, this.#faces.length);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
  }

  #uploadPositions() {
    const gl = this.#gl;
    for (const [name, values] of [["positions", this.#positions], ["normals", this.#normals], ["hollows", this.#hollows]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.#buffers[name]);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    }
  }

  #used(name, view, projection, pointSize) {
    const [gl, program] = [this.#gl, this.#programs[name]];
    gl.useProgram(program);
    gl.uniformMatrix4fv(gl.getUniformLocation(program, "view"), false, view);
    gl.uniformMatrix4fv(gl.getUniformLocation(program, "projection"), false, projection);
    gl.uniform1f(gl.getUniformLocation(program, "pointSize"), pointSize);
    return program;
  }

  #attribute(program, name, buffer, size) {
    const gl = this.#gl;
    const at = gl.getAttribLocation(program, name);
    if (at < 0) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
  }
}

function linked(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
    throw new Error(`The graphics driver refuses the shading: ${[...logs, gl.getProgramInfoLog(program)].join(" ").trim()}`);
  }
  return program;
}

function applied(matrix, vector) {
  return [0, 1, 2, 3].map((row) => vector.reduce((sum, value, column) => sum + matrix[4 * column + row] * value, 0));
}

function meanEdge(faces, positions) {
  let sum = 0;
  for (let k = 0; k < faces.length; k++) {
    const [a, b] = [3 * faces[k], 3 * faces[k % 3 === 2 ? k - 2 : k + 1]];
    sum += Math.hypot(positions[a] - positions[b], positions[a + 1] - positions[b + 1], positions[a + 2] - positions[b + 2]);
  }
  return sum / faces.length;
}

/** The loops of edges with one triangle, but for the longest, which is the rim of a mask: the mouth, for instance. Each in its triangles' order. */
function openings(faces, positions) {
  const n = positions.length / 3;
  const edges = new Set();
  for (let k = 0; k < faces.length; k++) edges.add(faces[k] * n + faces[k % 3 === 2 ? k - 2 : k + 1]);
  const next = new Map();
  for (const edge of edges) {
    const [from, to] = [Math.floor(edge / n), edge % n];
    if (!edges.has(to * n + from)) next.set(from, to);
  }
  const loops = [];
  while (next.size > 0) {
    const [start] = next.keys();
    const loop = [];
    for (let vertex = start; next.has(vertex); ) {
      loop.push(vertex);
      const following = next.get(vertex);
      next.delete(vertex);
      vertex = following;
    }
    loops.push(loop);
  }
  const length = (loop) =>
    loop.reduce((sum, vertex, k) => {
      const [a, b] = [3 * vertex, 3 * loop[(k + 1) % loop.length]];
      return sum + Math.hypot(positions[a] - positions[b], positions[a + 1] - positions[b + 1], positions[a + 2] - positions[b + 2]);
    }, 0);
  const lengths = loops.map(length);
  return loops.filter((loop, k) => loop.length > 2 && lengths[k] < Math.max(...lengths));
}

/** A point behind the middle of a loop, half its mean radius against the mean normal. */
function behind(loop, positions, normals) {
  const mean = (values) => [0, 1, 2].map((axis) => loop.reduce((sum, vertex) => sum + values[3 * vertex + axis], 0) / loop.length);
  const [middle, normal] = [mean(positions), mean(normals)];
  const radius = loop.reduce((sum, vertex) => sum + Math.hypot(...middle.map((value, axis) => positions[3 * vertex + axis] - value)), 0) / loop.length;
  const long = Math.hypot(...normal) || 1;
  return middle.map((value, axis) => value - (0.5 * radius * normal[axis]) / long);
}

/** Unit normals, weighted by area, and how far each vertex lies in a hollow: its neighbours' mean along the normal, in edges. */
function shade(faces, positions, normals, hollows, edge) {
  normals.fill(0);
  const means = new Float32Array(positions.length);
  const counts = new Float32Array(hollows.length);
  for (let k = 0; k < faces.length; k += 3) {
    const [i, j, l] = [faces[k], faces[k + 1], faces[k + 2]];
    const [a, b, c] = [3 * i, 3 * j, 3 * l];
    const [ux, uy, uz] = [positions[b] - positions[a], positions[b + 1] - positions[a + 1], positions[b + 2] - positions[a + 2]];
    const [vx, vy, vz] = [positions[c] - positions[a], positions[c + 1] - positions[a + 1], positions[c + 2] - positions[a + 2]];
    const n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (let axis = 0; axis < 3; axis++) {
      const [p, q, r] = [positions[a + axis], positions[b + axis], positions[c + axis]];
      normals[a + axis] += n[axis];
      normals[b + axis] += n[axis];
      normals[c + axis] += n[axis];
      means[a + axis] += q + r;
      means[b + axis] += p + r;
      means[c + axis] += p + q;
    }
    counts[i] += 2;
    counts[j] += 2;
    counts[l] += 2;
  }
  for (let vertex = 0; vertex < hollows.length; vertex++) {
    const at = 3 * vertex;
    const length = Math.hypot(normals[at], normals[at + 1], normals[at + 2]);
    let along = 0;
    for (let axis = 0; axis < 3; axis++) {
      normals[at + axis] = length > 0 ? normals[at + axis] / length : axis === 2 ? 1 : 0;
      along += normals[at + axis] * (means[at + axis] / Math.max(1, counts[vertex]) - positions[at + axis]);
    }
    hollows[vertex] = counts[vertex] > 0 ? along / edge : 0;
  }
}
