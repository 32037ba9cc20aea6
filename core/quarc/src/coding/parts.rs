//! Code the numbers of a sequence as the planes of SPEC 8.4.
//!
//! The context of a bit is what is already known about its number. Numbers with the same context
//! are therefore kept adjacent: each bit splits such a part in two, and nothing is sorted again.

use super::counts::Model;
use super::planes::{Answers, Planes};
use super::sequence::{Form, Sequence, MODELLED_BITS};
use super::sorting::{Run, Sorted};
use crate::arithmetic::bit_length;
use crate::error::Result;

/// A range of numbers about which the same is known.
#[derive(Clone, Copy)]
struct Part {
    first: u32,
    last: u32,
    /// The outer context at first, then the context of 8.4.
    context: u32,
    /// Bit length, once known.
    class: u32,
    /// The known bits, after a leading 1.
    known: u32,
}

/// The planes of a sequence, coded one after the other.
pub struct Walk<'a, P> {
    planes: &'a mut P,
    sequence: &'a Sequence,
    numbers: &'a mut [i64],
    /// The indices of the numbers, grouped by part.
    order: Vec<u32>,
    parts: Vec<Part>,
    bits: Vec<bool>,
    spare: Vec<u32>,
}

impl<'a, P: Planes> Walk<'a, P> {
    /// Start with numbers that each have an outer context.
    pub fn begin(
        planes: &'a mut P,
        sequence: &'a Sequence,
        contexts: &[u16],
        numbers: &'a mut [i64],
    ) -> Self {
        let mut elements = Sorted::default();
        elements.sort(contexts);
        let Sorted { order, runs, .. } = elements;
        let part = |run: &Run| Part {
            first: run.first,
            last: run.last,
            context: run.context,
            class: 0,
            known: 1,
        };
        let parts = runs.iter().map(part).collect();
        let (bits, spare) = (vec![false; order.len()], vec![0; order.len()]);
        Walk { planes, sequence, numbers, order, parts, bits, spare }
    }

    /// Code all planes, in place.
    pub fn code(mut self) -> Result<()> {
        self.code_classes()?;
        if self.sequence.form == Form::Signed {
            self.code_signs()?;
        }
        if self.sequence.form != Form::Fixed {
            self.code_mantissas()?;
            self.code_rest()?;
        }
        Ok(())
    }

    /// Code bit lengths, or the numbers themselves if the form is Fixed.
    fn code_classes(&mut self) -> Result<()> {
        let (width, fixed) = (self.sequence.width, self.sequence.form == Form::Fixed);
        for place in (0..width).rev() {
            self.code_bit(
                self.sequence.class,
                |_| true,
                |part| (part.context << width) + part.known,
                |_, number| {
                    let class = u64::from(bit_length(number.unsigned_abs()));
                    (if fixed { number as u64 } else { class }) >> place & 1 == 1
                },
            )?;
        }
        for part in &mut self.parts {
            part.class = part.known - (1 << width);
            part.context = (part.context << width) + part.class;
            part.known = u32::from(part.class > 0);
        }
        if fixed && !P::WRITES {
            for part in &self.parts {
                for &element in &self.order[part.first as usize..part.last as usize] {
                    self.numbers[element as usize] = i64::from(part.class);
                }
            }
        }
        Ok(())
    }

    /// Code the signs of nonzero numbers, and append them to the contexts.
    fn code_signs(&mut self) -> Result<()> {
        let there = |part: &Part| part.class > 0;
        self.code_bit(self.sequence.sign, there, |part| part.context, |_, number| number < 0)?;
        for part in &mut self.parts {
            let negative = there(part) && part.known & 1 == 1;
            part.context = 2 * part.context + u32::from(negative);
            part.known = u32::from(part.class > 0);
        }
        Ok(())
    }

    /// Code the first bits below the leading 1, in contexts.
    fn code_mantissas(&mut self) -> Result<()> {
        for depth in 0..MODELLED_BITS {
            self.code_bit(
                self.sequence.mantissa,
                |part| part.class > depth + 1,
                |part| (part.context << MODELLED_BITS) + part.known,
                |part, number| number.unsigned_abs() >> (part.class - 2 - depth) & 1 == 1,
            )?;
        }
        Ok(())
    }

