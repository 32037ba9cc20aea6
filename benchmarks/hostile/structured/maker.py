"""Generates streams with up to two faults; a series and a number determine each stream."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

from hostile.mutations import Mutant
from hostile.structured.builder import StreamBuilder
from hostile.structured.fault import Fault, Stage
from hostile.structured.generator import RecordGenerator
from hostile.structured.pieces import assemble
from hostile.structured.records import list_record_faults
from hostile.structured.streams import list_container_faults
from hostile.structured.values import VALUE_FAULTS
from quarc_ref.decoder.engine import REFERENCE
from quarc_ref.decoder.engines import use_engine

_STREAM_STAGES = (Stage.STREAM, Stage.BYTES)
_DONOR_COUNT = 24


class StructuredMaker:
    """Generates the streams of a series.

    Streams with consecutive numbers cycle through all faults. A fifth of the streams have a second
    fault, which is chosen at random.

    Args:
        series: Number of the series of streams.
    """

    def __init__(self, series: int) -> None:
        self._series = series
        self._donors = build_donors()
        self.faults: Sequence[Fault | None] = (
            None,  # for numbers without a fault
            *VALUE_FAULTS,
            *list_record_faults([record for donor in self._donors for record in donor.records]),
            *list_container_faults([donor.pieces for donor in self._donors]),
        )

    def make(self, number: int) -> Mutant:
        """Return the stream with the given number in the series."""
        generator = RecordGenerator.from_seed(self._series, number)
        first = self.faults[number % len(self.faults)]
        second = generator.rng.choice(self.faults) if generator.rng.random() < 0.2 else None
        faults = tuple(fault for fault in (first, second) if fault is not None)
        donor = generator.rng.choice(self._donors) if generator.rng.random() < 0.5 else None
        with use_engine(REFERENCE):
            builder = _build_stream(generator, faults, donor)
        pieces = _apply_faults(Stage.STREAM, faults, generator, builder.pieces)
        data = _apply_faults(Stage.BYTES, faults, generator, assemble(pieces))
        return Mutant(data, tuple(fault.name for fault in faults), has_forged_crcs=False)


@cache
def build_donors() -> Sequence[StreamBuilder]:
    """Build the streams without faults whose parts all series use."""
    with use_engine(REFERENCE):
        return [
            _build_stream(RecordGenerator.from_seed(number), ()) for number in range(_DONOR_COUNT)
        ]


def _build_stream(
    generator: RecordGenerator, faults: Sequence[Fault], header_donor: StreamBuilder | None = None
) -> StreamBuilder:
    """Generate a few frames and apply the faults to them; return the builder of the stream.

    Args:
        generator: Source of random values.
        faults: Faults of the stream.
        header_donor: Builder from which the header is copied; None for a random header.
    """
    header = generator.generate_header() if header_donor is None else header_donor.header
    for fault in faults:
        header = replace(header, **fault.header_fields)
    builder = StreamBuilder(generator, header)
    for _ in range(generator.rng.choice((1, 2, 3, 5))):
        builder.add_valid_frame()
    for fault in (fault for fault in faults if fault.stage not in _STREAM_STAGES):
        builder.add_hostile_frame(fault)
    for _ in range(generator.rng.choice((0, 0, 2))):
        builder.add_valid_frame()
    builder.finish(index=generator.rng.random() < 0.7)
    return builder


def _apply_faults(
    stage: Stage,
    faults: Sequence[Fault],
    generator: RecordGenerator,
    value: Any,  # noqa: ANN401
) -> Any:  # noqa: ANN401
    for fault in faults:
        if fault.stage is stage:
            value = fault.change(generator, value)
    return value
