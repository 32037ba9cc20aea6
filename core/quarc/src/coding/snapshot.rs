//! Snapshots, which are canonical frames coded against an earlier one: SPEC 7.9.

use super::canonical::{
    order_of, read_canonical, require_even, require_writable, sort, take, write_canonical,
};
use super::grid::Grid;
use super::survivors::{can_survive, read_survivors, write_survivors};
use crate::error::{Error, Reject, Result};
use crate::records::{Gaussians, Section, SnapshotChunk};

/// The canonical index of a Gaussian that does not survive from the CANO.
pub const NEWBORN: i32 = -1;

/// The content of a SNAP chunk, and the resulting frame.
#[derive(Clone, Debug)]
pub struct CodedSnapshot {
    /// Number of new Gaussians, which are not in the CANO.
    pub newborn_count: u32,
    /// Bounding box of the new Gaussians.
    pub grid: Grid,
    /// Section of the survivors of the CANO.
    pub survivors: Section,
    /// Sections of the new Gaussians.
    pub sections: [Section; 6],
    /// All Gaussians, in the order of the frame.
    pub gaussians: Gaussians,
}

/// Encode Gaussians, in any order, against those of a CANO.
///
/// `canonical_indices` holds for each Gaussian its index in the CANO, or [`NEWBORN`]. Gaussians that
/// have changed too much since are coded as new.
///
/// # Errors
/// `Encode`: the frame is too wide, a number is out of range, or an index is invalid or used twice.
pub fn write_snapshot(
    canonical: &Gaussians,
    gaussians: &Gaussians,
    canonical_indices: &[i32],
) -> Result<CodedSnapshot> {
    require_writable(gaussians)?;
    require_even(canonical, gaussians.codes.len())?;
    let (survivors, newborn) = part(canonical, gaussians, canonical_indices)?;
    let kept: Vec<u32> =
        survivors.iter().map(|&place| canonical_indices[place as usize] as u32).collect();
    let survivors = take(gaussians, &survivors);
    let (grid, newborn) = sort(&take(gaussians, &newborn))?;
    let section = write_survivors(canonical, &kept, &survivors);
    let sections = write_canonical(&newborn, grid)?;
    let newborn_count = newborn.count() as u32;
    let (_, gaussians) = sort(&join(survivors, newborn))?;
    Ok(CodedSnapshot { newborn_count, grid, survivors: section, sections, gaussians })
}

/// The indices of the survivors, in the order of the CANO, and the indices of all others.
fn part(
    canonical: &Gaussians,
    gaussians: &Gaussians,
    canonical_indices: &[i32],
) -> Result<(Vec<u32>, Vec<u32>)> {
    let unfit =
        || Error::Encode("a survivor is not in the canonical frame, or occurs twice".into());
    if canonical_indices.len() != gaussians.count() {
        return Err(unfit());
    }
    let survives = |&place: &u32| {
        let index = canonical_indices[place as usize];
        index >= 0
            && (index as usize) < canonical.count()
            && can_survive(gaussians, place as usize, canonical, index as usize)
    };
    let all = 0..gaussians.count() as u32;
    let (mut survivors, newborn): (Vec<u32>, Vec<u32>) = all.partition(survives);
    survivors.sort_by_key(|&place| canonical_indices[place as usize]);
    if survivors
        .windows(2)
        .any(|pair| canonical_indices[pair[0] as usize] == canonical_indices[pair[1] as usize])
    {
        return Err(unfit());
    }
    Ok((survivors, newborn))
}

/// Decode a frame that is coded against a CANO: its Gaussians, in order, and for each its index in
/// the CANO or [`NEWBORN`].
///
/// `check` is called with the number of Gaussians before they are allocated.
///
/// # Errors
/// Those of reading the sections and of `check`; `symbol-range` if the frame is too wide;
/// `position-range`.
pub fn read_snapshot(
    chunk: &SnapshotChunk,
    canonical: &Gaussians,
    check: impl Fn(u64) -> Result<()>,
) -> Result<(Gaussians, Vec<i32>)> {
    let newborn_count = u64::from(chunk.newborn_count);
    let (kept, survivors) = read_survivors(&chunk.survivors, canonical, |survivors| {
        check(survivors as u64 + newborn_count)
    })?;
    let grid = Grid { origin: chunk.origin, axis_bits: chunk.axis_bits };
    let newborn =
        read_canonical(&chunk.sections, newborn_count as usize, grid, canonical.codes.len())?;
    let mut canonical_indices: Vec<i32> = kept.into_iter().map(|index| index as i32).collect();
    canonical_indices.resize(canonical_indices.len() + newborn.count(), NEWBORN);
    let gaussians = join(survivors, newborn);
    // [7.9-4]
    let wide = || Error::new(Reject::SymbolRange, "a snapshot is 2^20 steps wide or more");
    let grid = Grid::around(&gaussians.positions).ok_or_else(wide)?;
    let order = order_of(&grid.keys(&gaussians.positions));
    let canonical_indices = order.iter().map(|&place| canonical_indices[place as usize]).collect();
    Ok((take(&gaussians, &order), canonical_indices))
}

/// The Gaussians of `first` followed by those of `second`.
fn join(mut first: Gaussians, mut second: Gaussians) -> Gaussians {
    let positions = first.positions.iter_mut().zip(&mut second.positions);
    let rotations = first.rotations.iter_mut().zip(&mut second.rotations);
    let codes = first.codes.iter_mut().zip(&mut second.codes);
    for (row, more) in positions.chain(rotations).chain(codes) {
        row.append(more);
    }
    first
}
