import importlib
import subprocess
import sys

import pytest

from quarc_ref.export.table import EXPORT_FORMATS


@pytest.mark.parametrize("export_entry", EXPORT_FORMATS.values(), ids=EXPORT_FORMATS)
def test_every_row_of_the_table_has_a_module_with_its_properties(export_entry):
    module = importlib.import_module(f"quarc_ref.export.{export_entry.module}")

    assert hasattr(module, "SequenceExporter") == export_entry.is_sequence
    assert hasattr(module, "build") != export_entry.is_sequence
    assert (export_entry.package is None) == (export_entry.extra is None)


def test_importing_the_table_loads_no_numpy_and_no_library():
    code = "import sys, quarc_ref.export.table; print(*sys.modules)"
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )

    heavy_modules = {export_entry.package for export_entry in EXPORT_FORMATS.values()} | {"numpy"}
    assert not heavy_modules & set(result.stdout.split())


def test_a_missing_library_is_an_import_error_before_anything_is_written(monkeypatch):
    monkeypatch.setitem(sys.modules, "gaussforge", None)

    with pytest.raises(ImportError):
        EXPORT_FORMATS["spz"].require_library()
