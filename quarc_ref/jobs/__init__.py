"""The same function on many arguments, in processes of this machine or on a Ray cluster.

    run_jobs(encode_segment, [Job("frames 0 to 29", first), ...], Where(workers=2))

This package does not depend on what the jobs do.
"""

from quarc_ref.jobs.job import Job, JobsError, WorkerPool
from quarc_ref.jobs.run_jobs import run_jobs

__all__ = ["Job", "JobsError", "WorkerPool", "run_jobs"]
