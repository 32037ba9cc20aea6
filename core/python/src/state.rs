//! States as Python has them: values, of which no method changes what it is called on.

use crate::arrays::{self, CodedArguments, CodedArrays};
use crate::errors::raise;
use crate::head::{StreamHead, Workers};
use crate::views::{self, BirthArrays, LevelArrays, UpdateArrays};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use quarc::coding::motion::Channels;
use quarc::records::{Births, CanonicalChunk, FrameChunk, SnapshotChunk, Updates};
use quarc::state::Coded;
use std::sync::{Arc, Mutex, PoisonError};

/// A state, and what the frame that made it has coded.
#[pyclass(frozen)]
pub struct State {
    workers: Workers,
    /// Behind a lock: looking for who follows an anchor keeps what it has found.
    state: Mutex<quarc::state::State>,
    symbols: Arc<Vec<Vec<Channels>>>,
    updates: Option<Arc<Updates>>,
    births: Option<Arc<Births>>,
}

impl State {
    fn canonical(workers: &Workers, state: quarc::state::State) -> Self {
        State {
            workers: workers.clone(),
            state: Mutex::new(state),
            symbols: Arc::default(),
            updates: None,
            births: None,
        }
    }

    /// Do something by the threads that work for this state, and let others have Python.
    pub fn work<R: Send>(&self, py: Python<'_>, task: impl FnOnce() -> R + Send) -> R {
        self.workers.run(py, task)
    }

    /// The state, to be looked at or made the next of.
    pub fn inner(&self) -> quarc::state::State {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn go_on(&self, state: quarc::state::State) -> Self {
        State {
            workers: self.workers.clone(),
            state: Mutex::new(state),
            symbols: self.symbols.clone(),
            updates: self.updates.clone(),
            births: self.births.clone(),
        }
    }
}

#[pymethods]
impl State {
    /// The state of a CANO chunk, and its Gaussians as they are coded, if they are wanted.
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
        Ok((State::canonical(&head.workers, state), coded))
    }

