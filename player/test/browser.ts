/**
 * Headless Chromium for the tests of the player and of the examples.
 *
 * `QUARC_CHROMIUM` is the path of the browser; by default, Chromium is searched on $PATH. Without Chromium, the
 * browser tests are skipped.
 */

import assert from "node:assert/strict";
import { accessSync, constants } from "node:fs";
import { delimiter, join } from "node:path";
import { after, test, type TestContext } from "node:test";
import { chromium, type Browser, type Page } from "playwright-core";
import { decodePng, type Pixels } from "./png.js";
import { readPlayerFile, readRoom, StreamServer, type ServerOptions } from "./server.js";

const BROWSER_NAMES = ["chromium-headless-shell", "chromium", "chromium-browser", "google-chrome"];
const BROWSER_ARGUMENTS = [
  ...["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--js-flags=--expose-gc"],
  "--autoplay-policy=no-user-gesture-required", // otherwise sound depends on what a test has done before
];
const TIMEOUT_MS = 60_000; // CI machines are slow, and share their processors

/** Screen pixels per CSS pixel, because software draws small pictures faster. */
export const PIXEL_RATIO = 0.5;

const browserPath = findChromium();
let browserPromise: Promise<Browser> | null = null;

after(async () => {
  await (await browserPromise)?.close();
});

export interface PageOptions extends ServerOptions {
  readonly stream?: Uint8Array;
  /** Attributes of the element `quarc-player` on the page; null for a page without the element. */
  readonly attributes?: string | null;
  readonly width?: number;
  readonly height?: number;
  readonly isTouch?: boolean;
  /** JavaScript to run before the page's own scripts. */
  readonly initScript?: string;
  /** Console errors that the test expects. */
  readonly expectedErrors?: RegExp;
}

/** A page with its own server. The test fails if the page logs an error or a warning. */
export class PlayerPage {
  readonly errors: string[] = [];

  private constructor(
    readonly page: Page,
    readonly server: StreamServer,
    private readonly expectedErrors: RegExp | null,
  ) {
    page.setDefaultTimeout(TIMEOUT_MS);
    page.on("pageerror", (error) => this.errors.push(String(error.stack ?? error)));
    page.on("console", (message) => {
      const isDriverMessage = message.text().includes("GL Driver Message"); // reading pixels is slow
      const isError = ["error", "warning"].includes(message.type()) && !isDriverMessage;
      if (isError) this.errors.push(message.text());
    });
  }

  static async open(options: PageOptions = {}): Promise<PlayerPage> {
    const { stream = readRoom(), attributes = "", width = 480, height = 400 } = options;
    const files = {
      "/": makePage(attributes),
      "/quarc-player.js": readPlayerFile("dist/quarc-player.js"),
      ...options.files,
    };
    const server = await StreamServer.start(stream, { ...options, files });
    const browser = await launch();
    const viewport = { width, height };
    const page = await browser.newPage({ viewport, hasTouch: options.isTouch ?? false, deviceScaleFactor: PIXEL_RATIO });
    const playerPage = new PlayerPage(page, server, options.expectedErrors ?? null);
    if (options.initScript !== undefined) await page.addInitScript(options.initScript);
    await page.goto(`${server.origin}/`);
    return playerPage;
  }

  /** Run a function on the page; it receives the player element and `argument`, which is passed as JSON. */
  run<T, A>(action: (playerElement: PlayerElement, argument: A) => T | Promise<T>, argument?: A): Promise<T> {
    const json = JSON.stringify(argument ?? null);
    return this.page.evaluate(`(${String(action)})(document.querySelector("quarc-player"), ${json})`);
  }

  /** Wait until a condition on the player element is true. */
  async waitUntil(condition: (playerElement: PlayerElement) => boolean): Promise<void> {
    await this.page.waitForFunction(`(${String(condition)})(document.querySelector("quarc-player"))`);
  }

  /** Take a screenshot of the page, in CSS pixels. */
  async takeScreenshot(): Promise<Pixels> {
    return decodePng(await this.page.screenshot({ scale: "css" }));
  }

  /** Seek, and wait until the frame is shown. */
  async setFrame(frame: number): Promise<void> {
    await this.run((playerElement, target) => playerElement.setFrame(target), frame);
    await this.page.waitForFunction(`document.querySelector("quarc-player").frame === ${frame}`);
  }

  async [Symbol.asyncDispose](): Promise<void> {
    await this.page.close();
    await this.server[Symbol.asyncDispose]();
    const unexpected = this.errors.filter((text) => this.expectedErrors?.test(text) !== true);
    assert.deepEqual(unexpected, [], "the console shows errors");
  }
}

/** The type of the component. Its module is not imported, because it needs a page. */
export type PlayerElement = import("../src/component/quarc-player.js").QuarcPlayer;

/** Define a test that needs a browser. */
export function browserTest(name: string, body: (context: TestContext) => Promise<void>): void {
  const skip = browserPath === null && "Chromium is not installed: install it, or set QUARC_CHROMIUM";
  test(name, { skip, timeout: 3 * TIMEOUT_MS }, body);
}

/** Return the browser of this process; the first call starts it. */
export function launch(): Promise<Browser> {
  assert.ok(browserPath !== null);
  browserPromise ??= chromium.launch({ executablePath: browserPath, args: BROWSER_ARGUMENTS });
  return browserPromise;
}

function findChromium(): string | null {
  const chosenPath = process.env["QUARC_CHROMIUM"];
  if (chosenPath !== undefined) return chosenPath;
  const folders = (process.env["PATH"] ?? "").split(delimiter);
  const paths = BROWSER_NAMES.flatMap((name) => folders.map((folder) => join(folder, name)));
  return paths.find(isExecutable) ?? null;
}

function isExecutable(path: string): boolean {
  try {
    accessSync(path, constants.X_OK);
    return true;
  } catch {
    return false;
  }
}

function makePage(attributes: string | null): string {
  const playerElement =
    attributes === null ? "" : `<quarc-player src="stream.quarc" ${attributes}></quarc-player>`;
  return `<!doctype html><html lang="en"><meta charset="utf-8"><title>player</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>body { margin: 0; background: #000 } quarc-player { width: 100vw; height: 100vh }</style>
<script type="module" src="quarc-player.js"></script>${playerElement}`;
}
