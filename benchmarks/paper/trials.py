"""What is tried: settings, and what of an encode is left in floats."""

from dataclasses import dataclass
from typing import Literal

from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import list_settings

Floats = Literal["", "motion", "all"]


@dataclass(frozen=True, slots=True)
class Trial:
    """One encode of the capture.

    Attributes:
        name: Tells it from all others, and names its files.
        title: For people.
        config: Its settings.
        floats: What is never rounded: nothing, which gives a stream; `motion`,
            motion and births; or `all`, the canonical frame too. Floats fit no
            stream: such a trial is measured without one (`unquantized`).
        rebinds: Whether every Gaussian is bound anew in every frame, to anchors
            that stay where they were sampled, as the release of the paper has
            it. The format keeps the binding between two samplings, so that
            this is tried in floats alone.
    """

    name: str
    title: str
    config: EncoderConfig
    floats: Floats = ""
    rebinds: bool = False

    def list_changes(self, base: EncoderConfig) -> dict[str, str]:
        """Return the settings that are not those of another tree."""
        ours, theirs = dict(list_settings(self.config)), dict(list_settings(base))
        return {name: f"{value}" for name, value in ours.items() if theirs[name] != value}
