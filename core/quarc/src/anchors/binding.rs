//! The nearest anchor of every Gaussian: SPEC 6.4.

/// The index of the nearest anchor of each position, by (squared distance, index).
pub fn bind(positions: [&[i32]; 3], anchors: &[Vec<i32>; 3]) -> Vec<u32> {
    (0..positions[0].len())
        .map(|i| {
            let at = [positions[0][i], positions[1][i], positions[2][i]];
            let nearest = |best: (i64, usize), a: usize| {
                let x = i64::from(anchors[0][a] - at[0]);
                let y = i64::from(anchors[1][a] - at[1]);
                let z = i64::from(anchors[2][a] - at[2]);
                best.min((x * x + y * y + z * z, a))
            };
            (0..anchors[0].len()).fold((i64::MAX, 0), nearest).1 as u32
        })
        .collect()
}
