// Tests of habitus.js: what it gives, what it refuses, and what becomes of its memory.
//
//     node wrapper.mjs HABITUS.wasm face.hab body.hab wavelet.hab
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import test from "node:test";
import vm from "node:vm";
import Habitus from "../habitus.js";

const [wasmPath, modelPath, bodyPath, waveletPath] = process.argv.slice(2);
if (waveletPath === undefined) {
  console.error("usage: node wrapper.mjs HABITUS.wasm face.hab body.hab wavelet.hab");
  process.exit(2);
}
const wasm = await readFile(wasmPath);
const face = await readFile(modelPath);
const body = await readFile(bodyPath);
const wavelet = await readFile(waveletPath);
const { CONSTANTS } = Habitus;

const loaded = () => Habitus.load(wasm);
const mean = (model) => ({ identity: model.weights("identity", []), pose: model.weights("pose", []) });
const landmarksOf = (model, positions) => Array.from(model.landmarks(), (vertex) => positions.slice(3 * vertex, 3 * vertex + 3));

/** Asserts a refusal of the kernel with this name and these numbers. */
function refuses(body, name, numbers) {
  assert.throws(body, (error) => {
    assert.ok(error instanceof Habitus.HabitusError, String(error.stack));
    assert.equal(error.name, name);
    assert.equal(error.code, CONSTANTS[name]);
    assert.ok(error.message.length > 10 && !error.message.includes("{"), error.message);
    if (numbers !== undefined) assert.deepEqual(error.numbers, numbers);
    return true;
  });
}

test("a model says what it holds", async () => {
  const model = (await loaded()).open(face);
  const { nVertices, nFaces, nLandmarks, identityDim, poseDim, nPoses } = model.counts;
  assert.ok(nVertices > 0 && nFaces > 0 && nLandmarks > 0);
  assert.equal(model.faces().length, 3 * nFaces);
  assert.ok(model.faces().every((vertex) => vertex < nVertices));
  assert.equal(model.landmarks().length, nLandmarks);
  assert.equal(new Set(model.landmarkNames()).size, nLandmarks);
  assert.ok(model.landmarkNames().includes("nose_tip"));
  assert.equal(model.poseNames().length, nPoses);
  assert.equal(model.poseNames()[0], "neutral");
  assert.deepEqual(model.poseStarts().map((start) => start.length), new Array(nPoses).fill(poseDim));
  assert.match(model.text(CONSTANTS.HAB_SECTION_PROVENANCE), /habitus/);
  assert.equal(model.section(9999), undefined);
  assert.equal(model.text(9999), "");
  assert.deepEqual(model.section(CONSTANTS.HAB_SECTION_IDENTITY_PRECISION).shape, [identityDim, identityDim]);
  assert.equal(model.sections().length, model.counts.nSections);
  const scale = model.readF32(CONSTANTS.HAB_SECTION_IDENTITY_SCALE);
  assert.deepEqual(model.readF32(CONSTANTS.HAB_SECTION_IDENTITY_SCALE, 2, 3), scale.slice(2, 5));
  refuses(() => model.readU32(CONSTANTS.HAB_SECTION_IDENTITY_SCALE), "HAB_BAD_OPTION", [2, 0]);
  refuses(() => model.readF32(9999), "HAB_UNSUPPORTED", [9999, 0]);
});

test("weights are mean and deviations times scale", async () => {
  const model = (await loaded()).open(face);
  const [all, scale] = [model.readF32(CONSTANTS.HAB_SECTION_IDENTITY_MEAN), model.readF32(CONSTANTS.HAB_SECTION_IDENTITY_SCALE)];
  const expected = all.map((value, k) => value + Math.fround([1.5, -2][k] ?? 0) * scale[k]);
  const found = model.weights("identity", [1.5, -2]);
  expected.forEach((value, k) => assert.ok(Math.abs(found[k] - value) < 1e-5));
  refuses(() => model.weights("pose", new Array(50).fill(0)), "HAB_DIMENSION_MISMATCH");
  refuses(() => model.weights("pose", [NaN]), "HAB_NOT_FINITE", [0, 0]);
  assert.throws(() => model.weights("who", []), TypeError);
});

