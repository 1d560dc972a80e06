// The page: sliders in standard deviations, expressions as presets, the picture, files. Uses habitus.js for the model, scene.js for the picture and
// bytes.js for the module and a first model; those come as a script because a page opened from a folder may fetch nothing.
"use strict";

const element = (id) => document.getElementById(id);
const canvas = element("canvas");
const MODES = ["identity", "pose"];

/** Sliders go to so many standard deviations, or further where an expression lies beyond. */
const REACH = 3;
/** Sliders of a mode that are shown at once; the others are behind a click. */
const SHOWN = 10;
/** Sliders of a mode at most: a wavelet model has weights of its own for every coefficient, the coarsest first. */
const MOST = 60;
/** Levels of a wavelet model that a pull moves, from the coarsest. */
const PULLED_LEVELS = 3;
const EASING_MS = 220;

let kernel;
let scene;
/** The opened model and what is kept of it; undefined before the first. */
let shown;
let drawing = 0;

function start() {
  setUpControls();
  try {
    scene = new Scene(canvas);
  } catch (error) {
    return failed(error.message);
  }
  setUpCamera();
  return load();
}

async function load() {
  try {
    const { wasm, wasmSimd, model, modelName } = globalThis.HabitusBytes ?? {};
    if (wasm === undefined) throw new Error("bytes.js is missing beside this page: `cargo xtask wasm` assembles the folder.");
    kernel = await Habitus.load(decoded(wasmSimd !== undefined && Habitus.hasSimd() ? wasmSimd : wasm));
    open(decoded(model), modelName);
  } catch (error) {
    failed(error.message);
  }
}

function decoded(base64) {
  const text = atob(base64);
  return Uint8Array.from({ length: text.length }, (_, k) => text.charCodeAt(k));
}

/** Shows a model; when its bytes are refused, says why and leaves the former one. */
function open(bytes, name) {
  let model;
  try {
    model = kernel.open(bytes);
    const counts = model.counts;
    const statistics = Object.fromEntries(MODES.map((mode) => [mode, statisticsOf(model, mode)]));
    const starts = model.poseStarts().map((weights) => deviationsOf(weights, statistics.pose));
    const names = model.poseNames();
    const deviations = { identity: new Float32Array(counts.identityDim), pose: new Float32Array(counts.poseDim) };
    const next = { model, name, counts, statistics, deviations, landmarks: model.landmarks(), landmarkNames: model.landmarkNames() };
    next.presets = starts.map((start, k) => ({ name: words(names[k] ?? `expression ${k + 1}`), deviations: start }));
    next.angles = anglesOf(model);
    next.levels = counts.kind === Habitus.CONSTANTS.HAB_KIND_WAVELET ? model.grid().levels : undefined;
    next.positions = new Float32Array(3 * counts.nVertices);
    model.evaluate(weightsOf(next), next.positions);
    scene.setMesh(model.faces(), next.positions, next.landmarks);
    shown?.model.close();
    shown = next;
  } catch (error) {
    model?.close();
    return failed(`${name} cannot be opened. ${error.message}`);
  }
  element("message").hidden = true;
  element("model-name").textContent = name;
  buildControls();
  buildLabels();
  figures();
  changed();
  document.documentElement.dataset.state = "ready";
}

/** Mean and standard deviation of the weights; 0 and 1 in a file without statistics, so that sliders then move the weights themselves. */
function statisticsOf(model, mode) {
  const part = (name) => {
    const id = Habitus.CONSTANTS[`HAB_SECTION_${mode.toUpperCase()}_${name}`];
    return model.section(id) === undefined ? undefined : model.readF32(id);
  };
  const dim = mode === "identity" ? model.counts.identityDim : model.counts.poseDim;
  const [mean, scale] = [part("MEAN"), part("SCALE")];
  return { known: mean !== undefined, mean: mean ?? new Float32Array(dim), scale: scale ?? new Float32Array(dim).fill(1) };
}

/** Name and bounds of each pose weight of a body, radians; undefined for models without joints. */
function anglesOf(model) {
  const joints = model.joints();
  if (joints.length === 0) return undefined;
  const { lower, upper } = model.poseBounds() ?? {};
  return joints.flatMap(({ name, firstWeight, nWeights }, number) =>
    Array.from({ length: nWeights }, (_, k) => ({
      name: `${words(name || `joint ${number + 1}`)}${nWeights > 1 ? ` ${"xyz"[k]}` : ""}`,
      low: lower?.[firstWeight + k] ?? -Math.PI,
      high: upper?.[firstWeight + k] ?? Math.PI,
    })),
  );
}

function deviationsOf(weights, { mean, scale }) {
  return Float32Array.from(weights, (weight, k) => (scale[k] > 0 ? (weight - mean[k]) / scale[k] : 0));
}

