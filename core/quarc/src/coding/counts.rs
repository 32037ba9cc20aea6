//! Adaptive bit counts of contexts, and the probabilities derived from them: SPEC 8.2.

use super::probability::WEIGHT_BITS;

const COUNT_LIMIT: u64 = 4096;

/// Counts of zeros and ones in a context.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    /// Number of 0 bits.
    pub zeros: u16,
    /// Number of 1 bits.
    pub ones: u16,
}

impl Seen {
    /// The weight of a 1 bit, of 2^24.
    #[must_use]
    pub const fn weight(self) -> u32 {
        let (zeros, ones) = (self.zeros as u64, self.ones as u64);
        (((2 * ones + 1) << WEIGHT_BITS) / (2 * (zeros + ones) + 2)) as u32
    }

    /// The counts after a plane with these zeros and ones.
    #[must_use]
    pub const fn after(self, zeros: u64, ones: u64) -> Seen {
        let (mut zeros, mut ones) = (self.zeros as u64 + zeros, self.ones as u64 + ones);
        while zeros + ones > COUNT_LIMIT {
            zeros /= 2;
            ones /= 2;
        }
        Seen { zeros: zeros as u16, ones: ones as u16 }
    }
}

/// A model: the index of its first context in [`Counts`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Model {
    first: usize,
}

impl Model {
    /// The model whose context 0 is at this index.
    #[must_use]
    pub const fn at(first: usize) -> Model {
        Model { first }
    }
}

/// The counts of all contexts of the models that belong together, model after model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Counts(Vec<Seen>);

impl Counts {
    /// Counts in their initial state.
    #[must_use]
    pub fn new(contexts: usize) -> Self {
        Counts(vec![Seen::default(); contexts])
    }

    /// The counts of a context of a model.
    ///
    /// # Panics
    /// If the context does not exist.
    #[must_use]
    pub fn of(&self, model: Model, context: u32) -> Seen {
        self.0[model.first + context as usize]
    }

    /// Add the zeros and ones of a plane to a context.
    ///
    /// # Panics
    /// If the context does not exist.
    pub fn learn(&mut self, model: Model, context: u32, zeros: u64, ones: u64) {
        let seen = &mut self.0[model.first + context as usize];
        *seen = seen.after(zeros, ones);
    }
}
