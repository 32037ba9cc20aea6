//! Methods that make states: from chunks, and from the sections of a frame.

use super::State;
use crate::arrays::{self, CodedArguments, CodedArrays};
use crate::errors::raise;
use crate::head::StreamHead;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use quarc::records::{CanonicalChunk, FrameChunk, SnapshotChunk};
use quarc::state::Coded;
use std::sync::{Arc, Mutex};

#[pymethods]
impl State {
    /// Decode a CANO chunk: its state and, if `wanted`, its Gaussians as coded.
    #[staticmethod]
    #[allow(clippy::too_many_arguments, reason = "the fields of the chunk")]
    fn decode_canonical<'py>(
        py: Python<'py>,
        head: &StreamHead,
        frame: u32,
        gaussian_count: u32,
        origin: [i32; 3],
        axis_bits: u8,
        sections: Vec<PyReadonlyArray1<'py, u32>>,
        state_crc: u32,
        wanted: bool,
    ) -> PyResult<(Self, Option<CodedArrays<'py>>)> {
        let sections = arrays::sections(&sections)?;
        let chunk =
            CanonicalChunk { frame, gaussian_count, origin, axis_bits, sections, state_crc };
        let decoded = head.workers.run(py, || quarc::state::State::canonical(&head.header, &chunk));
        let (state, gaussians) = decoded.map_err(raise)?;
        let coded = wanted.then(|| arrays::gaussian_arrays(py, &gaussians)).transpose()?;
        Ok((State::without_coded(&head.workers, state), coded))
    }

    /// Decode a SNAP chunk: its state, and the index of each Gaussian in the CANO, or -1.
    #[staticmethod]
    #[allow(clippy::too_many_arguments, reason = "the fields of the chunk")]
    fn decode_snapshot<'py>(
        py: Python<'py>,
        head: &StreamHead,
        ordinals: (u32, u32),
        newborn_count: u32,
        origin: [i32; 3],
        axis_bits: u8,
        survivors: PyReadonlyArray1<'py, u32>,
        sections: Vec<PyReadonlyArray1<'py, u32>>,
        state_crc: u32,
        canonical: CodedArguments<'py>,
    ) -> PyResult<(Self, Bound<'py, PyArray1<i64>>)> {
        let chunk = SnapshotChunk {
            frame: ordinals.0,
            canonical: ordinals.1,
            newborn_count,
            origin,
            axis_bits,
            survivors: arrays::section(&survivors),
            sections: arrays::sections(&sections)?,
            state_crc,
        };
        let known = arrays::gaussians(&canonical)?;
        let decoded = {
            let snapshot = || quarc::state::State::snapshot(&head.header, &chunk, &known);
            head.workers.run(py, snapshot)
        };
        let (state, canonical_indices) = decoded.map_err(raise)?;
        let canonical_indices =
            PyArray1::from_iter(py, canonical_indices.into_iter().map(i64::from));
        Ok((State::without_coded(&head.workers, state), canonical_indices))
    }

    /// Make the state of a canonical frame from Gaussians in the order of their ids.
    #[staticmethod]
    fn begin_canonical(
        head: &StreamHead,
        frame: u32,
        gaussians: CodedArguments<'_>,
    ) -> PyResult<Self> {
        let gaussians = arrays::gaussians(&gaussians)?;
        let state = quarc::state::State::begin(&head.header, frame, &gaussians);
        Ok(State::without_coded(&head.workers, state.map_err(raise)?))
    }

    /// Decode the FRAM chunk that follows this state.
    #[allow(clippy::too_many_arguments, reason = "the fields of the chunk")]
    fn decode_frame(
        &self,
        py: Python<'_>,
        phase: u32,
        previous_contexts: bool,
        death_count: u32,
        birth_count: u32,
        motion: PyReadonlyArray1<'_, u32>,
        updates: Option<PyReadonlyArray1<'_, u32>>,
        births: PyReadonlyArray1<'_, u32>,
        state_crc: u32,
    ) -> PyResult<Self> {
        let chunk = FrameChunk {
            phase,
            previous_contexts,
            death_count,
            birth_count,
            motion: arrays::section(&motion),
            updates: updates.as_ref().map(arrays::section),
            births: arrays::section(&births),
            state_crc,
        };
        let mut state = self.inner();
        let decoded = self.work(py, || state.frame(&chunk));
        let Coded { symbols, updates, births } = decoded.map_err(raise)?;
        Ok(State {
            workers: self.workers.clone(),
            state: Mutex::new(state),
            symbols: Arc::new(symbols),
            updates: updates.map(Arc::new),
            births: Some(Arc::new(births)),
        })
    }

    /// Begin the next frame: remove the Gaussians that die, and bind all others to anchors.
    fn begin_frame(&self, py: Python<'_>, death_count: u32) -> PyResult<Self> {
        let mut state = self.inner();
        self.work(py, || state.begin_frame(death_count)).map_err(raise)?;
        Ok(State::without_coded(&self.workers, state))
    }

    /// Decode a section of motion and apply it.
    fn decode_motion(
        &self,
        py: Python<'_>,
        section: PyReadonlyArray1<'_, u32>,
        previous: bool,
    ) -> PyResult<Self> {
        let (mut state, section) = (self.inner(), arrays::section(&section));
        let moved = self.work(py, || {
            let symbols = state.read_motion(&section, previous)?;
            state.move_by(&symbols)?;
            Ok(symbols)
        });
        let symbols = Arc::new(moved.map_err(raise)?);
        Ok(State { symbols, ..self.with_state(state) })
    }

    /// Decode a section of updates and apply it.
    fn decode_updates(&self, py: Python<'_>, section: PyReadonlyArray1<'_, u32>) -> PyResult<Self> {
        let (mut state, section) = (self.inner(), arrays::section(&section));
        let updated = self.work(py, || {
            let updates = state.read_updates(&section)?;
            state.update(&updates)?;
            Ok(updates)
        });
        let updates = Some(Arc::new(updated.map_err(raise)?));
        Ok(State { updates, ..self.with_state(state) })
    }

    /// Decode a section of births and append them.
    fn decode_births(
        &self,
        py: Python<'_>,
        section: PyReadonlyArray1<'_, u32>,
        count: u32,
    ) -> PyResult<Self> {
        let (mut state, section) = (self.inner(), arrays::section(&section));
        let grown = self.work(py, || {
            let births = state.read_births(&section, count)?;
            state.bear(&births)?;
            Ok(births)
        });
        let births = Some(Arc::new(grown.map_err(raise)?));
        Ok(State { births, ..self.with_state(state) })
    }
}
