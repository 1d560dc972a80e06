// Runs the golden vectors of every kernel of the C interface through habitus.js, and their negative control:
//
//     node golden.mjs HABITUS.wasm tests/golden/vectors
//
// Prints each failing case, then the figures as lines `@name value`, as the other runners do (tests/golden-c). Ends with 0 when every bit is
// as it should be and every changed bit was noticed. The format of the vectors is in tests/golden/src/text.rs.
//
// Not in the C interface, and so not compared: in `open`, the flags of linear terms (but the number of terms must belong to them) and the bit
// that lets a reader ignore a section. A reversed range has no form in it.
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import Habitus from "../habitus.js";

const FILES = ["generator.txt", "fit.txt", "bodies.txt", "wavelets.txt", "files.txt"];
const { CONSTANTS } = Habitus;

/** The cases of a text: kernel, name, and the words of each field. */
function parsed(text) {
  const cases = [];
  let words;
  for (const line of text.split("\n")) {
    const parts = line.split(" ").filter((word) => word !== "");
    if (line.startsWith("case ")) cases.push({ kernel: parts[1], name: parts[2], fields: new Map(), line });
    else if (line.startsWith("    ")) words.push(...parts);
    else if (line.startsWith("  ")) cases[cases.length - 1].fields.set(parts[0], (words = parts.slice(1)));
  }
  return cases;
}

/** What a case says: its inputs, and a tally of what is compared with its outputs. */
class Case {
  numbers = 0;
  differingBits = 0;
  first = null;

  constructor({ kernel, name, fields }, models) {
    Object.assign(this, { kernel, name, fields: new Map(fields), models });
  }

  has = (key) => this.fields.has(key);
  words(key) {
    if (!this.has(key)) throw new Error(`the case has no field ${key}`);
    return this.fields.get(key);
  }
  word = (key) => this.words(key)[0];
  integers = (key) => this.words(key).map(Number);
  integer = (key) => Number(this.word(key));
  floats = (key) => floats(this.words(key));
  float = (key) => this.floats(key)[0];

  /** The model file that the case names, with its changes. */
  model() {
    const { fields } = this.models.find(({ name }) => name === this.word("model"));
    const bytes = fields.get("bytes").flatMap((word) =>
      word.startsWith("00*") ? new Array(Number(word.slice(3))).fill(0) : word.match(/../g).map((pair) => parseInt(pair, 16)),
    );
    const patch = this.has("patch") ? this.words("patch") : [];
    for (let k = 0; k < patch.length; k += 2) bytes[Number(patch[k])] = parseInt(patch[k + 1], 16);
    const length = this.has("length") ? this.integer("length") : bytes.length;
    const kept = new Uint8Array(length);
    kept.set(bytes.slice(0, length));
    return kept;
  }

  /** Compares reals by their bits. */
  compare(key, found) {
    const bits = new Uint32Array(Float32Array.from(found).buffer);
    this.#compare(key, this.words(key).map((word) => (word === "0" ? 0 : parseInt(word, 16))), found instanceof Float32Array ? raw(found) : bits);
  }

  compareIntegers(key, found) {
    this.#compare(key, this.integers(key), found);
  }

  #compare(key, expected, found) {
    if (expected.length !== found.length) throw new Error(`${key} has ${found.length} numbers, expected ${expected.length}`);
    expected.forEach((number, k) => {
      let difference = (number ^ found[k]) >>> 0;
      if (difference !== 0) this.first ??= `${key}[${k}] is ${found[k].toString(16)} instead of ${number.toString(16)}`;
      for (; difference !== 0; difference &= difference - 1) this.differingBits++;
      this.numbers++;
    });
  }
}