test("ranges and prepared forms give the bits of the whole", async () => {
  const model = (await loaded()).open(face);
  const weights = { identity: model.weights("identity", [1, -1, 0.5]), pose: model.weights("pose", [0.7, -0.2]) };
  const whole = model.evaluate(weights);
  assert.equal(whole.length, 3 * model.counts.nVertices);
  assert.deepEqual(model.evaluateRange(weights, 100, 33), whole.slice(300, 399));
  const out = new Float32Array(whole.length);
  assert.equal(model.evaluate(weights, out), out);
  assert.deepEqual(out, whole);
  const form = model.prepared("pose", weights.pose);
  model.close();
  assert.deepEqual(form.evaluate(weights.identity), whole);
  assert.deepEqual(form.evaluateRange(weights.identity, 100, 33), whole.slice(300, 399));
  form.close();
  form.close();
  refuses(() => form.evaluate(weights.identity), "HAB_NOT_OPENED", [1, 0]);
});

test("an evaluation of a face gives the bits of the model", async () => {
  const kernel = await loaded();
  const model = kernel.open(face);
  const weights = mean(model);
  const whole = model.evaluate(weights);
  const { jacobian } = model.linearise(weights, 0, 2);
  const evaluation = model.begin(weights, { derivatives: true });
  assert.equal(model.counts.needsEvaluation, 0);
  assert.deepEqual(evaluation.positions(), whole);
  assert.deepEqual(evaluation.linearise(0, 2).jacobian, jacobian);
  refuses(() => evaluation.jointPositions(), "HAB_UNSUPPORTED");
  refuses(() => model.setBlend(0), "HAB_WRONG_KIND", [3, 1]);
  assert.deepEqual(model.joints(), []);
  assert.equal(model.poseBounds(), undefined);
  evaluation.close();
});

test("a body is posed, its joints are known, its forms give its bits", async () => {
  const kernel = await loaded();
  const before = kernel.usedBytes;
  const model = kernel.open(body);
  const { nVertices, nJoints, poseDim, identityDim, nBlocks, kind } = model.counts;
  assert.equal(kind, CONSTANTS.HAB_KIND_SKINNED);
  const joints = model.joints();
  assert.equal(joints.length, nJoints);
  assert.equal(joints[0].parent, null);
  assert.ok(joints.slice(1).every(({ parent }, k) => parent <= k));
  assert.equal(joints.reduce((sum, { nWeights }) => sum + nWeights, 0), poseDim);
  assert.ok(joints.every(({ name, axis, nWeights }) => name.length > 0 && (axis === null) === (nWeights === 3)));
  const { lower, upper } = model.poseBounds();
  const weights = { identity: model.weights("identity", [1, -0.5]), pose: upper.map((high, k) => 0.4 * high + 0.1 * lower[k]) };

  const evaluation = model.begin(weights);
  const whole = evaluation.positions();
  assert.equal(whole.length, 3 * nVertices);
  assert.deepEqual(model.evaluate(weights), whole);
  assert.deepEqual(model.evaluateRange(weights, 17, 20), whole.slice(51, 111));
  assert.deepEqual(evaluation.positionsRange(17, 20), whole.slice(51, 111));
  const there = evaluation.jointPositions();
  assert.ok(there.length === 3 * nJoints && joints.some(({ position }, k) => Math.abs(position[1] - there[3 * k + 1]) > 1));
  refuses(() => evaluation.linearise(), "HAB_BAD_OPTION", [7, 0]);
  refuses(() => evaluation.positionsRange(nVertices, 1), "HAB_INDEX_OUT_OF_RANGE", [nVertices + 1, nVertices]);
  refuses(() => evaluation.positions(new Float32Array(3)), "HAB_DIMENSION_MISMATCH", [3 * nVertices, 3]);
  refuses(() => model.begin({ identity: [1], pose: weights.pose }), "HAB_DIMENSION_MISMATCH", [identityDim, 1]);
  refuses(() => model.evaluate({ ...weights, pose: weights.pose.map(() => NaN) }), "HAB_NOT_FINITE", [identityDim, 0]);
  const { values, jacobian } = model.linearise(weights, 0, nBlocks);
  const angle = 4;
  const stepped = { ...weights, pose: weights.pose.map((value, k) => value + (k === angle ? 1e-3 : 0)) };
  const moved = model.linearise(stepped, 0, nBlocks).values;
  const block = CONSTANTS.HAB_BLOCK_VERTICES * 3;
  for (let k = 0; k < values.length; k++) {
    const at = (Math.floor(k / block) * (identityDim + poseDim) + identityDim + angle) * block + (k % block);
    assert.ok(Math.abs((moved[k] - values[k]) / 1e-3 - jacobian[at]) < 1 + 0.01 * Math.abs(jacobian[at]), `number ${k}`);
  }

  const person = model.prepared("identity", weights.identity);
  assert.deepEqual(person.evaluate(weights.pose), whole);
  assert.equal(person.linearise(weights.pose).jacobian.length, nBlocks * block * poseDim);
  const tracked = person.begin(weights.pose, { derivatives: true });
  // The bytes of the file live as long as something reads them.
  model.close();
  refuses(() => model.begin(weights), "HAB_NOT_OPENED", [1, 0]);
  const other = kernel.open(face);
  assert.deepEqual(person.evaluate(weights.pose), whole);
  person.close();
  refuses(() => person.begin(weights.pose), "HAB_NOT_OPENED", [1, 0]);
  const again = kernel.open(face);
  assert.deepEqual(tracked.positions(), whole);
  assert.deepEqual(tracked.jointPositions(), there);
  assert.deepEqual(evaluation.positions(), whole);
  for (const open of [tracked, tracked, evaluation, other, again]) open.close();
  refuses(() => tracked.positions(), "HAB_NOT_OPENED", [1, 0]);
  assert.equal(kernel.usedBytes, before);
});