function weightsOf({ model, statistics, deviations }) {
  const weights = (mode) => (statistics[mode].known ? model.weights(mode, deviations[mode]) : deviations[mode]);
  return { identity: weights("identity"), pose: weights("pose") };
}

/** After a change of the deviations: sliders at once, the picture with the next frame. */
function changed() {
  for (const mode of MODES) {
    document.querySelectorAll(`#${mode} input`).forEach((input, k) => {
      input.value = shown.deviations[mode][k];
      input.nextElementSibling.value = signed(shown.deviations[mode][k]);
    });
  }
  const equal = (a, b) => a.every((value, k) => Math.abs(value - b[k]) < 5e-3);
  document.querySelectorAll("#presets button").forEach((button, k) => {
    button.setAttribute("aria-pressed", String(equal(shown.presets[k].deviations, shown.deviations.pose)));
  });
  shown.stale = true;
  redraw();
}

function redraw() {
  if (drawing !== 0 || shown === undefined) return;
  drawing = requestAnimationFrame(() => {
    drawing = 0;
    if (shown.stale) {
      shown.model.evaluate(weightsOf(shown), shown.positions);
      scene.setPositions(shown.positions);
      shown.stale = false;
    }
    scene.draw();
    placeLabels();
    canvas.dataset.frames = Number(canvas.dataset.frames ?? 0) + 1;
  });
}

/** Moves the deviations to others within a moment. */
function ease(target) {
  cancelAnimationFrame(shown.easing);
  const from = Object.fromEntries(MODES.map((mode) => [mode, shown.deviations[mode].slice()]));
  const started = performance.now();
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const of = shown;
  canvas.dataset.easing = "yes";
  const step = () => {
    if (shown !== of) return;
    const t = still ? 1 : Math.min(1, (performance.now() - started) / EASING_MS);
    const along = t * t * (3 - 2 * t);
    for (const mode of MODES) {
      if (target[mode] === undefined) continue;
      shown.deviations[mode] = from[mode].map((value, k) => (t < 1 ? value + along * (target[mode][k] - value) : target[mode][k]));
    }
    changed();
    if (t < 1) shown.easing = requestAnimationFrame(step);
    else delete canvas.dataset.easing;
  };
  step();
}

function buildControls() {
  for (const mode of MODES) {
    const group = element(mode);
    group.querySelectorAll(".slider, details").forEach((old) => old.remove());
    const deviations = shown.deviations[mode];
    group.hidden = deviations.length === 0;
    const angles = mode === "pose" && shown.angles !== undefined ? "radians" : "weights";
    group.querySelector("small").textContent = shown.statistics[mode].known ? "in standard deviations" : angles;
    const furthest = mode === "pose" ? Math.max(0, ...shown.presets.flatMap((preset) => Array.from(preset.deviations, Math.abs))) : 0;
    const reach = Math.max(REACH, Math.ceil(furthest));
    const rest = document.createElement("details");
    const count = Math.min(deviations.length, MOST);
    const of = count < deviations.length ? ` of ${deviations.length}` : "";
    rest.append(Object.assign(document.createElement("summary"), { textContent: `${count - SHOWN} more${of}` }));
    for (let k = 0; k < count; k++) (k < SHOWN ? group : rest).append(slider(mode, k, reach));
    if (count > SHOWN) group.append(rest);
  }
  const chips = shown.presets.map(({ name, deviations }) => {
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: name });
    button.addEventListener("click", () => ease({ pose: deviations }));
    return button;
  });
  element("presets").hidden = chips.length === 0;
  document.querySelector(".chips").replaceChildren(...chips);
  element("landmarks").disabled = shown.landmarks.length === 0;
}

function slider(mode, k, reach) {
  const label = Object.assign(document.createElement("label"), { className: "slider" });
  const number = Object.assign(document.createElement("span"), { textContent: String(k + 1) });
  const input = Object.assign(document.createElement("input"), { type: "range", min: -reach, max: reach, step: 0.01, value: 0 });
  input.setAttribute("aria-label", `${mode === "identity" ? "Identity" : "Expression"} weight ${k + 1}`);
  // Bounds are those of the weights themselves.
  const angle = mode === "pose" && !shown.statistics.pose.known ? shown.angles?.[k] : undefined;
  if (angle !== undefined) {
    label.classList.add("named");
    number.textContent = angle.name;
    Object.assign(input, { min: angle.low, max: angle.high });
    input.setAttribute("aria-label", angle.name);
  }
  input.addEventListener("input", () => {
    cancelAnimationFrame(shown.easing);
    shown.deviations[mode][k] = Number(input.value);
    changed();
  });
  label.append(number, input, document.createElement("output"));
  return label;
}