    /// The state of a SNAP chunk, and of each Gaussian its index in the CANO, or -1.
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
        let (state, roots) = decoded.map_err(raise)?;
        let roots = PyArray1::from_iter(py, roots.into_iter().map(i64::from));
        Ok((State::canonical(&head.workers, state), roots))
    }

    /// The state of a canonical frame of Gaussians, in the order of their ids.
    #[staticmethod]
    fn begin_canonical(
        head: &StreamHead,
        frame: u32,
        gaussians: CodedArguments<'_>,
    ) -> PyResult<Self> {
        let gaussians = arrays::gaussians(&gaussians)?;
        let state = quarc::state::State::begin(&head.header, frame, &gaussians);
        Ok(State::canonical(&head.workers, state.map_err(raise)?))
    }

    /// The state of a FRAM chunk after this one.
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

    /// The state with the dead gone and every Gaussian bound.
    fn begin_frame(&self, py: Python<'_>, death_count: u32) -> PyResult<Self> {
        let mut state = self.inner();
        self.work(py, || state.begin_frame(death_count)).map_err(raise)?;
        Ok(State::canonical(&self.workers, state))
    }

    /// The state moved by a section.
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
        Ok(State { symbols, ..self.go_on(state) })
    }

    /// The state with the updates of a section.
    fn decode_updates(&self, py: Python<'_>, section: PyReadonlyArray1<'_, u32>) -> PyResult<Self> {
        let (mut state, section) = (self.inner(), arrays::section(&section));
        let updated = self.work(py, || {
            let updates = state.read_updates(&section)?;
            state.update(&updates)?;
            Ok(updates)
        });
        let updates = Some(Arc::new(updated.map_err(raise)?));
        Ok(State { updates, ..self.go_on(state) })
    }

    /// The state with the newborn of a section.
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
        Ok(State { births, ..self.go_on(state) })
    }

    /// The words of a frame's motion, of symbols `[c, a]` of each level.
    fn write_motion<'py>(
        &self,
        py: Python<'py>,
        symbols: Vec<PyReadonlyArray2<'py, i64>>,
        previous: bool,
    ) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let (state, symbols) = (self.inner(), arrays::symbols(&symbols)?);
        let section = self.work(py, || state.write_motion(&symbols, previous)).map_err(raise)?;
        Ok(arrays::words(py, &section))
    }

    /// The words of a frame's updates.
    fn write_updates<'py>(
        &self,
        py: Python<'py>,
        gaussians: PyReadonlyArray1<'py, i64>,
        dies: PyReadonlyArray1<'py, bool>,
        residuals: PyReadonlyArray2<'py, i64>,
    ) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let updates = arrays::updates(&gaussians, &dies, &residuals)?;
        let section = self.inner().write_updates(&updates).map_err(raise)?;
        Ok(arrays::words(py, &section))
    }

    /// The words of a frame's births.
    fn write_births<'py>(
        &self,
        py: Python<'py>,
        parents: PyReadonlyArray1<'py, i64>,
        newborn: CodedArguments<'py>,
    ) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let births = arrays::births(&parents, &newborn)?;
        let section = self.inner().write_births(&births).map_err(raise)?;
        Ok(arrays::words(py, &section))
    }

    /// The CRC that the chunk of the frame carries.
    fn state_crc(&self, py: Python<'_>) -> u32 {
        let state = self.inner();
        self.work(py, || state.state_crc())
    }

    #[getter]
    fn frame(&self) -> u32 {
        self.inner().frame_ordinal()
    }

    #[getter]
    fn phase(&self) -> u32 {
        self.inner().phase()
    }

    /// The id that the next newborn gets.
    #[getter]
    fn next_id(&self) -> u64 {
        self.inner().next_id()
    }

    /// How many Gaussians there are.
    #[getter]
    fn count(&self) -> usize {
        self.inner().count()
    }

    /// `[N]` ids.
    fn ids<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        arrays::indices_array(py, self.inner().ids())
    }

    /// `[3, N]` positions, not to be written to.
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        arrays::view(py, self.inner().shared_places()[0])
    }

    /// `[4, N]` rotations, not to be written to.
    fn rotations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        arrays::view(py, self.inner().shared_places()[1])
    }

    /// `[code_planes, N]` codes, not to be written to.
    fn codes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i16>>> {
        arrays::view(py, self.inner().shared_codes())
    }

    /// `[c, N]` what moved each Gaussian in the frame.
    fn motion<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i16>>> {
        let state = self.inner();
        arrays::channel_array(py, state.motion(), state.header().symbol_planes())
    }

    /// `[c, a]` of each level's anchors.
    fn symbols<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyArray2<i64>>>> {
        let channels = self.inner().header().symbol_planes();
        self.symbols.iter().map(|own| arrays::channel_array(py, own, channels)).collect()
    }

    /// Which Gaussians the frame changed, which of them left, and residuals `[13, n]`.
    fn updates<'py>(&self, py: Python<'py>) -> PyResult<Option<UpdateArrays<'py>>> {
        self.updates.as_ref().map(|updates| views::updates(py, updates)).transpose()
    }

    /// The parents of the frame's newborn, and these as they are coded.
    fn births<'py>(&self, py: Python<'py>) -> PyResult<Option<BirthArrays<'py>>> {
        self.births.as_ref().map(|births| views::births(py, births)).transpose()
    }

    /// The anchors of each level, level 1 first; nothing before the first sampling.
    fn levels<'py>(&self, py: Python<'py>) -> PyResult<Vec<LevelArrays<'py>>> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.anchors_mut().map_or(Ok(Vec::new()), |anchors| views::levels(py, anchors))
    }

    /// `[L, n]` the number of the anchor that each Gaussian follows at each level; the newborn of
    /// the frame are not bound yet.
    fn binding<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        views::binding(py, state.anchors_mut().map_err(raise)?)
    }
}
