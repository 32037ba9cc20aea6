//! Integers as planes of bits: SPEC 8.4.

use super::parts::Walk;
use super::planes::Planes;
use super::sequence::Sequence;
use crate::error::{Error, Reject, Result};

const STEP_LIMIT: i64 = 1 << 60;

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
