/**
 * Keeps the built player in the Python package, where `quarc-ref view` and `publish` take it from:
 *
 *     node keep.mjs           builds it anew if its sources have changed
 *     node keep.mjs --check   fails if they have, or if a new build gives something else
 *
 * Beside the player lies a stamp: digests of the sources that it was built from, the tools that
 * built it. While the sources of the decoder are the same, its module is taken out of the player
 * that is kept, so that a change of player/src needs npm only. `make player` hands over a module
 * that it has just built ($QUARC_WASM); one that differs although its sources are the same is an
 * error, unless other tools have made it.
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

/** One digest of the names and the bytes of files; tests/viewing/test_kept_player.py has the same. */
function digestSources(paths) {
  const lines = paths.flatMap(listFiles).map((path) => `${sha256(readFileSync(at(path)))}  ${path}\n`);
  return sha256(lines.sort().join(""));
}

const takeModule = (player) => gunzipSync(Buffer.from(MODULE.exec(player)[0], "base64"));

/** The player with its module as a digest: how well zlib compresses depends on its version. */
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
  fail(`${KEPT} is not of these sources: \`make player\` refreshes it`);
}
const given = process.env.QUARC_WASM ? readFileSync(process.env.QUARC_WASM) : null;
let wasm = given;
if (isKept && isCurrent.core) {
  wasm = takeModule(kept);
  if (given !== null && !given.equals(wasm)) {
    const tools = JSON.stringify(nameTools());
    const said = `the decoder that is kept was built by ${JSON.stringify(stamp.tools)}, and ${tools} give another`;
    if (tools === JSON.stringify(stamp.tools)) fail(said);
    console.log(`${said}: it stays`);
  }
}
wasm ??= buildModule();
const built = buildPlayer(wasm);
if (isKept && isCurrent.player && isCurrent.core) {
  if (normalize(built) !== normalize(kept)) fail(`the same sources give another player than ${KEPT} has`);
  console.log(`${KEPT} is of these sources`);
} else {
  mkdirSync(at(KEPT), { recursive: true });
  writeFileSync(PLAYER, built);
  const written = { ...digests, bytes: sha256(built), wasm: sha256(wasm), tools: nameTools() };
  writeFileSync(STAMP, `${JSON.stringify(written, null, 2)}\n`);
  console.log(`${KEPT} is new`);
}
