"""Generates streams with one or two faults, always the same for a number."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from hostile.mutations import Mutant
from hostile.structured.builder import Builder
from hostile.structured.draws import Draws
from hostile.structured.hostility import Hostility, Stage
from hostile.structured.pieces import assemble
from hostile.structured.records import list_hostile_records
from hostile.structured.streams import list_hostile_streams
from hostile.structured.values import HOSTILE_VALUES
from quarc_ref.decoder.engine import REFERENCE
from quarc_ref.decoder.engines import use_engine

_WHOLE = (Stage.STREAM, Stage.BYTES)
_DONORS = 24


class StructuredMaker:
    """Generates streams by series and number.

    The numbers cycle through all hostilities; occasionally, a second one is drawn.

    Args:
        series: Series of streams.
    """

    def __init__(self, series: int) -> None:
        self._series = series
        with use_engine(REFERENCE):
            self._donors = [_build(Draws.seeded(number), ()) for number in range(_DONORS)]
        self.hostilities: Sequence[Hostility | None] = (
            None,  # for numbers without a fault
            *HOSTILE_VALUES,
            *list_hostile_records([record for donor in self._donors for record in donor.records]),
            *list_hostile_streams([donor.pieces for donor in self._donors]),
        )

    def make(self, number: int) -> Mutant:
        """Return a stream of the series."""
        draws = Draws.seeded(self._series, number)
        first = self.hostilities[number % len(self.hostilities)]
        second = draws.rng.choice(self.hostilities) if draws.rng.random() < 0.2 else None
        chosen = tuple(hostility for hostility in (first, second) if hostility is not None)
        donor = draws.rng.choice(self._donors) if draws.rng.random() < 0.5 else None
        with use_engine(REFERENCE):
            built = _build(draws, chosen, donor)
        pieces = _apply(Stage.STREAM, chosen, draws, built.pieces)
        data = _apply(Stage.BYTES, chosen, draws, assemble(pieces))
        return Mutant(data, tuple(hostility.name for hostility in chosen), forged=False)


def _build(draws: Draws, chosen: Sequence[Hostility], like: Builder | None = None) -> Builder:
    """Return a stream of a few frames, some of which are hostile.

    Args:
        draws: Source of random values.
        chosen: What is wrong.
        like: A stream with the header to use.
    """
    header = draws.header() if like is None else like.header
    for hostility in chosen:
        header = replace(header, **hostility.header)
    builder = Builder(draws, header)
    for _ in range(draws.rng.choice((1, 2, 3, 5))):
        builder.add_valid_frame()
    for hostility in (each for each in chosen if each.stage not in _WHOLE):
        builder.add_hostile_frame(hostility)
    for _ in range(draws.rng.choice((0, 0, 2))):
        builder.add_valid_frame()
    builder.end(index=draws.rng.random() < 0.7)
    return builder


def _apply(stage: Stage, chosen: Sequence[Hostility], draws: Draws, value: Any) -> Any:  # noqa: ANN401
    for hostility in chosen:
        if hostility.stage is stage:
            value = hostility.change(draws, value)
    return value
