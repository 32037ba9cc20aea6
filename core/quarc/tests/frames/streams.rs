//! Whole streams: the digest of each frame is that of the manifest.

use crate::known::{read_json, suite_file, Json};
use quarc::chunks::{
    prove_payload, ChunkOrder, Kind, CANO, CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, FRAM, HEAD, MAGIC,
    SNAP,
};
use quarc::error::{Error, Reject, Result};
use quarc::records::{Gaussians, Header};
use quarc::seek::SeekDecoder;
use quarc::state::State;
use quarc::stream::Decoder;
use quarc::wire::{parse_canonical, parse_frame, parse_header, parse_snapshot};
use std::sync::Arc;

/// Kinds and payloads of the chunks of a stream, up to the first damaged chunk.
pub fn chunks(stream: &[u8]) -> Vec<(Kind, &[u8])> {
    let (mut order, mut place, mut chunks) = (ChunkOrder::default(), MAGIC.len(), Vec::new());
    while let Some(Ok(header)) = stream.get(place..).map(|rest| order.accept(rest)) {
        let begin = place + CHUNK_HEADER_BYTES;
        let end = begin + header.length as usize;
        let payload = match stream.get(begin..end) {
            Some(payload) => payload,
            None => break,
        };
        if prove_payload(&header, crc32fast::hash(payload), &stream[end..]).is_err() {
            break;
        }
        chunks.push((header.kind, payload));
        if let (HEAD, Ok(header)) = (header.kind, parse_header(payload)) {
            order.keep_to(&header);
        }
        order.pass(&header);
        place = end + CHUNK_CRC_BYTES;
    }
    chunks
}

/// A decoder of frames that ignores everything about their chunks.
#[derive(Default)]
pub struct Frames {
    header: Option<Arc<Header>>,
    canonical: Gaussians,
    state: Option<State>,
}

impl Frames {
    /// Decode a chunk and return its state, if it is a frame.
    pub fn push(&mut self, kind: Kind, payload: &[u8]) -> Result<Option<&State>> {
        match kind {
            HEAD => {
                self.header = Some(Arc::new(parse_header(payload)?));
                return Ok(None);
            }
            CANO => {
                let header = self.header.as_ref().expect("HEAD comes first");
                let (state, gaussians) = State::canonical(header, &parse_canonical(payload)?)?;
                (self.state, self.canonical) = (Some(state), gaussians);
            }
            SNAP if self.state.is_some() => {
                let header = self.header.as_ref().expect("HEAD comes first");
                let chunk = parse_snapshot(payload)?;
                let (state, roots) = State::snapshot(header, &chunk, &self.canonical)?;
                assert_eq!(roots.len(), state.count());
                self.state = Some(state);
            }
            FRAM => {
                let updates = self.header.as_ref().map_or(false, |header| header.updates);
                let chunk = parse_frame(payload, updates)?;
                if let Some(state) = &mut self.state {
                    state.frame(&chunk)?;
                }
            }
            _ => return Ok(None),
        }
        Ok(self.state.as_ref())
    }
}

/// Ordinals, counts and digests of the frames before the first rejection.
fn decode(stream: &[u8]) -> (Vec<(i128, i128, String)>, Option<Error>) {
    let (mut frames, mut found) = (Frames::default(), Vec::new());
    for (kind, payload) in chunks(stream) {
        match frames.push(kind, payload) {
            Ok(Some(state)) => {
                let count = state.count() as i128;
                found.push((state.frame_ordinal().into(), count, state.digest()));
            }
            Ok(None) => {}
            Err(error) => return (found, Some(error)),
        }
    }
    (found, None)
}

/// The streams of a folder of the suite that are files, with their manifest entries.
pub fn vectors(folder: &str) -> Vec<(String, Vec<u8>, Json)> {
    let manifest = read_json("manifest.json");
    let mut vectors = Vec::new();
    for vector in manifest.get("vectors").list() {
        let name = vector.get("name").text();
        if let (true, Some(file)) = (name.starts_with(folder), vector.find("file")) {
            let stream = std::fs::read(suite_file(file.text())).expect("a stream of the suite");
            vectors.push((name.to_string(), stream, vector.clone()));
        }
    }
    assert!(!vectors.is_empty());
    vectors
}

fn expected(vector: &Json) -> Vec<(i128, i128, String)> {
    let frames = vector.get("decode").get("frames").list().iter().map(Json::list);
    frames.map(|f| (f[0].number(), f[1].number(), f[2].text().to_string())).collect()
}

#[test]
fn valid_streams_give_the_expected_frames() {
    for folder in ["streams/", "traps/", "levels/"] {
        for (name, stream, due) in vectors(folder) {
            let (frames, error) = decode(&stream);
            assert_eq!(frames, expected(&due), "{name}");
            assert_eq!(error, None, "{name}");
        }
    }
}

#[test]
fn invalid_streams_have_an_expected_reject_id() {
    let mut rejected = 0;
    for (name, stream, due) in vectors("invalid/") {
        // Faults outside the payloads of frames are not detected here: there may be more frames.
        let (frames, error) = decode(&stream);
        assert_eq!(frames[..expected(&due).len().min(frames.len())], expected(&due)[..], "{name}");
        if let Some(id) = error.and_then(|error| error.reject()).map(Reject::id) {
            let ids = due.get("decode").get("refused").list();
            assert!(
                ids.iter().any(|due| due.text() == id),
                "{name}: {id}; expected one of {ids:?}"
            );
            rejected += 1;
        }
    }
    assert!(rejected > 100, "{rejected} streams were rejected");
}

#[test]
fn after_an_error_there_is_no_state_and_bytes_are_ignored() {
    let mut stream = std::fs::read(suite_file("streams/journey.quarc")).expect("a stream");
    let last = stream.len() - 1;
    stream[last] ^= 1;
    let mut decoder = Decoder::new();
    decoder.push(&stream);
    let error = loop {
        match decoder.pull() {
            Ok(state) => assert!(state.is_some(), "the stream is complete"),
            Err(error) => break error,
        }
    };
    assert_eq!(error.reject(), Some(Reject::PayloadCrc));
    assert!(decoder.state().is_none());
    let before = format!("{decoder:?}");
    decoder.push(&stream);
    assert_eq!(format!("{decoder:?}"), before);
    assert_eq!(decoder.pull().err(), Some(error));

    let mut decoder = SeekDecoder::new(&stream[..], 4).expect("the end is read last");
    while decoder.pull().is_ok() {}
    assert!(decoder.state().is_none());
}
