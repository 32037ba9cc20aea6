//! The survivors of a snapshot: SPEC 8.9.
//!
//! They are in the Morton order of the CANO, so that the preceding survivor is a neighbor, which
//! has often moved similarly.

use super::canonical::{code_index, PLAIN_CODES, ROTATION_INDEX_BITS};
use super::counts::{Counts, Model};
use super::planes::{PlaneReader, PlaneWriter, Planes};
use super::rows::{code_one_by_one, REST_CLASSES};
use super::sequence::{Sequence, CLASS_BITS};
use crate::constants::SURVIVOR_ROWS;
use crate::error::{Error, Reject, Result};
use crate::records::{Gaussians, Section};
use std::ops::Range;

const POSITION: Range<usize> = 0..3;
const ROTATION: Range<usize> = 3..7;
const FIELDS: [Range<usize>; 5] = [POSITION, ROTATION, 7..10, 10..11, 11..14];
/// Maximum magnitude of a written difference, so that the difference of two of these fits into
/// `Signed(CLASS_BITS)`.
const MOST_CHANGE: i64 = (1 << 14) - 1;

// The contexts, model after model.
const LIVES: usize = 0;
const MAY_DIFFER: [usize; 5] = [1, 2, 4, 8, 16];
const INDEX: Sequence = Sequence::fixed(32, 1, ROTATION_INDEX_BITS);
const DIFFERENCES: Sequence =
    Sequence::signed(INDEX.end(), REST_CLASSES * SURVIVOR_ROWS, CLASS_BITS);

/// Encode which Gaussians of a CANO survive (`kept`, ascending) and their current values.
///
/// # Panics
/// If [`can_survive`] does not hold for one of them.
#[must_use]
pub fn write_survivors(canonical: &Gaussians, kept: &[u32], survivors: &Gaussians) -> Section {
    let mut lives = vec![false; canonical.count()];
    kept.iter().for_each(|&gaussian| lives[gaussian as usize] = true);
    let mut rows: Vec<Vec<i32>> = vec![Vec::new(); SURVIVOR_ROWS];
    for (place, &gaussian) in kept.iter().enumerate() {
        let differences = subtract(survivors, place, canonical, gaussian as usize);
        rows.iter_mut().zip(differences).for_each(|(row, number)| row.push(number as i32));
    }
    let mut writer = PlaneWriter::new(Counts::new(DIFFERENCES.end()));
    walk(&mut writer, lives, rows, |_| Ok(()))
        .expect("survivors are within the range of the format");
    writer.section()
}

/// Whether a Gaussian can be coded as the survivor of a given one of the CANO.
#[must_use]
pub fn can_survive(
    gaussians: &Gaussians,
    place: usize,
    canonical: &Gaussians,
    root: usize,
) -> bool {
    let mut rest = gaussians.codes[PLAIN_CODES..].iter().zip(&canonical.codes[PLAIN_CODES..]);
    rest.all(|(code, before)| code[place] == before[root])
        && subtract(gaussians, place, canonical, root)
            .iter()
            .all(|number| number.abs() <= MOST_CHANGE)
}

/// Decode the survivors of a CANO: their indices in it, ascending, and their current values.
///
/// `check` is called with the number of survivors before they are allocated.
///
/// # Errors
/// Those of reading the section and of `check`; `position-range`.
pub fn read_survivors(
    section: &Section,
    canonical: &Gaussians,
    check: impl Fn(usize) -> Result<()>,
) -> Result<(Vec<u32>, Gaussians)> {
    let mut counts = Counts::new(DIFFERENCES.end());
    let mut reader = PlaneReader::new(section, &mut counts)?;
    let lives = vec![false; canonical.count()];
    let (kept, rows) = walk(&mut reader, lives, vec![Vec::new(); SURVIVOR_ROWS], check)?;
    reader.finish()?;
    let survivors = add(canonical, &kept, &rows)?;
    Ok((kept, survivors))
}