const raw = (values) => new Uint32Array(values.buffer, values.byteOffset, values.length);
const floats = (words) => new Float32Array(Uint32Array.from(words, (word) => (word === "0" ? 0 : parseInt(word, 16))).buffer);
const weightsOf = (test) => ({ identity: test.floats("identity"), pose: test.floats("pose") });
const chunks = (values, size) => Array.from({ length: values.length / size }, (_, k) => values.slice(k * size, (k + 1) * size));

function placementOf(numbers) {
  return { scale: numbers[0], rotation: numbers.slice(1, 10), translation: numbers.slice(10) };
}

/** One function per kernel: reads the inputs of a case, calls the wrapper, compares. */
const KERNELS = {
  evaluate(test, model) {
    for (const [from, to] of chunks(test.integers("ranges"), 2)) {
      const part = model.evaluateRange(weightsOf(test), from, to - from);
      const expected = new Case({ ...test, fields: new Map([["out", test.words("out").slice(3 * from, 3 * to)]]) });
      expected.compare("out", part);
      test.numbers += expected.numbers;
      test.differingBits += expected.differingBits;
      test.first ??= expected.first;
    }
    test.compare("out", model.evaluate(weightsOf(test), new Float32Array(3 * model.counts.nVertices).fill(NaN)));
  },

  linearised_block(test, model) {
    const { values, jacobian } = model.linearise(weightsOf(test), test.integer("block"), 1);
    test.compare("values", values);
    test.compare("jacobian", jacobian);
  },

  prepared(test, model) {
    const { identity, pose } = weightsOf(test);
    const [fixed, free] = test.word("fixed") === "identity" ? [identity, pose] : [pose, identity];
    const from = test.integer("from");
    const form = model.prepared(test.word("fixed"), fixed, from, test.integer("to") - from);
    try {
      test.compare("out", form.evaluate(free));
      const { values, jacobian } = form.linearise(free);
      test.compare("values", values);
      test.compare("jacobian", jacobian);
    } finally {
      form.close();
    }
  },

  fit_points(test, model) {
    compareFit(test, model.fitPoints(samplesOf(test), fitOptions(test)));
  },

  fit_wavelet(test, model) {
    const [identityFree, poseFree] = test.integers("free");
    const [firstLevel, end] = test.integers("fitted_levels");
    const options = {
      frame: test.word("frame"),
      ...{ identity: identityFree > 0, pose: poseFree > 0, firstLevel, nLevels: end - firstLevel },
      ...{ kappa: test.float("kappa"), omega: test.float("omega"), passes: test.integer("passes") },
      start: { ...weightsOf(test), placement: placementOf(test.floats("placement")) },
    };
    const { identity, pose, placement, report } = model.fitLevels(samplesOf(test), options);
    test.compareIntegers("passes_reached", [report.passes, report.reached]);
    test.compare("rms_start", [report.rms, report.startRms]);
    test.compare("identity_fitted", identity);
    test.compare("pose_fitted", pose);
    test.compare("placement_fitted", [placement.scale, ...placement.rotation, ...placement.translation]);
  },

  fit_landmarks(test, model) {
    const kinds = test.integers("kinds");
    const targets = chunks(test.floats("targets"), 3).map((target, k) => (kinds[k] > 0 ? target : null));
    compareFit(test, model.fitLandmarks(targets, fitOptions(test)));
  },

  open(test, model) {
    const { kind, nVertices, identityDim, poseDim } = model.counts;
    // The header of a wavelet model counts the weights of one coefficient.
    const coefficients = kind === CONSTANTS.HAB_KIND_WAVELET ? model.grid().nCoefficients : 1;
    const [d, e] = [identityDim / coefficients, poseDim / coefficients];
    const flags = test.integers("header")[4];
    test.compareIntegers("header", [kind, nVertices, d, e, flags]);
    test.numbers--;
    const sections = model.sections();
    const terms = termsOf(model, d, e, flags);
    if (sections[0].shape[1] !== terms) throw new Error(`${sections[0].shape[1]} terms, expected ${terms}`);
    const ignorable = chunks(test.integers("sections"), 9).map((section) => section[1]);
    const rows = sections.map(({ id, element, rank, shape, dataBytes }, k) => {
      const axes = Array.from({ length: 4 }, (_, axis) => shape[axis] ?? 1);
      return [id, ignorable[k], element, rank, ...axes, dataBytes];
    });
    test.compareIntegers("sections", rows.flat());
    test.numbers -= rows.length;
    const statistics = { identity: "HAB_SECTION_IDENTITY_", pose: "HAB_SECTION_POSE_" };
    for (const [mode, prefix] of Object.entries(statistics)) {
      const ids = ["MEAN", "SCALE", "PRECISION"].map((part) => CONSTANTS[prefix + part]);
      if (ids.some((id) => model.section(id) === undefined)) continue;
      const all = ids.flatMap((id) => Array.from(raw(model.readF32(id))));
      test.compare(`${mode}_gaussian`, new Float32Array(Uint32Array.from(all).buffer));
    }
    if (model.counts.nLandmarks > 0) test.compareIntegers("landmarks", model.landmarks());
    if (model.counts.nFaces > 0) test.compareIntegers("faces", model.faces());
  },
};

