"""The rungs: what is free to change between two frames."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Rung:
    """What is free.

    Attributes:
        name: Tells it from all others, and names its files.
        title: For people.
        free: `anchors`, or what of single Gaussians is free: names of `UPDATE_FIELDS`,
            `deaths` and `SH rest`.
        canonical_learning_rates: Whether Gaussians on their own also move and turn at the learning
            rates of canonical training, and not at those of motion.
        rest_factor: Of the learning rate of SH rest, which canonical training has at a
            twentieth of that of SH DC.
    """

    name: str
    title: str
    free: frozenset[str]
    canonical_learning_rates: bool = False
    rest_factor: float = 1.0


STILL = "still"
_GROWING = (
    ("own", "every Gaussian moved on its own", "translation"),
    ("deaths", "+ deaths", "deaths"),
    ("opacity", "+ opacity", "opacity"),
    ("dc", "+ SH DC", "SH DC"),
    ("rest", "+ SH rest", "SH rest"),
    ("scales", "+ scales", "log-scales"),
    ("all", "+ rotations, which is all", "rotation"),
)
_FIELDS = frozenset(field for _, _, field in _GROWING)


def _climb() -> list[Rung]:
    listed = [
        Rung(name, title, frozenset(field for _, _, field in _GROWING[: number + 1]))
        for number, (name, title, _) in enumerate(_GROWING)
    ]
    return [
        Rung(STILL, "nothing", frozenset()),
        Rung("anchors", "motion by anchors", frozenset({"anchors"})),
        *listed,
        Rung("carried", "all but SH rest", _FIELDS - {"SH rest"}),
        Rung("turned", "moved and turned on its own", frozenset({"translation", "rotation"})),
        Rung("fast-rest", "all, SH rest at the rate of SH DC", _FIELDS, rest_factor=20.0),
        Rung("slow", "all, at canonical training's rates", _FIELDS, canonical_learning_rates=True),
    ]


RUNGS = {rung.name: rung for rung in _climb()}
