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
}

/// The loaded parts of a stream. A read stores the range it lacks in `missing`.
#[derive(Debug, Default)]
pub struct Parts {
    /// By their offsets; a later part also ends later.
    parts: Vec<Part>,
    /// Length of the stream in bytes, as far as it is known.
    pub size: u64,
    /// Whether this is the length of the whole stream.
    pub is_whole: bool,
    /// The range that the last read lacked: its first offset and its end.
    pub missing: Option<(u64, u64)>,
}

impl Parts {
    /// Store bytes at an offset. Bytes that are already known stay as they are.
    pub fn put(&mut self, offset: u64, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        let end = offset + bytes.len() as u64;
        if !self.is_whole {
            self.size = self.size.max(end);
        }
        let next = self.count_up_to(offset);
        let place = match self.parts[..next].last() {
            Some(part) if part.end() >= offset => next - 1,
            _ => {
                self.parts.insert(next, Part { offset, bytes: Vec::new() });
                next
            }
        };
        let part = &mut self.parts[place];
        if end > part.end() {
            let known = (part.end() - offset) as usize;
            part.bytes.extend_from_slice(&bytes[known..]);
            let later = &self.parts[place + 1..];
            let inside = later.partition_point(|part| part.end() <= end);
            self.parts.drain(place + 1..=place + inside);
        }
    }

    /// Discard bytes before an offset, once they are at least half of their part.
    pub fn forget_before(&mut self, place: u64) {
        let forgotten = self.parts.partition_point(|part| part.end() <= place);
        self.parts.drain(..forgotten);
        let Some(part) = self.parts.first_mut() else { return };
        let passed = place.saturating_sub(part.offset) as usize;
        if passed >= part.bytes.len() / 2 {
            part.bytes.drain(..passed);
            part.offset += passed as u64;
        }
    }

    /// The number of parts that begin at an offset or before it.
    fn count_up_to(&self, place: u64) -> usize {
        self.parts.partition_point(|part| part.offset <= place)
    }

    /// The known bytes from an offset on; `None` if the first of them is missing.
    fn known_at(&self, place: u64) -> Option<&[u8]> {
        let part = self.parts[..self.count_up_to(place)].last()?;
        (place < part.end()).then(|| &part.bytes[(place - part.offset) as usize..])
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
            match known.known_at(place) {
                Some(bytes) => place += bytes.len() as u64,
                None => {
                    known.missing = Some((place, end));
                    return Err(Error::Source("bytes are missing".into()));
                }
            }
        }
        let mut place = offset;
        while place < end {
            let Some(bytes) = known.known_at(place) else { break };
            let wanted = (bytes.len() as u64).min(end - place) as usize;
            into.extend_from_slice(&bytes[..wanted]);
            place += wanted as u64;
        }
        Ok(())
    }

    fn size(&mut self) -> Result<u64> {
        Ok(self.0.borrow().size)
    }
}
