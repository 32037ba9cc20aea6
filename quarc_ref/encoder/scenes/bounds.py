"""Bounds on the error of each attribute of decoded Gaussians, relative to the input."""

from dataclasses import asdict, dataclass, fields, replace

import numpy as np

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.format.errors import EncodeError


@dataclass(frozen=True, slots=True)
class Bounds:
    """The largest allowed error of each attribute, for all Gaussians and frames.

    Attributes:
        position: Error per axis, world units; 0: use `position_share`.
        rotation: Angle between input and decoded rotation, radians.
        log_scale: Error of each log-scale (natural logarithm).
        opacity: Error of the opacity logit.
        sh_dc: Error of each coefficient of degree 0.
        sh_rest: Error of each coefficient of degree 1.
        position_share: Bound of positions as a fraction of the median scale of the first frame;
            used if `position` is 0.
        most_slack: Largest factor by which the bounds of position and rotation are multiplied
            for Gaussians in which errors are less visible (`slack.measure_slack`); 1: all
            Gaussians have the same bounds.
        median_scale: Median scale of the first frame, world units; 0 until `resolved` sets it.
    """

    position: float = 0.0
    rotation: float = 0.02
    log_scale: float = 1 / 32
    opacity: float = 1 / 16
    sh_dc: float = 1 / 64
    sh_rest: float = 1 / 64
    position_share: float = 0.05
    most_slack: float = 1.0
    median_scale: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (0 <= value < np.inf and (value or field.name in ("position", "median_scale"))):
                message = f"{field.name} is {value}, but it must be a positive number"
                raise ValueError(message)
        if self.most_slack < 1:
            message = f"most_slack is {self.most_slack}, but it must be at least 1"
            raise ValueError(message)

    def resolved(self, splats: Splats) -> "Bounds":
        """Return the bounds after computing `position` and `median_scale` from the first frame.

        Args:
            splats: Gaussians of the first frame.

        Raises:
            EncodeError: The median scale of the scene is 0 or not finite.
        """
        if self.position and self.most_slack == 1:
            return self
        median_scale = float(np.exp(np.median(splats.log_scales.astype(np.float64).mean(axis=1))))
        if not 0 < median_scale < np.inf:
            message = (
                "the median scale of the first frame is 0 or not finite: set the position bound"
            )
            raise EncodeError(message)
        return replace(
            self,
            position=self.position or self.position_share * median_scale,
            median_scale=median_scale,
        )

    def __str__(self) -> str:
        return " ".join(f"{name}={value:.6g}" for name, value in self.as_dict().items())

    def as_dict(self) -> dict[str, float]:
        """Return the bound of each attribute by name, and `most_slack` if it is above 1."""
        values = asdict(self)
        del values["position_share"], values["median_scale"]
        if self.most_slack == 1:
            del values["most_slack"]
        return values


PROFILES = {
    "fine": Bounds(),
    "coarse": Bounds(
        rotation=0.06, log_scale=1 / 16, opacity=1 / 8, sh_dc=1 / 32, position_share=0.125,
        most_slack=4,
    ),
}  # fmt: skip
