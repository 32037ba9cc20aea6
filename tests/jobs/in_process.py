"""Runs jobs in this process, where starting others, which import torch, is not what is tested."""

from contextlib import contextmanager
from importlib import import_module

import pytest

from quarc_ref.jobs.job import run_call


@contextmanager
def run_jobs_in_this_process():
    """Run the jobs of `run_jobs` in this process, with the same treatment of results and errors."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(import_module("quarc_ref.jobs.run_jobs"), "run_in_processes", _run_calls)
        yield


def _run_calls(calls, _pool):
    for index, call in enumerate(calls):
        yield index, run_call(call, {})
