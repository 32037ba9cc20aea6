"""Input of exporters: frames, and the properties of a stream."""

from dataclasses import dataclass, field

from quarc_ref.decoder.dequantize import Splats, dequantize
from quarc_ref.decoder.scene import Scene
from quarc_ref.format.cameras import Camera
from quarc_ref.format.records import StreamHeader

_ASSUMED_UP = 4  # -y, as in PLY files with COLMAP's axes, and as PLY viewers assume


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A decoded frame, as integers and as floats.

    Attributes:
        scene: Integer scene.
        splats: Dequantized scene.
    """

    scene: Scene
    splats: Splats

    @classmethod
    def of(cls, scene: Scene) -> "Frame":
        """Make the frame of a scene."""
        return cls(scene, dequantize(scene))


@dataclass(frozen=True, slots=True)
class Clip:
    """Properties of a whole stream.

    Attributes:
        header: Header of the stream.
        cameras: Cameras of the stream; may be empty.
        metadata: Metadata of the stream.
    """

    header: StreamHeader
    cameras: tuple[Camera, ...] = ()
    metadata: dict[str, str] = field(default_factory=dict)

    @property
    def knows_up(self) -> bool:
        """Whether the stream declares its up axis."""
        return self.header.up_axis != 0

    @property
    def up(self) -> str:
        """`+x`, `-x`, `+y`, `-y`, `+z` or `-z`; -y if the stream does not declare it."""
        return AXES[(self.header.up_axis or _ASSUMED_UP) - 1]

    @property
    def meters_per_unit(self) -> float:
        """Size of a world unit in meters; 1 if the stream does not declare it."""
        return self.header.meters_per_unit or 1.0

    def seconds(self, frame: int) -> float:
        """Return the time of a frame on the stream's clock (SPEC 11.1)."""
        return frame * self.header.frame_ticks / self.header.timescale


AXES = ("+x", "-x", "+y", "-y", "+z", "-z")
