//! States of canonical frames: SPEC 7.2, 7.9.

use super::{narrow_code, narrow_position, require_gaussians, State};
use crate::coding::births::birth_counts;
use crate::coding::canonical::{read_canonical, require_even, require_writable};
use crate::coding::channels::Channels;
use crate::coding::grid::Grid;
use crate::coding::motion::motion_counts;
use crate::coding::snapshot::read_snapshot;
use crate::coding::updates::update_counts;
use crate::constants::RECENCY_LIMIT;
use crate::error::{Error, Reject, Result};
use crate::records::{CanonicalChunk, Gaussians, Header, SnapshotChunk};
use crate::rotation::expand;
use crate::rows::Rows;
use crate::shared::Shared;
use std::sync::Arc;

impl State {
    /// The state of a CANO chunk (SPEC 7.2), and its Gaussians as coded.
    ///
    /// # Errors
    /// The chunk is invalid.
    pub fn canonical(header: &Arc<Header>, chunk: &CanonicalChunk) -> Result<(State, Gaussians)> {
        header.check()?;
        // [7.2-2]
        require_some(chunk.gaussian_count as usize)?;
        require_gaussians(header, u64::from(chunk.gaussian_count))?;
        let grid = Grid { origin: chunk.origin, axis_bits: chunk.axis_bits };
        let count = chunk.gaussian_count as usize;
        let gaussians = read_canonical(&chunk.sections, count, grid, header.code_planes())?;
        let state = State::begin(header, chunk.frame, &gaussians)?;
        state.prove(chunk.state_crc)?;
        Ok((state, gaussians))
    }

    /// The state of a SNAP chunk (SPEC 7.9), relative to the Gaussians of the CANO that it names; and
    /// for each Gaussian its index in that CANO, -1 if it is not a survivor.
    ///
    /// # Errors
    /// The chunk is invalid; `Encode`: `canonical` has the wrong shape, or a number out of range.
    pub fn snapshot(
        header: &Arc<Header>,
        chunk: &SnapshotChunk,
        canonical: &Gaussians,
    ) -> Result<(State, Vec<i32>)> {
        header.check()?;
        require_even(canonical, header.code_planes())?;
        require_writable(canonical)?;
        require_gaussians(header, u64::from(chunk.newborn_count))?;
        let (gaussians, canonical_indices) = read_snapshot(chunk, canonical, |count| {
            // [7.9-3]
            require_some(count as usize)?;
            require_gaussians(header, count)
        })?;
        let state = State::begin(header, chunk.frame, &gaussians)?;
        state.prove(chunk.state_crc)?;
        Ok((state, canonical_indices))
    }

    /// The state of a canonical frame with these Gaussians, in coded order.
    ///
    /// # Errors
    /// `position-range`, `code-range`, `rotation-range`; `Encode`: the planes differ in length,
    /// or a field of the header is out of range.
    pub fn begin(header: &Arc<Header>, frame: u32, gaussians: &Gaussians) -> Result<State> {
        header.check()?;
        require_even(gaussians, header.code_planes())?;
        let count = gaussians.count();
        let recency = if header.updates { vec![RECENCY_LIMIT; count] } else { Vec::new() };
        Ok(State {
            header: Arc::clone(header),
            frame,
            phase: 0,
            next_id: count as u64,
            ids: Shared::new((0..count as u32).collect()),
            positions: Shared::new(scale_positions(header, gaussians)?),
            rotations: Shared::new(expand_rotations(header, gaussians)?),
            codes: Shared::new(narrow_codes(gaussians)?),
            motion: Shared::new(vec![Channels::default(); count]),
            departed: Vec::new(),
            is_moved: true,
            recency: Shared::new(recency),
            anchors: None,
            moved: Shared::new(vec![false; count]),
            bound: 0,
            motion_counts: Arc::new(motion_counts()),
            birth_counts: Arc::new(birth_counts()),
            update_counts: Arc::new(update_counts()),
        })
    }
}

fn require_some(count: usize) -> Result<()> {
    if count == 0 {
        return Err(Error::new(Reject::Count, "a canonical frame has no Gaussians"));
    }
    Ok(())
}

fn scale_positions(header: &Header, gaussians: &Gaussians) -> Result<Rows<i32>> {
    let mut rows = Rows::zeros(3, gaussians.count(), 0);
    for (axis, row) in gaussians.positions.iter().enumerate() {
        for (to, &position) in rows.row_mut(axis).iter_mut().zip(row) {
            // [7.2-3]
            *to = narrow_position(i64::from(position) * i64::from(header.position_step))?;
        }
    }
    Ok(rows)
}

/// The rotations `[4, n]` of Gaussians.
pub(super) fn expand_rotations(header: &Header, gaussians: &Gaussians) -> Result<Rows<i32>> {
    let mut rows = Rows::zeros(4, gaussians.count(), 0);
    for place in 0..gaussians.count() {
        let coded = [0, 1, 2, 3].map(|row: usize| gaussians.rotations[row][place]);
        // [7.2-5] [7.2-6] [7.6-4]
        let rotation = expand(coded, header.rotation_bits)?;
        for (row, part) in rotation.iter().enumerate() {
            rows.row_mut(row)[place] = *part;
        }
    }
    Ok(rows)
}

/// The codes of Gaussians.
pub(super) fn narrow_codes(gaussians: &Gaussians) -> Result<Rows<i16>> {
    let mut rows = Rows::zeros(gaussians.codes.len(), gaussians.count(), 0);
    for (number, row) in gaussians.codes.iter().enumerate() {
        for (to, &code) in rows.row_mut(number).iter_mut().zip(row) {
            // [7.2-4] [7.6-3]
            *to = narrow_code(code)?;
        }
    }
    Ok(rows)
}
