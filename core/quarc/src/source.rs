//! Sources of a stream: anything that can be read at an offset.

use crate::error::{Error, Result};
use std::io::{Read, Seek, SeekFrom};

/// The bytes of a stream, read on demand.
pub trait Source {
    /// Append `length` bytes from `offset` on; fewer only at the end of the source. Implementations
    /// must not allocate more than the bytes that exist. [13-1]
    ///
    /// # Errors
    /// [`Error::Source`] if the bytes cannot be read.
    fn read(&mut self, offset: u64, length: u64, into: &mut Vec<u8>) -> Result<()>;

    /// The current number of bytes.
    ///
    /// # Errors
    /// [`Error::Source`] if it is unknown.
    fn size(&mut self) -> Result<u64>;
}

impl<S: Source + ?Sized> Source for Box<S> {
    fn read(&mut self, offset: u64, length: u64, into: &mut Vec<u8>) -> Result<()> {
        (**self).read(offset, length, into)
    }

    fn size(&mut self) -> Result<u64> {
        (**self).size()
    }
}

/// A stream in memory.
impl Source for &[u8] {
    fn read(&mut self, offset: u64, length: u64, into: &mut Vec<u8>) -> Result<()> {
        let size = self.len() as u64;
        let begin = offset.min(size);
        let end = offset.saturating_add(length).min(size);
        into.extend_from_slice(&self[begin as usize..end as usize]);
        Ok(())
    }

    fn size(&mut self) -> Result<u64> {
        Ok(self.len() as u64)
    }
}

/// A stream in a file, or in anything else that implements `Read` and `Seek`.
#[derive(Debug)]
pub struct IoSource<T>(pub T);

impl<T: Read + Seek> Source for IoSource<T> {
    fn read(&mut self, offset: u64, length: u64, into: &mut Vec<u8>) -> Result<()> {
        let read = match self.0.seek(SeekFrom::Start(offset.min(i64::MAX as u64))) {
            // A file system may refuse offsets beyond the longest file it can hold.
            Err(_) if self.size().map_or(false, |size| size <= offset) => return Ok(()),
            at => at.and_then(|_| self.0.by_ref().take(length).read_to_end(into)),
        };
        read.map(drop).map_err(|error| Error::Source(error.to_string()))
    }

    fn size(&mut self) -> Result<u64> {
        self.0.seek(SeekFrom::End(0)).map_err(|error| Error::Source(error.to_string()))
    }
}

/// `length` bytes from `offset` on, fewer at the end.
pub(crate) fn read<S: Source>(source: &mut S, offset: u64, length: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    source.read(offset, length, &mut bytes)?;
    Ok(bytes)
}
