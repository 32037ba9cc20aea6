/**
 * Builds dist/: quarc-player.js for pages and quarc-decode.js for programs, each a single file; with --test, builds the
 * tests for node --test.
 *
 * The import `worker:NAME` is the code of src/NAME.ts as text, and `wasm:quarc` is the compressed decoder.
 */

import { existsSync, readFileSync, rmSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { build } from "esbuild";

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const WASM = process.env.QUARC_WASM ?? here("../core/wasm/quarc-player.wasm");

const shared = { bundle: true, minify: true, target: "es2022", legalComments: "none" };

const wasm = {
  name: "wasm",
  setup({ onResolve, onLoad }) {
    onResolve({ filter: /^wasm:quarc$/ }, ({ path }) => ({ path, namespace: "wasm" }));
    onLoad({ filter: /.*/, namespace: "wasm" }, () => {
      const contents = gzipSync(readFileSync(WASM), { level: 9 }).toString("base64");
      return { contents, loader: "text", watchFiles: [WASM] };
    });
  },
};

const workers = {
  name: "workers",
  setup({ onResolve, onLoad }) {
    onResolve({ filter: /^worker:/ }, ({ path }) => ({
      path: here(`src/${path.slice("worker:".length)}.ts`),
      namespace: "worker",
    }));
    onLoad({ filter: /.*/, namespace: "worker" }, async ({ path }) => {
      const bundled = await build({
        ...{ ...shared, entryPoints: [path], plugins: [wasm] },
        ...{ format: "iife", write: false, metafile: true },
      });
      const watchFiles = Object.keys(bundled.metafile.inputs);
      return { contents: bundled.outputFiles[0].text, loader: "text", watchFiles };
    });
  },
};

if (!existsSync(WASM)) {
  console.error(`player/build.mjs: ${WASM} is missing; run core/wasm/build.sh --player`);
  process.exit(1);
}
const plugins = [workers, wasm];
if (process.argv.includes("--test")) {
  rmSync(here("build"), { recursive: true, force: true });
  await build({
    ...{ bundle: true, target: "es2022", plugins, platform: "node", format: "esm" },
    ...{ entryPoints: [here("test/*.test.ts")], outdir: here("build"), outExtension: { ".js": ".mjs" } },
    external: ["node:*", "playwright-core"],
  });
} else {
  await build({
    ...{ ...shared, plugins, format: "esm", outdir: here("dist") },
    entryPoints: { "quarc-player": here("src/index.ts"), "quarc-decode": here("src/decode/index.ts") },
  });
  for (const name of ["quarc-player", "quarc-decode"]) {
    const size = gzipSync(readFileSync(here(`dist/${name}.js`)), { level: 9 }).length;
    console.log(`dist/${name}.js: ${size} bytes gzipped`);
  }
}