test("a body moves in the way that was set, and is fitted within its bounds", async () => {
  const model = (await loaded()).open(body);
  const { lower, upper } = model.poseBounds();
  const weights = { identity: model.weights("identity", [1]), pose: upper.map((high) => high / 3) };
  const whole = model.evaluate(weights);
  const targets = landmarksOf(model, whole);
  const form = model.prepared("identity", weights.identity);
  const options = { frame: "fixed", place: false, posePrior: "bounds", maxIterations: 200, prepared: form };
  const { pose, report } = model.fitLandmarks(targets, options);
  assert.ok(report.rms < 1, `${report.rms} mm`);
  assert.ok(pose.every((angle, k) => angle >= lower[k] && angle <= upper[k]));
  refuses(() => model.fitLandmarks(targets, { ...options, posePrior: "gaussian" }), "HAB_UNSUPPORTED");
  model.setBlend(CONSTANTS.HAB_BLEND_DUAL_QUATERNION);
  model.setJoints(CONSTANTS.HAB_JOINTS_MEAN);
  assert.deepEqual([model.counts.blend, model.counts.joints], [1, 1]);
  assert.notDeepEqual(model.evaluate(weights), whole);
  refuses(() => model.setBlend(9), "HAB_BAD_OPTION", [2, 0]);
  model.setBlend(CONSTANTS.HAB_BLEND_LINEAR);
  model.setJoints(CONSTANTS.HAB_JOINTS_REGRESSED);
  assert.deepEqual(model.evaluate(weights), whole);
});

