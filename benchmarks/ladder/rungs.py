"""The rungs of the ladder: the fields that can change between two frames."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Rung:
    """A set of fields that can change.

    Attributes:
        name: Unique name, also used for its files.
        title: Title of the rung in the table.
        free: `anchors`, or the fields of individual Gaussians that can change: names of
            `UPDATE_FIELDS`, `deaths` and `SH rest`.
        uses_canonical_rates: Whether translation and rotation use the learning rates of canonical
            training instead of those of motion.
        sh_rest_rate_factor: Factor for the learning rate of SH rest. In canonical training, that
            learning rate is 1/20 of the learning rate of SH DC.
    """

    name: str
    title: str
    free: frozenset[str]
    uses_canonical_rates: bool = False
    sh_rest_rate_factor: float = 1.0


STILL_NAME = "still"
_CUMULATIVE_FIELDS = (
    ("own", "every Gaussian moves freely", "translation"),
    ("deaths", "+ deaths", "deaths"),
    ("opacity", "+ opacity", "opacity"),
    ("dc", "+ SH DC", "SH DC"),
    ("rest", "+ SH rest", "SH rest"),
    ("scales", "+ scales", "log-scales"),
    ("all", "+ rotations (all fields)", "rotation"),
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
        Rung(
            "turned",
            "translation and rotation of every Gaussian",
            frozenset({"translation", "rotation"}),
        ),
        Rung(
            "fast-rest",
            "all, SH rest at the learning rate of SH DC",
            _FIELDS,
            sh_rest_rate_factor=20.0,
        ),
        Rung(
            "slow",
            "all, at the learning rates of canonical training",
            _FIELDS,
            uses_canonical_rates=True,
        ),
    ]


RUNGS = {rung.name: rung for rung in _list_rungs()}
