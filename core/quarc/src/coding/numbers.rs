//! Integers as planes of bits: SPEC 8.4.

use super::parts::Walk;
use super::planes::Planes;
use crate::error::{Error, Reject, Result};

/// Bits of the class of most numbers.
pub const CLASS_BITS: u32 = 4;
/// Bits of the class of a difference of ascending numbers.
pub const KEY_CLASS_BITS: u32 = 6;

pub(super) const MODELLED_BITS: u32 = 2;
const STEP_LIMIT: i64 = 1 << 60;

/// The form of the numbers of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    Fixed,
    Unsigned,
    Signed,
}

/// The models of a sequence of numbers, its form and its width.
#[derive(Clone, Copy, Debug)]
pub struct Sequence {
    pub(super) form: Form,
    pub(super) width: u32,
    pub(super) class: usize,
    pub(super) sign: usize,
    pub(super) mantissa: usize,
    end: usize,
}

impl Sequence {
    /// A sequence of numbers below 2^`width`, in `outer` outer contexts.
    ///
    /// Here and below, `first` is the index in [`super::counts::Counts`] of the first context of
    /// the sequence.
    #[must_use]
    pub const fn fixed(first: usize, outer: usize, width: u32) -> Self {
        let end = first + (outer << width);
        Sequence { form: Form::Fixed, width, class: first, sign: end, mantissa: end, end }
    }

    /// A sequence of nonnegative numbers whose bit lengths have `width` bits.
    #[must_use]
    pub const fn unsigned(first: usize, outer: usize, width: u32) -> Self {
        let mantissa = first + (outer << width);
        let end = mantissa + (outer << (width + MODELLED_BITS));
        Sequence { form: Form::Unsigned, width, class: first, sign: mantissa, mantissa, end }
    }

    /// A sequence of signed numbers whose magnitudes have bit lengths of `width` bits.
    #[must_use]
    pub const fn signed(first: usize, outer: usize, width: u32) -> Self {
        let sign = first + (outer << width);
        let mantissa = sign + (outer << width);
        let end = mantissa + (outer << (width + MODELLED_BITS + 1));
        Sequence { form: Form::Signed, width, class: first, sign, mantissa, end }
    }

    /// The end of the contexts, at which those of the next sequence may begin.
    #[must_use]
    pub const fn end(&self) -> usize {
        self.end
    }
}

/// Code numbers in place, each in an outer context.
///
/// Written numbers are within the range of the sequence; when reading, the numbers are overwritten.
///
/// # Errors
/// Those of reading the section.
pub fn code_numbers<P: Planes>(
    planes: &mut P,
    sequence: &Sequence,
    contexts: &[u16],
    numbers: &mut [i64],
) -> Result<()> {
    if numbers.is_empty() {
        return Ok(());
    }
    Walk::begin(planes, sequence, contexts, numbers).code()
}

/// Code nonnegative numbers that do not descend, in place: the form Ascending.
///
/// # Errors
/// Those of reading the section; `symbol-range` if a difference is too large; `beyond` if a number
/// is above `most`, which is at most 2^61.
pub fn code_ascending<P: Planes>(
    planes: &mut P,
    sequence: &Sequence,
    numbers: &mut [i64],
    (most, beyond): (i64, Reject),
) -> Result<()> {
    for place in (1..numbers.len()).rev() {
        numbers[place] -= numbers[place - 1];
    }
    code_numbers(planes, sequence, &vec![0; numbers.len()], numbers)?;
    let mut sum = 0;
    for number in numbers {
        // [8.4-1]
        if *number > STEP_LIMIT {
            let message = format!("two numbers are {number} apart");
            return Err(Error::new(Reject::SymbolRange, message));
        }
        sum += *number;
        if sum > most {
            return Err(Error::new(beyond, format!("{sum} is above {most}, the greatest number")));
        }
        *number = sum;
    }
    Ok(())
}
