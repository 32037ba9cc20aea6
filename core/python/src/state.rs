//! States as Python objects. They are values: no method changes the state it is called on.

mod decoding;
mod writing;

use crate::arrays;
use crate::errors::raise;
use crate::head::Workers;
use crate::views::{self, BirthArrays, LevelArrays, UpdateArrays};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use quarc::coding::channels::Channels;
use quarc::records::{Births, Updates};
use std::sync::{Arc, Mutex, PoisonError};

/// A state, with what its frame coded.
#[pyclass(frozen, module = "quarc_core")]
pub struct State {
    workers: Workers,
    /// Locked, as searches for the followers of anchors store their results.
    state: Mutex<quarc::state::State>,
    symbols: Arc<Vec<Vec<Channels>>>,
    updates: Option<Arc<Updates>>,
    births: Option<Arc<Births>>,
}

impl State {
    /// A state whose frame coded no motion, updates or births.
    fn without_coded(workers: &Workers, state: quarc::state::State) -> Self {
        State {
            workers: workers.clone(),
            state: Mutex::new(state),
            symbols: Arc::default(),
            updates: None,
            births: None,
        }
    }

    /// Run a task on the threads of this state, without the GIL.
    pub fn work<R: Send>(&self, py: Python<'_>, task: impl FnOnce() -> R + Send) -> R {
        self.workers.run(py, task)
    }

    /// The threads of this state.
    pub fn workers(&self) -> &Workers {
        &self.workers
    }

    /// A clone of the core's state, to read from or to make the next one of.
    pub fn inner(&self) -> quarc::state::State {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Another state of the same frame.
    fn with_state(&self, state: quarc::state::State) -> Self {
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
    /// The CRC that the chunk of this frame carries.
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

    /// The id of the next Gaussian to be born.
    #[getter]
    fn next_id(&self) -> u64 {
        self.inner().next_id()
    }

    /// The number of Gaussians, N.
    #[getter]
    fn count(&self) -> usize {
        self.inner().count()
    }

    /// `[N]` ids.
    fn ids<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        arrays::indices_array(py, self.inner().ids())
    }

    /// `[3, N]` positions; read-only.
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        arrays::view(py, self.inner().shared_places()[0])
    }

    /// `[4, N]` rotations; read-only.
    fn rotations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        arrays::view(py, self.inner().shared_places()[1])
    }

    /// `[code_planes, N]` codes; read-only.
    fn codes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i16>>> {
        arrays::view(py, self.inner().shared_codes())
    }

    /// `[c, N]` the motion of each Gaussian in this frame.
    fn motion<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i16>>> {
        let state = self.inner();
        arrays::channel_array(py, &state.motion(), state.header().symbol_planes())
    }

    /// `[c, a]` symbols of the anchors of each level.
    fn symbols<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyArray2<i64>>>> {
        let channels = self.inner().header().symbol_planes();
        self.symbols.iter().map(|own| arrays::channel_array(py, own, channels)).collect()
    }

    /// Indices of the updated Gaussians, which of them die, and residuals `[13, n]`.
    fn updates<'py>(&self, py: Python<'py>) -> PyResult<Option<UpdateArrays<'py>>> {
        self.updates.as_ref().map(|updates| views::updates(py, updates)).transpose()
    }

    /// The parents of the Gaussians born in this frame, and these as coded.
    fn births<'py>(&self, py: Python<'py>) -> PyResult<Option<BirthArrays<'py>>> {
        self.births.as_ref().map(|births| views::births(py, births)).transpose()
    }

    /// The anchors of each level, level 1 first; empty before the first sampling.
    fn levels<'py>(&self, py: Python<'py>) -> PyResult<Vec<LevelArrays<'py>>> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.anchors_mut().map_or(Ok(Vec::new()), |anchors| views::levels(py, anchors))
    }

    /// `[L, n]` the index of the anchor that each Gaussian follows at each level. Gaussians born in
    /// this frame are not bound yet.
    fn binding<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        views::binding(py, state.anchors_mut().map_err(raise)?)
    }
}
