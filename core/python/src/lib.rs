//! The fast engine of `quarc_ref.decoder.engine`: the core as an extension of Python.

mod arrays;
mod errors;
mod floats;
mod head;
mod state;
mod views;

use crate::arrays::CodedArguments;
use crate::errors::raise;
use numpy::PyArray1;
use pyo3::prelude::*;
use quarc::coding::canonical;
use quarc::coding::grid::Grid;

/// The words of the six sections of a canonical frame.
#[pyfunction]
fn write_canonical<'py>(
    py: Python<'py>,
    gaussians: CodedArguments<'py>,
    origin: [i32; 3],
) -> PyResult<Vec<Bound<'py, PyArray1<u32>>>> {
    let gaussians = arrays::gaussians(&gaussians)?;
    let grid = Grid { origin, axis_bits: 20 };
    let sections = py.detach(|| canonical::write_canonical(&gaussians, grid)).map_err(raise)?;
    Ok(sections.iter().map(|section| arrays::words(py, section)).collect())
}

#[pymodule(gil_used = false)]
fn quarc_core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("RejectedError", py.get_type::<errors::RejectedError>())?;
    module.add("DeclinedError", py.get_type::<errors::DeclinedError>())?;
    module.add("UnwritableError", py.get_type::<errors::UnwritableError>())?;
    module.add_class::<head::Workers>()?;
    module.add_class::<head::StreamHead>()?;
    module.add_class::<state::State>()?;
    module.add_class::<floats::Dequantizer>()?;
    module.add_function(wrap_pyfunction!(write_canonical, module)?)
}
