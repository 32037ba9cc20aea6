"""Defines trials: encodes with given settings, in which some parts can stay unquantized."""

from dataclasses import dataclass
from typing import Literal

from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import list_settings

FloatParts = Literal["", "motion", "all"]


@dataclass(frozen=True, slots=True)
class Trial:
    """One encode of a capture.

    Attributes:
        name: Unique name, also used for its files.
        title: Title in tables.
        config: Settings of the encoder.
        floats: The parts that stay in floats: empty for none, `motion` for motion and births, or
            `all`. A stream cannot contain floats, so a trial with floats is measured without
            writing a stream (see `unquantized`), and has no updates.
        rebinds: Whether all Gaussians are bound again in every frame, to the anchors whose sampled
            positions are nearest, as in the released code of the paper. In the format, bindings do
            not change between two samplings, so rebinding is possible only in floats.
    """

    name: str
    title: str
    config: EncoderConfig
    floats: FloatParts = ""
    rebinds: bool = False

    def list_changes(self, base_config: EncoderConfig) -> dict[str, str]:
        """Return the settings of the trial that differ from `base_config`."""
        settings, base_settings = dict(list_settings(self.config)), dict(list_settings(base_config))
        return {
            name: f"{value}" for name, value in settings.items() if base_settings[name] != value
        }
