import signal
import threading

import pytest

from quarc_ref.encoder.resume.interruption import defer_signals

_SIGNALS = [signal.SIGINT, signal.SIGTERM]


class _SignalError(Exception):
    """Raised by a signal handler of the caller."""


def _handle(number, _frame):
    raise _SignalError(number)


@pytest.fixture(autouse=True)
def _handled():
    before = {number: signal.signal(number, _handle) for number in _SIGNALS}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def _work(done, *arriving):
    with defer_signals():
        for number in arriving:
            signal.raise_signal(number)
        done.append("all")


@pytest.mark.parametrize(
    "arriving", [[signal.SIGINT], [signal.SIGTERM], [signal.SIGTERM, signal.SIGINT]]
)
def test_a_signal_takes_effect_when_the_work_is_done(arriving):
    done = []

    with pytest.raises(_SignalError) as arrived:
        _work(done, *arriving)

    assert done == ["all"]
    assert arrived.value.args == (arriving[0],)


def test_signal_handlers_are_restored():
    _work([])
    with pytest.raises(AttributeError):
        _work("no list")

    assert [signal.getsignal(number) for number in _SIGNALS] == [_handle, _handle]


def test_an_ignored_or_default_signal_stays_so():
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

    with defer_signals():
        within = [signal.getsignal(number) for number in _SIGNALS]

    assert within == [signal.SIG_IGN, signal.SIG_DFL]


def test_other_threads_are_not_affected():
    done = []
    thread = threading.Thread(target=_work, args=(done,))
    thread.start()
    thread.join()

    assert done == ["all"]
