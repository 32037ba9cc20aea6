//! The `quarc` executable: output, files and exit status.

mod info;
mod ply;
mod usage;

use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn stream(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../conformance/streams");
    folder.join(name).with_extension("quarc")
}

/// An empty folder for one test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("removing the folder of the last run");
    }
    fs::create_dir(&folder).expect("a folder");
    folder
}

fn quarc<S: AsRef<OsStr>>(arguments: &[S]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_quarc")).args(arguments).output().expect("it starts")
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let name = |entry: fs::DirEntry| entry.file_name().into_string().expect("UTF-8");
    let mut names: Vec<_> = entries.map(|entry| name(entry.expect("a file"))).collect();
    names.sort();
    names
}

/// Check for one line on standard error, and no standard output.
fn assert_fails(output: &Output, status: i32, says: &str) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{said}");
    assert!(said.contains(says), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(output.stdout.is_empty());
}

/// A stream that is truncated inside its last frame.
fn cut(folder: &Path) -> PathBuf {
    let whole = fs::read(stream("journey")).expect("a stream");
    let path = folder.join("cut.quarc");
    fs::write(&path, &whole[..whole.len() - 150]).expect("room");
    path
}

#[test]
fn a_stream_is_verified() {
    let output = quarc(&["verify".as_ref(), stream("journey").as_os_str()]);
    assert_eq!(output.status.code(), Some(0));
    let said = String::from_utf8(output.stdout).expect("UTF-8");
    let digest = "11867f0891966a520645201af8697f37f941bc64caa3f77db9c62c857dc11eac";
    assert!(said.contains("9 frames") && said.contains(digest), "{said}");
}

#[test]
fn failures_are_one_line_and_an_exit_status() {
    let folder = folder("wrong");
    let path = cut(&folder);
    assert_fails(&quarc(&["verify".as_ref(), path.as_os_str()]), 1, "truncated at byte ");
    assert_fails(&quarc(&["info".as_ref(), path.as_os_str()]), 1, "truncated at byte ");
    assert_fails(&quarc(&["verify".as_ref(), folder.join("none").as_os_str()]), 2, "none: ");
    assert_fails(&quarc(&["verify"]), 2, "needs the name of a stream");
    assert_fails(&quarc(&["dance", "a"]), 2, "unknown command");
    assert_fails(&quarc(&["decode", "a", "-o", ""]), 2, "decode needs -o and the name of a folder");
    assert_fails(&quarc(&["verify", "a", "b"]), 2, "unexpected argument");
    assert_fails(&quarc(&["decode", "a", "-o", "b", "--stop", "-1"]), 2, "--stop: ");
    let large = stream("journey").with_file_name("../resource/gaussians.quarc");
    assert_fails(&quarc(&["verify".as_ref(), large.as_os_str()]), 3, "exceed this decoder");
}

#[test]
fn all_frames_are_written_completely() {
    let folder = folder("frames");
    let mut arguments = vec!["decode".into(), stream("journey").into_os_string()];
    arguments.extend(["-o".into(), folder.clone().into_os_string()]);
    let output = quarc(&arguments);
    assert_eq!(output.status.code(), Some(0));
    let due: Vec<_> = (0..9).map(|frame| format!("frame-{frame:08}.ply")).collect();
    assert_eq!(names(&folder), due); // and no temporary files
}

#[test]
fn only_requested_frames_are_written() {
    let folder = folder("some");
    let mut arguments = vec!["decode".into(), stream("journey").into_os_string()];
    arguments.extend(["-o".into(), folder.clone().into_os_string()]);
    arguments.extend(["--start", "4", "--stop", "6"].map(Into::into));
    assert_eq!(quarc(&arguments).status.code(), Some(0));
    assert_eq!(names(&folder), ["frame-00000004.ply", "frame-00000005.ply"]);
}

#[test]
fn the_output_folder_is_made_for_the_first_frame_and_other_files_stay() {
    let folder = folder("output");
    let decode = |stream: PathBuf, output: &Path| {
        quarc(&["decode".as_ref(), stream.as_os_str(), "-o".as_ref(), output.as_os_str()])
    };
    let made = folder.join("a/b");
    assert_fails(&decode(folder.join("none"), &made), 2, "none: ");
    let damaged = folder.join("damaged.quarc");
    fs::write(&damaged, b"no stream").expect("room");
    assert_fails(&decode(damaged.clone(), &made), 1, "bad-magic");
    assert!(!folder.join("a").exists());
    assert_fails(&decode(stream("still"), &damaged), 2, "damaged.quarc: this is not a folder");
    assert_fails(&decode(stream("still"), &damaged.join("c")), 2, "damaged.quarc/c: ");

    assert_eq!(decode(stream("journey"), &made).status.code(), Some(0));
    let first = made.join("frame-00000000.ply");
    let journey = fs::read(&first).expect("a frame");
    fs::write(made.join("notes.txt"), b"kept").expect("room");
    assert_eq!(decode(stream("still"), &made).status.code(), Some(0));
    assert_ne!(fs::read(&first).expect("a frame"), journey);
    assert_eq!(names(&made).len(), 10);
}

#[test]
fn recovery_writes_intact_frames_and_reports_gaps() {
    let folder = folder("damaged");
    let frames = folder.join("frames");
    let mut arguments = vec!["decode".into(), cut(&folder).into_os_string(), "-o".into()];
    arguments.extend([frames.clone().into_os_string(), "--recover".into()]);
    let output = quarc(&arguments);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("frames lost: unknown; truncated"), "{said}");
    assert!(names(&frames).len() >= 7);
}

#[cfg(unix)]
#[test]
fn an_input_that_cannot_be_read_is_not_declined() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_quarc"));
    let input = fs::File::open(env!("CARGO_TARGET_TMPDIR")).expect("a folder");
    let output = command.arg("conformance").stdin(input).output().expect("it starts");
    assert_fails(&output, 2, "Is a directory");
}

/// Standard input is a pipe here; /dev/stdin is a pipe with a path.
#[cfg(unix)]
#[test]
fn pipes_are_read_like_files() {
    for (number, name) in ["-", "/dev/stdin"].into_iter().enumerate() {
        let run = |arguments: &[&str]| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_quarc"));
            command.args([arguments[0], name]).args(&arguments[1..]);
            let pipes = command.stdin(Stdio::piped()).stdout(Stdio::piped());
            let mut child = pipes.stderr(Stdio::piped()).spawn().expect("it starts");
            let bytes = fs::read(stream("journey")).expect("a stream");
            child.stdin.take().expect("a pipe").write_all(&bytes).expect("it reads");
            let output = child.wait_with_output().expect("it ends");
            assert_eq!(output.status.code(), Some(0), "{output:?}");
            output.stdout
        };
        assert!(run(&["verify"]).starts_with(format!("{name}: 9 frames").as_bytes()));
        let said: Value = serde_json::from_slice(&run(&["info", "--json"])).expect("JSON");
        assert_eq!(said["frames"], 9);
        let folder = folder(&format!("pipe-{number}"));
        let path = folder.to_str().expect("UTF-8");
        run(&["decode", "-o", path, "--start", "8"]);
        assert_eq!(names(&folder), ["frame-00000008.ply"]);
        run(&["decode", "-o", path, "--recover"]);
        assert_eq!(names(&folder).len(), 9);
    }
}
