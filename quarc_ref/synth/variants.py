"""Variants of the ray-traced scene, each of which adds a difficulty of real captures."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Variant:
    """A variant of the scene, described by its differences from the playroom.

    Attributes:
        summary: Short description for `--help` and tables.
        is_hall: Whether the scene shows only the robot in an empty hall; the robot covers a
            few percent of the pixels.
        is_dark: Whether the walls, floor and ceiling of the hall are black.
        tempo: Speed of all motion relative to the playroom.
        has_balloon: Whether a balloon flies through the scene from left to right.
        camera_gain_spread: Standard deviation of the logarithm of the cameras' gains in linear
            light. The standard deviation of the crosstalk between colors is a tenth of this value.
        exposure_amplitude: Amplitude of the sine wave in which the logarithm of a camera's exposure
            changes over time; the phases of the cameras differ.
    """

    summary: str
    is_hall: bool = False
    is_dark: bool = False
    tempo: float = 1.0
    has_balloon: bool = False
    camera_gain_spread: float = 0.0
    exposure_amplitude: float = 0.0


PLAYROOM = Variant("a bright, detailed room")
VARIANTS = {
    "playroom": PLAYROOM,
    "bright-stage": Variant("one small subject in an empty hall", is_hall=True),
    "dark-stage": Variant("the same subject and light in a black hall", is_hall=True, is_dark=True),
    "mixed-cameras": Variant(
        "cameras with different exposures and colors", camera_gain_spread=0.25
    ),
    "auto-exposure": Variant("cameras whose exposures change over time", exposure_amplitude=0.2),
    "fast": Variant("all motion is three times as fast", tempo=3.0),
    "visitor": Variant("an object that appears and disappears", has_balloon=True),
}
