"""The engine is the chosen one, so that comparisons of the engines do compare two engines."""

import sys
import threading
import tomllib
from importlib import import_module
from pathlib import Path

import pytest

from quarc_ref.decoder import engines
from quarc_ref.decoder.engine import FAST, REFERENCE
from quarc_ref.decoder.reference_engine import ReferenceEngine
from quarc_ref.format.errors import EnvironmentVariableError
from tests.engines import needs_fast
from tests.small_streams import make_gaussians
from tests.strategies import StreamHeader


@needs_fast
@pytest.mark.parametrize(
    ("value", "is_reference"), [(REFERENCE, True), (FAST, False), ("", False), (None, False)]
)
def test_the_environment_variable_chooses_the_engine(value, is_reference, monkeypatch):
    monkeypatch.delenv("QUARC_REF_ENGINE", raising=False)
    if value is not None:
        monkeypatch.setenv("QUARC_REF_ENGINE", value)

    assert isinstance(engines.choose_engine(), ReferenceEngine) == is_reference


@needs_fast
def test_a_block_overrides_the_environment_variable(monkeypatch):
    for outer, inner in ((REFERENCE, FAST), (FAST, REFERENCE)):
        monkeypatch.setenv("QUARC_REF_ENGINE", outer)
        with engines.use_engine(inner):
            assert isinstance(engines.choose_engine(), ReferenceEngine) == (inner == REFERENCE)
        assert isinstance(engines.choose_engine(), ReferenceEngine) == (outer == REFERENCE)


def test_the_number_of_threads_is_limited(monkeypatch):
    monkeypatch.delenv("QUARC_REF_ENGINE", raising=False)
    monkeypatch.setattr(engines, "find_fast_engine", lambda: lambda threads: threads)

    assert [engines.choose_engine(count) for count in (2, 100_000)] == [2, engines.MAX_THREADS]


@pytest.mark.parametrize("engine_name", [REFERENCE, pytest.param(FAST, marks=needs_fast)])
@pytest.mark.parametrize("threads", [0, -1])
def test_an_engine_needs_a_thread(engine_name, threads):
    with (
        engines.use_engine(engine_name),
        pytest.raises(ValueError, match=rf"threads \({threads}\) must be at least 1"),
    ):
        engines.choose_engine(threads)


def test_a_missing_fast_engine_is_replaced_unless_it_is_requested(monkeypatch):
    monkeypatch.setattr(engines, "find_fast_engine", lambda: None)
    monkeypatch.delenv("QUARC_REF_ENGINE", raising=False)
    assert isinstance(engines.choose_engine(), ReferenceEngine)

    monkeypatch.setenv("QUARC_REF_ENGINE", FAST)
    with pytest.raises(EnvironmentVariableError, match="quarc_core is not installed"):
        engines.choose_engine()


@needs_fast
def test_the_fast_engine_makes_empty_floats_without_gaussians():
    header = StreamHeader(sh_degree=1)
    with engines.use_engine(FAST):
        engine = engines.choose_engine()

    splats = engine.make_dequantizer()(engine.begin_canonical(header, 0, make_gaussians(header, 0)))

    assert splats.positions.shape == (0, 3)
    assert splats.sh.shape == (0, 4, 3)


@pytest.mark.parametrize(
    ("core", "reason"),
    [
        ("raise ImportError('built for another Python')", "built for another Python"),
        ("__version__ = '0.9.0'", "its version is 0.9.0"),
        ("", "its version is None"),
    ],
)
def test_a_fast_engine_that_cannot_be_used_is_named_with_the_reason(
    core, reason, monkeypatch, tmp_path
):
    (tmp_path / "quarc_core.py").write_text(core)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "quarc_core", raising=False)
    monkeypatch.delitem(sys.modules, "quarc_ref.decoder.fast_engine", raising=False)
    monkeypatch.setattr(engines, "find_fast_engine", engines.find_fast_engine.__wrapped__)
    monkeypatch.delenv("QUARC_REF_ENGINE", raising=False)
    assert isinstance(engines.choose_engine(), ReferenceEngine)
    assert engines.explain_missing().startswith("quarc_core cannot be used (")

    monkeypatch.setenv("QUARC_REF_ENGINE", FAST)
    with pytest.raises(EnvironmentVariableError, match=reason):
        engines.choose_engine()


@needs_fast
def test_the_fast_engine_needs_the_version_in_this_repository():
    manifest = Path(__file__).parents[2] / "core/Cargo.toml"

    needed_version = import_module("quarc_ref.decoder.fast_engine").CORE_VERSION

    assert tomllib.loads(manifest.read_text())["workspace"]["package"]["version"] == needed_version


@needs_fast
def test_classes_of_the_fast_engine_are_named_with_their_module():
    import quarc_core

    classes = [value for value in vars(quarc_core).values() if isinstance(value, type)]
    assert classes
    assert {value.__module__ for value in classes} == {"quarc_core"}


@needs_fast
def test_threads_can_share_a_dequantizer_of_the_fast_engine():
    with engines.use_engine(FAST):
        engine = engines.choose_engine(threads=2)
    header = StreamHeader()
    count = 1 << 15  # enough for the two threads to share the work of a state
    state = engine.begin_canonical(header, 0, make_gaussians(header, count))
    dequantize = engine.make_dequantizer()

    def dequantize_often():
        for _ in range(200):
            assert dequantize(state).positions.shape == (count, 3)

    threads = [threading.Thread(target=dequantize_often, daemon=True) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=60)
        assert not thread.is_alive()
