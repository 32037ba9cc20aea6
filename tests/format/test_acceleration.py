import gc
import os
import subprocess
import sys
import threading
import weakref

import numpy as np
import pytest

from quarc_ref.decoder import compute_digest
from quarc_ref.format.acceleration import (
    COMPILED,
    PLAIN,
    computing_with,
    count_threads,
    load_kernels,
    map_parts,
    start_parts,
    threading_by,
    threading_for,
)
from quarc_ref.format.errors import VariableError
from tests.streams import make_stream

_MODULE = "quarc_ref.format.plane_kernels"
_DECODE = """
import sys
from quarc_ref.decoder import compute_digest, decode
assert sys.modules.get("numba") is None
for scene in decode(sys.stdin.buffer.read()):
    print(compute_digest(scene))
assert bool(sys.modules.get("numba")) == EXPECTED
"""


def _decode_elsewhere(data, *, numba, kernels, before=""):
    """The digests that a process of its own gives, which must import numba or must not."""
    environment = {**os.environ, "QUARC_REF_KERNELS": kernels}
    done = subprocess.run(
        [sys.executable, "-c", before + _DECODE.replace("EXPECTED", str(numba))],
        input=data,
        env={name: value for name, value in environment.items() if value},
        capture_output=True,
        check=True,
    )
    return done.stdout.decode().split()


def test_a_small_stream_is_decoded_without_numba_and_any_stream_where_there_is_none():
    data, states = make_stream()
    digests = [compute_digest(state.scene) for state in states]
    blocked = "import sys\nsys.modules['numba'] = None\n"

    assert _decode_elsewhere(data, numba=False, kernels="") == digests
    assert _decode_elsewhere(data, numba=False, kernels=COMPILED, before=blocked) == digests


def test_compiled_kernels_give_the_same_in_a_process_of_their_own():
    pytest.importorskip("numba")
    data, states = make_stream()

    digests = _decode_elsewhere(data, numba=True, kernels=COMPILED)

    assert digests == [compute_digest(state.scene) for state in states]


def test_kernels_are_chosen_by_whoever_asks_for_them():
    pytest.importorskip("numba")

    with computing_with(PLAIN):
        assert load_kernels(_MODULE, 1 << 20) is None
    with computing_with(COMPILED):
        assert load_kernels(_MODULE, 1) is not None
    assert load_kernels(_MODULE, 1) is not None  # what is loaded is used


@pytest.mark.parametrize("number", ["0", "-1", "two", "1.5", "²"])
def test_a_number_of_threads_that_is_none_is_refused(number, monkeypatch):
    monkeypatch.setenv("QUARC_REF_THREADS", number)

    with pytest.raises(VariableError, match="QUARC_REF_THREADS is"):
        count_threads()


def test_the_environment_says_how_many_threads_and_which_kernels(monkeypatch):
    monkeypatch.setenv("QUARC_REF_THREADS", "3")
    monkeypatch.setenv("QUARC_REF_KERNELS", PLAIN)
    assert count_threads() == 3
    assert load_kernels(_MODULE, 1 << 20) is None

    monkeypatch.setenv("QUARC_REF_THREADS", "")
    monkeypatch.setenv("QUARC_REF_KERNELS", "fast")
    assert count_threads() == 1
    with pytest.raises(VariableError, match="QUARC_REF_KERNELS is"):
        load_kernels(_MODULE, 1 << 20)


@pytest.mark.parametrize("threads", [1, 3])
def test_parts_come_back_in_order_from_as_many_threads_as_there_may_be(threads):
    seen, met = set(), threading.Barrier(threads)

    def act(part):
        seen.add(threading.get_ident())
        met.wait(60)  # for as many others as there may be threads
        return 2 * part

    with threading_by(threads):
        assert count_threads() == threads
        assert map_parts(act, range(6)) == list(range(0, 12, 2))

    assert len(seen) == threads
    assert threading.get_ident() in seen  # who waits lends a hand


def test_little_work_is_not_shared():
    with threading_by(3):
        with threading_for(1000):
            assert count_threads() == 1
        with threading_for(1_000_000):
            assert count_threads() == 3
        assert count_threads() == 3


@pytest.mark.parametrize("threads", [1, 3])
def test_what_has_been_begun_can_be_waited_for_again_and_takes_no_more_threads(threads):
    with threading_by(threads):
        wait = start_parts(lambda part: (part, count_threads()), range(5))

    assert wait() == wait() == [(part, 1) for part in range(5)]


@pytest.mark.parametrize("threads", [1, 2])
def test_what_was_worked_on_is_let_go_though_somebody_may_still_wait(threads):
    planes = np.zeros(1)
    there = weakref.ref(planes)
    with threading_by(threads):
        wait = start_parts(lambda part, planes=planes: float(planes[part]), [0, 0])
    del planes

    assert wait() == [0, 0]
    gc.collect()
    assert there() is None
    assert wait() == [0, 0]


@pytest.mark.parametrize("threads", [1, 2])
def test_what_goes_wrong_meanwhile_is_told_whoever_waits_the_first_of_it_first(threads):
    def act(part):
        if part:
            raise ValueError(part)
        return part

    with threading_by(threads):
        wait = start_parts(act, range(4))

    for _ in range(2):
        with pytest.raises(ValueError, match="1"):
            wait()


def test_an_interruption_is_not_put_off_until_all_parts_are_done():
    done = []

    def act(part):
        if part == 1:
            raise KeyboardInterrupt
        done.append(part)

    with threading_by(1), pytest.raises(KeyboardInterrupt):
        map_parts(act, range(3))
    assert done == [0]


def test_an_interruption_is_not_hidden_by_what_went_wrong_before_it():
    interrupted = threading.Event()

    def act(part):
        if part == 0:  # of the other thread, which begins at this end
            interrupted.wait(60)
            message = "wrong"
            raise ValueError(message)
        interrupted.set()
        raise KeyboardInterrupt

    with threading_by(2), pytest.raises(KeyboardInterrupt):
        map_parts(act, range(2))
