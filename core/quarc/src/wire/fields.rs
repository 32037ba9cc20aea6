//! The types of fields: SPEC 2.2 and 5.

use crate::error::{Error, Reject, Result};
use crate::records::Section;
use std::fmt::Display;

const WORD_BYTES: usize = 4;

/// The unread bytes of a payload.
pub(super) struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    pub fn new(payload: &'a [u8]) -> Self {
        Fields { rest: payload }
    }

    /// The next bytes, unparsed.
    pub fn bytes(&mut self, count: usize) -> Result<&'a [u8]> {
        if count > self.rest.len() {
            return Err(Error::new(Reject::Field, "the payload ends too early"));
            // [5-1]
        }
        let (bytes, rest) = self.rest.split_at(count);
        self.rest = rest;
        Ok(bytes)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.bytes(N)?);
        Ok(array)
    }

    pub fn u8(&mut self) -> Result<u8> {
        self.array().map(u8::from_le_bytes)
    }

    pub fn u16(&mut self) -> Result<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub fn u32(&mut self) -> Result<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Result<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub fn i32(&mut self) -> Result<i32> {
        self.array().map(i32::from_le_bytes)
    }

    pub fn f32(&mut self) -> Result<f32> {
        self.array().map(f32::from_le_bytes)
    }

    /// `N` floats of 32 bits.
    pub fn f32s<const N: usize>(&mut self) -> Result<[f32; N]> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.f32()?;
        }
        Ok(numbers)
    }

    /// A u8 that is 0 or 1.
    pub fn flag(&mut self, name: &str) -> Result<bool> {
        let number = self.u8()?;
        within(name, number, 0, 1).map_err(rejected)?;
        Ok(number == 1)
    }

    /// A UTF-8 text of `count` bytes.
    pub fn text(&mut self, count: usize) -> Result<String> {
        let bytes = self.bytes(count)?;
        let text = std::str::from_utf8(bytes)
            .map_err(|_| Error::new(Reject::Field, "a text is not UTF-8"))?; // [5-4]
        Ok(text.to_owned())
    }

    /// A section (SPEC 8.1). Memory is allocated only for words that are present.
    pub fn section(&mut self) -> Result<Section> {
        let count = self.u32()? as usize;
        let bytes = self.bytes(count.saturating_mul(WORD_BYTES))?;
        Ok(bytes.chunks_exact(WORD_BYTES).map(word).collect())
    }

    /// Check that no bytes follow.
    pub fn end(self) -> Result<()> {
        if self.rest.is_empty() {
            return Ok(());
        }
        let message = format!("{} bytes follow the last field", self.rest.len());
        Err(Error::new(Reject::TrailingData, message)) // [5-2]
    }
}

fn word(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |number, &byte| number << 8 | u32::from(byte))
}

/// Check that a number is in its range; NaN never is. [5-3]
pub(super) fn within<T: PartialOrd + Display>(
    name: &str,
    number: T,
    least: T,
    most: T,
) -> std::result::Result<(), String> {
    if number >= least && number <= most {
        return Ok(());
    }
    Err(format!("{name} is {number}; it must be from {least} to {most}"))
}

/// The rejection of a field outside its range.
pub(super) fn rejected(message: String) -> Error {
    Error::new(Reject::Field, message)
}

/// A payload under construction.
#[derive(Default)]
pub(super) struct Payload {
    pub bytes: Vec<u8>,
}

impl Payload {
    pub fn u8(&mut self, number: u8) {
        self.bytes.push(number);
    }

    pub fn u16(&mut self, number: u16) {
        self.bytes.extend_from_slice(&number.to_le_bytes());
    }

    pub fn u32(&mut self, number: u32) {
        self.bytes.extend_from_slice(&number.to_le_bytes());
    }

    pub fn u64(&mut self, number: u64) {
        self.bytes.extend_from_slice(&number.to_le_bytes());
    }

    pub fn i32(&mut self, number: i32) {
        self.bytes.extend_from_slice(&number.to_le_bytes());
    }

    pub fn f32s(&mut self, numbers: &[f32]) {
        for number in numbers {
            self.bytes.extend_from_slice(&number.to_le_bytes());
        }
    }

    /// A text after a u8 with its number of bytes.
    pub fn text8(&mut self, text: &str) -> Result<()> {
        self.u8(count(text.len(), "bytes of a name")?);
        self.bytes.extend_from_slice(text.as_bytes());
        Ok(())
    }

    /// A text after a u32 with its number of bytes.
    pub fn text32(&mut self, text: &str) -> Result<()> {
        self.u32(count(text.len(), "bytes of a text")?);
        self.bytes.extend_from_slice(text.as_bytes());
        Ok(())
    }

    pub fn section(&mut self, section: &Section) -> Result<()> {
        self.u32(count(section.len(), "words of a section")?);
        for &word in section {
            self.u32(word);
        }
        Ok(())
    }
}

/// Convert a count to the type of its field.
pub(super) fn count<T: TryFrom<usize>>(number: usize, what: &str) -> Result<T> {
    T::try_from(number).map_err(|_| Error::Encode(format!("{number} {what} exceed the limit")))
}
