"""Decodes arbitrary streams, and classifies each result as decoded, rejected or failed."""

import contextlib
import io
import resource
import signal
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from types import FrameType

from hostile.both_engines import decode_by_both_engines
from hostile.forging import forge_state_crcs
from quarc_ref.decoder import dequantize
from quarc_ref.format.coding.entropy import use_bit_decoder
from quarc_ref.format.errors import (
    BitstreamError,
    EditError,
    LimitError,
    SourceError,
)
from quarc_ref.inspection.cross_check import CrossChecker
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.streams import BytesSource, PipeSource, decode, recover
from quarc_ref.streams.cut import cut
from quarc_ref.streams.join import join

MAX_SECONDS = 2.0
MAX_MEBIBYTES = 512
_MIB = 1 << 20


@dataclass(frozen=True, slots=True)
class Verdict:
    """The result of decoding a stream.

    Attributes:
        outcome: `decoded`, `declined`, the reject id of a rejection, `hang`, or `escape` (an
            unexpected exception).
        seconds: Processor time of decoding, in seconds.
        frames: Number of decoded frames.
        detail: Traceback of the hang or escape; empty for other outcomes.
    """

    outcome: str
    seconds: float
    frames: int
    detail: str = ""

    @property
    def is_failure(self) -> bool:
        """Whether the outcome is a fault of the decoder."""
        return self.outcome in ("hang", "escape")


class _TooLongError(BaseException):
    """The time limit was exceeded; this is a BaseException, so that decoders do not catch it."""


def judge(mode: str, data: bytes, *, has_forged_crcs: bool) -> Verdict:
    """Decode a stream in one of the `MODES` and classify the result.

    Args:
        mode: Name of the mode.
        data: The stream.
        has_forged_crcs: Whether to correct the state CRCs before decoding.
    """
    start, count, detail = time.process_time(), 0, ""
    signal.setitimer(signal.ITIMER_PROF, MAX_SECONDS)
    try:
        for _ in MODES[mode](forge_state_crcs(data) if has_forged_crcs else data):
            count += 1
        outcome = "decoded"
    except BitstreamError as error:
        outcome = error.reject_id
    except (EditError, LimitError, SourceError):
        outcome = "declined"
    except _TooLongError:
        outcome, detail = "hang", traceback.format_exc()
    except Exception:  # any other exception is an escape
        outcome, detail = "escape", traceback.format_exc()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    return Verdict(outcome, time.process_time() - start, count, detail)


def prepare(seeds: Iterable[bytes]) -> None:
    """Prepare this process for `judge`: set the memory limit, and turn warnings into errors.

    Args:
        seeds: Streams to decode first, so that loading and compiling the decoders does not count
            towards the limits.
    """
    for decode_in_mode in MODES.values():
        for seed in seeds:
            with contextlib.suppress(BitstreamError, EditError):
                list(decode_in_mode(seed))
    signal.signal(signal.SIGPROF, _raise_too_long)
    warnings.simplefilter("error")
    limit = _measure_virtual_bytes() + MAX_MEBIBYTES * _MIB
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _measure_virtual_bytes() -> int:
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[0]) * resource.getpagesize()


def _raise_too_long(_signal: int, _frame: FrameType | None) -> None:
    raise _TooLongError


def _decode(data: bytes) -> Iterator[object]:
    for scene in decode(data):
        yield dequantize(scene)


def _decode_with_cross_check(data: bytes) -> Iterator[object]:
    """Decode with both entropy decoders; a difference between them counts as an escape."""
    with use_bit_decoder(CrossChecker().make_decoder):
        yield from decode(data)


def _cut(data: bytes) -> Iterator[object]:
    yield cut(BytesSource(data), None, 2, io.BytesIO())


def _join(data: bytes) -> Iterator[object]:
    yield join([BytesSource(data), BytesSource(data)], io.BytesIO())


def _inspect(data: bytes) -> Iterator[object]:
    yield from inspect_stream(data).frames


BOTH_ENGINES_MODE = "decode by both engines"
MODES: dict[str, Callable[[bytes], Iterator[object]]] = {
    "decode": _decode,
    "decode by both coders": _decode_with_cross_check,
    BOTH_ENGINES_MODE: decode_by_both_engines,
    "from a pipe": lambda data: decode(PipeSource(io.BytesIO(data))),
    "from frame 1": lambda data: decode(data, 1),
    "recover": recover,
    "recover from a pipe": lambda data: recover(PipeSource(io.BytesIO(data))),
    "inspect": _inspect,
    "cut": _cut,
    "join": _join,
}
