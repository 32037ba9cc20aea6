"""The rungs of the ladder: the fields that can change between two frames."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Rung:
    """A set of fields that can change.

    Attributes:
        name: Unique name, also used for its files.
        title: Title in the table.
        free: `anchors`, or the free fields of single Gaussians: names of `UPDATE_FIELDS`, `deaths`
            and `SH rest`.
        canonical_learning_rates: Whether free Gaussians also move and rotate at the learning rates
            of canonical training instead of those of motion.
        rest_factor: Factor for the learning rate of SH rest, which is 1/20 of that of SH DC in
            canonical training.
    """

    name: str
    title: str
    free: frozenset[str]
    canonical_learning_rates: bool = False
    rest_factor: float = 1.0


STILL_NAME = "still"
_CUMULATIVE_FIELDS = (
    ("own", "every Gaussian moves freely", "translation"),
    ("deaths", "+ deaths", "deaths"),
    ("opacity", "+ opacity", "opacity"),
    ("dc", "+ SH DC", "SH DC"),
    ("rest", "+ SH rest", "SH rest"),
    ("scales", "+ scales", "log-scales"),
    ("all", "+ rotations, which is all", "rotation"),
)
_FIELDS = frozenset(field for _, _, field in _CUMULATIVE_FIELDS)


def _list_rungs() -> list[Rung]:
    cumulative_rungs = [
        Rung(name, title, frozenset(field for _, _, field in _CUMULATIVE_FIELDS[: number + 1]))
        for number, (name, title, _) in enumerate(_CUMULATIVE_FIELDS)
    ]
    return [
        Rung(STILL_NAME, "nothing", frozenset()),
        Rung("anchors", "motion by anchors", frozenset({"anchors"})),
        *cumulative_rungs,
        Rung("carried", "all but SH rest", _FIELDS - {"SH rest"}),
        Rung("turned", "free motion and rotation", frozenset({"translation", "rotation"})),
        Rung("fast-rest", "all, SH rest at the learning rate of SH DC", _FIELDS, rest_factor=20.0),
        Rung(
            "slow",
            "all, at the learning rates of canonical training",
            _FIELDS,
            canonical_learning_rates=True,
        ),
    ]


RUNGS = {rung.name: rung for rung in _list_rungs()}
