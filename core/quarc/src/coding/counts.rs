//! What contexts have seen so far, and the probability that follows: SPEC 8.2.

use super::probability::WEIGHT_BITS;

const COUNT_LIMIT: u64 = 4096;

/// The zeros and ones that a context has had.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    /// How many bits were 0.
    pub zeros: u16,
    /// How many were 1.
    pub ones: u16,
}

impl Seen {
    /// The weight of a 1, of 2^24.
    #[must_use]
    pub const fn weight(self) -> u32 {
        let (zeros, ones) = (self.zeros as u64, self.ones as u64);
        (((2 * ones + 1) << WEIGHT_BITS) / (2 * (zeros + ones) + 2)) as u32
    }

    /// Add what a plane has shown.
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

/// A model: where its contexts begin in [`Counts`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Model {
    first: usize,
}

impl Model {
    /// The model whose context 0 is this one of all.
    #[must_use]
    pub const fn at(first: usize) -> Model {
        Model { first }
    }
}

/// The counts of all contexts of the models that belong together, one model after the other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Counts(Vec<Seen>);

impl Counts {
    /// Contexts that have seen nothing.
    #[must_use]
    pub fn new(contexts: usize) -> Self {
        Counts(vec![Seen::default(); contexts])
    }

    /// What a context of a model has seen.
    ///
    /// # Panics
    /// If there is no such context.
    #[must_use]
    pub fn of(&self, model: Model, context: u32) -> Seen {
        self.0[model.first + context as usize]
    }

    /// Add what a plane has shown in a context.
    ///
    /// # Panics
    /// If there is no such context.
    pub fn learn(&mut self, model: Model, context: u32, zeros: u64, ones: u64) {
        let seen = &mut self.0[model.first + context as usize];
        *seen = seen.after(zeros, ones);
    }
}
