"""A Ray cluster of two processors on this machine."""

import importlib.util
import subprocess
import sys
import uuid

import pytest

# The program ends when its standard input is closed, and stops all processes of Ray.
_PROGRAM = """
import sys
import ray

context = ray.init("local", num_cpus=2, include_dashboard=False, log_to_driver=False)
print(context.address_info["address"], flush=True)
sys.stdin.read()
ray.shutdown()
"""


def run_cluster():
    """Yield the address of a cluster; the environment contains the token of the cluster."""
    if importlib.util.find_spec("ray") is None:
        pytest.skip("Ray is not installed: pip install '.[ray]'")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_AUTH_MODE", "token")  # read when ray is imported, which must happen later
        patch.setenv("RAY_AUTH_TOKEN", uuid.uuid4().hex)
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        with subprocess.Popen([sys.executable, "-c", _PROGRAM], text=True, **pipes) as process:
            yield process.stdout.readline().strip()
