//! Independently coded Gaussians, as in a canonical frame: SPEC 8.5.

use super::counts::Counts;
use super::grid::{Grid, AXIS_BITS_LIMIT};
use super::numbers::{code_ascending, code_numbers};
use super::planes::{PlaneReader, PlaneWriter, Planes};
use super::rows::{code_one_by_one, code_rows, REST_CLASSES};
use super::sequence::{Sequence, CLASS_BITS, KEY_CLASS_BITS};
use crate::constants::CODE_LIMIT;
use crate::error::{Error, Reject, Result};
use crate::morton::deinterleave;
use crate::records::{Gaussians, Section};

/// Bits of the index of the largest rotation component.
pub const ROTATION_INDEX_BITS: u32 = 2;
/// Rows of codes of every Gaussian, without SH rest.
pub const PLAIN_CODES: usize = 7;
/// Rows of codes with SH rest.
const ALL_CODES: usize = PLAIN_CODES + 9;

const KEYS: Sequence = Sequence::unsigned(0, 1, KEY_CLASS_BITS);
const SH_DC: Sequence = Sequence::signed(0, 3, CLASS_BITS);
const OPACITY: Sequence = Sequence::signed(0, 1, CLASS_BITS);
const LOG_SCALES: Sequence = Sequence::signed(0, 3, CLASS_BITS);
const INDEX: Sequence = Sequence::fixed(0, 1, ROTATION_INDEX_BITS);
const ROTATIONS: Sequence = Sequence::signed(INDEX.end(), 3, CLASS_BITS);
const SH_REST: Sequence = Sequence::signed(0, 9 * REST_CLASSES, CLASS_BITS);
/// The contexts of each section.
const CONTEXTS: [usize; 6] =
    [KEYS.end(), SH_DC.end(), OPACITY.end(), LOG_SCALES.end(), ROTATIONS.end(), SH_REST.end()];

/// Gaussians with all numbers 0 and the given number of code planes.
#[must_use]
pub fn blank(code_planes: usize, count: usize) -> Gaussians {
    let row = || vec![0; count];
    Gaussians {
        positions: [row(), row(), row()],
        rotations: [row(), row(), row(), row()],
        codes: (0..code_planes).map(|_| row()).collect(),
    }
}

/// Sort Gaussians into coding order and return their bounding box.
///
/// # Errors
/// `Encode`: they span 2^20 position steps or more, or the planes differ in length.
pub fn sort(gaussians: &Gaussians) -> Result<(Grid, Gaussians)> {
    require_even(gaussians, gaussians.codes.len())?;
    let wide = || Error::Encode(format!("positions are 2^{AXIS_BITS_LIMIT} steps or more apart"));
    let grid = Grid::around(&gaussians.positions).ok_or_else(wide)?;
    let order = order_of(&grid.keys(&gaussians.positions));
    Ok((grid, take(gaussians, &order)))
}

/// The indices that sort the keys; the sort is stable.
#[must_use]
pub fn order_of(keys: &[u64]) -> Vec<u32> {
    let mut entries: Vec<u128> =
        (0..).zip(keys).map(|(index, &key)| u128::from(key) << 32 | index).collect();
    entries.sort_unstable();
    entries.into_iter().map(|entry| entry as u32).collect()
}

/// The Gaussians at these indices.
#[must_use]
pub fn take(gaussians: &Gaussians, which: &[u32]) -> Gaussians {
    let some = |row: &Vec<i32>| which.iter().map(|&index| row[index as usize]).collect();
    let [x, y, z] = &gaussians.positions;
    let [j, a, b, c] = &gaussians.rotations;
    Gaussians {
        positions: [some(x), some(y), some(z)],
        rotations: [some(j), some(a), some(b), some(c)],
        codes: gaussians.codes.iter().map(some).collect(),
    }
}

