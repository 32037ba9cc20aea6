"""Trials: settings, and the parts of an encode that stay in floats."""

from dataclasses import dataclass
from typing import Literal

from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import list_settings

Floats = Literal["", "motion", "all"]


@dataclass(frozen=True, slots=True)
class Trial:
    """One encode of the capture.

    Attributes:
        name: Unique name, also used for its files.
        title: For people.
        config: Its settings.
        floats: What is not rounded: nothing, for a normal stream; `motion`, for motion and births;
            or `all`, including the canonical frame. A stream cannot contain floats: such a trial is
            measured without one (`unquantized`).
        rebinds: Whether every Gaussian is bound again in every frame to anchors that stay at their
            sampled positions, as in the released code of the paper. The format keeps the binding
            between two samplings, so this is possible only in floats.
    """

    name: str
    title: str
    config: EncoderConfig
    floats: Floats = ""
    rebinds: bool = False

    def list_changes(self, base: EncoderConfig) -> dict[str, str]:
        """Return the settings that differ between two trees of settings."""
        ours, theirs = dict(list_settings(self.config)), dict(list_settings(base))
        return {name: f"{value}" for name, value in ours.items() if theirs[name] != value}