/** Terms of a block of coefficients: the offset lies apart unless they are `f32`. */
function termsOf(model, d, e, flags) {
  const { kind, element, nJoints } = model.counts;
  const offset = element === CONSTANTS.HAB_ELEMENT_F32 ? 1 : 0;
  if (kind === CONSTANTS.HAB_KIND_WAVELET) return offset + d * e;
  if (kind === CONSTANTS.HAB_KIND_LINEAR) return offset + d;
  if (kind === CONSTANTS.HAB_KIND_SKINNED) return offset + d + (flags & 2 ? 9 * nJoints : 0);
  return offset + d * e + (flags & 1 ? d : 0) + (flags & 2 ? e : 0);
}

function samplesOf(test) {
  const triples = (key) => chunks(test.floats(key), 3);
  const [corners, kinds] = [chunks(test.integers("corners"), 3), test.integers("kinds")];
  const [barycentric, targets, normals, weights] = [triples("barycentric"), triples("targets"), triples("normals"), test.floats("sample_weights")];
  return kinds.map((kind, k) => ({
    vertices: corners[k],
    barycentric: barycentric[k],
    target: targets[k],
    normal: kind === 2 ? normals[k] : undefined,
    weight: kind === 0 ? 0 : weights[k],
  }));
}

function fitOptions(test) {
  const prior = (key) => {
    const [kind, factor] = test.words(key);
    return [kind, factor === undefined ? undefined : floats([factor])[0]];
  };
  const [identityPrior, identityFactor] = prior("identity_prior");
  const [posePrior, poseFactor] = prior("pose_prior");
  return {
    frame: test.word("frame"),
    place: test.integer("place") > 0,
    ...{ identityPrior, identityFactor, posePrior, poseFactor },
    noise: test.float("noise"),
    maxIterations: test.integer("max_iterations"),
    relativeDecrease: test.float("relative_decrease"),
    damping: test.float("damping"),
    start: { ...weightsOf(test), placement: placementOf(test.floats("placement")) },
  };
}

function compareFit(test, { identity, pose, placement, report }) {
  test.compareIntegers("iterations_status", [report.iterations, report.status]);
  test.compare("rms_energy_start", [report.rms, report.energy, report.startEnergy]);
  test.compare("identity_fitted", identity);
  test.compare("pose_fitted", pose);
  test.compare("placement_fitted", [placement.scale, ...placement.rotation, ...placement.translation]);
}

