#!/bin/sh
# Builds the decoder as one WebAssembly module: quarc.wasm in this folder. With --player, it is
# quarc-player.wasm, which exports only the functions that the player calls; with --conformance,
# quarc-conformance.wasm, which also answers the test cases of building blocks.
#
# To reduce the size, the standard library is built, too. This needs the compiler version in
# `toolchain` with the source of its library. Searched in this order: $RUSTC and $CARGO, the
# compiler on the path, that of the distribution, that of rustup. Each gives the same module, in
# every folder.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
version=$(cat "$here/toolchain")
target=wasm32-unknown-unknown

fail() {
    echo "core/wasm/build.sh: $1" >&2
    exit 1
}

# Use a compiler, if it has the right version and its source.
take() {
    rustc=$1 cargo=$2
    found=$($rustc --version 2>/dev/null | cut -d ' ' -f 2)
    [ "$found" = "$version" ] || return 1
    root=$($rustc --print sysroot 2>/dev/null)/lib/rustlib
    [ -f "$root/src/rust/library/Cargo.lock" ]
}

find_linker() {
    other=$(rustc --print sysroot 2>/dev/null || true)/lib/rustlib
    for linker in "$root"/*/bin/rust-lld "$other"/*/bin/rust-lld; do
        if [ -x "$linker" ]; then
            echo "$linker"
            return
        fi
    done
    command -v wasm-ld || command -v wasm-ld-22
}

# Drop all functions of the module except those that player/src/decode/functions.ts declares.
keep_player_functions() {
    graph=$built.json
    {
        echo '[ { "name": "memory", "export": "memory", "root": true }'
        sed -n 's/^ *\(quarc_[a-z_]*\)(.*/, { "name": "\1", "export": "\1", "root": true }/p' \
            "$here/../../player/src/decode/functions.ts"
        echo ']'
    } >"$graph"
    # shellcheck disable=SC2086
    wasm-metadce $wasm_features --graph-file "$graph" "$built" -o "$built.player" >/dev/null
    built=$built.player
}

module=quarc features=
case ${1:-} in
'') ;;
--player) module=quarc-player ;;
--conformance) module=quarc-conformance features="--features conformance" ;;
*) fail "unknown option $1; the options are --player and --conformance" ;;
esac
take "${RUSTC:-none}" "${CARGO:-cargo}" || take rustc cargo || take /usr/bin/rustc /usr/bin/cargo ||
    take "rustc +$version" "cargo +$version" ||
    fail "no rustc $version with its source: rustup toolchain install $version --component rust-src, \
or Debian's packages rustc-web, cargo-web and rust-web-src"
command -v wasm-opt >/dev/null || fail "no wasm-opt: Debian's package binaryen"
linker=$(find_linker) || fail "no linker for WebAssembly: rustup's rust-lld, or Debian's package lld-22"

case $rustc in
*+*) ;; # rustup's cargo selects it
*) export RUSTC="$rustc" ;;
esac
export RUSTC_BOOTSTRAP=1 # for -Z
export RUSTC_WRAPPER="$here/rustc.sh" # for the order of functions
export CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER="$linker"
flags="-Ctarget-feature=+simd128 -Zunstable-options -Cpanic=immediate-abort -Clink-arg=--strip-all"
flags="$flags -Zlocation-detail=none" # no paths of sources, which nothing reports
for limit in inline-threshold=5 inlinehint-threshold=84 unroll-runtime=false unroll-partial-threshold=0 unroll-threshold=40; do
    flags="$flags -Cllvm-args=-$limit"
done
export CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS="$flags"
cd "$here/.."
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$here/../target}"
# shellcheck disable=SC2086
$cargo build --quiet --locked --package quarc-wasm $features --profile wasm --target $target \
    -Zbuild-std=std,panic_abort -Zbuild-std-features=
wasm_features="--enable-simd --enable-bulk-memory --enable-sign-ext --enable-nontrapping-float-to-int \
--enable-mutable-globals --enable-reference-types --enable-multivalue"
built=$CARGO_TARGET_DIR/$target/wasm/quarc_wasm.wasm
if [ "$module" = quarc-player ]; then keep_player_functions; fi
# shellcheck disable=SC2086
wasm-opt -Oz --converge $wasm_features "$built" -o "$here/$module.wasm"
echo "$here/$module.wasm: $(wc -c <"$here/$module.wasm") bytes"
