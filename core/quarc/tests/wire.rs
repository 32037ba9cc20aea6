//! Every stream of the suite: serialized records equal the parsed payloads, and a stream written
//! from payloads equals the original.

use quarc::chunks::{CAME, CANO, FRAM, HEAD, INDX, META, SNAP, TAIL};
use quarc::error::{Error, Reject};
use quarc::reader::{Chunk, ChunkReader};
use quarc::wire;
use quarc::writer::StreamWriter;
use std::fs;
use std::path::PathBuf;

fn streams() -> Vec<(String, Vec<u8>)> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../conformance/streams");
    let mut streams: Vec<_> = fs::read_dir(folder)
        .expect("the conformance suite")
        .map(|entry| entry.expect("a file").path())
        .map(|path| (path.display().to_string(), fs::read(path).expect("a stream")))
        .collect();
    streams.sort();
    assert!(streams.len() > 40, "the suite has its streams");
    streams
}

fn chunks(stream: &[u8]) -> Result<Vec<Chunk>, Error> {
    let mut reader = ChunkReader::new(stream)?;
    let mut chunks = Vec::new();
    while let Some(chunk) = reader.read_chunk()? {
        if chunk.header.kind == HEAD {
            reader.order.keep_to(&wire::parse_header(&chunk.payload)?);
        }
        chunks.push(chunk);
    }
    Ok(chunks)
}

fn rebuild(chunk: &Chunk, updates: bool) -> Result<Vec<u8>, Error> {
    let payload = &chunk.payload;
    match chunk.header.kind {
        HEAD => wire::build_header(&wire::parse_header(payload)?),
        CANO => wire::build_canonical(&wire::parse_canonical(payload)?),
        SNAP => wire::build_snapshot(&wire::parse_snapshot(payload)?),
        FRAM => wire::build_frame(&wire::parse_frame(payload, updates)?),
        CAME => wire::build_cameras(&wire::parse_cameras(payload)?),
        META => wire::build_metadata(&wire::parse_metadata(payload)?),
        INDX => wire::build_index(&wire::parse_index(payload)?),
        TAIL => wire::parse_tail(payload).map(|tail| wire::build_tail(&tail)),
        _ => Ok(Vec::new()), // payloads of unknown types are not kept
    }
}

#[test]
fn payloads_are_rebuilt_from_their_records() {
    for (name, stream) in streams() {
        let chunks = chunks(&stream).unwrap_or_else(|error| panic!("{name}: {error}"));
        let header = wire::parse_header(&chunks[0].payload).expect("HEAD is right");
        for chunk in &chunks {
            let again = rebuild(chunk, header.updates);
            // The version and the compatible features are those of this writer.
            let skip = if chunk.header.kind == HEAD { 10 } else { 0 };
            let again = again.unwrap_or_else(|error| panic!("{name}: {error}"));
            if chunk.header.kind == META {
                let entries = wire::parse_metadata(&chunk.payload);
                assert_eq!(wire::parse_metadata(&again), entries, "{name}"); // keys are unique
            } else {
                assert_eq!(again.get(skip..), chunk.payload.get(skip..), "{name}");
            }
        }
    }
}

#[test]
fn of_metadata_with_the_same_key_the_last_entry_counts() {
    let entry = |place: u32| ((place * 7919 % 101).to_string(), place.to_string());
    let payload = wire::build_metadata(&(0..1000).map(entry).collect::<Vec<_>>()).expect("it fits");
    let entries = wire::parse_metadata(&payload).expect("it is right");
    let last = |place: u32| place + (999 - place) / 101 * 101; // with the same key
    let due: Vec<_> = (0..101).map(|place| (entry(place).0, last(place).to_string())).collect();
    assert_eq!(entries, due);
}

#[test]
fn streams_are_rebuilt_from_their_payloads() {
    let mut same = 0;
    for (name, stream) in streams() {
        let chunks = chunks(&stream).expect("the streams of this folder are right");
        let header = wire::parse_header(&chunks[0].payload).expect("HEAD is right");
        let known = chunks.iter().all(|chunk| quarc::chunks::is_known(chunk.header.kind));
        let indexed = chunks.iter().any(|chunk| chunk.header.kind == INDX);
        if !known || !indexed || wire::build_header(&header).as_ref() != Ok(&chunks[0].payload) {
            continue;
        }
        let (mut writer, mut written) = StreamWriter::new(&header).expect("HEAD is right");
        for chunk in &chunks[1..] {
            if ![INDX, TAIL].contains(&chunk.header.kind) {
                assert_eq!(writer.offset(), chunk.header.offset, "{name}");
                written.extend(writer.write(chunk.header.kind, &chunk.payload).expect("it fits"));
            }
        }
        written.extend(writer.finish().expect("there are numbers left"));
        assert!(written == stream, "{name}");
        same += 1;
    }
    assert!(same >= 6, "{same} streams have an index and only known chunks");
}

#[test]
fn chunks_that_the_writer_adds_or_that_have_no_type_are_refused() {
    let (_, stream) = streams().remove(0);
    let header = wire::parse_header(&chunks(&stream).expect("a stream")[0].payload);
    let (mut writer, _) = StreamWriter::new(&header.expect("HEAD is right")).expect("a header");
    for kind in [HEAD, INDX, TAIL, *b"a1~\0", *b"tEsT"] {
        assert!(matches!(writer.write(kind, b""), Err(Error::Encode(_))), "{kind:?}");
    }
    for kind in [*b"test", *b"tEst"] {
        assert!(writer.write(kind, b"").is_ok(), "{kind:?}");
    }
}

#[test]
fn truncated_and_extended_payloads_are_rejected() {
    for (name, stream) in streams() {
        let chunks = chunks(&stream).expect("the streams of this folder are right");
        let updates = wire::parse_header(&chunks[0].payload).expect("HEAD is right").updates;
        for mut chunk in chunks {
            if !quarc::chunks::is_known(chunk.header.kind) {
                continue;
            }
            let last = chunk.payload.pop().expect("no payload is empty");
            let cut = rebuild(&chunk, updates).map_err(|error| error.reject());
            assert_eq!(cut, Err(Some(Reject::Field)), "{name}");
            chunk.payload.extend([last, 0]);
            let long = rebuild(&chunk, updates).map_err(|error| error.reject());
            assert_eq!(long, Err(Some(Reject::TrailingData)), "{name}");
        }
    }
}
