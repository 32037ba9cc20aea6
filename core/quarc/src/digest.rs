//! The serialized state, its digest and its CRC: SPEC 9.

use crate::error::{Error, Reject, Result};
use crate::parallel::each;
use crate::rows::Rows;
use crate::state::State;
use sha2::{Digest, Sha256};

/// Numbers converted at a time.
const BLOCK: usize = 1024;

/// The serialized parts of a state, in order (SPEC 9.1).
#[derive(Clone, Copy, Debug)]
pub struct Serialized<'a> {
    /// Frames since the canonical frame.
    pub phase: u32,
    /// `[N]`.
    pub ids: &'a [u32],
    /// `[3, N]`.
    pub positions: &'a Rows<i32>,
    /// `[4, N]`.
    pub rotations: &'a Rows<i32>,
    /// `[7 or 16, N]`.
    pub codes: &'a Rows<i16>,
}

impl Serialized<'_> {
    /// The SHA-256 of the serialization as hexadecimal digits (SPEC 9.1).
    #[must_use]
    pub fn digest(&self) -> String {
        let mut digest = Sha256::new_with_prefix(self.head());
        self.parts(true).iter().for_each(|part| part.write(|bytes| digest.update(bytes)));
        digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// The CRC of the serialization, with or without the codes (SPEC 9.2).
    #[must_use]
    pub fn crc(&self, with_codes: bool) -> u32 {
        let mut all = crc32fast::Hasher::new();
        all.update(&self.head());
        let crc_of = |part: Part| {
            let mut crc = crc32fast::Hasher::new();
            part.write(|bytes| crc.update(bytes));
            crc
        };
        each(self.parts(with_codes), &crc_of).iter().for_each(|crc| all.combine(crc));
        all.finalize()
    }

    /// The bytes before the parts.
    fn head(&self) -> [u8; 8] {
        (u64::from(self.phase) << 32 | self.ids.len() as u64).to_le_bytes()
    }

    /// The ids and the rows, in order.
    fn parts(&self, with_codes: bool) -> Vec<Part<'_>> {
        let codes = if with_codes { self.codes.rows() } else { 0 };
        let mut parts = vec![Part::Ids(self.ids)];
        for rows in [self.positions, self.rotations] {
            parts.extend((0..rows.rows()).map(|row| Part::Numbers(rows.row(row))));
        }
        parts.extend((0..codes).map(|row| Part::Codes(self.codes.row(row))));
        parts
    }
}

/// A part of the serialization.
enum Part<'a> {
    Ids(&'a [u32]),
    Numbers(&'a [i32]),
    Codes(&'a [i16]),
}

impl Part<'_> {
    /// Pass on the bytes of the part in pieces.
    fn write(&self, to: impl FnMut(&[u8])) {
        match self {
            Part::Ids(ids) => write(ids, |&id| id.to_le_bytes(), to),
            Part::Numbers(numbers) => write(numbers, |&number| number.to_le_bytes(), to),
            Part::Codes(codes) => write(codes, |&code| i32::from(code).to_le_bytes(), to),
        }
    }
}

impl State {
    /// The SHA-256 of the state's serialization as hexadecimal digits (SPEC 9.1).
    #[must_use]
    pub fn digest(&self) -> String {
        self.serialized().digest()
    }

    /// The CRC that the chunk of this frame carries (SPEC 9.2).
    #[must_use]
    pub fn state_crc(&self) -> u32 {
        let with_codes = self.phase() % u32::from(self.header().full_crc_interval) == 0;
        self.serialized().crc(with_codes)
    }

    /// Check the state against the CRC of its chunk.
    ///
    /// # Errors
    /// `state-crc`: it differs from the encoder's state.
    pub fn prove(&self, state_crc: u32) -> Result<()> {
        // [9.2-1] [9.2-2]
        if self.state_crc() != state_crc {
            let message =
                format!("the state of frame {} differs from the encoder's", self.frame_ordinal());
            return Err(Error::new(Reject::StateCrc, message));
        }
        Ok(())
    }

    fn serialized(&self) -> Serialized<'_> {
        Serialized {
            phase: self.phase(),
            ids: self.ids(),
            positions: self.positions(),
            rotations: self.rotations(),
            codes: self.codes(),
        }
    }
}

/// Serialize numbers in blocks.
fn write<T>(numbers: &[T], bytes_of: impl Fn(&T) -> [u8; 4], mut to: impl FnMut(&[u8])) {
    let mut bytes = [0; 4 * BLOCK];
    for block in numbers.chunks(BLOCK) {
        for (bytes, number) in bytes.chunks_exact_mut(4).zip(block) {
            bytes.copy_from_slice(&bytes_of(number));
        }
        to(&bytes[..4 * block.len()]);
    }
}
