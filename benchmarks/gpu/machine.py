"""Describes the machine: device, processor and versions."""

import os
import platform
from pathlib import Path

import torch

from gpu.plan import Sizes
from gpu.rows import Row, RowLog


def run(sizes: Sizes, folder: Path, row_log: RowLog) -> None:
    """Add rows for the versions, the processor and the device.

    Raises:
        RuntimeError: torch finds no CUDA device.
    """
    del folder
    processor = platform.processor() or platform.machine()
    software = f"Python {platform.python_version()}, torch {torch.__version__}"
    row_log.add(Row("machine", "software", software))
    row_log.add(Row("machine", "processor", f"{processor}, {os.cpu_count()} cores"))
    if sizes.device == "cpu":
        row_log.add(Row("machine", "device", "CPU: a dry run, whose times are not meaningful"))
        return
    if not torch.cuda.is_available():
        message = "torch finds no CUDA device; use --dry-run to run on the CPU"
        raise RuntimeError(message)
    memory = torch.cuda.get_device_properties(0).total_memory / 2**30
    name = torch.cuda.get_device_name(0)
    row_log.add(Row("machine", "device", f"{name}, {memory:.0f} GiB", figures={"gib": memory}))