    /// Code the remaining, raw bits in the order of the sequence.
    fn code_rest(&mut self) -> Result<()> {
        let signed = self.sequence.form == Form::Signed;
        let mut classes = vec![0u8; self.numbers.len()];
        for part in &self.parts {
            let known = i64::from(part.known);
            let negative = signed && part.context & 1 == 1;
            for &element in &self.order[part.first as usize..part.last as usize] {
                classes[element as usize] = part.class as u8;
                if !P::WRITES {
                    self.numbers[element as usize] = if negative { -known } else { known };
                }
            }
        }
        let greatest = u32::from(classes.iter().max().copied().unwrap_or(0));
        let mut left: Vec<u32> = (0..classes.len() as u32).collect();
        for depth in MODELLED_BITS..greatest.max(1) - 1 {
            left.retain(|&element| u32::from(classes[element as usize]) > depth + 1);
            self.code_raw_bit(&left, &classes, depth)?;
        }
        Ok(())
    }

    fn code_raw_bit(&mut self, left: &[u32], classes: &[u8], depth: u32) -> Result<()> {
        let bits = &mut self.bits[..left.len()];
        if P::WRITES {
            for (bit, &element) in bits.iter_mut().zip(left) {
                let magnitude = self.numbers[element as usize].unsigned_abs();
                *bit = magnitude >> (u32::from(classes[element as usize]) - 2 - depth) & 1 == 1;
            }
        }
        self.planes.code_raw(bits)?;
        if !P::WRITES {
            for (&bit, &element) in bits.iter().zip(left) {
                let number = &mut self.numbers[element as usize];
                *number = 2 * *number + number.signum() * i64::from(bit);
            }
        }
        Ok(())
    }

    /// Code one bit of the numbers of the selected parts, append it to `known`, and split the
    /// parts.
    fn code_bit(
        &mut self,
        model: usize,
        asked: impl Fn(&Part) -> bool,
        context: impl Fn(&Part) -> u32,
        bit_of: impl Fn(&Part, i64) -> bool,
    ) -> Result<()> {
        let mut runs = Vec::with_capacity(self.parts.len());
        for part in self.parts.iter().filter(|part| asked(part)) {
            let run = Run { context: context(part), first: part.first, last: part.last };
            runs.push(run);
            if P::WRITES {
                for (bit, &element) in
                    self.bits[run.range()].iter_mut().zip(&self.order[run.range()])
                {
                    *bit = bit_of(part, self.numbers[element as usize]);
                }
            }
        }
        let mut zeros = Vec::with_capacity(runs.len());
        let Walk { order, bits, spare, .. } = self;
        let answers = &mut Parting { order, bits, spare, zeros: &mut zeros };
        self.planes.code_runs(Model::at(model), &runs, answers)?;
        let mut parts = Vec::with_capacity(2 * self.parts.len());
        let mut zeros = zeros.into_iter();
        for part in &self.parts {
            if !asked(part) {
                parts.push(*part);
                continue;
            }
            let middle = part.first + zeros.next().unwrap_or(0);
            let halves = [(part.first, middle, 0), (middle, part.last, 1)];
            for (first, last, bit) in halves.iter().copied().filter(|half| half.0 < half.1) {
                parts.push(Part { first, last, known: 2 * part.known + bit, ..*part });
            }
        }
        self.parts = parts;
        Ok(())
    }
}

/// Reorders the elements of each run by their bit: zeros first, otherwise stable.
struct Parting<'a> {
    order: &'a mut [u32],
    /// The bits to write, in the previous order.
    bits: &'a [bool],
    spare: &'a mut [u32],
    /// The number of zeros in each run.
    zeros: &'a mut Vec<u32>,
}

impl Answers for Parting<'_> {
    fn known(&self, run: Run, bits: &mut Vec<bool>) {
        bits.extend_from_slice(&self.bits[run.range()]);
    }

    fn take(&mut self, run: Run, mut next: impl FnMut() -> bool) -> u64 {
        let (order, spare) = (&mut self.order[run.range()], &mut self.spare[run.range()]);
        let (mut zeros, mut ones) = (0, 0);
        for place in 0..order.len() {
            let (element, bit) = (order[place], next());
            order[zeros] = element;
            spare[ones] = element;
            zeros += usize::from(!bit);
            ones += usize::from(bit);
        }
        order[zeros..].copy_from_slice(&spare[..ones]);
        self.zeros.push(zeros as u32);
        ones as u64
    }
}
