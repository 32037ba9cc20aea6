//! The coded data of a frame, and its anchors, as NumPy arrays.

use crate::arrays::{self, CodedArrays};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use quarc::anchors::Anchors;
use quarc::records::{Births, Updates};

/// Indices of updated Gaussians, which of them are deleted, and residuals `[13, n]`.
pub type UpdateArrays<'py> =
    (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<bool>>, Bound<'py, PyArray2<i64>>);

/// Indices of parents, and the new Gaussians as coded.
pub type BirthArrays<'py> = (Bound<'py, PyArray1<i64>>, CodedArrays<'py>);

/// The anchors of one level: ids of their Gaussians, positions `[3, a]`, parents.
pub type LevelArrays<'py> =
    (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<i32>>, Bound<'py, PyArray1<i64>>);

pub fn updates<'py>(py: Python<'py>, updates: &Updates) -> PyResult<UpdateArrays<'py>> {
    let which = arrays::indices_array(py, &updates.gaussians);
    let residuals = arrays::widen(py, &updates.residuals, updates.gaussians.len())?;
    Ok((which, PyArray1::from_slice(py, &updates.dies), residuals))
}

pub fn births<'py>(py: Python<'py>, births: &Births) -> PyResult<BirthArrays<'py>> {
    let parents = arrays::indices_array(py, &births.parents);
    Ok((parents, arrays::gaussian_arrays(py, &births.newborn)?))
}

pub fn levels<'py>(py: Python<'py>, anchors: &mut Anchors) -> PyResult<Vec<LevelArrays<'py>>> {
    let count = anchors.levels().len();
    (0..count).map(|level| one_level(py, anchors, level)).collect()
}

fn one_level<'py>(
    py: Python<'py>,
    anchors: &mut Anchors,
    number: usize,
) -> PyResult<LevelArrays<'py>> {
    let parents = match anchors.levels().get(number + 1) {
        Some(coarser) => anchors.parents(number, &vec![true; coarser.ids.len()]),
        None => vec![0; anchors.levels()[number].ids.len()],
    };
    let level = &anchors.levels()[number];
    let numbers = level.positions.iter().flatten().copied();
    let positions = PyArray1::from_iter(py, numbers).reshape([3, level.ids.len()])?;
    let owners = arrays::indices_array(py, &level.ids);
    Ok((owners, positions, arrays::indices_array(py, &parents)))
}

pub fn binding<'py>(py: Python<'py>, anchors: &mut Anchors) -> PyResult<Bound<'py, PyArray2<i32>>> {
    let levels = anchors.levels().len();
    let mut numbers: Vec<i32> = Vec::new();
    for level in 0..levels {
        numbers.extend(anchors.binding(level).iter().map(|&anchor| anchor as i32));
    }
    let columns = numbers.len() / levels;
    PyArray1::from_vec(py, numbers).reshape([levels, columns])
}
