//! Streams with random changes and corrected CRCs never cause a panic, and all ways of reading
//! reject the same ones.

use quarc::chunks::{build_chunk, ChunkHeader, CANO, HEAD, MAGIC, SYNC, TAIL};
use quarc::error::Error;
use quarc::preview::Preview;
use quarc::reader::{Chunk, ChunkReader};
use quarc::recover::{Recovered, Recovery};
use quarc::seek::SeekDecoder;
use quarc::source::IoSource;
use quarc::stream::Decoder;
use quarc::wire::{build_tail, parse_header, parse_tail};
use std::fs;
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::path::PathBuf;
use std::sync::Arc;

const STREAMS: [&str; 6] = [
    "journey",
    "births-and-deaths",
    "snapshots-journey",
    "snapshots-newborn",
    "rotation",
    "updates-journey",
];
const CHANGES: u32 = 150;

fn read(name: &str) -> Vec<u8> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../conformance/streams");
    fs::read(folder.join(name).with_extension("quarc")).expect("the conformance suite")
}

fn chunks(stream: &[u8]) -> Vec<Chunk> {
    let mut reader = ChunkReader::new(stream).expect("the magic");
    let mut chunks = Vec::new();
    while let Some(header) = reader.read_header().expect("a header") {
        let mut chunk = reader.take(header).expect("a chunk");
        if header.kind == HEAD {
            reader.order.keep_to(&parse_header(&chunk.payload).expect("HEAD"));
        }
        let from = header.payload_offset() as usize; // also if the reader keeps no payload
        chunk.payload = stream[from..][..header.length as usize].to_vec();
        chunks.push(chunk);
    }
    chunks
}

/// Xorshift: deterministic numbers.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound as u64) as usize
    }

    /// Change up to three bytes of a payload, or its length.
    fn change(&mut self, payload: &mut Vec<u8>) {
        for _ in 0..=self.below(3) {
            if payload.is_empty() {
                return;
            }
            let place = self.below(payload.len());
            match self.below(8) {
                0 => payload.truncate(place),
                1 => payload.insert(place, 0xFF),
                2 => payload[place] = 0xFF,
                3 => payload[place] = 0,
                bit => payload[place] ^= 1 << (bit + self.below(5) - 4),
            }
        }
    }
}

fn build(chunks: &[Chunk]) -> Vec<u8> {
    let mut stream = MAGIC.to_vec();
    for Chunk { header, payload } in chunks {
        stream.extend(build_chunk(header.kind, header.sequence, payload).expect("it fits"));
    }
    stream
}

fn decode(stream: &[u8]) -> (Vec<String>, Option<Error>) {
    let (mut decoder, mut digests) = (Decoder::new(), Vec::new());
    decoder.push(stream);
    decoder.finish();
    loop {
        match decoder.pull() {
            Ok(Some(state)) => digests.push(state.digest()),
            Ok(None) => return (digests, None),
            Err(error) => return (digests, Some(error)),
        }
    }
}

/// The frames before the first gap that loses frames. Checks that gaps are within the stream.
fn recover(stream: &[u8]) -> Vec<String> {
    let (mut digests, mut whole) = (Vec::new(), true);
    let Ok(mut recovery) = Recovery::new(stream) else { return digests };
    while let Ok(Some(found)) = recovery.pull() {
        match found {
            Recovered::Frame(state) if whole => digests.push(state.digest()),
            Recovered::Frame(_) => {}
            Recovered::Gap(gap) => {
                assert!(gap.offset + gap.bytes <= stream.len() as u64);
                whole = whole && gap.frames_lost == Some(0);
            }
        }
    }
    digests
}

fn seek(stream: &[u8], start: u32) {
    let Ok(mut decoder) = SeekDecoder::new(stream, start) else { return };
    while let Ok(Some(state)) = decoder.pull() {
        assert!(state.frame_ordinal() >= start);
    }
}

