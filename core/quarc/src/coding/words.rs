//! Bits to words and back, by asymmetric numeral systems (ANS): SPEC 8.3.

use super::probability::WEIGHT_BITS;
use crate::error::{Error, Reject, Result};

const WEIGHT_TOTAL: u64 = 1 << WEIGHT_BITS;
const WORD_BITS: u32 = 32;

/// Decodes bits from the words of a section.
#[derive(Clone, Copy, Debug)]
pub struct WordReader<'a> {
    state: u64,
    words: &'a [u32],
}

impl<'a> WordReader<'a> {
    /// Start with the words of a section.
    ///
    /// # Errors
    /// `invalid-words`: the last word is 0.
    pub fn new(words: &'a [u32]) -> Result<Self> {
        match words.split_last() {
            // [8.3-1]
            Some((0, _)) => Err(Error::new(Reject::InvalidWords, "the last word is 0")),
            Some((&last, words)) => Ok(WordReader { state: u64::from(last), words }),
            None => Ok(WordReader { state: 0, words }),
        }
    }

    /// Decode a bit; `weight` is that of a 1, of 2^24.
    #[inline]
    pub fn take(&mut self, weight: u32) -> bool {
        if self.state >> WORD_BITS == 0 {
            if let Some((&word, rest)) = self.words.split_last() {
                self.state = self.state << WORD_BITS | u64::from(word);
                self.words = rest;
            }
        }
        let one = u64::from(weight);
        let zero = WEIGHT_TOTAL - one;
        let (high, part) = (self.state >> WEIGHT_BITS, self.state & (WEIGHT_TOTAL - 1));
        let bit = part >= zero;
        // Compute both outcomes first: a branch here would often be mispredicted.
        let if_zero = high * zero + part;
        let if_one = (high * one + part).wrapping_sub(zero);
        self.state = if bit { if_one } else { if_zero };
        bit
    }

    /// End the section.
    ///
    /// # Errors
    /// `unconsumed-words`: words or state are left.
    pub fn finish(&self) -> Result<()> {
        // [8.3-2] [8.3-3]
        if self.state != 0 || !self.words.is_empty() {
            return Err(Error::new(Reject::UnconsumedWords, "words are left after the last bit"));
        }
        Ok(())
    }
}

/// Consecutive bits of the same weight in a section.
#[derive(Clone, Copy, Debug)]
pub struct WeighedBits<'a> {
    /// Weight of a 1, of 2^24.
    pub weight: u32,
    /// In decoding order.
    pub bits: &'a [bool],
}

/// Encode bits to words, in the order in which a section stores them.
#[must_use]
pub fn encode_bits<'a>(runs: impl DoubleEndedIterator<Item = WeighedBits<'a>>) -> Vec<u32> {
    let mut state = 0u64;
    let mut words = Vec::new();
    for run in runs.rev() {
        let one = u64::from(run.weight);
        let zero = WEIGHT_TOTAL - one;
        for &bit in run.bits.iter().rev() {
            let (left, share) = if bit { (zero, one) } else { (0, zero) };
            if state >> (2 * WORD_BITS - WEIGHT_BITS) >= share {
                words.push(state as u32);
                state >>= WORD_BITS;
            }
            state = (state / share) << WEIGHT_BITS | (left + state % share);
        }
    }
    while state > 0 {
        words.push(state as u32);
        state >>= WORD_BITS;
    }
    words
}
