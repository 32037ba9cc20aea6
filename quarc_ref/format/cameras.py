"""The cameras of streams and captures: SPEC 5.6."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole camera of a capture or of a stream's `came` chunk (SPEC 5.6).

    Pixel (0, 0) has its center at (0.5, 0.5). The camera looks along its +z axis;
    its x axis points right and its y axis points down.

    Attributes:
        name: Name of the camera in the capture.
        width: Picture width, pixels.
        height: Picture height, pixels.
        fx: Horizontal focal length, pixels.
        fy: Vertical focal length, pixels.
        cx: x coordinate of the principal point, pixels.
        cy: y coordinate of the principal point, pixels.
        rotation: Rotation from world to camera, nine numbers in row-major order.
        translation: Translation from world to camera, world units.
        near: Minimum depth of the scene, world units (SPEC 10.3).
        held_out: Whether the camera was held out of training.
    """

    name: str
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    rotation: tuple[float, ...]
    translation: tuple[float, ...]
    near: float
    held_out: bool

    def __post_init__(self) -> None:
        numbers = (self.fx, self.fy, self.cx, self.cy, *self.rotation, *self.translation, self.near)
        if not all(map(math.isfinite, numbers)):
            message = f"camera {self.name} has a non-finite number"
            raise ValueError(message)
        if len(self.rotation) != 9 or len(self.translation) != 3:
            message = (
                f"camera {self.name} needs 9 numbers for its rotation and 3 for its translation"
            )
            raise ValueError(message)
        if min(self.width, self.height, self.fx, self.fy, self.near) <= 0:
            message = f"width, height, fx, fy and near of camera {self.name} must be positive"
            raise ValueError(message)
