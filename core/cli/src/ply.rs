//! A frame as a 3DGS PLY file, which every splat viewer opens: SPEC Annex C.1.

use quarc::floats::Splats;

/// The bytes of a binary little-endian PLY file, in the coordinates of the stream.
pub fn build_ply(splats: &Splats) -> Vec<u8> {
    let count = splats.opacities.len();
    let coefficients = splats.sh.len() / (3 * count).max(1); // 1 or 4, as frames are never empty
    let names = names(coefficients.saturating_sub(1));
    let mut file = build_header(count, &names);
    file.reserve(4 * names.len() * count);
    for gaussian in 0..count {
        let sh = row(&splats.sh, gaussian, 3 * coefficients);
        push(&mut file, row(&splats.positions, gaussian, 3));
        push(&mut file, &[0.0; 3]); // normals
        push(&mut file, &sh[..3]);
        for color in 0..3 {
            // Channel by channel, red first; a state stores the three channels of a coefficient
            // together.
            (1..coefficients).for_each(|i| push(&mut file, &[sh[3 * i + color]]));
        }
        push(&mut file, row(&splats.opacities, gaussian, 1));
        push(&mut file, row(&splats.log_scales, gaussian, 3));
        push(&mut file, row(&splats.rotations, gaussian, 4));
    }
    file
}

fn build_header(count: usize, names: &[String]) -> Vec<u8> {
    let mut lines = vec!["ply".to_owned(), "format binary_little_endian 1.0".to_owned()];
    lines.push(format!("element vertex {count}"));
    lines.extend(names.iter().map(|name| format!("property float {name}")));
    lines.push("end_header\n".to_owned());
    lines.join("\n").into_bytes()
}

/// The property names in order, for a number of SH rest coefficients.
fn names(rest: usize) -> Vec<String> {
    let numbered = |name: &'static str, count| (0..count).map(move |i| format!("{name}_{i}"));
    let mut names: Vec<String> = ["x", "y", "z", "nx", "ny", "nz"].map(str::to_owned).into();
    names.extend(numbered("f_dc", 3).chain(numbered("f_rest", 3 * rest)));
    names.push("opacity".to_owned());
    names.extend(numbered("scale", 3).chain(numbered("rot", 4)));
    names
}

/// The numbers of a Gaussian in an array with `width` numbers each.
fn row(array: &[f32], gaussian: usize, width: usize) -> &[f32] {
    &array[gaussian * width..][..width]
}

fn push(file: &mut Vec<u8>, numbers: &[f32]) {
    for number in numbers {
        file.extend_from_slice(&number.to_le_bytes());
    }
}
