//! Single building blocks: the functions of conformance/unit.

use crate::given::Given;
use quarc::anchors::{count_anchors, Anchors};
use quarc::arithmetic::{bit_length, divide_round, isqrt};
use quarc::coding::canonical::blank;
use quarc::coding::counts::{Counts, Seen};
use quarc::coding::numbers::{code_ascending, code_numbers};
use quarc::coding::planes::PlaneReader;
use quarc::coding::probability::weight_of_code;
use quarc::coding::sequence::{Sequence, KEY_CLASS_BITS};
use quarc::coding::words::WordReader;
use quarc::digest::Serialized;
use quarc::error::{Reject, Result};
use quarc::floats::Dequantizer;
use quarc::morton::interleave;
use quarc::philox::philox;
use quarc::records::Header;
use quarc::rotation::{expand, normalize_sum, turn};
use quarc::rows::Rows;
use quarc::state::{choose_deaths, State};
use serde_json::{json, Value};
use std::sync::Arc;

/// A function from the fields of a test case to the result.
pub type Unit = fn(&Given) -> Result<Value>;

const UNITS: [(&str, Unit); 23] = [
    ("anchor_counts", answer_anchor_counts),
    ("ascending", answer_ascending),
    ("bind", answer_bind),
    ("bit_length", |given| Ok(json!(bit_length(given.number("v")?)))),
    ("counts", answer_counts),
    ("crc", |given| Ok(json!(crc32fast::hash(&given.bytes("bytes")?)))),
    ("deaths", answer_deaths),
    ("decode_bits", answer_bits),
    ("dequantize", answer_dequantize),
    ("digest", answer_digest),
    ("divide_round", |given| Ok(json!(divide_round(given.number("n")?, given.number("d")?)))),
    ("expand", answer_expand),
    ("fixed", |given| answer_numbers(given, Sequence::fixed)),
    ("isqrt", |given| Ok(json!(isqrt(given.number("v")?)))),
    ("morton", answer_morton),
    ("normalize", |given| Ok(json!(normalize_sum(given.array("vector")?)?))),
    ("philox", |given| Ok(json!(philox(given.array("counter")?, given.array("key")?)))),
    ("sample", answer_sample),
    ("signed", |given| answer_numbers(given, Sequence::signed)),
    ("turn", answer_turn),
    ("unsigned", |given| answer_numbers(given, Sequence::unsigned)),
    ("weight_by_counts", answer_weight_by_counts),
    ("weight_of_code", |given| Ok(json!(weight_of_code(given.number("code")?)?))),
];

/// The names of all functions.
pub fn names() -> Vec<&'static str> {
    UNITS.iter().map(|(name, _)| *name).collect()
}

/// The function with a name.
pub fn find(name: &str) -> Option<Unit> {
    UNITS.iter().find(|(known, _)| *known == name).map(|(_, unit)| *unit)
}

fn answer_anchor_counts(given: &Given) -> Result<Value> {
    let header = sampler_header(given, 0)?;
    Ok(json!(count_anchors(&header, given.number("gaussians")?)))
}

fn answer_ascending(given: &Given) -> Result<Value> {
    const MOST: i64 = 1 << 61; // above all numbers of the cases
    let sequence = Sequence::unsigned(0, 1, KEY_CLASS_BITS);
    let mut numbers = vec![0; given.number("count")?];
    read_planes(given, &sequence, |reader| {
        code_ascending(reader, &sequence, &mut numbers, (MOST, Reject::SymbolRange))
    })?;
    Ok(json!(numbers))
}

fn answer_numbers(given: &Given, form: fn(usize, usize, u32) -> Sequence) -> Result<Value> {
    let contexts: Vec<u16> = given.numbers("contexts")?;
    let outer = contexts.iter().max().map_or(1, |&most| usize::from(most) + 1);
    let sequence = form(0, outer, given.number("width")?);
    let mut numbers = vec![0; contexts.len()];
    read_planes(given, &sequence, |reader| {
        code_numbers(reader, &sequence, &contexts, &mut numbers)
    })?;
    Ok(json!(numbers))
}

/// Decode all words, with counts that start at 0.
fn read_planes(
    given: &Given,
    sequence: &Sequence,
    read: impl FnOnce(&mut PlaneReader) -> Result<()>,
) -> Result<()> {
    let words = given.numbers("words")?;
    let mut counts = Counts::new(sequence.end());
    let mut reader = PlaneReader::new(&words, &mut counts)?;
    read(&mut reader)?;
    reader.finish()
}

fn answer_counts(given: &Given) -> Result<Value> {
    let [zeros, ones] = given.array("before")?;
    let [more_zeros, more_ones] = given.array("plane")?;
    let seen = Seen { zeros, ones }.after(more_zeros, more_ones);
    Ok(json!([seen.zeros, seen.ones]))
}