/// Encode Gaussians that are in the order of [`sort`].
///
/// # Errors
/// `Encode`: two colors of a Gaussian differ by too much, or the Gaussians are not in order or not
/// in the box.
pub fn write_canonical(gaussians: &Gaussians, grid: Grid) -> Result<[Section; 6]> {
    require_writable(gaussians)?;
    let keys = grid.keys(&gaussians.positions);
    if !grid.holds(&gaussians.positions) || keys.windows(2).any(|pair| pair[0] > pair[1]) {
        return Err(Error::Encode("Gaussians are not in the order of their positions".into()));
    }
    let mut keys: Vec<i64> = keys.into_iter().map(|key| key as i64).collect();
    let mut coded = gaussians.clone();
    let mut sections: [Section; 6] = Default::default();
    for (number, section) in sections.iter_mut().enumerate() {
        let mut writer = PlaneWriter::new(Counts::new(CONTEXTS[number]));
        walk_section(&mut writer, number, grid, &mut keys, &mut coded)?;
        *section = writer.section();
    }
    Ok(sections)
}

/// Check that all planes have the same length and that there are `code_planes` of them.
///
/// # Errors
/// `Encode`.
pub fn require_even(gaussians: &Gaussians, code_planes: usize) -> Result<()> {
    let rows = gaussians.positions.iter().chain(&gaussians.rotations).chain(&gaussians.codes);
    let even = rows.map(Vec::len).all(|length| length == gaussians.count());
    if even && gaussians.codes.len() == code_planes {
        return Ok(());
    }
    Err(Error::Encode(format!("Gaussians need {code_planes} planes of codes, all of one length")))
}

/// Check that a chunk can hold the Gaussians.
///
/// # Errors
/// `Encode`: there are not 7 or 16 planes of codes, the planes differ in length, or a number is out
/// of range.
pub fn require_writable(gaussians: &Gaussians) -> Result<()> {
    let is_plain = gaussians.codes.len() <= PLAIN_CODES;
    require_even(gaussians, if is_plain { PLAIN_CODES } else { ALL_CODES })?;
    let indices = gaussians.rotations[0].iter().all(|index| (0..4).contains(index));
    let parts = gaussians.rotations[1..].iter().flatten();
    let mut numbers = parts.chain(gaussians.codes.iter().flatten());
    if indices && numbers.all(|number| i64::from(number.unsigned_abs()) <= CODE_LIMIT) {
        return Ok(());
    }
    Err(Error::Encode(format!("a rotation or a code exceeds {CODE_LIMIT}")))
}

/// Decode `count` Gaussians. The caller has checked the count against the level.
///
/// # Errors
/// Those of reading the sections; `field` if `axis_bits` exceeds its range; `symbol-range` if a
/// position is outside the box; `position-range`.
pub fn read_canonical(
    sections: &[Section; 6],
    count: usize,
    grid: Grid,
    code_planes: usize,
) -> Result<Gaussians> {
    if u32::from(grid.axis_bits) > AXIS_BITS_LIMIT {
        let message = format!("axis_bits must be from 0 to {AXIS_BITS_LIMIT}");
        return Err(Error::new(Reject::Field, message));
    }
    let mut reader = CanonicalReader::new(count, grid, code_planes);
    for section in sections {
        reader.read(section)?;
    }
    Ok(reader.gaussians)
}

/// Decodes the sections of a canonical frame one by one.
#[derive(Clone, Debug)]
pub struct CanonicalReader {
    /// The Gaussians so far; numbers of sections not yet read are 0.
    pub gaussians: Gaussians,
    /// Number of sections decoded.
    pub sections: usize,
    grid: Grid,
}

impl CanonicalReader {
    /// A decoder of `count` Gaussians. The caller has checked the count against the level.
    #[must_use]
    pub fn new(count: usize, grid: Grid, code_planes: usize) -> Self {
        CanonicalReader { gaussians: blank(code_planes, count), sections: 0, grid }
    }