test("a wavelet model has levels and windows, and is fitted level by level", async () => {
  const kernel = await loaded();
  const before = kernel.usedBytes;
  const model = kernel.open(wavelet);
  const { width, height, levels, nCoefficients } = model.grid();
  assert.deepEqual([model.counts.kind, model.counts.nVertices, nCoefficients], [CONSTANTS.HAB_KIND_WAVELET, width * height, width * height]);
  const whole = model.evaluate(mean(model));
  // Half a standard deviation from the mean in the weights of some coefficients of the base.
  const shape = { ...mean(model), identity: model.weights("identity", new Array(24).fill(0.5)) };
  const targets = landmarksOf(model, model.evaluate(shape));
  const samples = targets.map(([x, y, z], k) => ({ vertex: model.landmarks()[k], target: [40 - y, x - 20, z + 300] }));
  const { identity, pose, report } = model.fitLevels(samples, { nLevels: 2 });
  assert.ok(report.rms < report.startRms / 2 && report.passes === 8, `${report.rms} mm`);
  assert.deepEqual([identity.length, pose.length], [model.counts.identityDim, model.counts.poseDim]);
  refuses(() => model.fitLevels(samples, { kappa: 0 }), "HAB_BAD_OPTION", [4, 0]);
  refuses(() => model.fitLevels(samples, { frame: "loose" }), "HAB_BAD_OPTION", [1, 0]);
  assert.throws(() => model.fitLevels(samples, { level: 1 }), TypeError);
  const all = model.counts;
  const faces = model.faces();
  model.setWindow(3, 2, 5, 1);
  assert.deepEqual([model.counts.nFaces, model.counts.nLandmarks, model.faces().length, model.landmarks().length], [0, 0, 0, 0]);
  assert.deepEqual(model.landmarkNames(), []);
  const { firstColumn, nColumns, firstRow, nRows } = model.grid();
  assert.deepEqual([firstColumn, nColumns, firstRow, nRows, model.counts.nVertices], [3, 2, 5, 1, 2]);
  assert.deepEqual(model.evaluate(mean(model)), whole.slice(3 * (5 * width + 3), 3 * (5 * width + 5)));
  model.setLevels(0, 1);
  assert.deepEqual([model.grid().detail, model.grid().resolution, model.counts.nVertices], [0, 1, 117]);
  assert.equal(model.evaluate(mean(model)).length, 3 * 117);
  assert.deepEqual([model.counts.nFaces, model.faces().length, model.landmarks().length], [0, 0, 0]);
  refuses(() => model.readU32(CONSTANTS.HAB_SECTION_FACES), "HAB_INDEX_OUT_OF_RANGE", [faces.length, 0]);
  refuses(() => model.fitLandmarks(targets, { identityPrior: "box", posePrior: "box" }), "HAB_EMPTY", [0, 0]);
  refuses(() => model.setLevels(levels + 1, 0), "HAB_INDEX_OUT_OF_RANGE", [levels + 1, levels + 1]);
  // The base has weights, all vertices are there, and so are what speaks of them. The spread of the weights makes a box; a Gaussian they have not.
  model.setLevels(0, levels);
  assert.deepEqual([model.counts.nVertices, model.counts.nFaces, model.counts.nLandmarks], [all.nVertices, all.nFaces, all.nLandmarks]);
  assert.deepEqual(model.faces(), faces);
  const boxed = model.fitLandmarks(targets, { identityPrior: "box", posePrior: "box" });
  assert.ok(boxed.report.rms < 0.5, `${boxed.report.rms} mm`);
  refuses(() => model.fitLandmarks(targets), "HAB_NEEDS_LEVELS", [CONSTANTS.HAB_SECTION_IDENTITY_PRECISION, 0]);
  const other = kernel.open(face);
  refuses(() => other.grid(), "HAB_WRONG_KIND", [4, 1]);
  other.close();
  model.close();
  assert.equal(kernel.usedBytes, before);
});

test("derivatives are what differences say", async () => {
  const model = (await loaded()).open(face);
  const { identityDim, poseDim, nBlocks } = model.counts;
  const weights = mean(model);
  const { values, jacobian } = model.linearise(weights, 0, nBlocks);
  const stepped = { ...weights, identity: weights.identity.map((value, k) => (k === 2 ? value + 0.5 : value)) };
  const moved = model.linearise(stepped, 0, nBlocks).values;
  const block = CONSTANTS.HAB_BLOCK_VERTICES * 3;
  for (let k = 0; k < values.length; k++) {
    const at = (Math.floor(k / block) * (identityDim + poseDim) + 2) * block + (k % block);
    assert.ok(Math.abs(moved[k] - values[k] - 0.5 * jacobian[at]) < 2e-3, `number ${k}`);
  }
});

