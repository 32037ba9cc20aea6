//! What the tests of the examples share: they run programs against the conformance suite.

use serde_json::Value;
use std::env;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub const STREAMS: [&str; 5] =
    ["journey", "births-and-deaths", "snapshots-journey", "updates-journey", "rotation"];

pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A stream of the suite.
pub fn stream(name: &str) -> PathBuf {
    root().join("conformance/streams").join(name).with_extension("quarc")
}

/// The folder in which cargo puts the libraries of this crate for its tests.
pub fn libraries() -> PathBuf {
    let test = env::current_exe().expect("the test has a name");
    test.parent().expect("a folder").to_owned()
}

pub fn run(command: &mut Command) -> Output {
    command.output().expect("the program starts")
}

/// Check for one line on standard error.
pub fn assert_fails(played: &Output, status: i32, says: &str) {
    let said = String::from_utf8_lossy(&played.stderr);
    assert_eq!(played.status.code(), Some(status), "{said}");
    assert!(said.contains(says) && said.lines().count() == 1, "{said}");
}

/// The frames of a stream in the manifest, formatted like the output of an example.
fn expected(manifest: &Value, name: &str) -> String {
    let vectors = manifest["vectors"].as_array().expect("vectors");
    let vector = vectors.iter().find(|vector| vector["name"] == format!("streams/{name}"));
    let frames = vector.and_then(|vector| vector["decode"]["frames"].as_array()).expect("frames");
    frames.iter().fold(String::new(), |mut lines, frame| {
        let digest = frame[2].as_str().expect("a digest");
        writeln!(lines, "{} {} {digest}", frame[0], frame[1]).expect("room");
        lines
    })
}

/// Check an example that prints the frames of a file; `start` starts it without arguments, and
/// `folder` is a folder for files.
pub fn check(start: impl Fn() -> Command, folder: &Path) {
    let text = fs::read(root().join("conformance/manifest.json")).expect("the suite");
    let manifest = serde_json::from_slice(&text).expect("JSON");
    for name in STREAMS {
        let played = run(start().arg(stream(name)));
        let said = String::from_utf8_lossy(&played.stdout);
        assert_eq!(said, expected(&manifest, name), "{name}");
        assert!(played.status.success() && played.stderr.is_empty(), "{name}");
    }
    let journey = fs::read(stream("journey")).expect("a stream");
    let cut = folder.join("cut.quarc");
    fs::write(&cut, &journey[..journey.len() - 1]).expect("room");
    let played = run(start().arg(cut));
    assert_fails(&played, 1, "cut.quarc: truncated at byte ");
    assert_eq!(String::from_utf8_lossy(&played.stdout), expected(&manifest, "journey"));
    check_failures(start, folder);
}

fn check_failures(start: impl Fn() -> Command, folder: &Path) {
    assert_fails(&run(start().arg(folder.join("none"))), 2, "none: ");
    assert_fails(&run(&mut start()), 2, "usage: ");
    let large = root().join("conformance/resource/gaussians.quarc");
    assert_fails(&run(start().arg(large)), 3, "exceed this decoder");
    if cfg!(target_os = "linux") {
        let name = folder.file_name().and_then(|name| name.to_str()).expect("UTF-8");
        assert_fails(&run(start().arg(folder)), 2, &format!("{name}: "));
        let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("a device");
        assert_fails(&run(start().arg(stream("journey")).stdout(full)), 2, ": ");
    }
}
