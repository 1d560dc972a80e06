// Runs the golden vectors and their negative control in a wasm module: node run.mjs MODULE.wasm
// Prints what main.c prints: each failing case, then the figures as lines `@name value`. Ends with 0 when every bit is as it should be
// and every changed bit was noticed.
import { readFile } from "node:fs/promises";

const [path] = process.argv.slice(2);
if (path === undefined) {
  console.error("usage: node run.mjs MODULE.wasm");
  process.exit(2);
}

let memory;
const text = (pointer, length) => new TextDecoder().decode(new Uint8Array(memory.buffer, pointer, length));
const { instance } = await WebAssembly.instantiate(await readFile(path), {
  golden: {
    golden_report: (pointer, length) => console.log(text(pointer, length)),
    golden_figure: (name, length, value) => console.log(`@${text(name, length)} ${value >>> 0}`),
  },
});
memory = instance.exports.memory;
const equal = instance.exports.golden_run() === 1;
const noticed = instance.exports.golden_control() === 1;
process.exitCode = equal && noticed ? 0 : 1;
