//! Updates of single Gaussians: SPEC 8.8.
//!
//! Most Gaussians of a frame are not updated: the first plane covers all Gaussians, and the other
//! planes only the few that are.

use super::channels::{magnitude, Channels};
use super::counts::{Counts, Model};
use super::numbers::code_numbers;
use super::planes::{PlaneReader, PlaneWriter, Planes};
use super::rows::require_within;
use super::sequence::{Sequence, CLASS_BITS};
use crate::constants::RESIDUAL_ROWS;
use crate::error::{Error, Result};
use crate::records::{Section, Updates};
use std::ops::Range;

/// Rows of translation residuals.
pub const TRANSLATION: Range<usize> = 0..3;
/// Rows of rotation residuals.
pub const ROTATION: Range<usize> = 3..6;
/// Rows of code residuals.
pub const CODES: Range<usize> = 6..RESIDUAL_ROWS;
/// Maximum magnitude of a rotation residual.
pub const TURN_LIMIT: u32 = 256;

const FIELDS: [Range<usize>; 5] = [TRANSLATION, ROTATION, 6..9, 9..10, 10..13];

// The contexts, model after model.
const CHANGES: usize = 0;
const DIES: usize = 16;
const MAY_DIFFER: [usize; 5] = [20, 21, 23, 27, 35];
const RESIDUALS: Sequence = Sequence::signed(51, 3 * RESIDUAL_ROWS, CLASS_BITS);

/// What is known about the Gaussians of a frame before its updates.
#[derive(Clone, Copy, Debug)]
pub struct UpdateContext<'a> {
    /// The anchors' motion of each Gaussian in this frame.
    pub motion: &'a [Channels],
    /// Frames since each Gaussian was updated or born, at most `RECENCY_LIMIT`.
    pub recency: &'a [u8],
}

/// Contexts of updates in their initial state.
#[must_use]
pub fn update_counts() -> Counts {
    Counts::new(RESIDUALS.end())
}

/// Encode the updates of a frame.
///
/// # Errors
/// `Encode`: a residual exceeds the range of the format, or the updates do not match these
/// Gaussians.
pub fn write_updates(
    context: UpdateContext<'_>,
    updates: &Updates,
    counts: &Counts,
) -> Result<Section> {
    require_writable(updates, context.recency.len())?;
    let mut changes = vec![false; context.recency.len()];
    for &gaussian in &updates.gaussians {
        changes[gaussian as usize] = true;
    }
    let mut writer = PlaneWriter::new(counts.clone());
    walk(&mut writer, context, changes, updates)?;
    Ok(writer.section())
}

/// Decode the updates of a frame.
///
/// # Errors
/// Those of reading the section.
pub fn read_updates(
    section: &Section,
    context: UpdateContext<'_>,
    counts: &mut Counts,
) -> Result<Updates> {
    let mut reader = PlaneReader::new(section, counts)?;
    let changes = vec![false; context.recency.len()];
    let updates = walk(&mut reader, context, changes, &Updates::default())?;
    reader.finish()?;
    Ok(updates)
}

/// Check the shape of updates for a scene of `count` Gaussians.
///
/// # Errors
/// `Encode`.
pub fn require_shape(updates: &Updates, count: usize) -> Result<()> {
    let size = updates.gaussians.len();
    let ascend = updates.gaussians.windows(2).all(|pair| pair[0] < pair[1]);
    let within = updates.gaussians.last().map_or(true, |&last| (last as usize) < count);
    let rows = updates.residuals.len() == RESIDUAL_ROWS
        && updates.residuals.iter().all(|row| row.len() == size);
    if ascend && within && rows && updates.dies.len() == size {
        return Ok(());
    }
    Err(Error::Encode("updates do not have ascending indices of Gaussians of the scene".into()))
}

fn require_writable(updates: &Updates, count: usize) -> Result<()> {
    require_shape(updates, count)?;
    let turns = updates.residuals[ROTATION].iter().flatten();
    if turns.map(|turn| turn.unsigned_abs()).any(|turn| turn > TURN_LIMIT) {
        return Err(Error::Encode(format!("a rotation residual exceeds {TURN_LIMIT}")));
    }
    Ok(())
}

