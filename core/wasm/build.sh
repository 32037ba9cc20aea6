#!/bin/sh
# Builds the decoder as one module for the web: quarc.wasm beside this file; and with
# --conformance quarc-conformance.wasm, which answers the suite's cases of building blocks, too.
#
# The standard library is built along, for size. So it takes the compiler of the version in
# `toolchain`, with the library's source: $RUSTC and $CARGO, rustup's, that on the path, or the
# distribution's, whichever of them is the first to fit.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
version=$(cat "$here/toolchain")
target=wasm32-unknown-unknown

fail() {
    echo "core/wasm/build.sh: $1" >&2
    exit 1
}

# Whether a compiler fits.
take() {
    rustc=$1 cargo=$2
    found=$($rustc --version 2>/dev/null | cut -d ' ' -f 2)
    [ "$found" = "$version" ] || return 1
    root=$($rustc --print sysroot)/lib/rustlib
    [ -f "$root/src/rust/library/Cargo.lock" ]
}

find_linker() {
    for linker in "$root"/*/bin/rust-lld "$(rustc --print sysroot 2>/dev/null)"/lib/rustlib/*/bin/rust-lld; do
        if [ -x "$linker" ]; then
            echo "$linker"
            return
        fi
    done
    command -v wasm-ld
}

module=quarc features=
case ${1:-} in
'') ;;
--conformance) module=quarc-conformance features="--features conformance" ;;
*) fail "there is no option $1; the only one is --conformance" ;;
esac
take "${RUSTC:-none}" "${CARGO:-cargo}" || take "rustc +$version" "cargo +$version" ||
    take rustc cargo || take /usr/bin/rustc /usr/bin/cargo ||
    fail "no rustc $version with its source: rustup toolchain install $version --component rust-src, \
or Debian's packages rustc-web, cargo-web and rust-web-src"
linker=$(find_linker) || fail "no linker for WebAssembly: rustup's rust-lld, or wasm-ld of LLVM"

case $rustc in
*+*) ;; # rustup's cargo knows it
*) export RUSTC="$rustc" ;;
esac
export RUSTC_BOOTSTRAP=1 # for -Z
export CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER="$linker"
export CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS="-Ctarget-feature=+simd128 -Zunstable-options -Cpanic=immediate-abort -Clink-arg=--strip-all"
cd "$here/.."
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$here/../target}"
# shellcheck disable=SC2086
$cargo build --quiet --locked --package quarc-wasm $features --profile wasm --target $target \
    -Zbuild-std=std,panic_abort -Zbuild-std-features=
cp "$CARGO_TARGET_DIR/$target/wasm/quarc_wasm.wasm" "$here/$module.wasm"
echo "$here/$module.wasm: $(wc -c <"$here/$module.wasm") bytes"