function buildLabels() {
  const labels = shown.landmarkNames.map((name) => Object.assign(document.createElement("span"), { textContent: words(name) }));
  element("labels").replaceChildren(...labels);
  // Asked of the page once, since it lays itself out anew for an answer.
  element("labels").hidden = false;
  shown.labels = labels.map((label) => ({ label, width: label.offsetWidth, height: label.offsetHeight }));
}

/** Puts each name beside its landmark, where it covers neither a point nor another name; it is left out where there is no such place. */
function placeLabels() {
  element("labels").hidden = !scene.showsLandmarks;
  if (!scene.showsLandmarks) return;
  const points = shown.labels.map((_, k) => scene.seen(shown.landmarks[k]));
  const taken = points.filter(({ facing }) => facing).map(({ x, y }) => [x - 6, y - 6, x + 6, y + 6]);
  const middle = points.reduce((sum, { x }) => sum + x, 0) / points.length;
  shown.labels.forEach(({ label, width, height }, k) => {
    const { x, y, facing } = points[k];
    const [right, left] = [[x + 9, y - height / 2], [x - 9 - width, y - height / 2]];
    const [above, below] = [[x - width / 2, y - 9 - height], [x - width / 2, y + 9]];
    const places = [...(x < middle - 2 ? [left, right] : [right, left]), above, below];
    const free = ([l, t]) => taken.every((box) => l >= box[2] || t >= box[3] || l + width <= box[0] || t + height <= box[1]);
    const place = facing ? places.find(free) : undefined;
    label.classList.toggle("crowded", place === undefined);
    if (place === undefined) return;
    taken.push([place[0], place[1], place[0] + width, place[1] + height]);
    label.style.transform = `translate(${place[0]}px, ${place[1]}px)`;
    label.dataset.x = x;
    label.dataset.y = y;
  });
}

/** What the model has, and how long an evaluation takes: the mean of as many as fit into a moment, because a browser's clock is coarse. */
function figures() {
  const { model, counts, positions } = shown;
  const weights = weightsOf(shown);
  let [runs, elapsed] = [0, 0];
  const started = performance.now();
  do {
    model.evaluate(weights, positions);
    runs++;
    elapsed = performance.now() - started;
  } while (elapsed < 30);
  shown.msPerEvaluation = elapsed / runs;
  const rows = [
    ["Evaluation of all vertices", `${shown.msPerEvaluation.toFixed(shown.msPerEvaluation < 1 ? 3 : 1)} ms`],
    ["Vertices, triangles", `${counts.nVertices}, ${counts.nFaces}`],
    ["Weights", `${counts.identityDim} + ${counts.poseDim}`],
    ["Landmarks", String(counts.nLandmarks)],
  ];
  element("figures").replaceChildren(
    ...rows.flatMap(([term, value]) => [
      Object.assign(document.createElement("dt"), { textContent: term }),
      Object.assign(document.createElement("dd"), { textContent: value }),
    ]),
  );
}

function setUpControls() {
  element("random").addEventListener("click", () => {
    if (shown !== undefined) ease({ identity: shown.deviations.identity.map(() => Math.max(-2.5, Math.min(2.5, normalDeviate()))) });
  });
  element("reset").addEventListener("click", () => {
    if (shown === undefined) return;
    ease({ identity: shown.deviations.identity.map(() => 0), pose: shown.deviations.pose.map(() => 0) });
    Object.assign(scene.camera, { yaw: 0, pitch: 0, distance: 1 });
  });
  element("landmarks").addEventListener("change", (event) => {
    if (scene === undefined) return;
    scene.showsLandmarks = event.target.checked;
    element("hint").textContent = event.target.checked ? "Pull a landmark: the face is fitted to it" : "Drag to turn, scroll or pinch to zoom";
    redraw();
  });
  element("file").addEventListener("change", (event) => {
    openFile(event.target.files[0]);
    // The same file may be chosen again.
    event.target.value = "";
  });
  addEventListener("dragover", (event) => {
    event.preventDefault();
    document.body.classList.add("dropping");
  });
  addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) document.body.classList.remove("dropping");
  });
  addEventListener("drop", (event) => {
    event.preventDefault();
    document.body.classList.remove("dropping");
    openFile(event.dataTransfer.files[0]);
  });
  addEventListener("resize", redraw);
}

async function openFile(file) {
  if (file === undefined || kernel === undefined || scene === undefined) return;
  try {
    open(await file.arrayBuffer(), file.name);
  } catch (error) {
    failed(`${file.name} cannot be read. ${error.message}`);
  }
}