/** The error that a case expects, with C's number of an option: the kernel counts the noise as 2, hab_fit_options as 7. */
function expectedError(test) {
  const [code, first, second] = test.integers("error");
  if (code !== CONSTANTS.HAB_BAD_OPTION) return [code, first, second];
  // Of a fit by levels the kernel counts 1 kappa, 2 omega, 3 levels or passes.
  if (test.kernel === "fit_wavelet") return [code, first < 3 ? first + 3 : test.integer("passes") === 0 ? 7 : 6, second];
  return test.kernel.startsWith("fit_") && first === 2 ? [code, 7, second] : [code, first, second];
}

function run(kernel, given, models) {
  const test = new Case(given, models);
  let problem = null;
  let model;
  try {
    model = kernel.open(test.model());
    if (test.has("levels")) model.setLevels(...test.integers("levels"));
    if (test.has("window")) {
      const [left, right, top, bottom] = test.integers("window");
      model.setWindow(left, right - left, top, bottom - top);
    }
    KERNELS[test.kernel](test, model);
    if (test.has("error")) problem = "it was accepted";
    else if (test.numbers === 0) problem = "nothing was compared";
  } catch (error) {
    const refused = error instanceof Habitus.HabitusError;
    if (refused && test.has("error")) {
      test.fields.set("error", expectedError(test));
      test.compareIntegers("error", [error.code, ...error.numbers]);
      if (error.name !== kernel.errorName(error.code) || error.message === "") problem = `the error has name ${error.name}`;
    } else {
      problem = refused ? `refused: ${error.name} ${error.numbers}` : String(error.stack);
    }
  } finally {
    model?.close();
  }
  return { test, problem, equal: problem === null && test.differingBits === 0 };
}

/** The case with the lowest bit of its last digit changed. */
function changed(given) {
  const [key, words] = [...given.fields].pop();
  const word = words[words.length - 1];
  const digit = (parseInt(word.slice(-1), 16) ^ 1).toString(16);
  const zero = word === "0" && given.fields.size > 0 && !INTEGERS.has(key);
  const other = zero ? "00000001" : word.slice(0, -1) + digit;
  return { ...given, fields: new Map(given.fields).set(key, [...words.slice(0, -1), other]) };
}

/** Fields whose words are decimal. */
const INTEGERS = new Set(["header", "sections", "landmarks", "faces", "error", "ranges", "kinds", "corners", "iterations_status", "passes_reached"]);

const [path, folder] = process.argv.slice(2);
if (folder === undefined) {
  console.error("usage: node golden.mjs HABITUS.wasm VECTORS");
  process.exit(2);
}
const models = parsed(await readFile(join(folder, "models.txt"), "utf8"));
const kernel = await Habitus.load(await readFile(path));
const used = kernel.usedBytes;
const sums = { cases: 0, failed: 0, numbers: 0, differing_bits: 0, pointer_bits: 32, changed: 0, noticed: 0 };
for (const file of FILES) {
  for (const given of parsed(await readFile(join(folder, file), "utf8"))) {
    const { kernel: name, fields } = given;
    const reversed = name === "evaluate" && chunks(fields.get("ranges"), 2).some(([from, to]) => Number(to) < Number(from));
    if (KERNELS[name] === undefined || reversed) continue;
    const { test, problem, equal } = run(kernel, given, models);
    if (!equal) console.log(`${file}: ${name} ${test.name}: ${[problem, test.first].filter((text) => text !== null).join(", ")}`);
    sums.cases++;
    sums.failed += equal ? 0 : 1;
    sums.numbers += test.numbers;
    sums.differing_bits += test.differingBits;
    sums.changed++;
    if (run(kernel, changed(given), models).equal) console.log(`${file}: ${name} ${test.name}: a changed bit was not noticed`);
    else sums.noticed++;
  }
}
if (kernel.usedBytes !== used) console.log(`${kernel.usedBytes - used} bytes of the module's memory were not given back`);
for (const [name, value] of Object.entries(sums)) console.log(`@${name} ${value}`);
const good = sums.cases > 0 && sums.failed === 0 && sums.noticed === sums.changed && kernel.usedBytes === used;
process.exitCode = good ? 0 : 1;
