"""Reads a checkpoint without the reader under test."""

import json
import math

import numpy as np


def read_checkpoint_arrays(path):
    """Return the arrays of a checkpoint by name."""
    header, _, body = path.read_bytes().partition(b"\n")
    arrays, offset = {}, 0
    for name, (dtype, shape) in json.loads(header)["arrays"].items():
        arrays[name] = np.frombuffer(body, dtype, math.prod(shape), offset).reshape(shape)
        offset += arrays[name].nbytes
    return arrays
