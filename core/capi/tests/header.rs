//! The header is that of the crate.

use std::fs;
use std::path::Path;

/// `QUARC_WRITE_HEADER=1 cargo test -p quarc-capi --test header` writes it anew.
#[test]
fn the_header_is_that_of_the_crate() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut made = Vec::new();
    cbindgen::generate(folder).expect("a header").write(&mut made);
    let path = folder.join("include/quarc.h");
    if std::env::var_os("QUARC_WRITE_HEADER").is_some() {
        fs::write(&path, &made).expect("the header can be written");
    }
    let known = fs::read(&path).expect("the header stands beside the crate");
    assert!(
        known == made,
        "include/quarc.h is of other sources: QUARC_WRITE_HEADER=1 cargo test -p quarc-capi --test header"
    );
}
