//! Streams that can be read only once.

use quarc::error::{Error, Result};
use quarc::source::Source;
use std::collections::VecDeque;
use std::io::Read;

/// The bytes that are kept: the longest payload, and a window of a search for the next chunk.
const KEPT_BYTES: usize = 66 << 20;
const PIECE_BYTES: u64 = 1 << 16;

/// A stream in a pipe. Its last bytes are kept, so that recovery can return to a damaged chunk.
pub struct Pipe<R> {
    input: R,
    kept: VecDeque<u8>,
    begin: u64, // offset of the first byte that is kept
}

impl<R: Read> Pipe<R> {
    /// The stream that begins with the next byte of `input`.
    pub fn new(input: R) -> Self {
        Pipe { input, kept: VecDeque::new(), begin: 0 }
    }

    fn end(&self) -> u64 {
        self.begin + self.kept.len() as u64
    }

    /// Read one piece, and forget what is too old and before `needed`; false at the end.
    fn advance(&mut self, length: u64, needed: u64) -> Result<bool> {
        let mut piece = Vec::new();
        let read = self.input.by_ref().take(length.min(PIECE_BYTES)).read_to_end(&mut piece);
        read.map_err(|error| Error::Source(error.to_string()))?;
        self.kept.extend(&piece);
        let old = self.kept.len().saturating_sub(KEPT_BYTES);
        let old = old.min(needed.saturating_sub(self.begin) as usize);
        self.kept.drain(..old);
        self.begin += old as u64;
        Ok(!piece.is_empty())
    }
}

impl<R: Read> Source for Pipe<R> {
    fn read(&mut self, offset: u64, length: u64, into: &mut Vec<u8>) -> Result<()> {
        if offset < self.begin {
            let message = format!("cannot go back to byte {offset} of a pipe; save it to a file");
            return Err(Error::Source(message));
        }
        let end = offset.saturating_add(length);
        while self.end() < end && self.advance(end - self.end(), offset)? {}
        let place = |offset: u64| (offset.min(self.end()) - self.begin) as usize;
        into.extend(self.kept.range(place(offset)..place(end)));
        Ok(())
    }

    /// Reads the rest of the stream.
    fn size(&mut self) -> Result<u64> {
        while self.advance(PIECE_BYTES, u64::MAX)? {}
        Ok(self.end())
    }
}

#[cfg(test)]
mod tests {
    use super::{Pipe, KEPT_BYTES, PIECE_BYTES};
    use quarc::source::Source;
    use std::io::{repeat, Read};

    #[test]
    fn a_pipe_keeps_a_bounded_number_of_bytes() {
        let kept = KEPT_BYTES as u64;
        let mut pipe = Pipe::new(repeat(7).take(3 * kept));
        let mut read = |offset, length| {
            let mut bytes = Vec::new();
            pipe.read(offset, length, &mut bytes).map(|()| bytes.len() as u64)
        };
        assert_eq!(read(0, 8), Ok(8));
        assert_eq!(read(kept, 8), Ok(8));
        assert_eq!(read(100, 8), Ok(8));
        assert_eq!(read(3 * kept - 4, 8), Ok(4));
        assert_eq!(read(2 * kept, 8), Ok(8));
        let failure = read(kept, 8).expect_err("it is too old").to_string();
        assert!(failure.contains("cannot go back to byte 69206016 of a pipe"), "{failure}");
        assert!(pipe.kept.len() as u64 <= kept + PIECE_BYTES);
        assert_eq!(pipe.size(), Ok(3 * kept));
    }
}
