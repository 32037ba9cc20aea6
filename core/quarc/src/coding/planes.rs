//! Planes of bits in contexts, and the sections that hold them: SPEC 8.1.
//!
//! A walk over the planes of a section is written once, for both directions. A [`PlaneWriter`]
//! takes the answers that it is handed; a [`PlaneReader`] writes those of the section over them.
//! So a walk hands in what it knows, and goes on from what it is given back.

use super::counts::{count_bits, Counts, Model};
use super::probability::{
    choose_code, is_worth_stating, weight_of_code, CODE_BITS, EVEN_WEIGHT, STATED_WEIGHT,
};
use super::words::{encode_bits, WeighedBits, WordReader};
use crate::error::Result;
use crate::records::Section;

/// Elements of one context that stand side by side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// Of the plane's model.
    pub context: u32,
    /// Where they begin.
    pub first: u32,
    /// Where they end; after `first`.
    pub last: u32,
}

impl Run {
    /// Its elements among all.
    #[must_use]
    pub const fn range(self) -> std::ops::Range<usize> {
        self.first as usize..self.last as usize
    }
}

/// One direction of a walk over planes.
pub trait Planes {
    /// Whether bits are taken, and not given.
    const WRITES: bool;

    /// Code a plane whose elements stand by context.
    ///
    /// `runs` ascend in context and in place, and none of them is empty; `bits` has the answers
    /// of the elements in that order. Bits of elements of no run are left alone.
    ///
    /// # Errors
    /// Of the section that is read.
    fn code_runs(&mut self, model: Model, runs: &[Run], bits: &mut [bool]) -> Result<()>;

    /// Code bits that are as likely 0 as 1, without contexts.
    ///
    /// # Errors
    /// Of the section that is read.
    fn code_raw(&mut self, bits: &mut [bool]) -> Result<()>;

    /// Code a plane: `contexts` and `bits` have an entry to each element.
    ///
    /// # Errors
    /// Of the section that is read.
    fn code(&mut self, model: Model, contexts: &[u16], bits: &mut [bool]) -> Result<()> {
        let (order, runs) = sort_by_context(contexts);
        if runs.len() <= 1 {
            return self.code_runs(model, &runs, bits);
        }
        let mut sorted = vec![false; bits.len()];
        if Self::WRITES {
            for (&element, bit) in order.iter().zip(&mut sorted) {
                *bit = bits[element as usize];
            }
        }
        self.code_runs(model, &runs, &mut sorted)?;
        for (&element, bit) in order.iter().zip(sorted) {
            bits[element as usize] = bit;
        }
        Ok(())
    }
}

/// The elements by context, those of one context in their order, and where contexts begin.
#[must_use]
pub fn sort_by_context(contexts: &[u16]) -> (Vec<u32>, Vec<Run>) {
    let most = contexts.iter().max().map_or(0, |&most| usize::from(most));
    let mut places = vec![[0u32; LANES]; most + 1];
    for_each_in_turn(contexts.len(), |lane, element| {
        places[usize::from(contexts[element])][lane] += 1;
    });
    let (mut runs, mut first) = (Vec::new(), 0);
    for (context, lanes) in places.iter_mut().enumerate() {
        let mut last = first;
        for place in lanes {
            // From here on: where the next element goes.
            last += std::mem::replace(place, last);
        }
        if last > first {
            runs.push(Run { context: context as u32, first, last });
        }
        first = last;
    }
    let mut order = vec![0; contexts.len()];
    for_each_in_turn(contexts.len(), |lane, element| {
        let place = &mut places[usize::from(contexts[element])][lane];
        order[*place as usize] = element as u32;
        *place += 1;
    });
    (order, runs)
}

const LANES: usize = 4;

/// Visit elements in as many places in turn, so that none waits for what the one before writes.
fn for_each_in_turn(count: usize, mut visit: impl FnMut(usize, usize)) {
    let length = count / LANES + 1;
    for step in 0..length {
        for lane in 0..LANES {
            let element = lane * length + step;
            if element < count {
                visit(lane, element);
            }
        }
    }
}

/// Gives back the planes of a section.
#[derive(Debug)]
pub struct PlaneReader<'a> {
    words: WordReader<'a>,
    counts: &'a mut Counts,
    weights: Vec<u32>,
}

