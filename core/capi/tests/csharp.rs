//! The classes in core/csharp, built with Mono if this machine has it.

mod examples;

use examples::{check, libraries, root, run, stream, STREAMS};
use quarc_capi::*;
use std::ffi::CStr;
use std::fmt::Write as _;
use std::fs;
use std::mem::MaybeUninit;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::slice::from_raw_parts;

/// A program of core/csharp; `None` if Mono is not installed.
fn build(source: &str) -> Option<PathBuf> {
    if Command::new("mcs").arg("--version").output().is_err() {
        eprintln!("Mono is not installed: core/csharp is not tested");
        return None;
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../csharp");
    let made = Path::new(env!("CARGO_TARGET_TMPDIR")).join("csharp");
    fs::create_dir_all(&made).expect("a folder");
    let program = made.join(Path::new(source).file_name().expect("a name")).with_extension("exe");
    let library = ["Native.cs", "StreamDecoder.cs", "Contents.cs", "FrameReader.cs"];
    let built = run(Command::new("mcs")
        .args(["-langversion:7.2", "-warn:4", "-warnaserror", "-r:System.Core"])
        .arg(folder.join(source))
        .args(library.map(|name| folder.join(name)))
        .arg(format!("-out:{}", program.display())));
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    Some(program)
}

fn start(program: &Path) -> Command {
    let mut command = Command::new("mono");
    command.arg(program).env("LD_LIBRARY_PATH", libraries());
    command
}

#[test]
fn the_example_prints_the_frames() {
    let Some(program) = build("examples/Frames.cs") else { return };
    check(|| start(&program), program.parent().expect("a folder"));
    let all = run(start(&program).arg(stream("journey")));
    let said = String::from_utf8(all.stdout).expect("UTF-8");
    let later = run(start(&program).arg(stream("journey")).arg("5"));
    let (_, expected) = said.split_once("\n5 ").expect("frame 5");
    assert_eq!(String::from_utf8(later.stdout).expect("UTF-8"), format!("5 {expected}"));
}

#[test]
fn the_classes_return_what_the_c_interface_returns() {
    let Some(program) = build("tests/Contents.cs") else { return };
    for name in STREAMS.iter().chain(&["cameras-and-metadata", "byte-order-marks", "sh-degree-0"]) {
        let printed = run(start(&program).arg(stream(name)));
        assert!(printed.status.success(), "{}", String::from_utf8_lossy(&printed.stderr));
        let said = String::from_utf8(printed.stdout).expect("UTF-8");
        // SAFETY: pointers and lengths belong together.
        assert_eq!(said, unsafe { describe(&fs::read(stream(name)).expect("a stream")) }, "{name}");
    }
}

#[test]
fn the_classes_withstand_misuse() {
    let Some(program) = build("tests/Misuse.cs") else { return };
    let large = root().join("conformance/levels/10-gaussians.quarc");
    let tried = run(start(&program).arg(stream("journey")).arg(large));
    assert!(tried.status.success(), "{}", String::from_utf8_lossy(&tried.stderr));
}

/// What tests/Contents.cs prints.
unsafe fn describe(bytes: &[u8]) -> String {
    let mut said = CStr::from_ptr(quarc_version()).to_str().expect("UTF-8").to_owned() + "\n";
    describe_frames(bytes, &mut said);
    describe_index(bytes, &mut said);
    describe_gaps(bytes, &mut said);
    said
}

fn fill<T>(function: impl FnOnce(*mut T) -> i32) -> Option<T> {
    let mut room = MaybeUninit::uninit();
    let is_filled = matches!(function(room.as_mut_ptr()), QUARC_OK | QUARC_FRAME);
    // SAFETY: the function has filled it.
    is_filled.then(|| unsafe { room.assume_init() })
}

fn sum(numbers: &[f32]) -> u64 {
    numbers.iter().map(|number| u64::from(number.to_bits())).sum()
}

fn title(value: bool) -> &'static str {
    if value {
        "True"
    } else {
        "False"
    }
}

unsafe fn text(view: &TextView) -> &str {
    std::str::from_utf8(from_raw_parts(view.bytes, view.length)).expect("UTF-8")
}

unsafe fn describe_frames(bytes: &[u8], said: &mut String) {
    let mut decoder = quarc_open();
    quarc_push(decoder, bytes.as_ptr(), bytes.len());
    quarc_finish(decoder);
    let next = || fill(|room| quarc_pull(decoder, room));
    let mut state = next();
    describe_head(decoder, said);
    while let Some(frame) = state {
        describe_splats(decoder, &frame, said);
        state = next();
    }
    quarc_close(&mut decoder);
}

