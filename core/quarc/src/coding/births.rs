//! The births of a frame: SPEC 8.6.

use super::canonical::{
    blank, code_colors, code_rotations, require_writable, PLAIN_CODES, ROTATION_INDEX_BITS,
};
use super::counts::Counts;
use super::numbers::code_ascending;
use super::planes::{PlaneReader, PlaneWriter, Planes};
use super::rows::{code_alike, code_rows};
use super::sequence::{Sequence, CLASS_BITS, KEY_CLASS_BITS};
use crate::error::{Error, Reject, Result};
use crate::records::{Births, Section};

const PARENTS: Sequence = Sequence::unsigned(0, 1, KEY_CLASS_BITS);
const POSITIONS: Sequence = Sequence::signed(PARENTS.end(), 1, CLASS_BITS);
const SH_DC: Sequence = Sequence::signed(POSITIONS.end(), 3, CLASS_BITS);
const OPACITY: Sequence = Sequence::signed(SH_DC.end(), 1, CLASS_BITS);
const LOG_SCALES: Sequence = Sequence::signed(OPACITY.end(), 3, CLASS_BITS);
const INDEX: Sequence = Sequence::fixed(LOG_SCALES.end(), 1, ROTATION_INDEX_BITS);
const ROTATIONS: Sequence = Sequence::signed(INDEX.end(), 3, CLASS_BITS);
const SH_REST: Sequence = Sequence::signed(ROTATIONS.end(), 1, CLASS_BITS);

/// Contexts of births in their initial state.
#[must_use]
pub fn birth_counts() -> Counts {
    Counts::new(SH_REST.end())
}

/// Encode the births of a frame. Parents must be in ascending order.
///
/// # Errors
/// `Encode`: two colors or scales of a new Gaussian differ by too much.
pub fn write_births(births: &Births, counts: &Counts) -> Result<Section> {
    require_writable(&births.newborn)?;
    let ascend = births.parents.windows(2).all(|pair| pair[0] <= pair[1]);
    if !ascend || births.parents.len() != births.newborn.count() {
        return Err(Error::Encode(
            "births have no parents, or the parents are not ascending".into(),
        ));
    }
    let mut writer = PlaneWriter::new(counts.clone());
    walk(&mut writer, &mut births.clone(), i64::from(u32::MAX))?;
    Ok(writer.section())
}

/// Decode `count` births in a scene of `parents` Gaussians. The caller has checked the count
/// against the level.
///
/// # Errors
/// Those of reading the section; `parent-range`.
pub fn read_births(
    section: &Section,
    count: usize,
    parents: usize,
    code_planes: usize,
    counts: &mut Counts,
) -> Result<Births> {
    let mut reader = PlaneReader::new(section, counts)?;
    let mut births = Births { parents: vec![0; count], newborn: blank(code_planes, count) };
    walk(&mut reader, &mut births, parents as i64 - 1)?;
    reader.finish()?;
    Ok(births)
}

fn walk<P: Planes>(planes: &mut P, births: &mut Births, greatest_parent: i64) -> Result<()> {
    let mut parents: Vec<i64> = births.parents.iter().map(|&parent| i64::from(parent)).collect();
    // [7.6-1]
    code_ascending(planes, &PARENTS, &mut parents, (greatest_parent, Reject::ParentRange))?;
    births.parents = parents.into_iter().map(|parent| parent as u32).collect();
    let newborn = &mut births.newborn;
    code_alike(planes, &POSITIONS, &mut newborn.positions)?;
    code_colors(planes, &SH_DC, &mut newborn.codes[4..7])?;
    code_rows(planes, &OPACITY, &mut newborn.codes[3..4])?;
    code_scales(planes, &mut newborn.codes[..3])?;
    code_rotations(planes, (&INDEX, &ROTATIONS), &mut newborn.rotations)?;
    code_alike(planes, &SH_REST, &mut newborn.codes[PLAIN_CODES..])
}

/// Code x, y - x and z - y.
fn code_scales<P: Planes>(planes: &mut P, rows: &mut [Vec<i32>]) -> Result<()> {
    let mut before = vec![0; rows[0].len()];
    for row in rows.iter_mut() {
        for (code, before) in row.iter_mut().zip(&mut before) {
            let own = *code;
            *code -= *before;
            *before = own;
        }
    }
    code_rows(planes, &LOG_SCALES, rows)?;
    before.fill(0);
    for row in rows {
        for (code, before) in row.iter_mut().zip(&mut before) {
            *before += *code;
            *code = *before;
        }
    }
    Ok(())
}
