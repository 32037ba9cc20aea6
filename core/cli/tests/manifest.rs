//! Every stream of the conformance suite, with every way of reading.

use quarc::error::{Error, Result};
use quarc::recover::{Recovered, Recovery};
use quarc::seek::SeekDecoder;
use quarc::state::State;
use quarc::stream::Decoder;
use serde_json::{json, Value};
use std::collections::HashMap;
use std::fs;
use std::path::PathBuf;

struct Suite {
    root: PathBuf,
    vectors: HashMap<String, Value>,
}

impl Suite {
    fn load() -> Self {
        let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../conformance");
        let text = fs::read(root.join("manifest.json")).expect("the conformance suite");
        let manifest: Value = serde_json::from_slice(&text).expect("JSON");
        let vectors = manifest["vectors"].as_array().expect("vectors").iter();
        let name = |vector: &Value| vector["name"].as_str().expect("a name").to_owned();
        Suite { vectors: vectors.map(|vector| (name(vector), vector.clone())).collect(), root }
    }

    /// The bytes of a vector: a committed file, or its parent with a patch.
    fn stream(&self, name: &str) -> Vec<u8> {
        let vector = &self.vectors[name];
        if let Some(file) = vector["file"].as_str() {
            return fs::read(self.root.join(file)).expect("a stream");
        }
        let parent = self.stream(vector["parent"].as_str().expect("a parent"));
        let (mut stream, mut place) = (Vec::new(), 0);
        for splice in vector["patch"].as_array().expect("a patch") {
            let number = |key: &str| splice[key].as_u64().map(|number| number as usize);
            let at = number("at").expect("a place");
            stream.extend_from_slice(&parent[place..at]);
            let insert = from_hex(splice["insert"].as_str().expect("bytes"));
            stream.extend(insert.repeat(number("count").unwrap_or(1)));
            place = at + number("remove").expect("a count");
        }
        stream.extend_from_slice(&parent[place..]);
        stream
    }

    /// Pass each vector that has an entry `mode` to `show`, with the entry.
    fn each(&self, mode: &str, least: usize, mut show: impl FnMut(&str, &[u8], &Value)) {
        let mut shown = 0;
        for (name, vector) in &self.vectors {
            if let Some(expected) = vector.get(mode) {
                show(name, &self.stream(name), expected);
                shown += 1;
            }
        }
        assert!(shown > least, "{shown} vectors have {mode}");
    }
}

fn from_hex(text: &str) -> Vec<u8> {
    let byte = |place| u8::from_str_radix(&text[place..place + 2], 16).expect("hexadecimal");
    (0..text.len()).step_by(2).map(byte).collect()
}

fn describe(state: &State) -> Value {
    json!([state.frame_ordinal(), state.count(), state.digest()])
}

/// Compare frames and outcome with the manifest.
fn compare(name: &str, expected: &Value, frames: &[Value], ended: &Result<()>) {
    if let (Err(Error::Limit(_)), Some(true)) = (ended, expected["may_decline"].as_bool()) {
        return;
    }
    assert_eq!(json!(frames), expected["frames"], "{name}: {ended:?}");
    let refused = expected["refused"].as_array().map_or(&[][..], Vec::as_slice);
    match ended {
        Ok(()) => assert!(refused.is_empty(), "{name} must be rejected: {refused:?}"),
        Err(error) => {
            let id = error.reject().expect("a rejection").id();
            assert!(
                refused.iter().any(|known| known == id),
                "{name}: {error}; expected one of {refused:?}"
            );
        }
    }
}

fn pull_all(decoder: &mut Decoder, frames: &mut Vec<Value>) -> Result<()> {
    while let Some(state) = decoder.pull()? {
        frames.push(describe(state));
    }
    Ok(())
}

fn decode(stream: &[u8], piece: usize, frames: &mut Vec<Value>) -> Result<()> {
    let mut decoder = Decoder::new();
    for bytes in stream.chunks(piece) {
        decoder.push(bytes);
        pull_all(&mut decoder, frames)?;
    }
    decoder.finish();
    let ended = pull_all(&mut decoder, frames);
    assert!(decoder.is_over() || ended.is_err());
    assert_eq!(pull_all(&mut decoder, frames), ended, "the error is repeated");
    ended
}

#[test]
fn streams_decode_in_sequence() {
    Suite::load().each("decode", 800, |name, stream, expected| {
        let mut frames = Vec::new();
        let ended = decode(stream, usize::MAX, &mut frames);
        compare(name, expected, &frames, &ended);
    });
}

#[test]
fn streams_decode_from_pieces_of_any_size() {
    for piece in [1, 37] {
        Suite::load().each("decode", 800, |name, stream, expected| {
            if stream.len() < 1 << 12 {
                let mut frames = Vec::new();
                let ended = decode(stream, piece, &mut frames);
                compare(name, expected, &frames, &ended);
            }
        });
    }
}

#[test]
fn seeking_returns_the_expected_frames() {
    let seek = |stream: &[u8], start, frames: &mut Vec<Value>| -> Result<()> {
        let mut decoder = SeekDecoder::new(stream, start)?;
        while let Some(state) = decoder.pull()? {
            frames.push(describe(state));
        }
        Ok(())
    };
    Suite::load().each("seek", 20, |name, stream, expected| {
        for case in expected.as_array().expect("cases") {
            let start = case["start"].as_u64().expect("an ordinal") as u32;
            let mut frames = Vec::new();
            let ended = seek(stream, start, &mut frames);
            compare(name, case, &frames, &ended);
        }
    });
}

#[test]
fn recovery_returns_the_expected_frames_and_gaps() {
    let recover = |stream: &[u8], frames: &mut Vec<Value>, gaps: &mut Vec<Value>| -> Result<()> {
        let mut recovery = Recovery::new(stream)?;
        while let Some(found) = recovery.pull()? {
            match found {
                Recovered::Frame(state) => frames.push(describe(state)),
                Recovered::Gap(gap) => gaps.push(json!({
                    "offset": gap.offset, "bytes": gap.bytes, "refused": gap.reject.id(),
                    "frames_lost": gap.frames_lost,
                })),
            }
        }
        Ok(())
    };
    Suite::load().each("recover", 300, |name, stream, expected| {
        let (mut frames, mut gaps) = (Vec::new(), Vec::new());
        let ended = recover(stream, &mut frames, &mut gaps);
        compare(name, expected, &frames, &ended);
        let due = expected["gaps"].as_array().map_or(&[][..], Vec::as_slice);
        assert_eq!(gaps.len(), due.len(), "{name}: {gaps:?}; expected {due:?}");
        for (gap, due) in gaps.iter().zip(due) {
            for key in ["offset", "bytes", "frames_lost"] {
                assert_eq!(gap[key], due[key], "{name}: {gap}; expected {due}");
            }
            let allowed = due["refused"].as_array().expect("reject ids");
            assert!(allowed.contains(&gap["refused"]), "{name}: {gap}; expected {due}");
        }
    });
}