fn answer_weight_by_counts(given: &Given) -> Result<Value> {
    let seen = Seen { zeros: given.number("zeros")?, ones: given.number("ones")? };
    Ok(json!(seen.weight()))
}

fn answer_bits(given: &Given) -> Result<Value> {
    let words: Vec<u32> = given.numbers("words")?;
    let mut reader = WordReader::new(&words)?;
    let weights: Vec<u32> = given.numbers("weights")?;
    let bits: Vec<u8> = weights.iter().map(|&weight| reader.take(weight).into()).collect();
    reader.finish()?;
    Ok(json!(bits))
}

fn answer_expand(given: &Given) -> Result<Value> {
    let [a, b, c] = given.array("abc")?;
    let coded = [given.number("j")?, a, b, c];
    Ok(json!(expand(coded, given.number("rotation_bits")?)?))
}

fn answer_turn(given: &Given) -> Result<Value> {
    let residual = normalize_sum(given.array("sums")?)?;
    Ok(json!(turn(given.array("rotation")?, residual)?))
}

fn answer_morton(given: &Given) -> Result<Value> {
    let [x, y, z] = given.array("position")?;
    Ok(json!(interleave(x, y, z)))
}

/// A header in which only the anchor fields matter.
fn sampler_header(given: &Given, seed: u64) -> Result<Header> {
    Ok(Header {
        gaussians_per_anchor: given.number("gaussians_per_anchor")?,
        anchor_ratio: given.number("anchor_ratio")?,
        level_count: given.number("level_count")?,
        seed,
        ..plain_header()
    })
}

fn answer_sample(given: &Given) -> Result<Value> {
    let header = sampler_header(given, given.number("seed")?)?;
    let ids: Vec<u32> = given.numbers("ids")?;
    let positions = read_rows(given, "positions")?;
    let anchors = Anchors::sample(&header, given.number("phase")?, &ids, &positions);
    Ok(anchors.levels().iter().map(|level| json!(level.ids)).collect())
}

/// With one Gaussian per anchor, all Gaussians are anchors, in order; new ones are bound to them.
fn answer_bind(given: &Given) -> Result<Value> {
    let places = read_rows(given, "anchors")?;
    let ids: Vec<u32> = (0..).take(places.columns()).collect();
    let mut anchors = Anchors::sample(&plain_header(), 1, &ids, &places);
    let newborn = read_rows(given, "positions")?;
    anchors.append(&[newborn.row(0), newborn.row(1), newborn.row(2)]);
    Ok(json!(anchors.binding(0)[ids.len()..]))
}

fn answer_deaths(given: &Given) -> Result<Value> {
    let opacities: Vec<i16> = given.numbers("opacities")?;
    Ok(json!(choose_deaths(&opacities, given.number("count")?)))
}

/// The code is the opacity of the only Gaussian of a state.
fn answer_dequantize(given: &Given) -> Result<Value> {
    let header = Header { opacity_step: given.binary32("step")?, ..plain_header() };
    let mut gaussians = blank(header.code_planes(), 1);
    gaussians.codes[3][0] = given.number("code")?;
    let state = State::begin(&Arc::new(header), 0, &gaussians)?;
    let number = Dequantizer::default().dequantize(&state).opacities[0];
    Ok(json!(format!("{:08x}", number.to_bits())))
}

fn answer_digest(given: &Given) -> Result<Value> {
    let state = Serialized {
        phase: given.number("phase")?,
        ids: &given.numbers::<u32>("ids")?,
        positions: &read_rows(given, "positions")?,
        rotations: &read_rows(given, "rotations")?,
        codes: &read_rows(given, "codes")?,
    };
    Ok(json!({
        "crc_all": state.crc(true),
        "crc_without_codes": state.crc(false),
        "sha256": state.digest(),
    }))
}

fn read_rows<T>(given: &Given, name: &str) -> Result<Rows<T>>
where
    T: TryFrom<i128> + Copy + Default,
{
    let columns = given.columns(name)?;
    let mut rows = Rows::zeros(columns.len(), columns.first().map_or(0, Vec::len), 0);
    for (row, numbers) in rows.rows_mut().zip(&columns) {
        row.copy_from_slice(numbers);
    }
    Ok(rows)
}

/// A header whose contents do not matter: all Gaussians are anchors of its one level.
fn plain_header() -> Header {
    Header {
        timescale: 1,
        lattice_exponent: 0,
        position_step: 1,
        translation_step: 1,
        rotation_unity: 1,
        rotation_bits: 1,
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
        ..Header::default()
    }
}
