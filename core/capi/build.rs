//! Names the shared library for the linker: a program then asks for this name when it starts, and
//! not for the file that it was linked with.

use std::env::var;

/// Version of the C interface: increased when programs must be compiled again.
const INTERFACE: u32 = 1;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let target = var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    if ["linux", "android", "freebsd", "netbsd", "openbsd"].contains(&target.as_str()) {
        println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libquarc_capi.so.{INTERFACE}");
    }
}
