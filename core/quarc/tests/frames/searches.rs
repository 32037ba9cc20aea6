//! Searches and checks in a stream that is still arriving.

use crate::known::suite_file;
use quarc::chunks::{build_chunk, parse_chunk_header, MAGIC};
use quarc::error::{Error, Result};
use quarc::reader::ChunkReader;
use quarc::seek::SeekDecoder;
use quarc::source::Source;
use std::cell::Cell;
use std::rc::Rc;

/// The first bytes of a stream without a known length; counts reads and the bytes that they return.
struct Arriving<'a> {
    stream: &'a [u8],
    arrived: Rc<Cell<usize>>,
    reads: Rc<Cell<usize>>,
    bytes: Rc<Cell<usize>>,
}

impl<'a> Arriving<'a> {
    fn new(stream: &'a [u8], arrived: &Rc<Cell<usize>>) -> Self {
        let (reads, bytes) = (Rc::default(), Rc::default());
        Arriving { stream, arrived: Rc::clone(arrived), reads, bytes }
    }
}

impl Source for Arriving<'_> {
    fn read(&mut self, offset: u64, length: u64, into: &mut Vec<u8>) -> Result<()> {
        self.reads.set(self.reads.get() + 1);
        let (begin, end) = (offset as usize, (offset + length) as usize);
        if end > self.arrived.get() {
            return Err(Error::Source("bytes are missing".into()));
        }
        self.bytes.set(self.bytes.get() + end - begin);
        into.extend_from_slice(&self.stream[begin..end]);
        Ok(())
    }

    fn size(&mut self) -> Result<u64> {
        Ok(self.arrived.get() as u64)
    }
}

#[test]
fn a_search_continues_where_bytes_were_missing() {
    let stream =
        std::fs::read(suite_file("streams/journey-without-index.quarc")).expect("a stream");
    let arrived = Rc::new(Cell::new(128));
    let source = Arriving::new(&stream, &arrived);
    let reads = Rc::clone(&source.reads);
    let mut decoder = SeekDecoder::new(source, 4).expect("HEAD has arrived");
    reads.set(0);
    let mut pulls = 0;
    while let Err(error) = decoder.pull() {
        assert!(matches!(error, Error::Source(_)), "{error}");
        assert!(arrived.get() < stream.len());
        arrived.set((arrived.get() + 2).min(stream.len()));
        pulls += 1;
    }
    assert!(decoder.state().is_some());
    assert!(pulls > 200);
    // Each pull reads the place of TAIL and the next header; each header is read only once.
    assert!(reads.get() < 4 * pulls, "{} reads in {pulls} pulls", reads.get());
}

#[test]
fn a_payload_of_an_unknown_type_is_read_once_while_it_arrives() {
    let payload = vec![7; 3 << 20];
    let chunk = build_chunk(*b"note", 0, &payload).expect("it fits");
    let stream = [&MAGIC[..], &chunk].concat();
    let arrived = Rc::new(Cell::new(28));
    let source = Arriving::new(&stream, &arrived);
    let bytes = Rc::clone(&source.bytes);
    let mut reader = ChunkReader::new(source).expect("the magic");
    let header = parse_chunk_header(&chunk[..20], 8).expect("a header");
    let mut pulls = 0;
    while let Err(error) = reader.take(header) {
        assert!(matches!(error, Error::Source(_)), "{error}");
        arrived.set((arrived.get() + (1 << 16)).min(stream.len()));
        pulls += 1;
    }
    assert!(pulls > 40);
    assert!(bytes.get() < stream.len() + 100, "{} bytes read", bytes.get());
}
