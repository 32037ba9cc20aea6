//! Planes of bits in contexts, and the sections that hold them: SPEC 8.1.
//!
//! A walk over the planes of a section is written once for both directions. A [`PlaneWriter`]
//! encodes the bits that are passed in; a [`PlaneReader`] overwrites them with the bits of the
//! section. The walk passes in what it has and continues with what it gets back.

use super::counts::{Counts, Model};
use super::probability::{
    choose_code, is_worth_stating, weight_of_code, CODE_BITS, EVEN_WEIGHT, STATED_WEIGHT,
};
use super::sorting::{Run, Sorted};
use super::words::{encode_bits, WeighedBits, WordReader};
use crate::error::Result;
use crate::records::Section;

/// The bits of a plane whose elements are sorted by context.
pub trait Answers {
    /// Append the bits of a run that are to be written.
    fn known(&self, run: Run, bits: &mut Vec<bool>);

    /// Store the bits of a run, in the order of its elements, and return how many are 1.
    fn take(&mut self, run: Run, next: impl FnMut() -> bool) -> u64;
}

/// One direction of a walk over planes.
pub trait Planes: Send {
    /// Whether this direction writes.
    const WRITES: bool;

    /// Code a plane by its runs, which are not empty and ascend in context.
    ///
    /// # Errors
    /// Those of reading the section.
    fn code_runs(&mut self, model: Model, runs: &[Run], answers: &mut impl Answers) -> Result<()>;

    /// Code bits with probability 1/2, without contexts.
    ///
    /// # Errors
    /// Those of reading the section.
    fn code_raw(&mut self, bits: &mut [bool]) -> Result<()>;

    /// Code a plane; `contexts` and `bits` have one entry per element.
    ///
    /// # Errors
    /// Those of reading the section.
    fn code(&mut self, model: Model, contexts: &[u16], bits: &mut [bool]) -> Result<()> {
        let mut sorted = std::mem::take(self.spare());
        sorted.sort(contexts);
        let answers = &mut Scattered { order: &sorted.order, bits };
        self.code_runs(model, &sorted.runs, answers)?;
        *self.spare() = sorted;
        Ok(())
    }

    /// The bits of the elements when writing; a buffer for them when reading.
    fn known<T>(elements: &[T], bit: impl Fn(&T) -> bool) -> Vec<bool> {
        if Self::WRITES {
            elements.iter().map(bit).collect()
        } else {
            vec![false; elements.len()]
        }
    }

    /// Buffers that are reused from plane to plane.
    fn spare(&mut self) -> &mut Sorted;
}

/// Bits in the order of the elements, which are not sorted by context.
struct Scattered<'a> {
    order: &'a [u32],
    bits: &'a mut [bool],
}

impl Answers for Scattered<'_> {
    fn known(&self, run: Run, bits: &mut Vec<bool>) {
        bits.extend(self.order[run.range()].iter().map(|&element| self.bits[element as usize]));
    }

    fn take(&mut self, run: Run, mut next: impl FnMut() -> bool) -> u64 {
        let mut ones = 0;
        for &element in &self.order[run.range()] {
            let bit = next();
            self.bits[element as usize] = bit;
            ones += u64::from(bit);
        }
        ones
    }
}

/// Reads the planes of a section.
#[derive(Debug)]
pub struct PlaneReader<'a> {
    words: WordReader<'a>,
    counts: &'a mut Counts,
    weights: Vec<u32>,
    spare: Sorted,
}

impl<'a> PlaneReader<'a> {
    /// Start a section; the counts are updated in place.
    ///
    /// # Errors
    /// `invalid-words`.
    pub fn new(section: &'a Section, counts: &'a mut Counts) -> Result<Self> {
        let (words, weights) = (WordReader::new(section)?, Vec::new());
        Ok(PlaneReader { words, counts, weights, spare: Sorted::default() })
    }

    /// End the section.
    ///
    /// # Errors
    /// `unconsumed-words`.
    pub fn finish(&self) -> Result<()> {
        self.words.finish()
    }

