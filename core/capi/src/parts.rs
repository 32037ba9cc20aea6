//! A partly loaded stream, which reports the byte ranges that it lacks.

use quarc::error::{Error, Result};
use quarc::source::Source;
use std::cell::RefCell;
use std::rc::Rc;

/// Bytes of a stream from an offset on.
#[derive(Debug)]
struct Part {
    offset: u64,
    bytes: Vec<u8>,
}

impl Part {
    fn end(&self) -> u64 {
        self.offset + self.bytes.len() as u64
    }

    /// The bytes that it has of a range that begins within it.
    fn slice(&self, place: u64, end: u64) -> &[u8] {
        let from = (place - self.offset) as usize;
        &self.bytes[from..from + (end.min(self.end()) - place) as usize]
    }
}

/// The loaded parts of a stream. A read stores the range it lacks in `missing`.
#[derive(Debug, Default)]
pub struct Parts {
    parts: Vec<Part>,
    /// Length of the stream in bytes, as far as it is known.
    pub size: u64,
    /// Whether this is the length of the whole stream.
    pub is_whole: bool,
    /// The range that the last read lacked: its first offset and its end.
    pub missing: Option<(u64, u64)>,
}

impl Parts {
    /// Store bytes at an offset.
    pub fn put(&mut self, offset: u64, bytes: &[u8]) {
        match self.parts.iter_mut().find(|part| part.end() == offset) {
            Some(part) => part.bytes.extend_from_slice(bytes),
            None => self.parts.push(Part { offset, bytes: bytes.to_vec() }),
        }
        self.size = self.size.max(offset + bytes.len() as u64);
    }

    /// Discard bytes before an offset, once they are at least half of their part.
    pub fn forget_before(&mut self, place: u64) {
        self.parts.retain(|part| part.end() > place);
        for part in &mut self.parts {
            let passed = place.saturating_sub(part.offset) as usize;
            if passed >= part.bytes.len() / 2 {
                part.bytes.drain(..passed);
                part.offset += passed as u64;
            }
        }
    }

    fn holding(&self, place: u64) -> Option<&Part> {
        self.parts.iter().find(|part| part.offset <= place && place < part.end())
    }
}

/// Parts that a decoder reads while others are stored.
#[derive(Clone, Debug, Default)]
pub struct SharedParts(pub Rc<RefCell<Parts>>);

impl SharedParts {
    /// A completely loaded stream.
    pub fn whole(bytes: Vec<u8>) -> Self {
        let size = bytes.len() as u64;
        let parts = vec![Part { offset: 0, bytes }];
        SharedParts(Rc::new(RefCell::new(Parts { parts, size, is_whole: true, missing: None })))
    }
}

impl Source for SharedParts {
    fn read(&mut self, offset: u64, length: u64, into: &mut Vec<u8>) -> Result<()> {
        let mut known = self.0.borrow_mut();
        let mut end = offset.saturating_add(length);
        if known.is_whole {
            end = end.min(known.size);
        }
        let mut place = offset;
        while place < end {
            match known.holding(place) {
                Some(part) => place = part.end(),
                None => {
                    known.missing = Some((place, end));
                    return Err(Error::Source("bytes are missing".into()));
                }
            }
        }
        let mut place = offset;
        while place < end {
            let Some(part) = known.holding(place) else { break };
            let bytes = part.slice(place, end);
            into.extend_from_slice(bytes);
            place += bytes.len() as u64;
        }
        Ok(())
    }

    fn size(&mut self) -> Result<u64> {
        Ok(self.0.borrow().size)
    }
}
