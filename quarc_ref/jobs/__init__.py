"""Calls a function with each of many arguments, in local processes or on a Ray cluster.

    run_jobs(encode_segment, [Job("frames 0 to 29", segment), ...], WorkerPool(workers=2))

The package does not depend on any other part of quarc-ref.
"""

from quarc_ref.jobs.job import Job, JobsError, WorkerPool
from quarc_ref.jobs.on_ray import require_ray
from quarc_ref.jobs.run_jobs import run_jobs

__all__ = ["Job", "JobsError", "WorkerPool", "require_ray", "run_jobs"]
