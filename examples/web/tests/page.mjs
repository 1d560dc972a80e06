// Drives the assembled page in a headless Chromium, from a server of this machine and from its folder:
//
//     node page.mjs FOLDER SCREENSHOTS
//
// A check that fails ends the run with 1 and its sentence. Figures are printed as lines `@name value`.
import assert from "node:assert/strict";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { decoded, differing, faceIn, noFace } from "./picture.mjs";
import { Browser } from "./webdriver.mjs";

const [folder, shots] = process.argv.slice(2);
if (shots === undefined) {
  console.error("usage: node page.mjs FOLDER SCREENSHOTS");
  process.exit(2);
}
await mkdir(shots, { recursive: true });
let checks = 0;
const check = (condition, sentence) => {
  checks++;
  assert.ok(condition, sentence);
};

/** The folder over HTTP, as a plain server gives it; counts what is asked for. */
async function served() {
  const types = { ".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".wasm": "application/wasm" };
  const asked = [];
  const server = createServer(async (request, response) => {
    const path = request.url === "/" ? "/index.html" : request.url;
    asked.push(path);
    const content = path === "/readme.html" ? await readmePage() : path.includes("..") ? null : await readFile(join(folder, path)).catch(() => null);
    response.writeHead(content === null ? 404 : 200, { "Content-Type": types[extname(path)] ?? "application/octet-stream" });
    response.end(content);
  });
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  return { server, asked, url: `http://127.0.0.1:${server.address().port}/` };
}

/** The page that the project's README shows. */
async function readmePage() {
  const text = await readFile(new URL("../../../README.md", import.meta.url), "utf8");
  return /^```html\n(.*?)^```$/ms.exec(text)[1];
}

class Page {
  constructor(browser, name) {
    Object.assign(this, { browser, name });
  }

  /** Waits until nothing moves any more. */
  async settled() {
    await this.browser.until("the page is at rest", () => document.documentElement.dataset.state !== "loading" && !("easing" in document.getElementById("canvas").dataset));
    await this.browser.runAsync(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true)))));
  }

  async picture(shot) {
    await this.settled();
    const png = await this.browser.screenshot();
    await writeFile(join(shots, `${this.name}-${shot}.png`), png);
    return decoded(png);
  }

  /** The part of the picture that only the face is in: without what is written above and below it. */
  area() {
    return this.browser.run(() => {
      const { left, top, width, height } = document.getElementById("canvas").getBoundingClientRect();
      return { left: Math.ceil(left), top: Math.ceil(top) + 60, width: Math.floor(width), height: Math.floor(height) - 120 };
    });
  }

  /** Sets a slider as a user's drag does. */
  slide(mode, k, value) {
    return this.browser.run(
      (mode, k, value) => {
        const input = document.querySelectorAll(`#${mode} input`)[k];
        input.value = value;
        input.dispatchEvent(new Event("input", { bubbles: true }));
      },
      mode, k, value,
    );
  }

  preset = (name) => this.browser.run((name) => [...document.querySelectorAll("#presets button")].find((button) => button.textContent === name).click(), name);

  message = () => this.browser.run(() => (document.getElementById("message").hidden ? "" : document.getElementById("message").textContent));

  /** Fails when the console has a warning or an error. */
  async consoleIsClean() {
    const entries = (await this.browser.log("browser")).filter(({ level }) => level !== "DEBUG" && level !== "INFO");
    check(entries.length === 0, `${this.name}: the console says ${JSON.stringify(entries)}`);
  }

  /** Everything that was asked for over a network or from the disk since the last call. */
  async requests() {
    const events = (await this.browser.log("performance")).map(({ message }) => JSON.parse(message).message);
    return events.filter(({ method }) => method === "Network.requestWillBeSent").map(({ params }) => params.request.url);
  }
}

