"""Exports frames as OpenUSD with usd-core: a ParticleField3DGaussianSplat with time samples.

In the stage, +y is up, lengths are in the stream's units, and time codes are frame ordinals. The
stage contains the cameras of the stream.
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from quarc_ref.datasets.camera_geometry import camera_center, rotation_matrix
from quarc_ref.export.activate import compute_opacities, compute_scales, convert_to_xyzw
from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.errors import ExportError
from quarc_ref.export.upright import make_upright_matrix, rotate_upright
from quarc_ref.format.cameras import Camera

_APERTURE = 36.0  # tenths of a world unit, as in USD; any value works, because only ratios matter


class SequenceExporter:
    """Collects all frames in one stage.

    Args:
        clip: Properties of the stream.
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

        splats, time_code = rotate_upright(frame.splats, self._clip), frame.scene.frame
        is_first = not self._stage.HasAuthoredTimeCodeRange()
        if is_first:
            self._stage.SetStartTimeCode(time_code)
        self._stage.SetEndTimeCode(time_code)
        particle_field = self._splats
        radius = 3 * compute_scales(splats).max(axis=1, keepdims=True)
        extent_corners = [
            (splats.positions - radius).min(axis=0),
            (splats.positions + radius).max(axis=0),
        ]
        sh_coefficients = splats.sh.reshape(-1, 3)
        for attribute, value in (
            (particle_field.CreatePositionsAttr(), Vt.Vec3fArray.FromNumpy(splats.positions)),
            (
                particle_field.CreateOrientationsAttr(),
                Vt.QuatfArray.FromNumpy(convert_to_xyzw(splats.rotations)),
            ),
            (particle_field.CreateScalesAttr(), Vt.Vec3fArray.FromNumpy(compute_scales(splats))),
            (
                particle_field.CreateOpacitiesAttr(),
                Vt.FloatArray.FromNumpy(compute_opacities(splats)),
            ),
            (
                particle_field.CreateRadianceSphericalHarmonicsCoefficientsAttr(),
                Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(sh_coefficients)),
            ),
            (
                particle_field.CreateExtentAttr(),
                Vt.Vec3fArray.FromNumpy(np.array(extent_corners, np.float32)),
            ),
        ):
            attribute.Set(value, time_code)
            if is_first:  # for readers that ignore time samples
                attribute.Set(value)

    def finish(self) -> bytes:
        """Build a `.usdc` file.

        Raises:
            ExportError: The library cannot write the file, for example because the disk is full.
        """
        from pxr import Tf

        with TemporaryDirectory() as folder:
            path = Path(folder) / "frames.usdc"
            try:
                self._stage.GetRootLayer().Export(str(path))
            except Tf.ErrorException as error:  # a list of errors, of which the first is the cause
                message = f"OpenUSD cannot write {path}: {error.args[0].commentary}"
                raise ExportError(message) from error
            return path.read_bytes()

    def _add_camera(self, number: int, camera: Camera) -> None:
        from pxr import Gf, UsdGeom

        prim = UsdGeom.Camera.Define(self._stage, f"/scene/camera_{number:02}")
        prim.GetPrim().SetDisplayName(camera.name)
        prim.CreateHorizontalApertureAttr(_APERTURE)
        pixel_width = _APERTURE / camera.width
        # USD has one focal length, so pixels that are not square have another height.
        pixel_height = pixel_width * camera.fx / camera.fy
        prim.CreateVerticalApertureAttr(camera.height * pixel_height)
        prim.CreateFocalLengthAttr(camera.fx * pixel_width)
        prim.CreateHorizontalApertureOffsetAttr((camera.width / 2 - camera.cx) * pixel_width)
        prim.CreateVerticalApertureOffsetAttr((camera.cy - camera.height / 2) * pixel_height)
        prim.CreateClippingRangeAttr(Gf.Vec2f(0.2 * camera.near, 1000 * camera.near))
        pose = Gf.Matrix4d(
            *_make_pose(camera, self._clip).T.ravel().tolist()
        )  # USD uses row vectors
        prim.AddTransformOp().Set(pose)


def _make_pose(camera: Camera, clip: Clip) -> Any:  # noqa: ANN401
    """Return the `[4, 4]` matrix from camera axes (-z forward, +y up) to upright world axes."""
    pose, upright_matrix = np.eye(4), make_upright_matrix(clip)
    pose[:3, :3] = upright_matrix @ rotation_matrix(camera).T @ np.diag([1.0, -1.0, -1.0])
    pose[:3, 3] = upright_matrix @ camera_center(camera)
    return pose
