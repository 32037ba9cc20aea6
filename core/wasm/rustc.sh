#!/bin/sh
# build.sh lets cargo call this with the command line of rustc, whose first word is rustc.
#
# rustc orders functions by hashes. These hashes include a number from cargo (-Cmetadata), which
# depends on the folder of the standard library, and the full version of rustc, which differs
# between rustup and Debian. Both are replaced here, so that the module depends on neither.
set -eu
export RUSTC_FORCE_RUSTC_VERSION=any
case $* in # both parts may contain the same crate, for example cfg-if
*force-unstable-if-unmarked*) part=std ;;
*) part=quarc ;;
esac
for argument; do
    shift
    case $argument in
    metadata=*) argument=metadata=$part ;;
    esac
    set -- "$@" "$argument"
done
exec "$@"
