import signal
import threading

import pytest

from quarc_ref.encoder.resume.interruption import defer_signals

_SIGNALS = [signal.SIGINT, signal.SIGTERM]


class _SignalError(Exception):
    """Raised by the signal handler that the test installs."""


def _handle(number, _frame):
    raise _SignalError(number)


@pytest.fixture(autouse=True)
def _install_handlers():
    handlers = {number: signal.signal(number, _handle) for number in _SIGNALS}
    yield
    for number, handler in handlers.items():
        signal.signal(number, handler)


def _raise_signals(events, *signals):
    with defer_signals():
        for number in signals:
            signal.raise_signal(number)
        events.append("all")


@pytest.mark.parametrize(
    "signals", [[signal.SIGINT], [signal.SIGTERM], [signal.SIGTERM, signal.SIGINT]]
)
def test_a_signal_takes_effect_when_the_work_is_done(signals):
    events = []

    with pytest.raises(_SignalError) as caught:
        _raise_signals(events, *signals)

    assert events == ["all"]
    assert caught.value.args == (signals[0],)


def test_signal_handlers_are_restored():
    _raise_signals([])
    with pytest.raises(AttributeError):
        _raise_signals("no list")

    assert [signal.getsignal(number) for number in _SIGNALS] == [_handle, _handle]


def test_an_ignored_or_default_signal_stays_so():
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

    with defer_signals():
        installed_handlers = [signal.getsignal(number) for number in _SIGNALS]

    assert installed_handlers == [signal.SIG_IGN, signal.SIG_DFL]


def test_other_threads_are_not_affected():
    events = []
    thread = threading.Thread(target=_raise_signals, args=(events,))
    thread.start()
    thread.join()

    assert events == ["all"]
