//! The anchors against the unit vectors of the conformance suite.

use crate::known::{known_answers, Json};
use crate::scenes::{plain_header, rows};
use quarc::anchors::{count_anchors, Anchors};
use quarc::morton::{deinterleave, interleave};
use quarc::philox::philox;
use quarc::records::Header;

fn header(input: &Json) -> Header {
    let number = |name| input.get(name).number();
    Header {
        gaussians_per_anchor: number("gaussians_per_anchor") as u16,
        anchor_ratio: number("anchor_ratio") as u16,
        level_count: number("level_count") as u8,
        ..plain_header()
    }
}

fn points(json: &Json) -> Vec<[i32; 3]> {
    let point = |item: &Json| item.i32s().try_into().expect("three coordinates");
    json.list().iter().map(point).collect()
}

#[test]
fn philox_matches_the_unit_vectors() {
    for (input, output) in known_answers("philox") {
        let (counter, key) = (input.get("counter").u32s(), input.get("key").u32s());
        let words = philox([0, 1, 2, 3].map(|i| counter[i]), [key[0], key[1]]);
        assert_eq!(words.to_vec(), output.u32s());
    }
}

#[test]
fn morton_keys_match_the_unit_vectors_and_invert() {
    for (input, output) in known_answers("morton") {
        let at: Vec<u32> = input.get("position").u32s();
        let key = interleave(at[0], at[1], at[2]);
        assert_eq!(i128::from(key), output.number());
        assert_eq!(deinterleave(key).to_vec(), at);
    }
}

#[test]
fn anchor_counts_match_the_unit_vectors() {
    for (input, output) in known_answers("anchor_counts") {
        let gaussians = input.get("gaussians").number() as usize;
        let counts = count_anchors(&header(&input), gaussians);
        assert_eq!(counts.iter().map(|&count| count as u32).collect::<Vec<_>>(), output.u32s());
    }
}

#[test]
fn sampled_ids_match_the_unit_vectors() {
    for (input, output) in known_answers("sample") {
        let header = Header { seed: input.get("seed").number() as u64, ..header(&input) };
        let (ids, points) = (input.get("ids").u32s(), points(input.get("positions")));
        let phase = input.get("phase").number() as u32;
        let anchors = Anchors::sample(&header, phase, &ids, &rows(&points));
        let found: Vec<Vec<u32>> = anchors.levels().iter().map(|level| level.ids.clone()).collect();
        assert_eq!(found, output.list().iter().map(Json::u32s).collect::<Vec<_>>());
    }
}

/// With one Gaussian per anchor, all Gaussians are anchors, in order; new ones are bound to them.
#[test]
fn bindings_match_the_unit_vectors() {
    for (input, output) in known_answers("bind") {
        let (positions, places) = (points(input.get("positions")), points(input.get("anchors")));
        let ids: Vec<u32> = (0..places.len() as u32).collect();
        let mut anchors = Anchors::sample(&plain_header(), 1, &ids, &rows(&places));
        let newborn = rows(&positions);
        anchors.append(&[newborn.row(0), newborn.row(1), newborn.row(2)]);
        assert_eq!(anchors.binding(0)[places.len()..], output.u32s());
    }
}