function setUpCamera() {
  const { camera } = scene;
  const turn = (dx, dy) => {
    camera.yaw += dx;
    camera.pitch = Math.max(-MOST_PITCH, Math.min(MOST_PITCH, camera.pitch + dy));
    redraw();
  };
  const zoom = (factor) => {
    camera.distance = Math.max(0.25, Math.min(4, camera.distance * factor));
    redraw();
  };
  const pointers = new Map();
  let pulled;
  const apart = () => {
    const [a, b] = pointers.values();
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    pulled = pointers.size === 1 ? landmarkAt(event) : undefined;
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = pointers.get(event.pointerId);
    if (last === undefined) return canvas.classList.toggle("pulls", landmarkAt(event) !== undefined);
    const before = pointers.size === 2 ? apart() : 0;
    const [dx, dy] = [event.clientX - last.x, event.clientY - last.y];
    Object.assign(last, { x: event.clientX, y: event.clientY });
    if (pulled !== undefined) pull(pulled, event);
    else if (pointers.size === 2) zoom(before / Math.max(1, apart()));
    else if (pointers.size === 1) turn(dx * 0.008, dy * 0.008);
    return undefined;
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, (event) => {
      pointers.delete(event.pointerId);
      pulled = undefined;
    });
  }
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(event.deltaY * 0.0012));
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const steps = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
    if (event.key in steps) turn(...steps[event.key]);
    else if (event.key === "+") zoom(0.9);
    else if (event.key === "-") zoom(1 / 0.9);
    else return;
    event.preventDefault();
  });
  document.querySelectorAll(".views button").forEach((button) => {
    button.addEventListener("click", () => {
      Object.assign(camera, { yaw: Number(button.dataset.yaw), pitch: 0 });
      redraw();
    });
  });
}

/** The landmark under a pointer, with what a pull starts from; undefined without one. */
function landmarkAt({ clientX, clientY }) {
  if (shown === undefined || !scene.showsLandmarks) return undefined;
  const box = canvas.getBoundingClientRect();
  const near = Array.from(shown.landmarks, (vertex, landmark) => ({ landmark, vertex, ...scene.seen(vertex) })).filter(
    ({ x, y, facing }) => facing && Math.hypot(x + box.left - clientX, y + box.top - clientY) < 14,
  );
  if (near.length === 0) return undefined;
  const { landmark, vertex } = near[0];
  const targets = Array.from(shown.landmarks, (other) => shown.positions.slice(3 * other, 3 * other + 3));
  return { landmark, vertex, targets, start: weightsOf(shown), x: clientX, y: clientY };
}

/** Fits the face to its landmarks where they were, but for one, which is where the pointer is. */
function pull({ landmark, vertex, targets, start, x, y }, event) {
  const moved = targets.slice();
  const there = scene.pulled(vertex, event.clientX - x, event.clientY - y);
  // From where the landmark was at the start of the pull, not from where the face has followed it to.
  moved[landmark] = there.map((value, axis) => value - shown.positions[3 * vertex + axis] + targets[landmark][axis]);
  try {
    const { identity, pose } = shown.levels === undefined ? pulledFit(moved, start) : pulledLevels(moved, start);
    shown.deviations = { identity: deviationsOf(identity, shown.statistics.identity), pose: deviationsOf(pose, shown.statistics.pose) };
    changed();
  } catch (error) {
    failed(`The face cannot be fitted. ${error.message}`);
  }
}

/** The weights that move landmarks, the face standing where it is. */
function pulledFit(targets, start) {
  const priors = Object.fromEntries(MODES.map((mode) => [`${mode}Prior`, shown.statistics[mode].known ? "gaussian" : "none"]));
  if (priors.posePrior === "none" && shown.model.poseBounds() !== undefined) priors.posePrior = "bounds";
  return shown.model.fitLandmarks(targets, { frame: "fixed", place: false, noise: 1, maxIterations: 20, start, ...priors });
}

/** The same for a wavelet model, by the coarse levels. */
function pulledLevels(targets, start) {
  const samples = targets.map((target, k) => ({ vertex: shown.landmarks[k], target }));
  return shown.model.fitLevels(samples, { frame: "fixed", nLevels: Math.min(PULLED_LEVELS, shown.levels + 1), start });
}

function failed(sentence) {
  const message = element("message");
  message.textContent = sentence;
  message.hidden = false;
  document.documentElement.dataset.state = shown === undefined ? "error" : "ready";
}

/** `left_eye_outer` as words. */
const words = (name) => name.replaceAll("_", " ");
const signed = (value) => (Math.abs(value) < 0.005 ? "0.00" : `${value > 0 ? "+" : "−"}${Math.abs(value).toFixed(2)}`);

/** Of mean 0 and variance 1, by Box and Muller. */
function normalDeviate() {
  return Math.sqrt(-2 * Math.log(1 - Math.random())) * Math.cos(2 * Math.PI * Math.random());
}

start();
