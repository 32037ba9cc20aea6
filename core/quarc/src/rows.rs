//! Rows of equal length in one allocation: the memory layout of a state's planes (SPEC 7.1).

use crate::parallel::each;
use std::ops::Range;

/// Rows of equal length in one allocation, with room for more columns after each.
///
/// A row begins `stride` numbers after the previous one, so that bindings can expose the rows
/// without a copy.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Rows<T> {
    numbers: Vec<T>,
    rows: usize,
    columns: usize,
    stride: usize,
}

impl<T: Copy + Default> Rows<T> {
    /// Rows of zeros, with room for `room` more columns.
    #[must_use]
    pub fn zeros(rows: usize, columns: usize, room: usize) -> Self {
        let stride = columns + room;
        Rows { numbers: vec![T::default(); rows * stride], rows, columns, stride }
    }

    /// Number of rows.
    #[must_use]
    pub const fn rows(&self) -> usize {
        self.rows
    }

    /// Length of each row.
    #[must_use]
    pub const fn columns(&self) -> usize {
        self.columns
    }

    /// Distance between the starts of consecutive rows, in numbers.
    #[must_use]
    pub const fn stride(&self) -> usize {
        self.stride
    }

    /// All numbers, including the room after each row.
    #[must_use]
    pub fn numbers(&self) -> &[T] {
        &self.numbers
    }

    /// A row.
    ///
    /// # Panics
    /// If the row does not exist.
    #[must_use]
    pub fn row(&self, row: usize) -> &[T] {
        &self.numbers[row * self.stride..][..self.columns]
    }

    /// A mutable row.
    ///
    /// # Panics
    /// If the row does not exist.
    pub fn row_mut(&mut self, row: usize) -> &mut [T] {
        &mut self.numbers[row * self.stride..][..self.columns]
    }

    /// All rows, mutable.
    pub fn rows_mut(&mut self) -> impl Iterator<Item = &mut [T]> {
        let columns = self.columns;
        self.numbers.chunks_mut(self.stride.max(1)).map(move |row| &mut row[..columns])
    }

    /// The first `R` rows, mutable.
    ///
    /// # Panics
    /// If there are fewer.
    pub fn first_mut<const R: usize>(&mut self) -> [&mut [T]; R] {
        let mut rows = self.rows_mut();
        [(); R].map(|()| rows.next().expect("at least R rows"))
    }

    /// Remove the columns at ascending indices; the others keep their order.
    pub fn remove(&mut self, gone: &[u32]) {
        let columns = self.columns - gone.len();
        for row in self.rows_mut() {
            let mut to = 0;
            for kept in kept_ranges(gone, row.len()) {
                let length = kept.len();
                if to < kept.start {
                    row.copy_within(kept, to);
                }
                to += length;
            }
        }
        self.columns = columns;
    }

    /// Make other rows a copy without the columns at ascending indices.
    pub fn copy_without(&self, gone: &[u32], others: &mut Self)
    where
        T: Send + Sync,
    {
        let mut numbers = std::mem::take(&mut others.numbers);
        numbers.resize(self.numbers.len(), T::default());
        let rows = numbers.chunks_mut(self.stride.max(1)).enumerate().collect();
        each(rows, &|(row, mut to)| {
            for kept in kept_ranges(gone, self.columns) {
                let (copied, rest) = to.split_at_mut(kept.len());
                copied.copy_from_slice(&self.row(row)[kept]);
                to = rest;
            }
        });
        *others = Rows { numbers, columns: self.columns - gone.len(), ..*self };
    }

    /// Append columns of zeros, in place if there is room.
    pub fn grow(&mut self, columns: usize) {
        if self.columns + columns > self.stride {
            let room = columns + (self.columns + columns) / 16;
            let mut wider = Rows::zeros(self.rows, self.columns, room);
            for row in 0..self.rows {
                wider.row_mut(row).copy_from_slice(self.row(row));
            }
            *self = wider;
        }
        let old = self.columns;
        self.columns += columns;
        for row in self.rows_mut() {
            row[old..].fill(T::default());
        }
    }
}

// Derived, it would not reuse the memory of the copy.
impl<T: Clone> Clone for Rows<T> {
    fn clone(&self) -> Self {
        Rows { numbers: self.numbers.clone(), ..*self }
    }

    fn clone_from(&mut self, rows: &Self) {
        let mut numbers = std::mem::take(&mut self.numbers);
        numbers.clone_from(&rows.numbers);
        *self = Rows { numbers, ..*rows };
    }
}

/// Make other numbers a copy without the entries at ascending indices.
pub fn copy_without<T: Copy>(numbers: &[T], gone: &[u32], others: &mut Vec<T>) {
    others.clear();
    others.reserve(numbers.len());
    kept_ranges(gone, numbers.len()).for_each(|kept| others.extend_from_slice(&numbers[kept]));
}

/// Remove the entries at ascending indices; the others keep their order.
pub fn remove_entries<T: Copy>(numbers: &mut Vec<T>, gone: &[u32]) {
    let mut to = 0;
    for kept in kept_ranges(gone, numbers.len()) {
        let length = kept.len();
        if to < kept.start {
            numbers.copy_within(kept, to);
        }
        to += length;
    }
    numbers.truncate(to);
}

/// Converts ascending indices after a removal to the indices before it; `gone` are the removed
/// ones, ascending.
pub fn before_removal(gone: &[u32]) -> impl FnMut(usize) -> usize + '_ {
    let mut passed = 0;
    move |index| {
        while gone.get(passed).map_or(false, |&gone| gone as usize <= index + passed) {
            passed += 1;
        }
        index + passed
    }
}

/// The ranges between the ascending indices to be removed.
pub fn kept_ranges(gone: &[u32], columns: usize) -> impl Iterator<Item = Range<usize>> + '_ {
    let begins = std::iter::once(0).chain(gone.iter().map(|&index| index as usize + 1));
    let ends = gone.iter().map(|&index| index as usize).chain(std::iter::once(columns));
    begins.zip(ends).map(|(begin, end)| begin..end)
}