unsafe fn describe_head(decoder: *mut DecoderHandle, said: &mut String) {
    let head: HeadView = fill(|room| quarc_head(decoder, room)).expect("a header");
    let is_thirty = title(head.timescale == 30 * head.frame_ticks);
    let (hand, axis) = (title(head.right_handed == 1), ["", "x", "-x", "y", "-y", "z", "-z"]);
    let (level, degree, up) = (head.level, head.sh_degree, axis[head.up_axis as usize]);
    writeln!(said, "{is_thirty} {level} {degree} {hand} {up} {}", sum(&[head.meters_per_unit]))
        .expect("room");
    let camera = |number| fill(|room: *mut CameraView| quarc_camera(decoder, number, room));
    for camera in (0..).map_while(camera) {
        let (name, is_held_out) = (text(&camera.name), title(camera.held_out == 1));
        write!(said, "{name} {is_held_out} {} {}", camera.width, camera.height).expect("room");
        let numbers: [&[f32]; 5] = [
            &camera.focal,
            &camera.center,
            &camera.rotation,
            &camera.translation,
            &[camera.near_plane],
        ];
        let sums: String = numbers.map(|row| format!(" {}", sum(row))).concat();
        writeln!(said, "{sums}").expect("room");
    }
    let entry = |number| fill(|room: *mut EntryView| quarc_metadata(decoder, number, room));
    for entry in (0..).map_while(entry) {
        writeln!(said, "{}={}", text(&entry.key), text(&entry.value)).expect("room");
    }
}

unsafe fn describe_splats(decoder: *mut DecoderHandle, state: &StateView, said: &mut String) {
    let splats: SplatsView = fill(|room| quarc_dequantize(decoder, room)).expect("floats");
    let ids: u64 = from_raw_parts(state.ids, state.count).iter().copied().map(u64::from).sum();
    write!(said, "{} {} {ids} {}", state.frame, state.count, splats.changed).expect("room");
    let arrays = [
        (splats.positions, 3),
        (splats.rotations, 4),
        (splats.log_scales, 3),
        (splats.opacities, 1),
        (splats.sh, 3 * splats.sh_coefficients),
    ];
    let sums = arrays.map(|(array, row)| sum(from_raw_parts(array, row * splats.count)));
    writeln!(said, "{}", sums.map(|sum| format!(" {sum}")).concat()).expect("room");
}

unsafe fn describe_index(bytes: &[u8], said: &mut String) {
    let mut decoder = quarc_open_parts(0);
    quarc_limit(decoder, bytes.len() as u64);
    quarc_put(decoder, 0, bytes.as_ptr(), bytes.len());
    let (mut numbers, mut frames) = ([0; 2], [0; 100]);
    quarc_index(decoder, numbers.as_mut_ptr(), frames.as_mut_ptr(), frames.len());
    let frames = &frames[..numbers[1] as usize];
    let list: Vec<String> = frames.iter().map(u32::to_string).collect();
    writeln!(said, "{} {}", numbers[0], list.join(" ")).expect("room");
    quarc_close(&mut decoder);
}

unsafe fn describe_gaps(bytes: &[u8], said: &mut String) {
    let mut damaged = bytes.to_owned();
    damaged[bytes.len() / 2] ^= 1;
    let mut decoder = quarc_open_recover();
    quarc_push(decoder, damaged.as_ptr(), damaged.len());
    quarc_finish(decoder);
    let mut state = MaybeUninit::<StateView>::uninit();
    loop {
        match quarc_pull(decoder, state.as_mut_ptr()) {
            QUARC_FRAME => {
                let mut digits = [0; QUARC_DIGEST_SIZE];
                quarc_digest(decoder, digits.as_mut_ptr());
                let digest = CStr::from_ptr(digits.as_ptr()).to_str().expect("ASCII");
                writeln!(said, "{} {digest}", state.assume_init_ref().frame).expect("room");
            }
            QUARC_GAP => {
                let gap: GapView = fill(|room| quarc_gap(decoder, room)).expect("a gap");
                let id = CStr::from_ptr(gap.reject_id).to_str().expect("ASCII");
                writeln!(said, "{} {} {} {id}", gap.offset, gap.bytes, gap.frames_lost)
                    .expect("room");
            }
            _ => break,
        }
    }
    quarc_close(&mut decoder);
}
