//! Rows of numbers as sequences: SPEC 8.5, 8.6, 8.9.

use super::numbers::code_numbers;
use super::planes::Planes;
use super::sequence::Sequence;
use crate::arithmetic::bit_length;
use crate::constants::CODE_LIMIT;
use crate::error::{Error, Result};

/// Number of classes of the sum of the preceding rows, where it is the context.
pub const REST_CLASSES: usize = 8;

/// Code rows as one sequence, row after row, in place; the outer context is the row number.
pub fn code_rows<P: Planes>(
    planes: &mut P,
    sequence: &Sequence,
    rows: &mut [Vec<i32>],
) -> Result<()> {
    code_joined(planes, sequence, rows, |row| row as u16)
}

/// Code rows as one sequence, row after row, in place; all in outer context 0.
pub fn code_alike<P: Planes>(
    planes: &mut P,
    sequence: &Sequence,
    rows: &mut [Vec<i32>],
) -> Result<()> {
    code_joined(planes, sequence, rows, |_| 0)
}

fn code_joined<P: Planes>(
    planes: &mut P,
    sequence: &Sequence,
    rows: &mut [Vec<i32>],
    context: impl Fn(usize) -> u16,
) -> Result<()> {
    let mut contexts = Vec::new();
    for (number, row) in rows.iter().enumerate() {
        contexts.resize(contexts.len() + row.len(), context(number));
    }
    let mut numbers: Vec<i64> = rows.iter().flatten().map(|&number| i64::from(number)).collect();
    require_within::<P>(&numbers)?;
    code_numbers(planes, sequence, &contexts, &mut numbers)?;
    for (to, number) in rows.iter_mut().flatten().zip(numbers) {
        *to = number as i32;
    }
    Ok(())
}

/// Code each row as its own sequence, in place, in outer contexts from row `first` on. The sum of
/// magnitudes of the preceding rows is part of the context.
pub fn code_one_by_one<P: Planes>(
    planes: &mut P,
    sequence: &Sequence,
    first: usize,
    rows: &mut [Vec<i32>],
) -> Result<()> {
    let count = rows.first().map_or(0, Vec::len);
    let mut so_far = vec![0u32; count];
    for (number, row) in rows.iter_mut().enumerate() {
        let class = |&sum: &u32| bit_length(u64::from(sum)).min(REST_CLASSES as u32 - 1) as u16;
        let begin = (REST_CLASSES * (first + number)) as u16;
        let contexts: Vec<u16> = so_far.iter().map(|sum| begin + class(sum)).collect();
        let mut numbers: Vec<i64> = row.iter().map(|&number| i64::from(number)).collect();
        require_within::<P>(&numbers)?;
        code_numbers(planes, sequence, &contexts, &mut numbers)?;
        for ((to, sum), number) in row.iter_mut().zip(&mut so_far).zip(numbers) {
            *to = number as i32;
            *sum += to.unsigned_abs();
        }
    }
    Ok(())
}

/// When writing, check that the numbers fit into `Signed(CLASS_BITS)`.
pub fn require_within<P: Planes>(numbers: &[i64]) -> Result<()> {
    let beyond = |number: &i64| number.unsigned_abs() > CODE_LIMIT as u64;
    if P::WRITES && numbers.iter().any(beyond) {
        let message = format!("two numbers of a Gaussian are more than {CODE_LIMIT} apart");
        return Err(Error::Encode(message));
    }
    Ok(())
}
