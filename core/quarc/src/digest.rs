//! The serialized state, its digest and its CRC: SPEC 9.

use crate::error::{Error, Reject, Result};
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
        let mut digest = Sha256::new();
        self.write(true, |bytes| digest.update(bytes));
        digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// The CRC of the serialization, with or without the codes (SPEC 9.2).
    #[must_use]
    pub fn crc(&self, with_codes: bool) -> u32 {
        let mut crc = crc32fast::Hasher::new();
        self.write(with_codes, |bytes| crc.update(bytes));
        crc.finalize()
    }

    /// Pass on the serialized bytes in pieces.
    fn write(&self, with_codes: bool, mut to: impl FnMut(&[u8])) {
        let head = [self.ids.len() as u32, self.phase];
        write(&head, |&number| number.to_le_bytes(), &mut to);
        write(self.ids, |&id| id.to_le_bytes(), &mut to);
        write_rows(self.positions, |&number| number.to_le_bytes(), &mut to);
        write_rows(self.rotations, |&number| number.to_le_bytes(), &mut to);
        if with_codes {
            write_rows(self.codes, |&code| i32::from(code).to_le_bytes(), &mut to);
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

fn write_rows<T: Copy + Default>(
    rows: &Rows<T>,
    bytes_of: impl Fn(&T) -> [u8; 4],
    to: &mut impl FnMut(&[u8]),
) {
    for row in 0..rows.rows() {
        write(rows.row(row), &bytes_of, to);
    }
}

/// Serialize numbers in blocks.
fn write<T>(numbers: &[T], bytes_of: impl Fn(&T) -> [u8; 4], to: &mut impl FnMut(&[u8])) {
    let mut bytes = [0; 4 * BLOCK];
    for block in numbers.chunks(BLOCK) {
        for (bytes, number) in bytes.chunks_exact_mut(4).zip(block) {
            bytes.copy_from_slice(&bytes_of(number));
        }
        to(&bytes[..4 * block.len()]);
    }
}
