//! A search for a frame in a stream that is still arriving.

use crate::known::suite_file;
use quarc::error::{Error, Result};
use quarc::seek::SeekDecoder;
use quarc::source::Source;
use std::cell::Cell;
use std::rc::Rc;

/// The first bytes of a stream without a known length; counts reads.
struct Arriving<'a> {
    stream: &'a [u8],
    arrived: Rc<Cell<usize>>,
    reads: Rc<Cell<usize>>,
}

impl Source for Arriving<'_> {
    fn read(&mut self, offset: u64, length: u64, into: &mut Vec<u8>) -> Result<()> {
        self.reads.set(self.reads.get() + 1);
        let (begin, end) = (offset as usize, (offset + length) as usize);
        if end > self.arrived.get() {
            return Err(Error::Source("bytes are missing".into()));
        }
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
    let (arrived, reads) = (Rc::new(Cell::new(128)), Rc::new(Cell::new(0)));
    let source = Arriving { stream: &stream, arrived: arrived.clone(), reads: reads.clone() };
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
