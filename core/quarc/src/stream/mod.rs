//! Decoding of a stream whose bytes arrive in order: push bytes, pull states.

mod states;

pub use states::{Reference, StateDecoder};

use crate::chunks::{
    is_known, prove_payload, ChunkHeader, ChunkOrder, CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, HEAD,
    MAGIC,
};
use crate::error::{Error, Result};
use crate::reader::{check_magic, trailing_data};
use crate::state::State;
use std::io::{ErrorKind, Read};
use std::ops::Deref;

const PIECE_BYTES: usize = 1 << 16;

/// Takes the bytes of a stream as they arrive and returns the state of every frame.
///
/// Push bytes, in pieces of any size, and pull until nothing is returned; at the end of the stream
/// call [`Decoder::finish`] and pull once more. The decoder derefs to its [`StateDecoder`], which
/// has the other information on the stream.
///
/// ```
/// use quarc::stream::Decoder;
///
/// let stream = std::fs::read("../../conformance/streams/journey.quarc")?;
/// let mut decoder = Decoder::new();
/// let mut gaussians = Vec::new();
/// for piece in stream.chunks(1000) {
///     decoder.push(piece);
///     while let Some(state) = decoder.pull()? {
///         gaussians.push(state.count());
///     }
/// }
/// decoder.finish();
/// decoder.pull()?; // an error if the stream is truncated
/// assert_eq!(gaussians, [12, 12, 13, 12, 12, 13, 12, 12, 13]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    bytes: Vec<u8>,
    taken: usize, // consumed bytes at the front
    is_begun: bool,
    is_finished: bool,
    order: ChunkOrder,
    at_hand: Option<ChunkHeader>, // accepted; its payload is next
    passed_over: crc32fast::Hasher,
    passed_bytes: usize, // of a payload that is not kept
    states: StateDecoder,
    failure: Option<Error>,
}

impl Deref for Decoder {
    type Target = StateDecoder;

    fn deref(&self) -> &StateDecoder {
        &self.states
    }
}

impl Decoder {
    /// A decoder without any bytes.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Append the next bytes of the stream; they are decoded by [`Decoder::pull`]. After an error,
    /// they are ignored.
    pub fn push(&mut self, bytes: &[u8]) {
        if self.failure.is_some() {
            return;
        }
        if self.taken >= self.bytes.len() / 2 {
            self.bytes.drain(..self.taken);
            self.taken = 0;
        }
        self.bytes.extend_from_slice(bytes);
    }

    /// Declare the end of the bytes.
    pub fn finish(&mut self) {
        self.is_finished = true;
    }

    /// Whether the stream is complete, from the magic to TAIL.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.order.is_past_tail()
    }

    /// Return the state of the next frame, after checking its CRC; `None` if more bytes are needed
    /// or the stream has ended.
    ///
    /// # Errors
    /// The stream is malformed; further calls return the same error. All frames before it have been
    /// returned.
    pub fn pull(&mut self) -> Result<Option<&State>> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        match self.advance() {
            Ok(true) => Ok(self.states.state()),
            Ok(false) => Ok(None),
            Err(error) => {
                self.failure = Some(error.clone());
                self.states.lose();
                Err(error)
            }
        }
    }

    /// Decode up to the next frame; false if it has not arrived.
    fn advance(&mut self) -> Result<bool> {
        if !self.begin()? {
            return Ok(false);
        }
        while !self.order.is_past_tail() {
            let Some(header) = self.take_header()? else { return Ok(false) };
            let Some(end) = self.prove(&header)? else { return Ok(false) };
            let length = end - CHUNK_CRC_BYTES;
            let payload = &self.bytes[self.taken..self.taken + length];
            let is_frame = self.states.push(&header, payload)?;
            self.taken += end;
            self.at_hand = None;
            self.order.pass(&header);
            if header.kind == HEAD {
                if let Some(stream) = self.states.header() {
                    self.order.keep_to(stream);
                }
            }
            if is_frame {
                return Ok(true);
            }
        }
        if self.taken < self.bytes.len() {
            return Err(trailing_data(self.order.offset));
        }
        Ok(false)
    }

    /// Read the magic; false if it has not arrived.
    fn begin(&mut self) -> Result<bool> {
        if self.is_begun {
            return Ok(true);
        }
        if self.bytes.len() < MAGIC.len() && !self.is_finished {
            return Ok(false);
        }
        check_magic(&self.bytes)?;
        self.taken = MAGIC.len();
        self.is_begun = true;
        Ok(true)
    }

    /// Read and check the next chunk header; `None` if it has not arrived.
    fn take_header(&mut self) -> Result<Option<ChunkHeader>> {
        if self.at_hand.is_none() {
            let data = &self.bytes[self.taken..];
            if data.len() < CHUNK_HEADER_BYTES && !self.is_finished {
                return Ok(None);
            }
            let data = &data[..data.len().min(CHUNK_HEADER_BYTES)];
            self.at_hand = Some(self.order.accept(data)?);
            self.taken += CHUNK_HEADER_BYTES;
            self.passed_over = crc32fast::Hasher::new();
            self.passed_bytes = 0;
        }
        Ok(self.at_hand)
    }

    /// Check the CRC of the next payload. Returns the number of bytes of payload and CRC that are
    /// still buffered, or `None` if they have not all arrived.
    fn prove(&mut self, header: &ChunkHeader) -> Result<Option<usize>> {
        if !is_known(header.kind) {
            self.pass_over(header);
        }
        let data = &self.bytes[self.taken..];
        let length = header.length as usize - self.passed_bytes;
        if data.len() < length.saturating_add(CHUNK_CRC_BYTES) && !self.is_finished {
            return Ok(None);
        }
        let (payload, stored) = data.split_at(data.len().min(length));
        let mut hasher = self.passed_over.clone();
        hasher.update(payload);
        prove_payload(header, hasher.finalize(), stored)?;
        Ok(Some(length + CHUNK_CRC_BYTES))
    }

    /// Drop the buffered bytes of a payload that is not decoded.
    fn pass_over(&mut self, header: &ChunkHeader) {
        let data = &self.bytes[self.taken..];
        let count = data.len().min(header.length as usize - self.passed_bytes);
        self.passed_over.update(&data[..count]);
        self.passed_bytes += count;
        self.taken += count;
    }
}

/// Decode a whole stream as its bytes arrive, and pass every state to `show`.
///
/// # Errors
/// Those of the stream, of its source and of `show`.
pub fn decode_all<E: From<Error>>(
    input: &mut dyn Read,
    decoder: &mut Decoder,
    mut show: impl FnMut(&State) -> std::result::Result<(), E>,
) -> std::result::Result<(), E> {
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        let count = match input.read(&mut piece) {
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            read => read.map_err(|error| Error::Source(error.to_string()))?,
        };
        decoder.push(&piece[..count]);
        if count == 0 {
            decoder.finish();
        }
        while let Some(state) = decoder.pull()? {
            show(state)?;
        }
        if count == 0 {
            return Ok(());
        }
    }
}
