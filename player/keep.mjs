/**
 * Stores the built player in the Python package, which `quarc-ref view` and `publish` use:
 *
 *     node keep.mjs           builds it again if its sources have changed
 *     node keep.mjs --check   fails if they have changed, or if a new build differs
 *
 * A stamp beside the player has digests of its sources, and the tools that built it. If the sources of the decoder have
 * not changed, its module is taken from the stored player, so that a change of player/src needs only npm. `make player`
 * passes a module that it has just built ($QUARC_WASM); if that differs although the sources are the same, it is an
 * error, unless other tools have built it.
 */

import { execFileSync, spawnSync } from "node:child_process";
import { createHash } from "node:crypto";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { gunzipSync } from "node:zlib";

const ROOT = fileURLToPath(new URL("..", import.meta.url));
const at = (path) => join(ROOT, path);
const KEPT = "quarc_ref/viewing/player";
const PLAYER = at(`${KEPT}/quarc-player.js`);
const STAMP = at(`${KEPT}/stamp.json`);
const SOURCES = JSON.parse(readFileSync(at("player/sources.json"), "utf8"));
const MODULE = /H4sI[A-Za-z0-9+/]+=*/; // gzip in base64

const sha256 = (data) => createHash("sha256").update(data).digest("hex");

function listFiles(path) {
  if (!statSync(at(path)).isDirectory()) return [path];
  return readdirSync(at(path)).flatMap((name) => listFiles(`${path}/${name}`));
}

/** One digest of the names and contents of files; tests/viewing/test_kept_player.py computes the same. */
function digestSources(paths) {
  const lines = paths.flatMap(listFiles).map((path) => `${sha256(readFileSync(at(path)))}  ${path}\n`);
  return sha256(lines.sort().join(""));
}

const takeModule = (player) => gunzipSync(Buffer.from(MODULE.exec(player)[0], "base64"));

/** The player with its module replaced by a digest, because zlib versions compress differently. */
const normalize = (player) => player.replace(MODULE, () => sha256(takeModule(player)));

function nameTools() {
  const ask = (command) => {
    const { stdout } = spawnSync(command, ["--version"], { encoding: "utf8" });
    return (stdout ?? "").trim().split("\n")[0] || null;
  };
  const { version: esbuild } = JSON.parse(readFileSync(at("player/node_modules/esbuild/package.json"), "utf8"));
  return { esbuild, rustc: readFileSync(at("core/wasm/toolchain"), "utf8").trim(), wasmOpt: ask("wasm-opt") };
}

function buildPlayer(wasm) {
  const folder = mkdtempSync(join(tmpdir(), "quarc-player-"));
  try {
    writeFileSync(join(folder, "quarc.wasm"), wasm);
    const env = { ...process.env, QUARC_WASM: join(folder, "quarc.wasm") };
    execFileSync(process.execPath, [at("player/build.mjs")], { env, stdio: ["ignore", "ignore", "inherit"] });
    return readFileSync(at("player/dist/quarc-player.js"), "utf8");
  } finally {
    rmSync(folder, { recursive: true });
  }
}

function buildModule() {
  execFileSync(at("core/wasm/build.sh"), ["--player"], { stdio: ["ignore", "ignore", "inherit"] });
  return readFileSync(at("core/wasm/quarc-player.wasm"));
}

function fail(message) {
  console.error(`player/keep.mjs: ${message}`);
  process.exit(1);
}

const isCheck = process.argv.includes("--check");
const stamp = existsSync(STAMP) ? JSON.parse(readFileSync(STAMP, "utf8")) : {};
const kept = existsSync(PLAYER) ? readFileSync(PLAYER, "utf8") : null;
const digests = { player: digestSources(SOURCES.player), core: digestSources(SOURCES.core) };
const isCurrent = { player: stamp.player === digests.player, core: stamp.core === digests.core };
const isKept = kept !== null && stamp.bytes === sha256(kept);

if (isCheck && !(isKept && isCurrent.player && isCurrent.core)) {
  fail(`${KEPT} is out of date: run \`make player\``);
}
const given = process.env.QUARC_WASM ? readFileSync(process.env.QUARC_WASM) : null;
let wasm = given;
if (isKept && isCurrent.core) {
  wasm = takeModule(kept);
  if (given !== null && !given.equals(wasm)) {
    const tools = JSON.stringify(nameTools());
    const said = `the stored decoder was built with ${JSON.stringify(stamp.tools)}, and ${tools} build a different one`;
    if (tools === JSON.stringify(stamp.tools)) fail(said);
    console.log(`${said}: kept the stored one`);
  }
}
wasm ??= buildModule();
const built = buildPlayer(wasm);
if (isKept && isCurrent.player && isCurrent.core) {
  if (normalize(built) !== normalize(kept)) fail(`the build differs from ${KEPT} although the sources are the same`);
  console.log(`${KEPT} is up to date`);
} else {
  mkdirSync(at(KEPT), { recursive: true });
  writeFileSync(PLAYER, built);
  const written = { ...digests, bytes: sha256(built), wasm: sha256(wasm), tools: nameTools() };
  writeFileSync(STAMP, `${JSON.stringify(written, null, 2)}\n`);
  console.log(`${KEPT} was updated`);
}
