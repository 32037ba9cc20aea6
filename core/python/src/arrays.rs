//! Conversion between NumPy arrays and the records of the core.
//!
//! The rows of a state are exposed without a copy; small data, and data with another layout in
//! Python, is copied.

use numpy::ndarray::{ArrayView1, ArrayView2, ShapeBuilder};
use numpy::{
    Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use quarc::coding::channels::Channels;
use quarc::records::{Births, Gaussians, Section, Updates};
use quarc::rows::Rows;
use std::any::Any;
use std::sync::Arc;

/// Positions, rotations and codes `[r, n]`, as in `Gaussians`.
pub type CodedArrays<'py> =
    (Bound<'py, PyArray2<i64>>, Bound<'py, PyArray2<i64>>, Bound<'py, PyArray2<i64>>);
/// The same as arguments.
pub type CodedArguments<'py> =
    (PyReadonlyArray2<'py, i64>, PyReadonlyArray2<'py, i64>, PyReadonlyArray2<'py, i64>);

/// Keeps the memory of an array alive while the array exists.
#[pyclass(frozen, module = "quarc_core")]
struct Keeper {
    _kept: Arc<dyn Any + Send + Sync>,
}

/// `[r, N]` read-only view of the rows of a state.
pub fn view<'py, T>(py: Python<'py>, rows: &Arc<Rows<T>>) -> PyResult<Bound<'py, PyArray2<T>>>
where
    T: Element + Copy + Default + Send + Sync + 'static,
{
    let keeper = Bound::new(py, Keeper { _kept: rows.clone() })?;
    let shape = (rows.rows(), rows.columns()).strides((rows.stride(), 1));
    let seen = ArrayView2::from_shape(shape, rows.numbers())
        .map_err(|error| PyValueError::new_err(error.to_string()))?;
    // SAFETY: the keeper owns the rows, and their numbers do not move: a shared `Arc` is copied
    // before it is written to.
    let array = unsafe { PyArray2::borrow_from_array(&seen, keeper.into_any()) };
    array.readwrite().make_nonwriteable();
    Ok(array)
}

/// `[n]` read-only view of numbers that `owner` keeps alive.
pub fn look_at<'py, T: Element, O: Send + Sync + 'static>(
    py: Python<'py>,
    owner: Arc<O>,
    numbers: &[T],
) -> PyResult<Bound<'py, PyArray1<T>>> {
    let keeper = Bound::new(py, Keeper { _kept: owner })?;
    let seen = ArrayView1::from(numbers);
    // SAFETY: the keeper owns the numbers, which nobody changes while they are shared.
    let array = unsafe { PyArray1::borrow_from_array(&seen, keeper.into_any()) };
    array.readwrite().make_nonwriteable();
    Ok(array)
}

/// A section with the words of an array.
pub fn section(words: &PyReadonlyArray1<'_, u32>) -> Section {
    words.as_array().to_vec()
}

/// The six sections of a canonical frame.
pub fn sections(words: &[PyReadonlyArray1<'_, u32>]) -> PyResult<[Section; 6]> {
    let all: Vec<Section> = words.iter().map(section).collect();
    all.try_into().map_err(|_| PyValueError::new_err("a canonical frame has six sections"))
}

/// Coded Gaussians from arrays `[r, n]`.
pub fn gaussians(arrays: &CodedArguments<'_>) -> PyResult<Gaussians> {
    let (positions, rotations, codes) = arrays;
    let wrong = || PyValueError::new_err("an array of Gaussians has the wrong number of rows");
    Ok(Gaussians {
        positions: narrow(positions)?.try_into().map_err(|_| wrong())?,
        rotations: narrow(rotations)?.try_into().map_err(|_| wrong())?,
        codes: narrow(codes)?,
    })
}

/// Coded Gaussians as arrays `[r, n]`.
pub fn gaussian_arrays<'py>(py: Python<'py>, gaussians: &Gaussians) -> PyResult<CodedArrays<'py>> {
    Ok((
        widen(py, &gaussians.positions, gaussians.count())?,
        widen(py, &gaussians.rotations, gaussians.count())?,
        widen(py, &gaussians.codes, gaussians.count())?,
    ))
}

