//! Dequantized states, for renderers.

use crate::arrays;
use crate::state::State;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// The arrays of 3DGS: positions, rotations, log-scales, opacities, SH.
type SplatArrays<'py> = (
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray3<f32>>,
);

/// Number of frames whose arrays are kept for later frames; a program may hold any number at once.
const MAX_KEPT: usize = 8;

/// Dequantizes the states of a stream, into arrays that Python no longer uses.
#[pyclass(frozen, module = "quarc_core")]
#[derive(Default)]
pub struct Dequantizer {
    used: Mutex<Vec<Arc<quarc::floats::Dequantizer>>>,
}

/// The lock is not held while floats are computed: a thread of the pool that waits for others may
/// take on the call of another Python thread meanwhile, which would wait for its own lock forever.
impl Dequantizer {
    /// Arrays that Python no longer refers to, or new ones.
    fn take_unused(&self) -> Arc<quarc::floats::Dequantizer> {
        let mut used = self.used.lock().unwrap_or_else(PoisonError::into_inner);
        let unused = used.iter().position(|each| Arc::strong_count(each) == 1);
        unused.map_or_else(Arc::default, |place| used.remove(place))
    }

    /// Keep arrays for later frames.
    fn keep(&self, arrays: Arc<quarc::floats::Dequantizer>) {
        let mut used = self.used.lock().unwrap_or_else(PoisonError::into_inner);
        if used.len() == MAX_KEPT {
            used.remove(0); // Python may still refer to it
        }
        used.push(arrays);
    }
}

#[pymethods]
impl Dequantizer {
    #[new]
    fn new() -> Self {
        Dequantizer::default()
    }

    /// The floats of a state. The arrays are not overwritten while Python refers to them.
    fn dequantize<'py>(&self, py: Python<'py>, state: &State) -> PyResult<SplatArrays<'py>> {
        let (owner, state) = (state, state.inner());
        let made = owner.workers().run_anywhere(py, || {
            let mut taken = self.take_unused();
            if let Some(dequantizer) = Arc::get_mut(&mut taken) {
                dequantizer.update(&state);
            }
            self.keep(taken.clone());
            taken
        });
        let (splats, count) = (made.splats(), state.count());
        let coefficients = (state.header().code_planes() - 4) / 3;
        let rows = |numbers: &[f32], width: usize| {
            arrays::look_at(py, made.clone(), numbers)?.reshape([count, width])
        };
        Ok((
            rows(&splats.positions, 3)?,
            rows(&splats.rotations, 4)?,
            rows(&splats.log_scales, 3)?,
            arrays::look_at(py, made.clone(), &splats.opacities)?,
            arrays::look_at(py, made.clone(), &splats.sh)?.reshape([count, coefficients, 3])?,
        ))
    }
}
