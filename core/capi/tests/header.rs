//! The committed header matches the crate.

use std::fs;
use std::path::Path;

/// `QUARC_WRITE_HEADER=1 cargo test -p quarc-capi --test header` regenerates it.
#[test]
fn the_header_matches_the_crate() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut made = Vec::new();
    cbindgen::generate(folder).expect("a header").write(&mut made);
    let path = folder.join("include/quarc.h");
    if std::env::var_os("QUARC_WRITE_HEADER").is_some() {
        fs::write(&path, &made).expect("writing the header");
    }
    let known = fs::read(&path).expect("include/quarc.h");
    assert!(
        known == made,
        "include/quarc.h is out of date; run QUARC_WRITE_HEADER=1 cargo test -p quarc-capi --test header"
    );
}
