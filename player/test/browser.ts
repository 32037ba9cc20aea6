/**
 * Headless Chromium for the tests of the player and of the examples.
 *
 * `QUARC_CHROMIUM` names the browser; the default is Debian's chromium-headless-shell or chromium. Without a browser,
 * the tests that need one are skipped.
 */

import assert from "node:assert/strict";
import { accessSync, constants } from "node:fs";
import { delimiter, join } from "node:path";
import { after, test, type TestContext } from "node:test";
import { chromium, type Browser, type Page } from "playwright-core";
import { decodePng, type Pixels } from "./png.js";
import { readPlayerFile, readRoom, StreamServer, type ServerOptions } from "./server.js";

const NAMES = ["chromium-headless-shell", "chromium", "chromium-browser", "google-chrome"];
const ARGUMENTS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--js-flags=--expose-gc"];
const PATIENCE_MS = 60_000; // CI machines are slow, and share their processors

const executable = findChromium();
let running: Promise<Browser> | null = null;

after(async () => {
  await (await running)?.close();
});

export interface PageOptions extends ServerOptions {
  readonly stream?: Uint8Array;
  /** Attributes of the `quarc-player` on the page; null for a page without one. */
  readonly attributes?: string | null;
  readonly width?: number;
  readonly height?: number;
  readonly isTouch?: boolean;
  /** Console errors that the test expects. */
  readonly expectedErrors?: RegExp;
}

/** A page with its own server; the test fails if anything is logged as an error. */
export class PlayerPage {
  readonly errors: string[] = [];

  private constructor(
    readonly page: Page,
    readonly server: StreamServer,
    private readonly expectedErrors: RegExp | null,
  ) {
    page.setDefaultTimeout(PATIENCE_MS);
    page.on("pageerror", (error) => this.errors.push(String(error.stack ?? error)));
    page.on("console", (message) => {
      const isOfDriver = message.text().includes("GL Driver Message"); // reading pixels is slow
      const isWrong = ["error", "warning"].includes(message.type()) && !isOfDriver;
      if (isWrong) this.errors.push(message.text());
    });
  }

  static async open(options: PageOptions = {}): Promise<PlayerPage> {
    const { stream = readRoom(), attributes = "", width = 480, height = 400 } = options;
    const files = {
      "/": writePage(attributes),
      "/quarc-player.js": readPlayerFile("dist/quarc-player.js"),
      ...options.files,
    };
    const server = await StreamServer.start(stream, { ...options, files });
    const browser = await launch();
    const viewport = { width, height };
    const page = await browser.newPage({ viewport, hasTouch: options.isTouch ?? false });
    const opened = new PlayerPage(page, server, options.expectedErrors ?? null);
    await page.goto(`${server.origin}/`);
    return opened;
  }

  /** Run a function on the page with its player; `argument` is passed as JSON. */
  run<T, A>(act: (player: PlayerElement, argument: A) => T | Promise<T>, argument?: A): Promise<T> {
    const json = JSON.stringify(argument ?? null);
    return this.page.evaluate(`(${String(act)})(document.querySelector("quarc-player"), ${json})`);
  }

  /** Wait until a condition on the player holds. */
  async until(holds: (player: PlayerElement) => boolean): Promise<void> {
    await this.page.waitForFunction(`(${String(holds)})(document.querySelector("quarc-player"))`);
  }

  /** A screenshot. */
  async look(): Promise<Pixels> {
    return decodePng(await this.page.screenshot());
  }

  /** Seek, and wait until the frame is shown. */
  async setFrame(frame: number): Promise<void> {
    await this.run((player, to) => player.setFrame(to), frame);
    await this.page.waitForFunction(`document.querySelector("quarc-player").frame === ${frame}`);
  }

  async [Symbol.asyncDispose](): Promise<void> {
    await this.page.close();
    await this.server[Symbol.asyncDispose]();
    const unexpected = this.errors.filter((text) => this.expectedErrors?.test(text) !== true);
    assert.deepEqual(unexpected, [], "the console shows errors");
  }
}

/** The part of the component that tests use; not imported, because its module needs a page. */
export type PlayerElement = import("../src/component/quarc-player.js").QuarcPlayer;

/** A test that needs a browser. */
export function browserTest(name: string, act: (context: TestContext) => Promise<void>): void {
  const skip = executable === null && "no Chromium here: apt-get install chromium-headless-shell";
  test(name, { skip, timeout: 3 * PATIENCE_MS }, act);
}

/** The browser of this process, started when it is first needed. */
export function launch(): Promise<Browser> {
  assert.ok(executable !== null);
  running ??= chromium.launch({ executablePath: executable, args: ARGUMENTS });
  return running;
}

function findChromium(): string | null {
  const named = process.env["QUARC_CHROMIUM"];
  if (named !== undefined) return named;
  const folders = (process.env["PATH"] ?? "").split(delimiter);
  const places = NAMES.flatMap((name) => folders.map((folder) => join(folder, name)));
  return places.find(isExecutable) ?? null;
}

function isExecutable(path: string): boolean {
  try {
    accessSync(path, constants.X_OK);
    return true;
  } catch {
    return false;
  }
}

function writePage(attributes: string | null): string {
  const player =
    attributes === null ? "" : `<quarc-player src="stream.quarc" ${attributes}></quarc-player>`;
  return `<!doctype html><html lang="en"><meta charset="utf-8"><title>player</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>body { margin: 0; background: #000 } quarc-player { width: 100vw; height: 100vh }</style>
<script type="module" src="quarc-player.js"></script>${player}`;
}
