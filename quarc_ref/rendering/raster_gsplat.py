"""The CUDA backend: gsplat's rasterizer with the interface `rasterizer.Rasterizer`.

gsplat (Apache-2.0) compiles its kernels at the first call, which requires nvcc from a CUDA
toolkit, unless it was installed from a wheel with compiled kernels. The backend follows the
conventions of SPEC 10.3. Opacities are clamped before the call, so gsplat's alpha clamp, which
differs between versions, has no effect.
"""

from importlib.util import find_spec

import torch
from torch import Tensor

from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import LOW_PASS, NEAR_FRACTION
from quarc_ref.rendering.constants_on_device import make_constant
from quarc_ref.rendering.rasterizer import Backdrop, Gaussians, JoinedBackdrop, Rendering
from quarc_ref.wording import suggest_install


class GsplatRasterizer:
    """Renders float32 Gaussians on a CUDA device.

    Raises:
        RuntimeError: gsplat is not installed, or cannot compile its kernels.
    """

    name = "gsplat"

    def __init__(self) -> None:
        try:
            from gsplat import rasterization
        except ImportError as error:
            message = f"training on CUDA needs gsplat; {suggest_install('encode,gpu')}"
            raise RuntimeError(message) from error
        if not _has_kernels():
            message = (
                "training on CUDA needs nvcc, with which gsplat compiles its kernels: install a "
                "CUDA toolkit and set CUDA_HOME, or use --device cpu"
            )
            raise RuntimeError(message)
        self._rasterization = rasterization

    def render(self, gaussians: Gaussians, camera: Camera, background: Tensor) -> Rendering:
        """See `Rasterizer.render`; `means2d` is `[1, N, 2]`."""
        world_to_camera, intrinsics = _make_matrices(camera, gaussians.means.device)
        colors, alphas, metadata = self._rasterization(
            gaussians.means,
            gaussians.quaternions,
            gaussians.scales,
            gaussians.opacities,
            gaussians.sh,
            world_to_camera,
            intrinsics,
            camera.width,
            camera.height,
            near_plane=NEAR_FRACTION * camera.near,
            eps2d=LOW_PASS,
            sh_degree=0 if gaussians.sh.shape[1] == 1 else 1,
            packed=False,
            backgrounds=background[None],
            rasterize_mode="classic",
        )
        radii = metadata["radii"][0].amax(dim=-1).to(gaussians.means.dtype)
        return Rendering(colors[0], alphas[0, ..., 0], metadata["means2d"], radii)

    def render_backdrop(self, gaussians: Gaussians, camera: Camera, background: Tensor) -> Backdrop:
        """See `Rasterizer.render_backdrop`."""
        return JoinedBackdrop(self, gaussians, camera, background)


def _make_matrices(camera: Camera, device: torch.device) -> tuple[Tensor, Tensor]:
    """Return the pose `[1, 4, 4]` and the intrinsics `[1, 3, 3]` of a camera."""
    rotation, (x, y, z) = camera.rotation, camera.translation
    pose = (*rotation[:3], x, *rotation[3:6], y, *rotation[6:], z, 0.0, 0.0, 0.0, 1.0)
    intrinsics = (camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0)
    return (
        make_constant(pose, device, torch.float32).reshape(1, 4, 4),
        make_constant(intrinsics, device, torch.float32).reshape(1, 3, 3),
    )


def _has_kernels() -> bool:
    """Return whether gsplat has compiled kernels, or can compile them."""
    from torch.utils import cpp_extension  # imports setuptools

    return cpp_extension.CUDA_HOME is not None or find_spec("gsplat.csrc") is not None
