#!/bin/sh
# Builds the decoder as one module for the web: build.sh [FILE], else quarc.wasm beside this file.
#
# It takes the first compiler of the version in `toolchain` that has the standard library for
# wasm32 or its source: $RUSTC with $CARGO, rustup's, that on the path, the distribution's.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
module=${1:-$here/quarc.wasm}
version=$(cat "$here/toolchain")
target=wasm32-unknown-unknown

fail() {
    echo "core/wasm/build.sh: $1" >&2
    exit 1
}

# Whether a compiler is the one that is looked for; `root` is where its libraries are.
take() {
    rustc=$1 cargo=$2
    found=$($rustc --version 2>/dev/null | cut -d ' ' -f 2)
    [ "$found" = "$version" ] || return 1
    root=$($rustc --print sysroot)
    has_library || [ -f "$root/lib/rustlib/src/rust/library/Cargo.lock" ]
}

has_library() {
    [ -d "$root/lib/rustlib/$target/lib" ]
}

find_linker() {
    for linker in "$root"/lib/rustlib/*/bin/rust-lld \
        "$(rustc --print sysroot 2>/dev/null)"/lib/rustlib/*/bin/rust-lld; do
        if [ -x "$linker" ]; then
            echo "$linker"
            return
        fi
    done
    command -v wasm-ld
}

take "${RUSTC:-none}" "${CARGO:-cargo}" || take "rustc +$version" "cargo +$version" ||
    take rustc cargo || take /usr/bin/rustc /usr/bin/cargo ||
    fail "no rustc $version with a standard library for $target or its source: \
rustup toolchain install $version --target $target, or Debian's rustc-web, cargo-web, rust-web-src"
linker=$(find_linker) || fail "no linker for $target: rustup's rust-lld, or LLVM's wasm-ld"

set --
if ! has_library; then
    export RUSTC_BOOTSTRAP=1 # the compiler builds its own standard library
    set -- -Zbuild-std=std,panic_abort -Zbuild-std-features=
fi
case $rustc in
*+*) ;; # rustup's cargo knows
*) export RUSTC="$rustc" ;;
esac
export CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER="$linker"
export CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS="-Ctarget-feature=+simd128"
cd "$here/.."
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$here/../target}"
$cargo build --quiet --locked --package quarc-wasm --profile wasm --target "$target" "$@"
cp "$CARGO_TARGET_DIR/$target/wasm/quarc_wasm.wasm" "$module"
echo "$module: $(wc -c <"$module") bytes"
