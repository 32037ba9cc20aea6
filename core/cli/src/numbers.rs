//! The numbers that a frame stands for: SPEC 10.1.

use quarc::state::State;

/// Rows in the order of the serialization (SPEC 9.1), each one rounding from the state.
pub fn rows(state: &State) -> Vec<Vec<f32>> {
    let header = state.header();
    let unit = 1.0 / (1_u32 << header.lattice_exponent) as f32;
    let turn = 1.0 / (1_u32 << 22) as f32;
    let mut rows = Vec::new();
    rows.extend(
        (0..3).map(|row| state.positions().row(row).iter().map(|&n| n as f32 * unit).collect()),
    );
    rows.extend(
        (0..4).map(|row| state.rotations().row(row).iter().map(|&n| n as f32 * turn).collect()),
    );
    for row in 0..header.code_planes() {
        let step = match row {
            0..=2 => header.log_scale_step,
            3 => header.opacity_step,
            4..=6 => header.sh_dc_step,
            _ => header.sh_rest_step,
        };
        rows.push(state.codes().row(row).iter().map(|&n| f32::from(n) * step).collect());
    }
    rows
}
