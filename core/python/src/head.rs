//! The HEAD of a stream, and the threads that decode its frames.

use crate::errors::raise;
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use quarc::records::Header;
use quarc::wire;
use rayon::{BroadcastContext, ThreadPool, ThreadPoolBuilder};
use std::sync::{Arc, Mutex, PoisonError};

/// A pool of threads that share the work of a frame; no pool for one thread.
#[pyclass(frozen, module = "quarc_core")]
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
    /// Run a task on these threads, without the GIL.
    ///
    /// It always starts on the first of them. glibc keeps freed memory for the thread that
    /// allocated it: if frames started on any thread, each would hold the memory of a frame.
    pub fn run<R: Send>(&self, py: Python<'_>, task: impl FnOnce() -> R + Send) -> R {
        py.detach(|| {
            let Some(pool) = &self.pool else { return task() };
            let task = Mutex::new(Some(task));
            let take = || task.lock().unwrap_or_else(PoisonError::into_inner).take();
            let first = |context: BroadcastContext| {
                (context.index() == 0).then(take).flatten().map(|task| task())
            };
            let results = pool.broadcast(first);
            results.into_iter().flatten().next().expect("the first thread of the pool has a result")
        })
    }

    /// Run a task that allocates little, on whichever of these threads is free, without the GIL.
    pub fn run_anywhere<R: Send>(&self, py: Python<'_>, task: impl FnOnce() -> R + Send) -> R {
        py.detach(|| match &self.pool {
            Some(pool) => pool.install(task),
            None => task(),
        })
    }
}

/// The HEAD of a stream.
#[pyclass(frozen, module = "quarc_core")]
pub struct StreamHead {
    /// Its contents.
    pub header: Arc<Header>,
    /// The threads that decode the frames.
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
