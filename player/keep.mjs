/**
 * Stores the built player in the Python package, where `quarc-ref view` and `quarc-ref publish` find it:
 *
 *     node keep.mjs           builds the player if its sources have changed
 *     node keep.mjs --check   fails if the sources have changed, or if a new build differs
 *     node keep.mjs --extract [FILE]
 *                             writes the stored decoder to the file that build.mjs reads, if its sources have not changed
 *
 * The file stamp.json beside the stored player contains digests of the sources and the versions of the tools. If the
 * sources of the decoder have not changed, its WebAssembly module is taken from the stored player; so a change of
 * player/src needs only npm. `make player` builds a module and passes it in $QUARC_WASM. If that module differs from the
 * stored one although the sources and the tools are the same, this is an error.
 */

import { execFileSync, spawnSync } from "node:child_process";
import { createHash } from "node:crypto";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { gunzipSync } from "node:zlib";

const ROOT = fileURLToPath(new URL("..", import.meta.url));
const resolvePath = (path) => join(ROOT, path);
const STORED_FOLDER = "quarc_ref/viewing/player";
const STORED_PLAYER = resolvePath(`${STORED_FOLDER}/quarc-player.js`);
const STAMP_PATH = resolvePath(`${STORED_FOLDER}/stamp.json`);
const SOURCES = JSON.parse(readFileSync(resolvePath("player/sources.json"), "utf8"));
const MODULE_PATTERN = /H4sI[A-Za-z0-9+/]+=*/; // gzip in base64

const sha256 = (data) => createHash("sha256").update(data).digest("hex");

function listFiles(path) {
  if (!statSync(resolvePath(path)).isDirectory()) return [path];
  return readdirSync(resolvePath(path)).flatMap((name) => listFiles(`${path}/${name}`));
}

/** Return a digest of the names and contents of files; tests/viewing/test_kept_player.py computes the same digest. */
function digestSources(paths) {
  const lines = paths.flatMap(listFiles).map((path) => `${sha256(readFileSync(resolvePath(path)))}  ${path}\n`);
  return sha256(lines.sort().join(""));
}

const extractModule = (player) => gunzipSync(Buffer.from(MODULE_PATTERN.exec(player)[0], "base64"));

/** Replace the module in a player by a digest of the module, because zlib versions compress differently. */
const normalize = (player) => player.replace(MODULE_PATTERN, () => sha256(extractModule(player)));

function readToolVersions() {
  const readVersion = (command) => {
    const { stdout } = spawnSync(command, ["--version"], { encoding: "utf8" });
    return (stdout ?? "").trim().split("\n")[0] || null;
  };
  const { version: esbuild } = JSON.parse(readFileSync(resolvePath("player/node_modules/esbuild/package.json"), "utf8"));
  const rustc = readFileSync(resolvePath("core/wasm/toolchain"), "utf8").trim();
  return { esbuild, rustc, wasmOpt: readVersion("wasm-opt") };
}

function buildPlayer(wasm) {
  const folder = mkdtempSync(join(tmpdir(), "quarc-player-"));
  try {
    writeFileSync(join(folder, "quarc.wasm"), wasm);
    const env = { ...process.env, QUARC_WASM: join(folder, "quarc.wasm") };
    execFileSync(process.execPath, [resolvePath("player/build.mjs")], { env, stdio: ["ignore", "ignore", "inherit"] });
    return readFileSync(resolvePath("player/dist/quarc-player.js"), "utf8");
  } finally {
    rmSync(folder, { recursive: true });
  }
}

function buildModule() {
  execFileSync(resolvePath("core/wasm/build.sh"), ["--player"], { stdio: ["ignore", "ignore", "inherit"] });
  return readFileSync(resolvePath("core/wasm/quarc-player.wasm"));
}

function fail(message) {
  console.error(`player/keep.mjs: ${message}`);
  process.exit(1);
}

const isCheck = process.argv.includes("--check");
const stamp = existsSync(STAMP_PATH) ? JSON.parse(readFileSync(STAMP_PATH, "utf8")) : {};
const storedPlayer = existsSync(STORED_PLAYER) ? readFileSync(STORED_PLAYER, "utf8") : null;
const digests = { player: digestSources(SOURCES.player), core: digestSources(SOURCES.core) };
const isCurrent = { player: stamp.player === digests.player, core: stamp.core === digests.core };
const isStoredIntact = storedPlayer !== null && stamp.bytes === sha256(storedPlayer);

if (isCheck && !(isStoredIntact && isCurrent.player && isCurrent.core)) {
  fail(`${STORED_FOLDER} is out of date: run \`make player\``);
}
const extractIndex = process.argv.indexOf("--extract");
if (extractIndex > 0) {
  if (!(isStoredIntact && isCurrent.core)) fail("the sources of the decoder have changed: run core/wasm/build.sh --player");
  const path = process.argv[extractIndex + 1] ?? resolvePath("core/wasm/quarc-player.wasm");
  writeFileSync(path, extractModule(storedPlayer));
  process.exit(0);
}
const newModule = process.env.QUARC_WASM ? readFileSync(process.env.QUARC_WASM) : null;
let wasm = newModule;
if (isStoredIntact && isCurrent.core) {
  wasm = extractModule(storedPlayer);
  if (newModule !== null && !newModule.equals(wasm)) {
    const tools = JSON.stringify(readToolVersions());
    const difference = `the new decoder module (${tools}) differs from the stored one (${JSON.stringify(stamp.tools)})`;
    if (tools === JSON.stringify(stamp.tools)) fail(`${difference}, although the sources and tools are the same`);
    console.log(`${difference}: using the stored module`);
  }
}
wasm ??= buildModule();
const builtPlayer = buildPlayer(wasm);
if (isStoredIntact && isCurrent.player && isCurrent.core) {
  if (normalize(builtPlayer) !== normalize(storedPlayer)) {
    fail(`the build differs from ${STORED_FOLDER}, although the sources are the same`);
  }
  console.log(`${STORED_FOLDER} is up to date`);
} else {
  mkdirSync(resolvePath(STORED_FOLDER), { recursive: true });
  writeFileSync(STORED_PLAYER, builtPlayer);
  // A module from the stored player was not built by the compiler of this machine.
  const versions = readToolVersions();
  const tools = isStoredIntact && isCurrent.core ? { ...stamp.tools, esbuild: versions.esbuild } : versions;
  const newStamp = { ...digests, bytes: sha256(builtPlayer), wasm: sha256(wasm), tools };
  writeFileSync(STAMP_PATH, `${JSON.stringify(newStamp, null, 2)}\n`);
  console.log(`${STORED_FOLDER} was updated`);
}
