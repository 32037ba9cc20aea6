#!/bin/sh
# Fuzzes a target: run.sh TARGET [libFuzzer options], such as run.sh decode -max_total_time=60.
#
# The corpus starts with the streams of the conformance suite and the seeds of tests/hostile, and
# keeps what is found. Needs cargo-fuzz; a stable compiler suffices.
set -eu
cd "$(dirname "$0")"
target=${1:?decode, seek, recover or interface}
shift
command -v cargo-fuzz >/dev/null || {
    echo "core/fuzz/run.sh: no cargo-fuzz: cargo install cargo-fuzz" >&2
    exit 1
}

# The first 48 bytes of an input of `interface` are calls: how to open, push all, pull.
calls() {
    printf '%b' "\\0$1\\0001"
    head -c 46 /dev/zero | tr '\000' '\005'
}

mkdir -p "corpus/$target"
for seed in ../../conformance/streams/*.quarc ../../tests/hostile/seeds/streams/*.quarc; do
    name=$(basename "$seed" .quarc)
    case $target in
    interface)
        for open in 000 100 202 376; do
            { calls $open && cat "$seed"; } >"corpus/$target/$name-$open"
        done
        ;;
    *) cp "$seed" "corpus/$target/$name" ;;
    esac
done
export RUSTC_BOOTSTRAP=1 # enables instrumentation
exec cargo fuzz run "$target" -- -max_len=16384 -timeout=30 -rss_limit_mb=2048 "$@"