test("a fit finds the face that its landmarks were taken from", async () => {
  const model = (await loaded()).open(face);
  const weights = { identity: model.weights("identity", [1, -1, 0.5]), pose: model.weights("pose", []) };
  const shift = [25, -40, 600];
  const targets = landmarksOf(model, model.evaluate(weights)).map((point) => point.map((x, axis) => x + shift[axis]));
  targets[3] = null;
  const { identity, pose, placement, report } = model.fitLandmarks(targets, { noise: 0.05 });
  assert.equal(report.status, CONSTANTS.HAB_STATUS_CONVERGED);
  assert.ok(report.rms < 0.1, `${report.rms} mm`);
  assert.equal(placement.scale, 1);
  const fitted = landmarksOf(model, model.evaluate({ identity, pose })).map((point) =>
    point.map((_, axis) => placement.translation[axis] + point.reduce((sum, x, k) => sum + placement.rotation[3 * axis + k] * x, 0)),
  );
  targets.forEach((target, k) => target?.forEach((x, axis) => assert.ok(Math.abs(fitted[k][axis] - x) < 0.5)));

  const samples = landmarksOf(model, model.evaluate(weights)).map((target, k) => ({ vertex: model.landmarks()[k], target }));
  const form = model.prepared("pose", weights.pose);
  const fixed = model.fitPoints(samples, { prepared: form, frame: "fixed", place: false, noise: 0.05 });
  assert.equal(fixed.pose.length, 0);
  assert.ok(fixed.report.rms < 0.1, `${fixed.report.rms} mm`);
});

test("misuse of a fit is refused in words", async () => {
  const kernel = await loaded();
  const model = kernel.open(face);
  const targets = landmarksOf(model, model.evaluate(mean(model)));
  const used = kernel.usedBytes;
  refuses(() => model.fitLandmarks(targets, { frame: "elastic" }), "HAB_BAD_OPTION", [1, 0]);
  refuses(() => model.fitLandmarks(targets, { identityPrior: "wild" }), "HAB_BAD_OPTION", [3, 0]);
  refuses(() => model.fitLandmarks(targets, { noise: -1 }), "HAB_BAD_OPTION", [7, 0]);
  refuses(() => model.fitLandmarks(targets, { noise: NaN }), "HAB_BAD_OPTION", [7, 0]);
  refuses(() => model.fitLandmarks(targets.slice(1)), "HAB_DIMENSION_MISMATCH", [39, 36]);
  refuses(() => model.fitLandmarks(targets.map(() => null)), "HAB_EMPTY");
  refuses(() => model.fitLandmarks(targets.map((target, k) => (k < 2 ? target : null))), "HAB_DEGENERATE");
  refuses(() => model.fitLandmarks([[NaN, 0, 0], ...targets.slice(1)]), "HAB_NOT_FINITE", [0, 0]);
  refuses(() => model.fitLandmarks(targets, { start: { identity: [0] } }), "HAB_DIMENSION_MISMATCH");
  refuses(() => model.fitPoints([]), "HAB_EMPTY");
  refuses(() => model.fitPoints([{ vertex: 0, target: [0, 0, 0], normal: [2, 0, 0] }]), "HAB_BAD_SAMPLE", [0, 0]);
  refuses(() => model.fitPoints([{ vertex: 1e6, target: [0, 0, 0] }]), "HAB_INDEX_OUT_OF_RANGE", [1e6, model.counts.nVertices]);
  assert.throws(() => model.fitLandmarks(targets, { nose: 1 }), /no fit option nose/);
  assert.throws(() => model.fitLandmarks(targets, { start: { placement: { rotation: [1] } } }), RangeError);
  assert.throws(() => model.fitLandmarks(targets, { prepared: {} }), TypeError);
  assert.throws(() => model.fitLandmarks([[1, 2], ...targets.slice(1)]), /target 0: 3 numbers/);
  assert.throws(() => model.fitLandmarks(null), TypeError);
  assert.throws(() => model.fitPoints([{ vertex: -1, target: [0, 0, 0] }]), RangeError);
  assert.throws(() => model.fitPoints([{ target: [0, 0, 0] }]), RangeError);
  const part = model.prepared("pose", mean(model).pose, 0, 2);
  refuses(() => model.fitLandmarks(targets, { prepared: part }), "HAB_DIMENSION_MISMATCH", [model.counts.nVertices, 32]);
  part.close();
  refuses(() => model.fitLandmarks(targets, { prepared: part }), "HAB_NOT_OPENED");
  assert.equal(kernel.usedBytes, used);
});