    /// Read which probabilities are stated and derive the others: `weights` gets one per run.
    fn weigh(&mut self, model: Model, runs: &[Run]) -> Result<()> {
        const STATED: u32 = 0; // no valid weight of a 1 is 0
        self.weights.clear();
        for run in runs {
            let stated = self.words.take(STATED_WEIGHT);
            let known = self.counts.of(model, run.context).weight();
            self.weights.push(if stated { STATED } else { known });
        }
        for weight in self.weights.iter_mut().filter(|weight| **weight == STATED) {
            let words = &mut self.words;
            let code =
                (0..CODE_BITS).fold(0, |code, _| code << 1 | u8::from(words.take(EVEN_WEIGHT)));
            *weight = weight_of_code(code)?;
        }
        Ok(())
    }
}

impl Planes for PlaneReader<'_> {
    const WRITES: bool = false;

    fn code_runs(&mut self, model: Model, runs: &[Run], answers: &mut impl Answers) -> Result<()> {
        self.weigh(model, runs)?;
        for (run, &weight) in runs.iter().zip(&self.weights) {
            let mut words = self.words; // a copy, so that it stays in registers
            let ones = answers.take(*run, || words.take(weight));
            self.words = words;
            self.counts.learn(model, run.context, run.range().len() as u64 - ones, ones);
        }
        Ok(())
    }

    fn code_raw(&mut self, bits: &mut [bool]) -> Result<()> {
        let mut words = self.words;
        bits.iter_mut().for_each(|bit| *bit = words.take(EVEN_WEIGHT));
        self.words = words;
        Ok(())
    }

    fn spare(&mut self) -> &mut Sorted {
        &mut self.spare
    }
}

/// Collects planes and encodes them as a section.
#[derive(Debug)]
pub struct PlaneWriter {
    counts: Counts,
    bits: Vec<bool>,
    // The weight of bits, and where they end.
    runs: Vec<(u32, usize)>,
    spare: Sorted,
}

impl PlaneWriter {
    /// Start a section that continues from these counts.
    #[must_use]
    pub fn new(counts: Counts) -> Self {
        PlaneWriter { counts, bits: Vec::new(), runs: Vec::new(), spare: Sorted::default() }
    }

    /// The section of all planes written.
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

    /// For a context with these bits, choose the weight, and the code to state if it pays.
    fn choose(&self, model: Model, context: u32, zeros: u64, ones: u64) -> (u32, Option<u8>) {
        let (code, fitting) = choose_code(ones, zeros + ones);
        let known = self.counts.of(model, context).weight();
        if is_worth_stating(zeros, ones, known, fitting) {
            (fitting, Some(code))
        } else {
            (known, None)
        }
    }
}

impl Planes for PlaneWriter {
    const WRITES: bool = true;

    fn code_runs(&mut self, model: Model, runs: &[Run], answers: &mut impl Answers) -> Result<()> {
        let (mut bits, mut weights, mut codes) = (Vec::new(), Vec::new(), Vec::new());
        for run in runs {
            let begin = bits.len();
            answers.known(*run, &mut bits);
            let ones = bits[begin..].iter().filter(|&&bit| bit).count() as u64;
            let zeros = run.range().len() as u64 - ones;
            let (weight, code) = self.choose(model, run.context, zeros, ones);
            weights.push(weight);
            codes.push(code);
            self.counts.learn(model, run.context, zeros, ones);
        }
        self.push(STATED_WEIGHT, codes.iter().map(Option::is_some));
        for &code in codes.iter().flatten() {
            self.push(EVEN_WEIGHT, (0..CODE_BITS).rev().map(|place| code >> place & 1 == 1));
        }
        let mut left = bits.into_iter();
        for (run, weight) in runs.iter().zip(weights) {
            let own: Vec<bool> = left.by_ref().take(run.range().len()).collect();
            let mut given = own.iter().copied();
            answers.take(*run, || given.next() == Some(true));
            self.push(weight, own);
        }
        Ok(())
    }

    fn code_raw(&mut self, bits: &mut [bool]) -> Result<()> {
        self.push(EVEN_WEIGHT, bits.iter().copied());
        Ok(())
    }

    fn spare(&mut self) -> &mut Sorted {
        &mut self.spare
    }
}
