//! `quarc info`, against what the library reads.

use crate::{folder, quarc, stream};
use quarc::chunks::{is_frame, Kind, CAME, META};
use quarc::reader::ChunkReader;
use quarc::records::Header;
use quarc::state::State;
use quarc::stream::{decode_all, Decoder};
use quarc::wire::{build_cameras, build_metadata, Camera};
use quarc::writer::StreamWriter;
use serde_json::{json, Value};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

fn info(path: &Path) -> Value {
    let output = quarc(&["info".as_ref(), path.as_os_str(), "--json".as_ref()]);
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Write a stream of these chunks; `quarc info` does not check whether frames fit the header.
fn make(test: &str, header: &Header, chunks: &[(Kind, Vec<u8>)]) -> PathBuf {
    let (mut writer, mut bytes) = StreamWriter::new(header).expect("a header");
    for (kind, payload) in chunks {
        bytes.extend(writer.write(*kind, payload).expect("it fits"));
    }
    bytes.extend(writer.finish().expect("it fits"));
    let path = folder(test).join("made.quarc");
    fs::write(&path, bytes).expect("room");
    path
}

/// The chunks of the nine frames of `journey`.
fn frames() -> Vec<(Kind, Vec<u8>)> {
    let journey = fs::read(stream("journey")).expect("a stream");
    let mut reader = ChunkReader::new(&journey[..]).expect("the magic");
    let chunks = std::iter::from_fn(|| reader.read_chunk().expect("a valid stream"));
    let frames = chunks.filter(|chunk| is_frame(chunk.header.kind));
    frames.map(|chunk| (chunk.header.kind, chunk.payload)).collect()
}

/// The fields of a header as `name: value`, sorted.
fn fields(header: &Header) -> Vec<String> {
    let text = format!("{header:?}");
    let inside = text.strip_prefix("Header { ").and_then(|text| text.strip_suffix(" }"));
    let mut fields: Vec<_> = inside.expect("a struct").split(", ").map(str::to_owned).collect();
    fields.sort();
    fields
}

/// The same for the JSON of a header.
fn described_fields(header: &Value) -> Vec<String> {
    let field = |(name, value): (&String, &Value)| match value.as_f64().filter(|_| value.is_f64()) {
        Some(number) => format!("{name}: {:?}", number as f32),
        None => format!("{name}: {value}"),
    };
    let mut fields: Vec<_> = header.as_object().expect("an object").iter().map(field).collect();
    fields.sort();
    fields
}

#[test]
fn a_stream_is_described() {
    let said = info(&stream("journey"));
    assert_eq!(said["schema"], "quarc/info/1");
    assert_eq!(said["frames"], 9);
    assert_eq!(said["canonical_frames"], 3);
    assert_eq!(said["bytes"], 2014);
    assert_eq!(said["chunks"]["FRAM"]["count"], 6);
    assert_eq!(said["header"]["level"], 10);
    let output = quarc(&["info".as_ref(), stream("journey").as_os_str()]);
    let said = String::from_utf8(output.stdout).expect("UTF-8");
    assert!(said.contains("frames      9, of which 3 canonical, from 0 on"), "{said}");
}

#[test]
fn the_description_is_what_the_library_reads() {
    for name in [
        "journey",
        "cameras-and-metadata",
        "byte-order-marks",
        "largest-fields",
        "least-fields",
        "seek-outside",
        "no-frames",
        "snapshots-journey",
    ] {
        let (mut decoder, mut ordinals) = (Decoder::new(), Vec::new());
        let show = |state: &State| -> quarc::error::Result<()> {
            ordinals.push(state.frame_ordinal());
            Ok(())
        };
        let mut input = fs::File::open(stream(name)).expect("a stream");
        decode_all(&mut input, &mut decoder, show).expect("a valid stream");
        let said = info(&stream(name));
        let names = |cameras: &[Camera], held_out: bool| -> Vec<String> {
            let those = cameras.iter().filter(|camera| camera.held_out || !held_out);
            those.map(|camera| camera.name.clone()).collect()
        };
        let header = decoder.header().expect("a header");
        assert_eq!(described_fields(&said["header"]), fields(header), "{name}");
        assert_eq!(said["frames"], ordinals.len(), "{name}");
        assert_eq!(said["first_frame"], json!(ordinals.first()), "{name}");
        assert_eq!(said["cameras"], json!(names(decoder.cameras(), false)), "{name}");
        assert_eq!(said["held_out"], json!(names(decoder.cameras(), true)), "{name}");
        let metadata: BTreeMap<_, _> = decoder.metadata().iter().cloned().collect();
        assert_eq!(said["metadata"], json!(metadata), "{name}");
    }
}

/// No two numbers are equal, and each flag has its own header.
#[test]
fn every_field_of_the_header_is_described() {
    let header = Header {
        level: 31,
        timescale: 90_000,
        frame_ticks: 3003,
        lattice_exponent: 14,
        position_step: 5,
        translation_step: 9,
        rotation_unity: 90,
        rotation_components: 4,
        rotation_bits: 11,
        log_scale_step: 0.1,
        opacity_step: 0.2,
        sh_dc_step: 0.3,
        sh_rest_step: 0.4,
        sh_degree: 0,
        level_count: 2,
        gaussians_per_anchor: 17,
        anchor_ratio: 7,
        resample_interval: 13,
        full_crc_interval: 12,
        seed: u64::MAX,
        up_axis: 6,
        meters_per_unit: 0.7,
        ..Header::default()
    };
    for flag in 0..3 {
        let (right_handed, updates, snapshots) = (flag == 0, flag == 1, flag == 2);
        let header = Header { right_handed, updates, snapshots, ..header.clone() };
        let said = info(&make("header", &header, &[]));
        assert_eq!(described_fields(&said["header"]), fields(&header));
    }
}

#[test]
fn time_and_held_out_cameras_are_described() {
    let header = Header { timescale: 25, frame_ticks: 2, ..Header::default() };
    let cameras =
        [("left", false), ("middle", true), ("right", false)].map(|(name, held_out)| Camera {
            name: name.to_owned(),
            held_out,
            width: 40,
            height: 30,
            focal: [50.0; 2],
            center: [20.0, 15.0],
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            translation: [0.0; 3],
            near: 0.1,
        });
    let mut chunks = frames();
    chunks.push((CAME, build_cameras(&cameras).expect("it fits")));
    let path = make("cameras", &header, &chunks);
    let said = info(&path);
    assert_eq!(said["seconds"], 0.72);
    assert_eq!(said["cameras"], json!(["left", "middle", "right"]));
    assert_eq!(said["held_out"], json!(["middle"]));
    let text = quarc(&["info".as_ref(), path.as_os_str()]).stdout;
    let text = String::from_utf8(text).expect("UTF-8");
    assert!(text.contains("  seconds     0.720\n") && text.contains("  cameras     3\n"), "{text}");
}

/// `quarc-ref info --json` has another schema; keys with the same names describe the same things.
#[test]
fn the_keys_are_known_and_some_are_those_of_the_python_command() {
    let schema = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/schemas/info.json");
    let schema: Value = serde_json::from_slice(&fs::read(schema).expect("a file")).expect("JSON");
    let said = info(&stream("journey"));
    let keys = said.as_object().expect("an object").keys();
    let (shared, own): (Vec<_>, Vec<_>) =
        keys.partition(|key| schema["properties"].get(key).is_some());
    assert_eq!(
        shared,
        ["bytes", "cameras", "first_frame", "frames", "held_out", "metadata", "schema"]
    );
    assert_eq!(own, ["canonical_frames", "chunks", "header", "seconds"]);
}

#[test]
fn a_long_metadata_key_is_separate_from_its_value() {
    let metadata = [("x-name-of-a-tool".to_owned(), "value".to_owned())];
    let payload = build_metadata(&metadata).expect("it fits");
    let path = make("metadata", &Header::default(), &[(META, payload)]);
    let said = quarc(&["info".as_ref(), path.as_os_str()]).stdout;
    assert!(String::from_utf8_lossy(&said).contains("  x-name-of-a-tool value\n"));
}
