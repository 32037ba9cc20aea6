//! examples/player.c, built with the C compiler of this machine, against the conformance suite.

use serde_json::Value;
use std::env;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const STREAMS: [&str; 5] =
    ["journey", "births-and-deaths", "snapshots-journey", "updates-journey", "rotation"];

/// System libraries that a statically linked Rust library needs.
const SYSTEM: [&str; 3] = ["-lpthread", "-ldl", "-lm"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The folder in which cargo puts the libraries of this crate for its tests.
fn libraries() -> PathBuf {
    let test = env::current_exe().expect("the test has a name");
    test.parent().expect("a folder").to_owned()
}

/// The player, linked to a library; `None` if there is no C compiler.
fn build(name: &str, link: &[&str]) -> Option<PathBuf> {
    let compiler = env::var("CC").unwrap_or_else(|_| "cc".to_owned());
    if Command::new(&compiler).arg("--version").output().is_err() {
        return None;
    }
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let player = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let built = Command::new(compiler)
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"])
        .args(["-Dnear=", "-Dfar=", "-I"]) // windows.h defines these macros
        .arg(crate_folder.join("include"))
        .arg(crate_folder.join("examples/player.c"))
        .args(link)
        .arg("-o")
        .arg(&player)
        .output()
        .expect("the compiler starts");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    Some(player)
}

fn play(player: &Path, stream: &Path) -> Output {
    Command::new(player).arg(stream).output().expect("the player starts")
}

/// Check for one line on standard error.
fn assert_fails(played: &Output, status: i32, says: &str) {
    let said = String::from_utf8_lossy(&played.stderr);
    assert_eq!(played.status.code(), Some(status), "{said}");
    assert!(said.contains(says) && said.lines().count() == 1, "{said}");
}

/// The frames of a stream in the manifest, formatted like the output of the player.
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

fn check(player: &Path) {
    let text = fs::read(root().join("conformance/manifest.json")).expect("the suite");
    let manifest = serde_json::from_slice(&text).expect("JSON");
    for name in STREAMS {
        let stream = root().join("conformance/streams").join(name).with_extension("quarc");
        let played = play(player, &stream);
        let said = String::from_utf8_lossy(&played.stdout);
        assert_eq!(said, expected(&manifest, name), "{name}");
        assert!(played.status.success() && played.stderr.is_empty(), "{name}");
    }
    let stream = fs::read(root().join("conformance/streams/journey.quarc")).expect("a stream");
    let cut = player.with_extension("cut.quarc");
    fs::write(&cut, &stream[..stream.len() - 1]).expect("room");
    let played = play(player, &cut);
    assert_fails(&played, 1, "cut.quarc: truncated at byte ");
    assert_eq!(String::from_utf8_lossy(&played.stdout), expected(&manifest, "journey"));
    check_failures(player);
}

fn check_failures(player: &Path) {
    let folder = player.parent().expect("a folder");
    assert_fails(&play(player, &folder.join("none")), 2, "none: ");
    assert_fails(&Command::new(player).output().expect("it starts"), 2, "usage: ");
    let large = root().join("conformance/resource/gaussians.quarc");
    assert_fails(&play(player, &large), 3, "exceed this decoder");
    if cfg!(target_os = "linux") {
        assert_fails(&play(player, folder), 2, "Is a directory");
        let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("a device");
        let stream = root().join("conformance/streams/journey.quarc");
        let played = Command::new(player).arg(stream).stdout(full).output().expect("it starts");
        assert_fails(&played, 2, "standard output: ");
    }
}

/// The library is linked under one name and found under the one that its `soname` states.
#[test]
fn the_player_decodes_with_the_shared_library() {
    let found = Path::new(env!("CARGO_TARGET_TMPDIR")).join("shared");
    fs::create_dir_all(&found).expect("a folder");
    if cfg!(target_os = "linux") {
        let library = libraries().join("libquarc_capi.so");
        fs::copy(library, found.join("libquarc_capi.so.1")).expect("room");
    }
    let places = [libraries(), found].map(|folder| folder.to_str().expect("UTF-8").to_owned());
    let [linked, found] = &places;
    let found = if cfg!(target_os = "linux") { found } else { linked };
    let link = [&format!("-L{linked}"), "-lquarc_capi", &format!("-Wl,-rpath,{found}")];
    if let Some(player) = build("player-shared", &link) {
        check(&player);
    }
}

#[test]
fn the_player_decodes_with_the_static_library() {
    let library = libraries().join("libquarc_capi.a");
    let mut link = vec![library.to_str().expect("UTF-8")];
    link.extend(SYSTEM);
    if let Some(player) = build("player-static", &link) {
        check(&player);
    }
}
