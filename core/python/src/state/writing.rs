//! Methods that encode the sections of a frame.

use super::State;
use crate::arrays::{self, CodedArguments};
use crate::errors::raise;
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

#[pymethods]
impl State {
    /// Encode the motion of a frame, symbols `[c, a]` of each level, as the words of a section.
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

    /// Encode the updates of a frame as the words of a section.
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

    /// Encode the births of a frame as the words of a section.
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
}
