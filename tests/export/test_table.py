import importlib
import subprocess
import sys

import pytest

from quarc_ref.export.table import EXPORTS


@pytest.mark.parametrize("row", EXPORTS.values(), ids=EXPORTS)
def test_every_row_of_the_table_has_a_module_with_its_properties(row):
    module = importlib.import_module(f"quarc_ref.export.{row.module}")

    assert hasattr(module, "Sequence") == row.is_sequence
    assert hasattr(module, "build") != row.is_sequence
    assert (row.package is None) == (row.extra is None)


def test_importing_the_table_loads_no_numpy_and_no_library():
    code = "import sys, quarc_ref.export.table; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )

    heavy = {row.package for row in EXPORTS.values()} | {"numpy"}
    assert not heavy & set(loaded.stdout.split())


def test_a_missing_library_is_an_import_error_before_anything_is_written(monkeypatch):
    monkeypatch.setitem(sys.modules, "gaussforge", None)

    with pytest.raises(ImportError):
        EXPORTS["spz"].require()
