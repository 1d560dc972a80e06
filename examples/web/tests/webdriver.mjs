// A headless Chromium driven through chromedriver by the WebDriver protocol, with nothing but fetch.
import { spawn } from "node:child_process";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";

/** The key of an element in the protocol. */
const ELEMENT = "element-6066-11e4-a52e-4f735466cecf";

// As root there is no sandbox; pictures come from a software renderer; and nothing but the page may cause a request.
const FLAGS = [
  "--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
  "--disable-dev-shm-usage", "--hide-scrollbars", "--force-device-scale-factor=1", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
];

export class Browser {
  #driver;
  #base;
  #id;
  #profile;

  /** Starts a browser; `flags` come after the usual ones. */
  static async started({ width, height, flags = [] }) {
    const browser = new Browser();
    browser.#profile = await mkdtemp(join(tmpdir(), "habitus-web-"));
    browser.#driver = spawn("chromedriver", ["--port=0"], { stdio: ["ignore", "pipe", "ignore"] });
    try {
      const port = await new Promise((found, failed) => {
        let text = "";
        browser.#driver.on("error", () => failed(new Error("chromedriver is missing: on Debian `apt-get install chromium chromium-driver`")));
        browser.#driver.on("exit", (code) => failed(new Error(`chromedriver ended with ${code}: ${text}`)));
        browser.#driver.stdout.on("data", (data) => {
          text += data;
          const port = /started successfully on port (\d+)/.exec(text);
          if (port !== null) found(port[1]);
        });
      });
      browser.#base = `http://127.0.0.1:${port}/session`;
      const args = [...FLAGS, `--user-data-dir=${browser.#profile}`, `--window-size=${width},${height}`, ...flags];
      const alwaysMatch = { "goog:chromeOptions": { args }, "goog:loggingPrefs": { browser: "ALL", performance: "ALL" } };
      const { sessionId, capabilities } = await browser.#call("POST", "", { capabilities: { alwaysMatch } });
      browser.#id = sessionId;
      browser.version = `${capabilities.browserName} ${capabilities.browserVersion}`;
      // The window's size counts what is around the page; the page's own is what is asked for.
      await browser.resize(width, height);
      return browser;
    } catch (error) {
      await browser.stop();
      throw error;
    }
  }

  async stop() {
    if (this.#id !== undefined) await this.#call("DELETE", `/${this.#id}`).catch(() => undefined);
    const ended = new Promise((done) => this.#driver.once("exit", done));
    if (this.#driver.exitCode === null && this.#driver.pid !== undefined) {
      this.#driver.kill();
      await ended;
    }
    await rm(this.#profile, { recursive: true, force: true, maxRetries: 10, retryDelay: 100 });
  }

  async #call(method, path, body) {
    const response = await fetch(this.#base + path, { method, body: body === undefined ? undefined : JSON.stringify(body) });
    const { value } = await response.json();
    if (!response.ok) throw new Error(`chromedriver, ${method} ${path}: ${value.message}`);
    return value;
  }

  #at = (method, path, body) => this.#call(method, `/${this.#id}${path}`, body);

  open = (url) => this.#at("POST", "/url", { url });

  resize = (width, height) => this.command("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: false });

  /** A command of the DevTools protocol. */
  command = (cmd, params) => this.#at("POST", "/goog/cdp/execute", { cmd, params });

  /** Runs a function in the page. */
  run = (body, ...args) => this.#at("POST", "/execute/sync", { script: `return (${body}).apply(null, arguments)`, args });

  /** The same with a function that returns a promise. */
  runAsync = (body, ...args) =>
    this.#at("POST", "/execute/async", {
      script: `const done = arguments[arguments.length - 1]; (${body}).apply(null, Array.prototype.slice.call(arguments, 0, -1)).then(done, (error) => done(String(error)))`,
      args,
    });

  /** Waits until a function in the page gives something true, and returns it. */
  async until(what, body, ...args) {
    for (const end = Date.now() + 60000; Date.now() < end; ) {
      const found = await this.run(body, ...args);
      if (found) return found;
      await new Promise((done) => setTimeout(done, 30));
    }
    throw new Error(`waited 60 s in vain: ${what}`);
  }

  async #element(selector) {
    const found = await this.#at("POST", "/element", { using: "css selector", value: selector });
    return found[ELEMENT];
  }

  async click(selector) {
    await this.#at("POST", `/element/${await this.#element(selector)}/click`, {});
  }

  /** Types into an element; a file's path into a file input. */
  async type(selector, text) {
    await this.#at("POST", `/element/${await this.#element(selector)}/value`, { text });
  }

  /** Drags the pointer along points of the page. */
  async drag(points) {
    const moves = points.map(([x, y], k) => ({ type: "pointerMove", duration: k === 0 ? 0 : 60, x: Math.round(x), y: Math.round(y) }));
    const actions = [moves[0], { type: "pointerDown", button: 0 }, ...moves.slice(1), { type: "pointerUp", button: 0 }];
    await this.#at("POST", "/actions", { actions: [{ type: "pointer", id: "mouse", parameters: { pointerType: "mouse" }, actions }] });
    await this.#at("DELETE", "/actions");
  }

  /** The page as a PNG. */
  async screenshot() {
    return Buffer.from(await this.#at("GET", "/screenshot"), "base64");
  }

  /** What has been logged since the last call; `type` is "browser" (the console) or "performance" (events of the DevTools protocol). */
  log = (type) => this.#at("POST", "/se/log", { type });
}
