"""Measures LPIPS with weights from a file that the user provides.

The package neither contains nor downloads weights. This Python statement creates the file:

    torch.save(lpips.LPIPS(net="vgg").state_dict(), "lpips_vgg.pth")

The values of pictures range from 0 to 1, although the network was trained with the range -1
to 1. 3DGS and methods based on it use the same range, so results are comparable with theirs.
"""

import hashlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import conv2d, max_pool2d, normalize, relu

from quarc_ref.evaluation.metrics import Picture
from quarc_ref.evaluation.same_capture import MismatchError
from quarc_ref.format.cameras import Camera

# Indices of the convolutions in VGG16's list of layers, by slice.
_CONVOLUTIONS_BY_SLICE = ((0, 2), (5, 7), (10, 12, 14), (17, 19, 21), (24, 26, 28))
_EPSILON = 1e-10
_MIN_SIZE = 16  # four downscalings by 2


class WeightsError(ValueError):
    """A file does not contain the weights of LPIPS."""


class Lpips:
    """LPIPS on VGG16.

    Args:
        path: File of the weights.

    Attributes:
        variant: Description of the variant, which is reported with the results.

    Raises:
        WeightsError: The file cannot be read, or does not contain the weights of LPIPS.
    """

    def __init__(self, path: Path) -> None:
        try:
            data = path.read_bytes()
            weights = torch.load(path, map_location="cpu", weights_only=True)
        except OSError as error:
            message = f"{path} cannot be read: {error.strerror or error}"
            raise WeightsError(message) from error
        except Exception as error:  # torch raises various errors, whose messages do not help
            message = f"{path} is not a file that torch.save has written"
            raise WeightsError(message) from error
        self._weights = _choose_weights(weights, path)
        self._try_weights(path)
        digest = hashlib.sha256(data).hexdigest()[:12]
        self.variant = f"lpips_vgg_3dgs: VGG16, input range from 0 to 1; weights {digest}"

    def _try_weights(self, path: Path) -> None:
        """Raise WeightsError unless the distance of two equal pictures can be measured and is 0."""
        picture = np.full((_MIN_SIZE, _MIN_SIZE, 3), 0.5, dtype=np.float32)
        try:
            distance = self.measure(picture, picture)
        except RuntimeError as error:
            message = f"{path}: the shapes of the weights are not those of LPIPS with VGG16"
            raise WeightsError(message) from error
        if distance != 0:
            message = f"{path}: not all weights are finite numbers"
            raise WeightsError(message)

    def require_sizes(self, cameras: Iterable[Camera]) -> None:
        """Raise MismatchError if the pictures of a camera are too small for the network."""
        for camera in cameras:
            if min(camera.width, camera.height) < _MIN_SIZE:
                message = (
                    f"LPIPS needs pictures of at least {_MIN_SIZE} x {_MIN_SIZE} pixels, but those "
                    f"of {camera.name} have {camera.width} x {camera.height}"
                )
                raise MismatchError(message)

    def measure(self, picture: Picture, truth: Picture) -> float:
        """Return the LPIPS distance between two pictures `[H, W, 3]` from 0 to 1.

        The pictures must have the sizes that `require_sizes` allows.
        """
        picture_pair = torch.from_numpy(np.stack([picture, truth]).astype(np.float32)).movedim(3, 1)
        total = 0.0
        with torch.no_grad():
            for index, features in enumerate(self._list_features(picture_pair)):
                first, second = normalize(features, dim=1, eps=_EPSILON)
                head_weights = self._weights[f"lin{index}.model.1.weight"]
                total += float(conv2d((first - second).square()[None], head_weights).mean())
        return total

    def _list_features(self, pictures: Tensor) -> list[Tensor]:
        """Return the `[2, C, h, w]` features of both pictures after each slice of the network."""
        shift, scale = (self._weights[f"scaling_layer.{name}"] for name in ("shift", "scale"))
        activations, features = (pictures - shift) / scale, []
        for index, layers in enumerate(_CONVOLUTIONS_BY_SLICE):
            activations = max_pool2d(activations, 2) if index else activations
            for layer in layers:
                name = f"net.slice{index + 1}.{layer}"
                weight, bias = (self._weights[f"{name}.{kind}"] for kind in ("weight", "bias"))
                activations = relu(conv2d(activations, weight, bias, padding=1))
            features.append(activations)
        return features


def _choose_weights(weights: Any, path: Path) -> dict[str, Tensor]:  # noqa: ANN401, from a file
    """Return the tensors of LPIPS from the content of a file; raise WeightsError without them."""
    names = _list_weight_names()
    tensors = weights if isinstance(weights, dict) else {}
    missing_names = [name for name in names if not isinstance(tensors.get(name), Tensor)]
    if missing_names:
        message = (
            f"{path} has no tensor {missing_names[0]}: the file must contain "
            "lpips.LPIPS(net='vgg').state_dict()"
        )
        raise WeightsError(message)
    return {name: tensors[name].float() for name in names}


def _list_weight_names() -> list[str]:
    head_names = [f"lin{index}.model.1.weight" for index in range(len(_CONVOLUTIONS_BY_SLICE))]
    layer_names = [
        f"net.slice{index + 1}.{layer}.{kind}"
        for index, slice_layers in enumerate(_CONVOLUTIONS_BY_SLICE)
        for layer in slice_layers
        for kind in ("weight", "bias")
    ]
    return ["scaling_layer.shift", "scaling_layer.scale", *layer_names, *head_names]