/// Walk the planes; `changes` has one entry per Gaussian, and `known` is what is written.
fn walk<P: Planes>(
    planes: &mut P,
    context: UpdateContext<'_>,
    mut changes: Vec<bool>,
    known: &Updates,
) -> Result<Updates> {
    planes.code(Model::at(CHANGES), &changes_contexts(context), &mut changes)?;
    let changed = changes.iter().enumerate().filter(|(_, &changes)| changes);
    let gaussians: Vec<u32> = changed.map(|(gaussian, _)| gaussian as u32).collect();
    let recency = |&gaussian: &u32| u16::from(context.recency[gaussian as usize]);
    let contexts: Vec<u16> = gaussians.iter().map(recency).collect();
    let mut dies = known.dies.clone();
    dies.resize(gaussians.len(), false);
    planes.code(Model::at(DIES), &contexts, &mut dies)?;
    let mut residuals = known.residuals.clone();
    residuals.resize(RESIDUAL_ROWS, Vec::new());
    residuals.iter_mut().for_each(|row| row.resize(gaussians.len(), 0));
    let stays = |place: &u32| !dies[*place as usize];
    let left: Vec<u32> = (0..gaussians.len() as u32).filter(stays).collect();
    code_fields(planes, &left, &mut residuals)?;
    Ok(Updates { gaussians, dies, residuals })
}

/// The context 4 M + R of each Gaussian: how far it was moved, and how recently it was updated.
fn changes_contexts(context: UpdateContext<'_>) -> Vec<u16> {
    let own = |(motion, &recency): (&Channels, &u8)| {
        let far = [0, 1, 2, 2, 3][usize::from(magnitude(motion).min(4))];
        4 * far + u16::from(recency)
    };
    context.motion.iter().zip(context.recency).map(own).collect()
}

/// Code which fields of the selected Gaussians change, and by how much.
fn code_fields<P: Planes>(planes: &mut P, left: &[u32], residuals: &mut [Vec<i32>]) -> Result<()> {
    let mut answers = vec![0u16; left.len()];
    for (number, field) in FIELDS.iter().enumerate() {
        let rows = &residuals[field.clone()];
        let differs = |&place: &u32| rows.iter().any(|row| row[place as usize] != 0);
        let mut bits = P::known(left, differs);
        planes.code(Model::at(MAY_DIFFER[number]), &answers, &mut bits)?;
        answers.iter_mut().zip(bits).for_each(|(all, bit)| *all |= u16::from(bit) << number);
    }
    for (number, field) in FIELDS.iter().enumerate() {
        let asked = |(_, answers): &(&u32, &u16)| **answers >> number & 1 == 1;
        let there: Vec<u32> =
            left.iter().zip(&answers).filter(asked).map(|(&place, _)| place).collect();
        code_field(planes, &there, field.clone(), residuals)?;
    }
    Ok(())
}

/// Code the residuals of a field; the sign of the sum of the preceding rows is part of the context.
fn code_field<P: Planes>(
    planes: &mut P,
    there: &[u32],
    field: Range<usize>,
    residuals: &mut [Vec<i32>],
) -> Result<()> {
    let mut sums = vec![0i64; there.len()];
    for row in field {
        let context = |sum: &i64| (3 * row as i64 + 1 + sum.signum()) as u16;
        let contexts: Vec<u16> = sums.iter().map(context).collect();
        let own = &mut residuals[row];
        let known = |&place: &u32| i64::from(own[place as usize]);
        let mut numbers: Vec<i64> = there.iter().map(known).collect();
        require_within::<P>(&numbers)?;
        code_numbers(planes, &RESIDUALS, &contexts, &mut numbers)?;
        for ((&place, number), sum) in there.iter().zip(numbers).zip(&mut sums) {
            own[place as usize] = number as i32;
            *sum += number;
        }
    }
    Ok(())
}