test("wrong weights and lengths are refused, and the output stays as it was", async () => {
  const kernel = await loaded();
  const model = kernel.open(face);
  const { nVertices, nBlocks, identityDim } = model.counts;
  const good = mean(model);
  const out = new Float32Array(3 * nVertices).fill(7);
  const used = kernel.usedBytes;
  refuses(() => model.evaluate({ ...good, identity: [1] }, out), "HAB_DIMENSION_MISMATCH", [identityDim, 1]);
  refuses(() => model.evaluate({ ...good, pose: [0, 0, Infinity, 0] }, out), "HAB_NOT_FINITE", [identityDim + 2, 0]);
  refuses(() => model.evaluate({ ...good, pose: ["a", 0, 0, 0] }, out), "HAB_NOT_FINITE", [identityDim, 0]);
  refuses(() => model.evaluateRange(good, 0, nVertices + 1, out), "HAB_INDEX_OUT_OF_RANGE", [nVertices + 1, nVertices]);
  assert.ok(out.every((value) => value === 7));
  refuses(() => model.evaluate(good, new Float32Array(5)), "HAB_DIMENSION_MISMATCH", [3 * nVertices, 5]);
  refuses(() => model.evaluateRange(good, 0xffffffff, 0xffffffff), "HAB_INDEX_OUT_OF_RANGE");
  refuses(() => model.linearise(good, nBlocks, 1), "HAB_INDEX_OUT_OF_RANGE");
  refuses(() => model.prepared("pose", good.pose, 1, nBlocks), "HAB_INDEX_OUT_OF_RANGE");
  refuses(() => model.prepared("pose", [1]), "HAB_DIMENSION_MISMATCH");
  assert.throws(() => model.evaluate(good, []), TypeError);
  assert.throws(() => model.evaluate(null), TypeError);
  assert.throws(() => model.evaluate({ identity: good.identity }), /weights.pose: an array/);
  assert.throws(() => model.evaluateRange(good, 0.5, 1), RangeError);
  assert.throws(() => model.evaluateRange(good, -1, 1), RangeError);
  assert.throws(() => model.readF32(CONSTANTS.HAB_SECTION_POSE_MEAN, 0, 1e9), RangeError);
  assert.equal(kernel.usedBytes, used);
});

test("a closed model is refused and gives its memory back", async () => {
  const kernel = await loaded();
  const before = kernel.usedBytes;
  const model = kernel.open(face);
  const weights = mean(model);
  assert.ok(model.isOpen);
  model.close();
  model.close();
  assert.ok(!model.isOpen);
  assert.equal(kernel.usedBytes, before);
  for (const body of [() => model.evaluate(weights), () => model.faces(), () => model.weights("pose", []), () => model.prepared("pose", []),
    () => model.fitLandmarks([]), () => model.fitPoints([]), () => model.landmarkNames(), () => model.section(1)]) {
    refuses(body, "HAB_NOT_OPENED", [1, 0]);
  }
  assert.equal(kernel.usedBytes, before);
});

test("hostile bytes are refused and cost no memory", async () => {
  const kernel = await loaded();
  const before = kernel.usedBytes;
  const hostile = [new Uint8Array(0), new Uint8Array(64), new Uint8Array(100000).fill(0xff), new TextEncoder().encode("GIF89a"), face.subarray(0, 1000)];
  for (const bytes of hostile) {
    assert.throws(() => kernel.open(bytes), (error) => error instanceof Habitus.HabitusError && error.code >= 300 && error.code < 400);
  }
  refuses(() => kernel.open(face.subarray(0, 63)), "HAB_TRUNCATED", [64, 63]);
  refuses(() => kernel.open(new TextEncoder().encode("x".repeat(100))), "HAB_BAD_MAGIC");
  for (let k = 0; k < 200; k++) {
    const flipped = Uint8Array.from(face);
    const at = (k * 7919) % 1200;
    flipped[at] ^= 1 << k % 8;
    try {
      const model = kernel.open(flipped, { trusted: k % 2 === 1 });
      model.evaluate(mean(model));
      model.close();
    } catch (error) {
      assert.ok(error instanceof Habitus.HabitusError, `byte ${at}: ${error.stack}`);
    }
  }
  for (const wrong of [undefined, null, "face.hab", 7, [1, 2, 3]]) assert.throws(() => kernel.open(wrong), TypeError);
  assert.equal(kernel.usedBytes, before);
});

