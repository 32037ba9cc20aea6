"""Parametrization of tests with the reference engine, and the fast engine if it is installed."""

import pytest

from quarc_ref.decoder.engine import FAST, REFERENCE
from quarc_ref.decoder.engines import find_fast_engine

needs_fast = pytest.mark.skipif(find_fast_engine() is None, reason="quarc_core is not installed")
engines = pytest.mark.parametrize("engine", [REFERENCE, pytest.param(FAST, marks=needs_fast)])
