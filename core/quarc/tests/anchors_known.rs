//! The anchors against the known answers of the conformance suite.

mod known;

use known::{known_answers, Json};
use quarc::anchors::{count_anchors, Anchors};
use quarc::morton::{deinterleave, interleave};
use quarc::philox::philox;
use quarc::records::Header;
use quarc::rows::Rows;

fn header(input: &Json) -> Header {
    let number = |name| input.get(name).number();
    Header {
        gaussians_per_anchor: number("gaussians_per_anchor") as u16,
        anchor_ratio: number("anchor_ratio") as u16,
        level_count: number("level_count") as u8,
        ..plain_header()
    }
}

fn plain_header() -> Header {
    Header {
        level: 10,
        timescale: 30,
        frame_ticks: 1,
        lattice_exponent: 12,
        position_step: 1,
        translation_step: 1,
        rotation_unity: 1,
        rotation_components: 3,
        rotation_bits: 8,
        log_scale_step: 1.0,
        opacity_step: 1.0,
        sh_dc_step: 1.0,
        sh_rest_step: 1.0,
        sh_degree: 0,
        level_count: 1,
        gaussians_per_anchor: 1,
        anchor_ratio: 2,
        resample_interval: 1,
        full_crc_interval: 1,
        seed: 0,
        right_handed: true,
        up_axis: 0,
        meters_per_unit: 0.0,
        color_space: 1,
        updates: false,
        snapshots: false,
    }
}

fn rows(points: &[Vec<i32>]) -> Rows<i32> {
    let mut rows = Rows::zeros(3, points.len(), 0);
    for axis in 0..3 {
        for (to, point) in rows.row_mut(axis).iter_mut().zip(points) {
            *to = point[axis];
        }
    }
    rows
}

fn points(json: &Json) -> Vec<Vec<i32>> {
    json.list().iter().map(Json::i32s).collect()
}

#[test]
fn philox_draws_the_known_words() {
    for (input, output) in known_answers("philox") {
        let (counter, key) = (input.get("counter").u32s(), input.get("key").u32s());
        let words = philox([0, 1, 2, 3].map(|i| counter[i]), [key[0], key[1]]);
        assert_eq!(words.to_vec(), output.u32s());
    }
}

#[test]
fn morton_keys_are_the_known_ones_and_go_back() {
    for (input, output) in known_answers("morton") {
        let at: Vec<u32> = input.get("position").u32s();
        let key = interleave(at[0], at[1], at[2]);
        assert_eq!(i128::from(key), output.number());
        assert_eq!(deinterleave(key).to_vec(), at);
    }
}

#[test]
fn levels_have_as_many_anchors_as_the_text_says() {
    for (input, output) in known_answers("anchor_counts") {
        let gaussians = input.get("gaussians").number() as usize;
        let counts = count_anchors(&header(&input), gaussians);
        assert_eq!(counts.iter().map(|&count| count as u32).collect::<Vec<_>>(), output.u32s());
    }
}

#[test]
fn the_sampler_chooses_the_known_ids() {
    for (input, output) in known_answers("sample") {
        let header = Header { seed: input.get("seed").number() as u64, ..header(&input) };
        let (ids, points) = (input.get("ids").u32s(), points(input.get("positions")));
        let phase = input.get("phase").number() as u32;
        let anchors = Anchors::sample(&header, phase, &ids, &rows(&points));
        let found: Vec<Vec<u32>> = anchors.levels().iter().map(|level| level.ids.clone()).collect();
        assert_eq!(found, output.list().iter().map(Json::u32s).collect::<Vec<_>>());
    }
}

/// With one Gaussian to an anchor all are anchors, in their order; newborn are bound to them.
#[test]
fn gaussians_follow_the_known_anchors() {
    for (input, output) in known_answers("bind") {
        let (positions, places) = (points(input.get("positions")), points(input.get("anchors")));
        let ids: Vec<u32> = (0..places.len() as u32).collect();
        let mut anchors = Anchors::sample(&plain_header(), 1, &ids, &rows(&places));
        let newborn = rows(&positions);
        anchors.append(&[newborn.row(0), newborn.row(1), newborn.row(2)]);
        assert_eq!(anchors.binding(0)[places.len()..], output.u32s());
    }
}