async function tour(page, url) {
  const { browser, name } = page;
  await browser.open(url);
  await page.settled();
  check((await page.message()) === "", `${name}: ${await page.message()}`);
  const area = await page.area();
  const first = await page.picture("start");
  const face = faceIn(first, area);
  check(noFace(face).length === 0, `${name}: the picture shows no face: ${noFace(face).join("; ")}`);

  // A page without the face must not pass for one, nor the bare ground.
  await browser.run(() => { document.getElementById("canvas").style.visibility = "hidden"; });
  check(noFace(faceIn(await page.picture("without"), area)).length > 0, `${name}: the check takes an empty page for a face`);
  await browser.run(() => { document.getElementById("canvas").style.visibility = ""; });
  check(differing(first, await page.picture("again"), area) === 0, `${name}: the same face gives another picture`);

  const little = Math.round(0.004 * area.width * area.height);
  for (const mode of ["identity", "pose"]) {
    await page.slide(mode, 0, 2.5);
    const moved = await page.picture(`${mode}-slider`);
    check(differing(first, moved, area) > little, `${name}: the slider of ${mode} changes nothing`);
    check(noFace(faceIn(moved, area)).length === 0, `${name}: no face with ${mode} at 2.5: ${noFace(faceIn(moved, area)).join("; ")}`);
    await page.slide(mode, 0, 0);
    check(differing(first, await page.picture(`${mode}-back`), area) === 0, `${name}: the slider of ${mode} does not lead back`);
  }

  await page.preset("surprise");
  const surprised = await page.picture("surprise");
  check(differing(first, surprised, area) > little, `${name}: the expression changes nothing`);
  check(await browser.run(() => document.querySelector("#presets [aria-pressed=true]").textContent === "surprise"), `${name}: the preset is not marked`);
  await page.preset("smile");
  check(differing(surprised, await page.picture("smile"), area) > little, `${name}: another expression changes nothing`);

  await browser.click("#random");
  check(differing(first, await page.picture("random"), area) > little, `${name}: a random face is the mean face`);
  await browser.click("#reset");
  check(differing(first, await page.picture("reset"), area) === 0, `${name}: reset does not lead back`);

  const [x, y] = [area.left + area.width / 2, area.top + area.height / 2];
  await browser.drag([[x, y], [x + 60, y + 20], [x + 110, y + 40]]);
  const turned = await page.picture("turned");
  check(differing(first, turned, area) > 3 * little, `${name}: dragging does not turn the face`);
  check(faceIn(turned, area).asymmetry > faceIn(first, area).asymmetry, `${name}: a turned face is as symmetrical as one from the front`);
  await browser.click(".views button:nth-child(3)");
  await page.picture("profile");
  await browser.click("#reset");
  await page.settled();

  await browser.click("#landmarks");
  const marked = await page.picture("landmarks");
  check(differing(first, marked, area) > 200, `${name}: landmarks are not shown`);
  const tip = await browser.run(() => {
    const label = [...document.querySelectorAll("#labels span")].find(({ textContent }) => textContent === "chin");
    const { left, top } = document.getElementById("canvas").getBoundingClientRect();
    return [left + Number(label.dataset.x), top + Number(label.dataset.y)];
  });
  await browser.drag([tip, [tip[0], tip[1] + 12], [tip[0], tip[1] + 26]]);
  const pulled = await page.picture("pulled");
  check((await page.message()) === "", `${name}: ${await page.message()}`);
  check(differing(marked, pulled, area) > little, `${name}: a pulled landmark changes nothing`);
  const down = await browser.run(() => [...document.querySelectorAll("#identity output, #pose output")].some(({ value }) => value !== "0.00"));
  check(down, `${name}: a fit leaves the sliders where they were`);
  await browser.click("#landmarks");
  await browser.click("#reset");
  check(differing(first, await page.picture("reset-again"), area) === 0, `${name}: reset does not lead back after a fit`);

  const ms = await browser.run(() => shown.msPerEvaluation);
  await damaged(page, first, area);
  await page.consoleIsClean();
  return { face, ms, drawnBy: await browser.run(() => scene.version) };
}

/** Files that are no models: by the file input and by dropping. */
async function damaged(page, first, area) {
  const { browser, name } = page;
  const model = await readFile(join(folder, "face.hab"));
  model[model.length / 2] ^= 1;
  const path = resolve(shots, "damaged.hab");
  await writeFile(path, model);
  await browser.type("#file", path);
  await browser.until("the sentence on a damaged file", () => !document.getElementById("message").hidden);
  const sentence = await page.message();
  check(/^damaged\.hab cannot be opened\. .*checksum.*damaged/i.test(sentence), `${name}: the sentence is: ${sentence}`);
  check(differing(first, await page.picture("damaged"), area) === 0, `${name}: a damaged file takes the face away`);

  const drop = (content, fileName) => {
    const data = new DataTransfer();
    data.items.add(new File([Uint8Array.from(content)], fileName));
    dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
  };
  await browser.run(drop, Array.from(new TextEncoder().encode("GIF89a".repeat(40))), "picture.gif");
  await browser.until("the sentence on a picture", () => document.getElementById("message").textContent.startsWith("picture.gif"));
  check(/no \.hab model/.test(await page.message()), `${name}: the sentence is: ${await page.message()}`);

  const small = await readFile(new URL("../../firmware/models/small.hab", import.meta.url));
  await browser.run(drop, Array.from(small), "small.hab");
  await browser.until("the other model", () => document.getElementById("model-name").textContent === "small.hab");
  check((await page.message()) === "", `${name}: ${await page.message()}`);
  const other = await page.picture("other-model");
  check(differing(first, other, area) > 1000, `${name}: another model gives the same picture`);
  // A lit sheet with a nose, in the colour of skin: the check on faces must be stricter than that.
  check(noFace(faceIn(other, area)).length > 0, `${name}: the check takes a sheet for a face`);
  await wavelets(page, drop);
}