/// Walk the planes; `lives` has one entry per Gaussian of the CANO, `rows` one per survivor.
fn walk<P: Planes>(
    planes: &mut P,
    mut lives: Vec<bool>,
    mut rows: Vec<Vec<i32>>,
    check: impl Fn(usize) -> Result<()>,
) -> Result<(Vec<u32>, Vec<Vec<i64>>)> {
    planes.code(Model::at(LIVES), &vec![0; lives.len()], &mut lives)?;
    let living = lives.iter().enumerate().filter(|(_, &lives)| lives);
    let kept: Vec<u32> = living.map(|(gaussian, _)| gaussian as u32).collect();
    check(kept.len())?;
    rows.iter_mut().for_each(|row| row.resize(kept.len(), 0));
    let mut answers = vec![0u16; kept.len()];
    for (number, field) in FIELDS.iter().enumerate() {
        let rows = &rows[field.clone()];
        let differs = |place: usize| rows.iter().any(|row| row[place] != 0);
        let mut bits: Vec<bool> = (0..kept.len()).map(differs).collect();
        planes.code(Model::at(MAY_DIFFER[number]), &answers, &mut bits)?;
        answers.iter_mut().zip(bits).for_each(|(all, bit)| *all |= u16::from(bit) << number);
    }
    let mut coded = vec![vec![0; kept.len()]; SURVIVOR_ROWS];
    for (number, field) in FIELDS.iter().enumerate() {
        let asked = |&place: &usize| answers[place] >> number & 1 == 1;
        let there: Vec<usize> = (0..kept.len()).filter(asked).collect();
        let pick = |row: &Vec<i32>| there.iter().map(|&place| row[place]).collect();
        let picked: Vec<Vec<i32>> = rows[field.clone()].iter().map(pick).collect();
        let numbers = code_field(planes, field.clone(), picked)?;
        for (row, numbers) in coded[field.clone()].iter_mut().zip(numbers) {
            there.iter().zip(numbers).for_each(|(&place, number)| row[place] = number);
        }
    }
    Ok((kept, coded))
}

/// Code the differences of a field.
fn code_field<P: Planes>(
    planes: &mut P,
    field: Range<usize>,
    mut rows: Vec<Vec<i32>>,
) -> Result<Vec<Vec<i64>>> {
    if field == ROTATION {
        code_index(planes, &INDEX, &mut rows[0])?;
        code_one_by_one(planes, &DIFFERENCES, field.start + 1, &mut rows[1..])?;
        return Ok(rows.into_iter().map(|row| row.into_iter().map(i64::from).collect()).collect());
    }
    let follow = field == POSITION;
    if follow {
        for row in &mut rows {
            (1..row.len()).rev().for_each(|place| row[place] -= row[place - 1]);
        }
    }
    code_one_by_one(planes, &DIFFERENCES, field.start, &mut rows)?;
    let sum = |row: Vec<i32>| {
        let add = |sum: &mut i64, number: i32| {
            *sum = i64::from(number) + if follow { *sum } else { 0 };
            Some(*sum)
        };
        row.into_iter().scan(0, add).collect()
    };
    Ok(rows.into_iter().map(sum).collect())
}

/// The numbers of a Gaussian that can differ.
fn numbers_of(gaussians: &Gaussians, place: usize) -> [i64; SURVIVOR_ROWS] {
    let mut numbers = [0; SURVIVOR_ROWS];
    let positions = gaussians.positions.iter().chain(&gaussians.rotations);
    for (to, row) in numbers.iter_mut().zip(positions.chain(&gaussians.codes)) {
        *to = i64::from(row[place]);
    }
    numbers
}

/// The differences of a Gaussian from another. If the rotation index differs, the rotation
/// components themselves.
fn subtract(
    gaussians: &Gaussians,
    place: usize,
    canonical: &Gaussians,
    root: usize,
) -> [i64; SURVIVOR_ROWS] {
    let own = numbers_of(gaussians, place);
    let mut differences = own;
    let before = numbers_of(canonical, root);
    differences.iter_mut().zip(before).for_each(|(number, before)| *number -= before);
    if differences[ROTATION.start] != 0 {
        differences[ROTATION].copy_from_slice(&own[ROTATION]);
        let turned = own[ROTATION.start] - before[ROTATION.start];
        differences[ROTATION.start] = turned.rem_euclid(1 << ROTATION_INDEX_BITS);
    }
    differences
}

/// Reconstruct the survivors (SPEC 7.9).
fn add(canonical: &Gaussians, kept: &[u32], rows: &[Vec<i64>]) -> Result<Gaussians> {
    let mut survivors = super::canonical::take(canonical, kept);
    let far = || Error::new(Reject::PositionRange, "a survivor is off the lattice");
    for (row, differences) in survivors.positions.iter_mut().zip(&rows[POSITION]) {
        for (number, difference) in row.iter_mut().zip(differences) {
            // [7.9-5] A position that does not fit into 32 bits is off the lattice for every step.
            let sum = i64::from(*number) + difference;
            *number = sum as i32;
            if i64::from(*number) != sum {
                return Err(far());
            }
        }
    }
    let [index, components @ ..] = &mut survivors.rotations;
    for (row, differences) in components.iter_mut().zip(&rows[ROTATION.start + 1..]) {
        let turned = rows[ROTATION.start].iter().map(|&turned| turned != 0);
        for ((number, &difference), turned) in row.iter_mut().zip(differences).zip(turned) {
            *number = difference as i32 + if turned { 0 } else { *number };
        }
    }
    for (number, &turned) in index.iter_mut().zip(&rows[ROTATION.start]) {
        *number = (*number + turned as i32) % (1 << ROTATION_INDEX_BITS);
    }
    for (row, differences) in survivors.codes.iter_mut().zip(&rows[ROTATION.end..]) {
        row.iter_mut().zip(differences).for_each(|(code, &number)| *code += number as i32);
    }
    Ok(survivors)
}