#[test]
fn modified_streams_never_panic_and_all_readers_agree() {
    let mut numbers = Numbers(0x5DEE_CE66_D1CE_CAFE);
    let mut rejected = 0;
    for name in STREAMS {
        let stream = read(name);
        let whole = chunks(&stream);
        assert!(build(&whole) == stream, "{name} comes back from its chunks");
        for _ in 0..CHANGES {
            let mut changed = whole.clone();
            let which = numbers.below(changed.len());
            numbers.change(&mut changed[which].payload);
            let bytes = build(&changed);
            let (digests, error) = decode(&bytes);
            if let Some(error) = &error {
                assert!(matches!(error, Error::Rejected { offset: Some(_), .. }), "{error}");
                rejected += 1;
            }
            let recovered = recover(&bytes);
            assert!(recovered.starts_with(&digests) || recovered.is_empty(), "{name}: {error:?}");
            seek(&bytes, numbers.below(12) as u32);
        }
    }
    assert!(rejected > 300, "{rejected} streams were rejected");
}

#[test]
fn a_truncated_stream_gives_its_complete_frames() {
    let stream = read("journey");
    let (all, error) = decode(&stream);
    assert_eq!(error, None);
    for end in 8..stream.len() {
        let (digests, error) = decode(&stream[..end]);
        assert!(all.starts_with(&digests), "cut at {end}");
        let id = error.and_then(|error| error.reject()).map(quarc::error::Reject::id);
        assert_eq!(id, Some("truncated"), "cut at {end}");
        assert!(recover(&stream[..end]).len() == digests.len(), "cut at {end}");
    }
}

/// A decoder of bytes in order would otherwise collect 4 GiB before it rejects them.
#[test]
fn a_payload_beyond_the_limit_of_this_decoder_is_declined_by_its_header() {
    for (length, is_declined) in [(1 << 26, false), ((1 << 26) + 1, true), (u32::MAX, true)] {
        let mut head = chunks(&read("still"))[0].payload.clone();
        head[10] = 31;
        let mut frame = [&SYNC[..], b"CANO", &[1, 0, 0, 0], &length.to_le_bytes()].concat();
        frame.extend(crc32fast::hash(&frame).to_le_bytes());
        let head = build_chunk(HEAD, 0, &head).expect("it fits");
        let stream = [&MAGIC[..], &head, &frame].concat();
        let mut decoder = Decoder::new();
        decoder.push(&stream);
        let pulled = decoder.pull().map(|state| state.is_some());
        assert_eq!(matches!(pulled, Err(Error::Limit(_))), is_declined, "{length}: {pulled:?}");
        let mut recovery = Recovery::new(&stream[..]).expect("HEAD");
        let pulled = recovery.pull().map(drop);
        assert_eq!(matches!(pulled, Err(Error::Limit(_))), is_declined, "{length}: {pulled:?}");
    }
}

#[test]
fn a_preview_at_the_greatest_offset_finds_no_bytes() {
    let still = read("still");
    let header = Arc::new(parse_header(&chunks(&still)[0].payload).expect("HEAD"));
    let chunk = ChunkHeader { kind: CANO, sequence: 1, length: 100, offset: u64::MAX };
    let id = Preview::new(&mut &still[..], &header, &chunk).err().and_then(|error| error.reject());
    assert_eq!(id.map(quarc::error::Reject::id), Some("field"));
}

/// A file that cannot be sought beyond its longest possible length, as on most file systems.
struct Limited(Cursor<Vec<u8>>);

impl Read for Limited {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.0.read(into)
    }
}

impl Seek for Limited {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match to {
            SeekFrom::Start(offset) if offset > 1 << 44 => Err(io::ErrorKind::InvalidInput.into()),
            _ => self.0.seek(to),
        }
    }
}

#[test]
fn an_index_beyond_the_end_of_a_file_is_rejected_at_every_offset() {
    for index_offset in [1 << 20, 1 << 50, i64::MAX as u64, u64::MAX] {
        let mut changed = chunks(&read("journey"));
        let tail = changed.last_mut().filter(|chunk| chunk.header.kind == TAIL).expect("TAIL");
        let totals = parse_tail(&tail.payload).expect("totals");
        tail.payload = build_tail(&quarc::records::Tail { index_offset, ..totals });
        let file = Limited(Cursor::new(build(&changed)));
        let mut decoder = SeekDecoder::new(IoSource(file), 7).expect("HEAD");
        let id =
            decoder.pull().err().and_then(|error| error.reject()).map(quarc::error::Reject::id);
        assert_eq!(id, Some("index-mismatch"), "{index_offset}");
    }
}