impl<'a> PlaneReader<'a> {
    /// Begin a section; the counts go on from what they are.
    ///
    /// # Errors
    /// `invalid-words`.
    pub fn new(section: &'a Section, counts: &'a mut Counts) -> Result<Self> {
        Ok(PlaneReader { words: WordReader::new(section)?, counts, weights: Vec::new() })
    }

    /// End the section.
    ///
    /// # Errors
    /// `unconsumed-words`.
    pub fn finish(&self) -> Result<()> {
        self.words.finish()
    }

    /// Read the code of a probability.
    fn take_code(&mut self) -> u8 {
        (0..CODE_BITS).fold(0, |code, _| code << 1 | u8::from(self.words.take(EVEN_WEIGHT)))
    }
}

impl Planes for PlaneReader<'_> {
    const WRITES: bool = false;

    fn code_runs(&mut self, model: Model, runs: &[Run], bits: &mut [bool]) -> Result<()> {
        const STATED: u32 = 0; // no weight of a 1 is 0
        self.weights.clear();
        for run in runs {
            let stated = self.words.take(STATED_WEIGHT);
            let known = self.counts.of(model, run.context).weight();
            self.weights.push(if stated { STATED } else { known });
        }
        for run in 0..runs.len() {
            if self.weights[run] == STATED {
                self.weights[run] = weight_of_code(self.take_code())?;
            }
        }
        for (run, &weight) in runs.iter().zip(&self.weights) {
            let answers = &mut bits[run.range()];
            self.words.take_run(weight, answers);
            self.counts.learn(model, run.context, answers);
        }
        Ok(())
    }

    fn code_raw(&mut self, bits: &mut [bool]) -> Result<()> {
        self.words.take_run(EVEN_WEIGHT, bits);
        Ok(())
    }
}

/// Gathers planes and makes a section of them.
#[derive(Debug)]
pub struct PlaneWriter {
    counts: Counts,
    bits: Vec<bool>,
    // The weight of bits, and where they end.
    runs: Vec<(u32, usize)>,
}

impl PlaneWriter {
    /// Begin a section; the counts go on from what they are.
    #[must_use]
    pub fn new(counts: Counts) -> Self {
        PlaneWriter { counts, bits: Vec::new(), runs: Vec::new() }
    }

    /// What was written.
    #[must_use]
    pub fn section(&self) -> Section {
        let begins = std::iter::once(0).chain(self.runs.iter().map(|&(_, end)| end));
        let runs: Vec<WeighedBits> = begins
            .zip(&self.runs)
            .map(|(begin, &(weight, end))| WeighedBits { weight, bits: &self.bits[begin..end] })
            .collect();
        encode_bits(runs.into_iter())
    }

    fn push(&mut self, weight: u32, bits: impl IntoIterator<Item = bool>) {
        self.bits.extend(bits);
        self.runs.push((weight, self.bits.len()));
    }

    /// The code that is to be stated for the bits of a context, if one is worth it.
    fn choose(&self, model: Model, context: u32, bits: &[bool]) -> Option<u8> {
        let (zeros, ones) = count_bits(bits);
        let code = choose_code(ones, zeros + ones);
        let fitting = weight_of_code(code).expect("one of those that there are");
        let known = self.counts.of(model, context).weight();
        is_worth_stating(zeros, ones, known, fitting).then_some(code)
    }
}

impl Planes for PlaneWriter {
    const WRITES: bool = true;

    fn code_runs(&mut self, model: Model, runs: &[Run], bits: &mut [bool]) -> Result<()> {
        let codes: Vec<Option<u8>> =
            runs.iter().map(|run| self.choose(model, run.context, &bits[run.range()])).collect();
        self.push(STATED_WEIGHT, codes.iter().map(Option::is_some));
        for &code in codes.iter().flatten() {
            self.push(EVEN_WEIGHT, (0..CODE_BITS).rev().map(|place| code >> place & 1 == 1));
        }
        for (run, code) in runs.iter().zip(codes) {
            let answers = &bits[run.range()];
            let weight = match code {
                Some(code) => weight_of_code(code)?,
                None => self.counts.of(model, run.context).weight(),
            };
            self.push(weight, answers.iter().copied());
            self.counts.learn(model, run.context, answers);
        }
        Ok(())
    }

    fn code_raw(&mut self, bits: &mut [bool]) -> Result<()> {
        self.push(EVEN_WEIGHT, bits.iter().copied());
        Ok(())
    }
}