/** A model with weights for each of its coefficients: a bounded number of sliders, and pulls by its coarse levels. */
async function wavelets(page, drop) {
  const { browser, name } = page;
  const file = await readFile(new URL("../../firmware/models/wavelet.hab", import.meta.url));
  await browser.run(drop, Array.from(file), "wavelet.hab");
  await browser.until("the wavelet model", () => document.getElementById("model-name").textContent === "wavelet.hab");
  check((await page.message()) === "", `${name}: ${await page.message()}`);
  const [sliders, weights] = await browser.run(() => ["identity", "pose"].map((mode) => [document.querySelectorAll(`#${mode} input`).length, shown.deviations[mode].length]).reduce(([a, b], [c, d]) => [a + c, b + d]));
  check(sliders > 0 && sliders <= 120 && weights > sliders, `${name}: ${sliders} sliders for ${weights} weights`);
  const moved = await browser.run(() => {
    const at = (k) => Array.from(shown.positions.slice(3 * shown.landmarks[k], 3 * shown.landmarks[k] + 3));
    const targets = Array.from(shown.landmarks, (_, k) => at(k));
    const before = at(0);
    targets[0] = [before[0], before[1], before[2] + 6];
    const fitted = pulledLevels(targets, weightsOf(shown));
    return shown.model.evaluate(fitted)[3 * shown.landmarks[0] + 2] - before[2];
  });
  check(moved > 0.5 && moved < 8, `${name}: a landmark that is pulled by 6 mm follows by ${moved}`);
}

const server = await served();
const browser = await Browser.started({ width: 1200, height: 800 });
try {
  const page = new Page(browser, "served");
  // The browser's own first page.
  await page.requests();
  const result = await tour(page, server.url);
  const outside = (await page.requests()).filter((url) => !url.startsWith(server.url) && !url.startsWith("data:"));
  check(outside.length === 0, `requests to elsewhere: ${outside}`);
  check(server.asked.length >= 6, "the page came from somewhere else");
  const entries = await browser.run(() => performance.getEntriesByType("resource").map(({ name }) => name));
  check(entries.length >= 5 && entries.every((url) => url.startsWith(server.url)), `loaded from elsewhere: ${entries}`);
  // The page could not ask for more if it tried.
  const tried = await browser.runAsync((url) => fetch(url).then(() => "it was allowed"), `${server.url}face.hab`);
  check(/TypeError|Failed to fetch/.test(tried) && !server.asked.includes("/face.hab"), `a request from within the page: ${tried}`);
  await browser.log("browser");

  const fromFolder = new Page(browser, "folder");
  await fromFolder.requests();
  await tour(fromFolder, pathToFileURL(resolve(folder, "index.html")).href);
  const others = (await fromFolder.requests()).filter((url) => !url.startsWith("file:") && !url.startsWith("data:"));
  check(others.length === 0, `requests from the folder: ${others}`);

  await browser.open(`${server.url}readme.html`);
  const said = await browser.until("what the README's page says", () => document.body.textContent.trim());
  check(/^1617 vertices, 3040 triangles, 0\.\d\d mm rms$/.test(said), `the README's page says: ${said}`);
  await browser.log("browser");

  const phone = new Page(browser, "phone");
  await browser.resize(390, 780);
  await browser.command("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: "dark" }] });
  await browser.open(server.url);
  const picture = await phone.picture("dark");
  const area = await phone.area();
  check(noFace(faceIn(picture, area)).length === 0, `on a phone: ${noFace(faceIn(picture, area)).join("; ")}`);
  const wide = await browser.run(() => document.documentElement.scrollWidth > innerWidth);
  check(!wide, "on a phone the page is wider than the screen");
  await phone.consoleIsClean();

  for (const [key, value] of Object.entries(result.face)) console.log(`face: ${key} ${value.toFixed(3)}`);
  console.log(`${browser.version}, ${result.drawnBy}, ${result.ms.toFixed(3)} ms an evaluation`);
} finally {
  await browser.stop();
}

const blind = await Browser.started({ width: 900, height: 600, flags: ["--disable-3d-apis"] });
try {
  await blind.open(server.url);
  const page = new Page(blind, "blind");
  await page.picture("no-webgl");
  check(/no WebGL/.test(await page.message()), `without WebGL the page says: ${await page.message()}`);
} finally {
  await blind.stop();
  server.server.close();
}
console.log(`@checks ${checks}`);
