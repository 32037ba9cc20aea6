//! The numbers in the files of `quarc decode`, against the floats of the library: SPEC Annex C.1.

use crate::{folder, quarc, stream};
use quarc::floats::{Dequantizer, Splats};
use quarc::state::State;
use quarc::stream::{decode_all, Decoder};
use std::fs;

const NAMES: &str = "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 \
    f_rest_0 f_rest_1 f_rest_2 f_rest_3 f_rest_4 f_rest_5 f_rest_6 f_rest_7 f_rest_8 \
    opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";

/// The file that a frame must become.
fn expected(splats: &Splats) -> Vec<u8> {
    let count = splats.opacities.len();
    let has_rest = splats.sh.len() > 3 * count;
    let names = NAMES.split(' ').filter(|name| has_rest || !name.starts_with("f_rest"));
    let mut file = format!("ply\nformat binary_little_endian 1.0\nelement vertex {count}\n");
    names.clone().for_each(|name| file += &format!("property float {name}\n"));
    file += "end_header\n";
    let mut file = file.into_bytes();
    for gaussian in 0..count {
        let values = names.clone().map(|name| value(splats, gaussian, name));
        file.extend(values.flat_map(f32::to_le_bytes));
    }
    file
}

/// The value of a property of a Gaussian.
fn value(splats: &Splats, gaussian: usize, name: &str) -> f32 {
    let (kind, number) = name.rsplit_once('_').unwrap_or((name, "0"));
    let number: usize = number.parse().expect("a number");
    let coefficients = splats.sh.len() / splats.opacities.len() / 3;
    let sh = |i: usize, channel: usize| splats.sh[(gaussian * coefficients + i) * 3 + channel];
    match kind {
        "x" => splats.positions[3 * gaussian],
        "y" => splats.positions[3 * gaussian + 1],
        "z" => splats.positions[3 * gaussian + 2],
        "f_dc" => sh(0, number),
        "f_rest" => sh(1 + number % 3, number / 3), // all coefficients of red come first
        "opacity" => splats.opacities[gaussian],
        "scale" => splats.log_scales[3 * gaussian + number],
        "rot" => splats.rotations[4 * gaussian + number],
        _ => 0.0, // normals
    }
}

#[test]
fn files_contain_the_numbers_of_the_library() {
    for name in ["journey", "updates-journey", "snapshots-journey", "updates-sh-degree-0"] {
        let folder = folder(&format!("numbers-{name}"));
        let path = stream(name);
        let output =
            quarc(&["decode".as_ref(), path.as_os_str(), "-o".as_ref(), folder.as_os_str()]);
        assert_eq!(output.status.code(), Some(0));
        let mut frames = 0;
        let compare = |state: &State| -> quarc::error::Result<()> {
            let frame = state.frame_ordinal();
            let file = fs::read(folder.join(format!("frame-{frame:08}.ply"))).expect("a frame");
            let mut numbers = Dequantizer::default(); // the command has one for all frames
            assert!(file == expected(numbers.dequantize(state)), "{name}, frame {frame}");
            frames += 1;
            Ok(())
        };
        let mut input = fs::File::open(&path).expect("a stream");
        decode_all(&mut input, &mut Decoder::new(), compare).expect("a valid stream");
        assert_eq!(fs::read_dir(&folder).expect("a folder").count(), frames);
    }
}
