"""Input of exporters: frames, and the properties of a stream."""

from dataclasses import dataclass, field

from quarc_ref.decoder.dequantize import Splats, dequantize
from quarc_ref.decoder.scene import Scene
from quarc_ref.format.cameras import Camera
from quarc_ref.format.records import StreamHeader

_DEFAULT_UP = "-y"  # as in PLY files with COLMAP's axes; PLY viewers assume this axis


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
    def from_scene(cls, scene: Scene) -> "Frame":
        """Dequantize a scene; return a frame with the scene and its splats."""
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
    def has_up_axis(self) -> bool:
        """Whether the stream declares its up axis."""
        return self.header.up_axis != 0

    @property
    def up(self) -> str:
        """Up axis: `+x`, `-x`, `+y`, `-y`, `+z` or `-z`; `-y` if the stream declares none."""
        return self.header.up or _DEFAULT_UP

    @property
    def meters_per_unit(self) -> float:
        """Size of a world unit in meters; 1 if the stream does not declare a size."""
        return self.header.meters_per_unit or 1.0

    def compute_time(self, frame: int) -> float:
        """Return the time of a frame on the stream's clock, in seconds (SPEC 11.1)."""
        return frame * self.header.frame_ticks / self.header.timescale
