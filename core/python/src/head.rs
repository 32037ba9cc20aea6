//! The HEAD of a stream, and who works at its frames.

use crate::errors::raise;
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use quarc::records::Header;
use quarc::wire;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::Arc;

/// Threads that share the work of a frame; none beside who calls, where one is enough.
#[pyclass(frozen)]
#[derive(Clone)]
pub struct Workers {
    pool: Option<Arc<ThreadPool>>,
}

#[pymethods]
impl Workers {
    #[new]
    fn new(threads: usize) -> PyResult<Self> {
        let make = || ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = (threads > 1).then(make).transpose();
        let pool = pool.map_err(|error| PyOSError::new_err(error.to_string()))?;
        Ok(Workers { pool: pool.map(Arc::new) })
    }
}

impl Workers {
    /// Have them do something, and let others have Python meanwhile.
    pub fn run<R: Send>(&self, py: Python<'_>, task: impl FnOnce() -> R + Send) -> R {
        py.detach(|| match &self.pool {
            Some(pool) => pool.install(task),
            None => task(),
        })
    }
}

/// The HEAD of a stream.
#[pyclass(frozen)]
pub struct StreamHead {
    /// What it says.
    pub header: Arc<Header>,
    /// Who works at the frames.
    pub workers: Workers,
}

#[pymethods]
impl StreamHead {
    #[new]
    fn new(payload: &[u8], workers: &Workers) -> PyResult<Self> {
        let header = Arc::new(wire::parse_header(payload).map_err(raise)?);
        Ok(StreamHead { header, workers: workers.clone() })
    }
}
