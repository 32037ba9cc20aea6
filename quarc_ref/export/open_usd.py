"""Exports frames as OpenUSD by usd-core: a ParticleField3DGaussianSplat with time samples.

The stage is +y up, in the unit of the stream; its time codes are frame ordinals. The cameras of
the stream are cameras of the stage.
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from quarc_ref.datasets.camera_geometry import camera_center, rotation_matrix
from quarc_ref.export.activate import opacities_of, scales_of, xyzw_of
from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.upright import find_turn, matrix_of, rotate_upright
from quarc_ref.format.cameras import Camera

_APERTURE = 36.0  # in tenths of a unit, as in USD; only its ratio to the focal length matters


class Sequence:
    """Collects all frames in one stage.

    Args:
        clip: Properties of all frames.
    """

    def __init__(self, clip: Clip) -> None:
        from pxr import Usd, UsdGeom, UsdVol

        self._clip = clip
        self._stage = stage = Usd.Stage.CreateInMemory()
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
        UsdGeom.SetStageMetersPerUnit(stage, clip.meters_per_unit)
        stage.SetTimeCodesPerSecond(clip.header.frames_per_second)
        stage.SetFramesPerSecond(clip.header.frames_per_second)
        root = UsdGeom.Xform.Define(stage, "/scene")
        stage.SetDefaultPrim(root.GetPrim())
        self._splats = UsdVol.ParticleField3DGaussianSplat.Define(stage, "/scene/splats")
        self._splats.CreateRadianceSphericalHarmonicsDegreeAttr(clip.header.sh_degree)
        for number, camera in enumerate(clip.cameras):
            self._add_camera(number, camera)

    def add(self, frame: Frame) -> None:
        """Append a frame as time samples."""
        from pxr import Vt

        splats, time = rotate_upright(frame.splats, self._clip), frame.scene.frame
        is_first = not self._stage.HasAuthoredTimeCodeRange()
        if is_first:
            self._stage.SetStartTimeCode(time)
        self._stage.SetEndTimeCode(time)
        field = self._splats
        radius = 3 * scales_of(splats).max(axis=1, keepdims=True)
        extent = [(splats.positions - radius).min(axis=0), (splats.positions + radius).max(axis=0)]
        coefficients = splats.sh.reshape(-1, 3)
        for attribute, value in (
            (field.CreatePositionsAttr(), Vt.Vec3fArray.FromNumpy(splats.positions)),
            (field.CreateOrientationsAttr(), Vt.QuatfArray.FromNumpy(xyzw_of(splats.rotations))),
            (field.CreateScalesAttr(), Vt.Vec3fArray.FromNumpy(scales_of(splats))),
            (field.CreateOpacitiesAttr(), Vt.FloatArray.FromNumpy(opacities_of(splats))),
            (
                field.CreateRadianceSphericalHarmonicsCoefficientsAttr(),
                Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(coefficients)),
            ),
            (field.CreateExtentAttr(), Vt.Vec3fArray.FromNumpy(np.array(extent, np.float32))),
        ):
            attribute.Set(value, time)
            if is_first:  # for readers that ignore time samples
                attribute.Set(value)

    def finish(self) -> bytes:
        """Build a `.usdc` file."""
        with TemporaryDirectory() as folder:
            path = Path(folder) / "frames.usdc"
            self._stage.GetRootLayer().Export(str(path))
            return path.read_bytes()

    def _add_camera(self, number: int, camera: Camera) -> None:
        from pxr import Gf, UsdGeom

        prim = UsdGeom.Camera.Define(self._stage, f"/scene/camera_{number:02}")
        prim.GetPrim().SetDisplayName(camera.name)
        prim.CreateHorizontalApertureAttr(_APERTURE)
        prim.CreateVerticalApertureAttr(_APERTURE * camera.height / camera.width)
        prim.CreateFocalLengthAttr(_APERTURE * camera.fx / camera.width)
        shift = _APERTURE / camera.width
        prim.CreateHorizontalApertureOffsetAttr((camera.width / 2 - camera.cx) * shift)
        prim.CreateVerticalApertureOffsetAttr((camera.cy - camera.height / 2) * shift)
        prim.CreateClippingRangeAttr(Gf.Vec2f(0.2 * camera.near, 1000 * camera.near))
        pose = Gf.Matrix4d(*_pose(camera, self._clip).T.ravel().tolist())  # USD uses row vectors
        prim.AddTransformOp().Set(pose)


def _pose(camera: Camera, clip: Clip) -> Any:  # noqa: ANN401
    """Return the `[4, 4]` matrix from a camera that looks along -z with +y up to the world."""
    rotation = rotation_matrix(camera)
    pose = np.eye(4)
    turn = matrix_of(find_turn(clip))
    if not clip.header.right_handed:
        turn = turn @ np.diag([1.0, 1.0, -1.0])
    pose[:3, :3] = turn @ rotation.T @ np.diag([1.0, -1.0, -1.0])
    pose[:3, 3] = turn @ camera_center(camera)
    return pose
