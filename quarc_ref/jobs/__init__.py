"""Calls a function for many arguments, in local processes or on a Ray cluster.

    run_jobs(encode_segment, [Job("frames 0 to 29", segment), ...], WorkerPool(workers=2))

The package does not depend on what the function does.
"""

from quarc_ref.jobs.job import Job, JobsError, WorkerPool
from quarc_ref.jobs.run_jobs import run_jobs

__all__ = ["Job", "JobsError", "WorkerPool", "run_jobs"]
