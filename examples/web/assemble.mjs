// Puts together a folder that is the page: works from a server and by a double click, because what a page from a folder may not fetch comes as a
// script.
//
//     node assemble.mjs FOLDER MODEL.hab HABITUS.wasm [HABITUS-SIMD.wasm]
import { copyFile, mkdir, readFile, writeFile } from "node:fs/promises";
import { basename, join } from "node:path";

const [folder, model, wasm, wasmSimd] = process.argv.slice(2);
if (wasm === undefined) {
  console.error("usage: node assemble.mjs FOLDER MODEL.hab HABITUS.wasm [HABITUS-SIMD.wasm]");
  process.exit(2);
}
await mkdir(folder, { recursive: true });
for (const name of ["index.html", "style.css", "habitus.js", "scene.js", "viewer.js"]) {
  await copyFile(new URL(name, import.meta.url), join(folder, name));
}
const files = { "habitus.wasm": wasm, "habitus-simd.wasm": wasmSimd, [basename(model)]: model };
for (const [name, from] of Object.entries(files)) if (from !== undefined) await copyFile(from, join(folder, name));
const base64 = async (path) => (path === undefined ? undefined : (await readFile(path)).toString("base64"));
const bytes = { wasm: await base64(wasm), wasmSimd: await base64(wasmSimd), model: await base64(model), modelName: basename(model) };
await writeFile(join(folder, "bytes.js"), `globalThis.HabitusBytes = ${JSON.stringify(bytes)};\n`);