test("bytes of any alignment and every kind of buffer are taken", async () => {
  const kernel = await loaded();
  const shifted = new Uint8Array(face.length + 3);
  shifted.set(face, 3);
  const plain = Uint8Array.from(face);
  const expected = kernel.open(plain.buffer);
  for (const bytes of [plain, plain.buffer, shifted.subarray(3), new DataView(shifted.buffer, 3)]) {
    const model = kernel.open(bytes);
    assert.deepEqual(model.evaluate(mean(model)), expected.evaluate(mean(expected)));
  }
});

test("memory may grow while models, forms and results are in use", async () => {
  const kernel = await loaded();
  const first = kernel.open(face);
  const weights = mean(first);
  const form = first.prepared("pose", weights.pose);
  const result = first.evaluate(weights);
  const copy = result.slice();
  const bytes = kernel.memoryBytes;
  const others = Array.from({ length: 12 }, () => kernel.open(face));
  assert.ok(kernel.memoryBytes > bytes + 10 * face.length);
  assert.deepEqual(result, copy);
  assert.deepEqual(first.evaluate(weights), copy);
  assert.deepEqual(form.evaluate(weights.identity), copy);
  assert.deepEqual(others[11].evaluate(weights), copy);
});

test("a thousand models opened and closed do not grow the memory", async () => {
  const kernel = await loaded();
  const small = await readFile(new URL("../../firmware/models/small.hab", import.meta.url));
  const round = (k) => {
    const [one, two] = [kernel.open(face, { trusted: true }), kernel.open(small)];
    const form = two.prepared(k % 2 === 0 ? "pose" : "identity", k % 2 === 0 ? mean(two).pose : mean(two).identity);
    one.evaluate(mean(one));
    // In either order, so that pieces of different sizes are joined again.
    for (const thing of k % 3 === 0 ? [one, form, two] : [form, two, one]) thing.close();
  };
  round(0);
  const [used, bytes] = [kernel.usedBytes, kernel.memoryBytes];
  for (let k = 1; k <= 500; k++) round(k);
  assert.equal(kernel.usedBytes, used);
  assert.equal(kernel.memoryBytes, bytes);
});

test("what is not the module is refused in words", async () => {
  await assert.rejects(Habitus.load(new Uint8Array([0, 97, 115, 109, 1, 0, 0, 0])), /not Habitus/);
  await assert.rejects(Habitus.load(new Uint8Array([1, 2, 3])), WebAssembly.CompileError);
  await assert.rejects(Habitus.load(Promise.resolve(new Response("", { status: 404 }))), /status 404/);
  const kernel = await Habitus.load(new Response(wasm));
  assert.equal(kernel.abiVersion, CONSTANTS.HAB_ABI_VERSION);
  assert.equal(kernel.errorName(103), "HAB_NOT_FINITE");
  assert.equal(kernel.errorName(-5), "HAB_UNKNOWN_CODE");
  assert.match(kernel.errorMessage(304), /damaged/);
});

test("the file is a plain script as well as a module", async () => {
  assert.equal(createRequire(import.meta.url)("../habitus.js").load, Habitus.load);
  const page = vm.createContext({ WebAssembly, TextDecoder });
  vm.runInContext(await readFile(new URL("../habitus.js", import.meta.url), "utf8"), page);
  const kernel = await vm.runInContext("Habitus", page).load(wasm);
  const model = kernel.open(face);
  assert.equal(model.evaluate(mean(model)).length, 3 * model.counts.nVertices);
});

test("the constants have the names that the module gives its codes", async () => {
  const kernel = await loaded();
  const [from, to] = ["HAB_OK", "HAB_INTERNAL"].map((name) => Object.keys(CONSTANTS).indexOf(name));
  const codes = Object.entries(CONSTANTS).slice(from, to + 1);
  assert.ok(codes.length >= 30);
  for (const [name, code] of codes) assert.equal(kernel.errorName(code), name);
});
