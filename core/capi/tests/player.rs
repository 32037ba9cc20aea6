//! examples/player.c, built with the C compiler of this machine.

mod examples;

use examples::{check, libraries};
use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// System libraries that a statically linked Rust library needs.
const SYSTEM: [&str; 3] = ["-lpthread", "-ldl", "-lm"];

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

fn check_player(player: &Path) {
    check(|| Command::new(player), player.parent().expect("a folder"));
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
        check_player(&player);
    }
}

#[test]
fn the_player_decodes_with_the_static_library() {
    let library = libraries().join("libquarc_capi.a");
    let mut link = vec![library.to_str().expect("UTF-8")];
    link.extend(SYSTEM);
    if let Some(player) = build("player-static", &link) {
        check_player(&player);
    }
}