    /// Decode the next section.
    ///
    /// # Errors
    /// Those of [`read_canonical`].
    ///
    /// # Panics
    /// If all six sections have been read.
    pub fn read(&mut self, section: &Section) -> Result<()> {
        let mut counts = Counts::new(CONTEXTS[self.sections]);
        let mut reader = PlaneReader::new(section, &mut counts)?;
        let mut keys = vec![0; if self.sections == 0 { self.gaussians.count() } else { 0 }];
        walk_section(&mut reader, self.sections, self.grid, &mut keys, &mut self.gaussians)?;
        reader.finish()?;
        self.sections += 1;
        self.place(&keys)
    }

    /// Set the positions from their Morton keys.
    fn place(&mut self, keys: &[i64]) -> Result<()> {
        for (place, &key) in keys.iter().enumerate() {
            let offsets = deinterleave(key as u64);
            for (row, (origin, &offset)) in
                self.gaussians.positions.iter_mut().zip(self.grid.origin.iter().zip(&offsets))
            {
                // [7.2-3] A position that does not fit into 32 bits is off the lattice for every
                // step.
                let beyond = || Error::new(Reject::PositionRange, "a Gaussian is off the lattice");
                row[place] = origin.checked_add(offset as i32).ok_or_else(beyond)?;
            }
        }
        Ok(())
    }
}

/// Walk the planes of one of the six sections.
fn walk_section<P: Planes>(
    planes: &mut P,
    section: usize,
    grid: Grid,
    keys: &mut [i64],
    gaussians: &mut Gaussians,
) -> Result<()> {
    let codes = &mut gaussians.codes;
    match section {
        // [8.5-1]
        0 => {
            let most = (1 << (3 * u32::from(grid.axis_bits))) - 1;
            code_ascending(planes, &KEYS, keys, (most, Reject::SymbolRange))
        }
        1 => code_colors(planes, &SH_DC, &mut codes[4..7]),
        2 => code_rows(planes, &OPACITY, &mut codes[3..4]),
        3 => code_rows(planes, &LOG_SCALES, &mut codes[..3]),
        4 => code_rotations(planes, (&INDEX, &ROTATIONS), &mut gaussians.rotations),
        _ => code_one_by_one(planes, &SH_REST, 0, &mut codes[PLAIN_CODES..]),
    }
}

/// Code red, green and blue as green, red - green and blue - green.
pub(super) fn code_colors<P: Planes>(
    planes: &mut P,
    sequence: &Sequence,
    rows: &mut [Vec<i32>],
) -> Result<()> {
    rows.swap(0, 1);
    let (green, others) = rows.split_at_mut(1);
    for row in others.iter_mut() {
        row.iter_mut().zip(&green[0]).for_each(|(code, green)| *code -= green);
    }
    code_rows(planes, sequence, rows)?;
    let (green, others) = rows.split_at_mut(1);
    for row in others.iter_mut() {
        row.iter_mut().zip(&green[0]).for_each(|(code, green)| *code += green);
    }
    rows.swap(0, 1);
    Ok(())
}

/// Code the index of the omitted component, then the other three.
pub(super) fn code_rotations<P: Planes>(
    planes: &mut P,
    (index, components): (&Sequence, &Sequence),
    rows: &mut [Vec<i32>; 4],
) -> Result<()> {
    code_index(planes, index, &mut rows[0])?;
    code_rows(planes, components, &mut rows[1..])
}

/// Code numbers below 4 in outer context 0.
pub(super) fn code_index<P: Planes>(
    planes: &mut P,
    sequence: &Sequence,
    row: &mut [i32],
) -> Result<()> {
    let mut numbers: Vec<i64> = row.iter().map(|&number| i64::from(number)).collect();
    code_numbers(planes, sequence, &vec![0; row.len()], &mut numbers)?;
    row.iter_mut().zip(numbers).for_each(|(to, number)| *to = number as i32);
    Ok(())
}
