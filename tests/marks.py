"""Marks for single cases of a parametrized test."""

from typing import Any

import pytest


def thorough(*values: Any) -> Any:
    """Return a case that only runs with --thorough (make check)."""
    return pytest.param(*values, marks=pytest.mark.thorough)