/// Births from the indices of parents and the new Gaussians.
pub fn births(
    parents: &PyReadonlyArray1<'_, i64>,
    newborn: &CodedArguments<'_>,
) -> PyResult<Births> {
    Ok(Births { parents: indices(parents)?, newborn: gaussians(newborn)? })
}

/// Updates from the indices of updated Gaussians, which of them are deleted, and residuals `[13,
/// n]`.
pub fn updates(
    which: &PyReadonlyArray1<'_, i64>,
    dies: &PyReadonlyArray1<'_, bool>,
    residuals: &PyReadonlyArray2<'_, i64>,
) -> PyResult<Updates> {
    Ok(Updates {
        gaussians: indices(which)?,
        dies: dies.as_array().to_vec(),
        residuals: narrow(residuals)?,
    })
}

/// Symbols of the levels from arrays `[c, a]`.
pub fn symbols(levels: &[PyReadonlyArray2<'_, i64>]) -> PyResult<Vec<Vec<Channels>>> {
    levels.iter().map(level_symbols).collect()
}

fn level_symbols(level: &PyReadonlyArray2<'_, i64>) -> PyResult<Vec<Channels>> {
    let rows = level.as_array();
    let mut symbols = vec![Channels::default(); rows.ncols()];
    if rows.nrows() > symbols.first().map_or(0, |channels| channels.len()) && rows.ncols() > 0 {
        return Err(PyValueError::new_err("too many channels of symbols"));
    }
    for (channel, row) in rows.outer_iter().enumerate() {
        for (own, &symbol) in symbols.iter_mut().zip(row) {
            own[channel] = symbol.clamp(i64::from(i16::MIN), i64::from(i16::MAX)) as i16;
        }
    }
    Ok(symbols)
}

/// Channels of anchors or Gaussians as an array `[c, n]`.
pub fn channel_array<'py, T>(
    py: Python<'py>,
    own: &[Channels],
    channels: usize,
) -> PyResult<Bound<'py, PyArray2<T>>>
where
    T: Element + Copy + From<i16>,
{
    let planes = (0..channels).flat_map(|channel| own.iter().map(move |each| each[channel]));
    PyArray1::from_iter(py, planes.map(T::from)).reshape([channels, own.len()])
}

/// Rows of numbers as an array `[r, n]`.
pub fn widen<'py>(
    py: Python<'py>,
    rows: &[Vec<i32>],
    columns: usize,
) -> PyResult<Bound<'py, PyArray2<i64>>> {
    let numbers = rows.iter().flatten().map(|&number| i64::from(number));
    PyArray1::from_iter(py, numbers).reshape([rows.len(), columns])
}

/// Ids or indices as an array `[n]`.
pub fn indices_array<'py>(py: Python<'py>, numbers: &[u32]) -> Bound<'py, PyArray1<i64>> {
    PyArray1::from_iter(py, numbers.iter().map(|&number| i64::from(number)))
}

/// A section as an array of its words.
pub fn words<'py>(py: Python<'py>, section: &Section) -> Bound<'py, PyArray1<u32>> {
    PyArray1::from_slice(py, section)
}

fn indices(numbers: &PyReadonlyArray1<'_, i64>) -> PyResult<Vec<u32>> {
    let wrong = |_| PyValueError::new_err("an index is out of range");
    numbers.as_array().iter().map(|&number| u32::try_from(number).map_err(wrong)).collect()
}

fn narrow(rows: &PyReadonlyArray2<'_, i64>) -> PyResult<Vec<Vec<i32>>> {
    let wrong = |_| PyValueError::new_err("a number of a Gaussian is out of range");
    let row = |row: ArrayView1<'_, i64>| {
        row.iter().map(|&number| i32::try_from(number).map_err(wrong)).collect()
    };
    debug_assert_eq!(rows.ndim(), 2);
    rows.as_array().outer_iter().map(row).collect()
}
