// Opens pages that habitus wrote, from their folders, in a headless Chromium without a network:
//
//     node pages.mjs SCREENSHOTS FOLDER...
//
// Every picture must be shown, every link lead to a file, the console stay empty, and nothing be asked for outside the folder. A check that fails
// ends the run with 1 and its sentence. Figures are printed as lines `@name value`.
import assert from "node:assert/strict";
import { access, mkdir, readFile, writeFile } from "node:fs/promises";
import { basename, join, resolve } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { decoded } from "../../examples/web/tests/picture.mjs";
import { Browser } from "../../examples/web/tests/webdriver.mjs";

const [shots, ...folders] = process.argv.slice(2);
if (folders.length === 0) {
  console.error("usage: node pages.mjs SCREENSHOTS FOLDER...");
  process.exit(2);
}
await mkdir(shots, { recursive: true });
let checks = 0;
const check = (condition, sentence) => {
  checks++;
  assert.ok(condition, sentence);
};

/** Everything that was asked for since the last call. */
async function requests(browser) {
  const events = (await browser.log("performance")).map(({ message }) => JSON.parse(message).message);
  return events.filter(({ method }) => method === "Network.requestWillBeSent").map(({ params }) => params.request.url);
}

/** The share of a PNG's pixels that are not of the colour of its corner. */
async function drawn(file) {
  const { channels, pixels } = decoded(await readFile(file));
  let others = 0;
  for (let at = 0; at < pixels.length; at += channels) {
    if (pixels[at] !== pixels[0] || pixels[at + 1] !== pixels[1] || pixels[at + 2] !== pixels[2]) others++;
  }
  return (others * channels) / pixels.length;
}

async function opened(browser, folder) {
  const [name, base] = [basename(folder), pathToFileURL(resolve(folder)).href + "/"];
  await requests(browser);
  await browser.open(`${base}index.html`);
  // A picture that cannot be decoded gives a sentence instead of nothing.
  const failed = await browser.runAsync(() =>
    Promise.all([...document.images].map((image) => image.decode().then(() => null, () => image.src))).then((all) => all.filter((src) => src !== null)),
  );
  check(failed.length === 0, `${name}: pictures that are not shown: ${failed}`);
  const page = await browser.run(() => ({
    images: [...document.images].map(({ src, alt, naturalWidth }) => ({ src, alt, naturalWidth })),
    links: [...document.querySelectorAll("a")].map(({ href }) => href),
    words: document.body.innerText.length,
  }));
  check(page.images.length >= 10 && page.words > 500, `${name}: only ${page.images.length} pictures and ${page.words} letters`);
  check(page.images.every(({ naturalWidth }) => naturalWidth > 0), `${name}: a picture without a size`);
  check(page.images.every(({ alt }) => alt.length > 5), `${name}: a picture without words for those who do not see it`);
  for (const url of [...page.images.map(({ src }) => src), ...page.links]) {
    check(url.startsWith(base), `${name}: ${url} is not in the folder`);
    await access(fileURLToPath(url)).catch(() => check(false, `${name}: ${url} is not there`));
  }
  for (const { src } of page.images.filter(({ src }) => src.endsWith(".png") && !src.endsWith("legend.png"))) {
    const share = await drawn(fileURLToPath(src));
    check(share > 0.15 && share < 0.97, `${name}: ${share} of ${basename(src)} is drawn`);
  }
  const outside = (await requests(browser)).filter((url) => !url.startsWith(base) && !url.startsWith("data:"));
  check(outside.length === 0, `${name}: requests to elsewhere: ${outside}`);
  // The page could not ask for more if it tried.
  const tried = await browser.runAsync(() => new Promise((done) => {
    const image = new Image();
    image.onload = () => done("it was allowed");
    image.onerror = () => done("refused");
    image.src = "https://example.org/picture.png";
  }));
  check(tried === "refused", `${name}: a picture from elsewhere: ${tried}`);
  await browser.log("browser");
  await requests(browser);
}

/** Opens the page at a width, in the light or in the dark, and takes its picture. */
async function shown(browser, folder, [width, scheme]) {
  const name = `${basename(folder)}-${width}-${scheme}`;
  await browser.command("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: scheme }] });
  await browser.resize(width, 800);
  await browser.open(pathToFileURL(resolve(folder, "index.html")).href);
  const [wide, height] = await browser.run(() => [document.documentElement.scrollWidth, document.documentElement.scrollHeight]);
  check(wide <= width, `${name}: the page is ${wide} wide`);
  await browser.resize(width, Math.min(height, 12000));
  await browser.run(() => Promise.all([...document.images].map((image) => image.decode())).then(() => true));
  const png = await browser.screenshot();
  await writeFile(join(shots, `${name}.png`), png);
  const { pixels } = decoded(png);
  check(pixels[0] > 200 === (scheme === "light"), `${name}: the ground is ${pixels.slice(0, 3)}`);
  const entries = (await browser.log("browser")).filter(({ level }) => level !== "DEBUG" && level !== "INFO");
  check(entries.length === 0, `${name}: the console says ${JSON.stringify(entries)}`);
}

const browser = await Browser.started({ width: 1200, height: 800 });
try {
  await browser.command("Network.enable", {});
  await browser.command("Network.emulateNetworkConditions", { offline: true, latency: 0, downloadThroughput: -1, uploadThroughput: -1 });
  for (const folder of folders) {
    await opened(browser, folder);
    for (const look of [[1200, "light"], [390, "dark"]]) await shown(browser, folder, look);
  }
  console.log(browser.version);
} finally {
  await browser.stop();
}
console.log(`@checks ${checks}`);
