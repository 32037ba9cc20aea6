//! A partly loaded stream, which reports the byte ranges that it lacks.

use quarc::error::{Error, Result};
use quarc::source::Source;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

/// The loaded parts of a stream. A read stores the range it lacks in `missing`.
#[derive(Debug, Default)]
pub struct Parts {
    /// The bytes of each part by its offset; a later part also ends later.
    parts: BTreeMap<u64, Vec<u8>>,
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
        self.size = self.size.max(end);
        let (place, known) = match self.parts.range_mut(..=offset).next_back() {
            Some((&place, known)) if end_of(place, known) >= offset => (place, known),
            _ => (offset, self.parts.entry(offset).or_default()),
        };
        let known_end = end_of(place, known);
        if end <= known_end {
            return;
        }
        known.extend_from_slice(&bytes[(known_end - offset) as usize..]);
        while let Some((&later, inside)) = self.parts.range(place + 1..).next() {
            if end_of(later, inside) > end {
                break;
            }
            self.parts.remove(&later);
        }
    }

    /// Discard bytes before an offset, once they are at least half of their part.
    pub fn forget_before(&mut self, place: u64) {
        let Some((&last, _)) = self.parts.range(..=place).next_back() else { return };
        while let Some(first) = self.parts.first_entry().filter(|first| *first.key() < last) {
            first.remove();
        }
        let mut bytes = self.parts.remove(&last).unwrap_or_default();
        let passed = (bytes.len() as u64).min(place - last) as usize;
        let offset = if passed < bytes.len() / 2 {
            last
        } else {
            bytes.drain(..passed);
            place
        };
        if !bytes.is_empty() {
            self.parts.insert(offset, bytes);
        }
    }

    /// The known bytes from an offset on; `None` if the first of them is missing.
    fn known_at(&self, place: u64) -> Option<&[u8]> {
        let (&offset, bytes) = self.parts.range(..=place).next_back()?;
        (place < end_of(offset, bytes)).then(|| &bytes[(place - offset) as usize..])
    }
}

/// The offset after the last byte of a part.
fn end_of(offset: u64, bytes: &[u8]) -> u64 {
    offset + bytes.len() as u64
}

/// Parts that a decoder reads while others are stored.
#[derive(Clone, Debug, Default)]
pub struct SharedParts(pub Rc<RefCell<Parts>>);

impl SharedParts {
    /// A completely loaded stream.
    pub fn whole(bytes: Vec<u8>) -> Self {
        let size = bytes.len() as u64;
        let parts = BTreeMap::from([(0, bytes)]);
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
