from dataclasses import replace

import numpy as np
import pytest
import torch

from quarc_ref.evaluation.lpips import Lpips, WeightsError
from quarc_ref.evaluation.same_capture import MismatchError
from tests.encoder.toys import make_cameras

_CHANNELS = (4, 5, 6, 7, 8)
_VGG16_CONVOLUTIONS = ((0, 2), (5, 7), (10, 12, 14), (17, 19, 21), (24, 26, 28))
_SHIFT, _SCALE = (-0.03, -0.09, -0.19), (0.46, 0.45, 0.45)


def _make_scaling_layer():
    return {
        "scaling_layer.shift": torch.tensor(_SHIFT)[None, :, None, None],
        "scaling_layer.scale": torch.tensor(_SCALE)[None, :, None, None],
    }


@pytest.fixture(scope="module")
def weights():
    """Weights of a much smaller network, with the names of the real weights."""
    generator = torch.Generator().manual_seed(0)
    state = _make_scaling_layer()
    input_channels = 3
    for index, (channel_count, layers) in enumerate(
        zip(_CHANNELS, _VGG16_CONVOLUTIONS, strict=True)
    ):
        for layer in layers:
            kernel = torch.randn(channel_count, input_channels, 3, 3, generator=generator) / (
                3 * input_channels**0.5
            )
            state[f"net.slice{index + 1}.{layer}.weight"] = kernel
            state[f"net.slice{index + 1}.{layer}.bias"] = torch.full((channel_count,), 0.05)
            input_channels = channel_count
        state[f"lin{index}.model.1.weight"] = torch.rand(
            1, channel_count, 1, 1, generator=generator
        )
    return state


@pytest.fixture
def lpips(weights, tmp_path):
    torch.save(weights, tmp_path / "weights.pth")
    return Lpips(tmp_path / "weights.pth")


def _make_picture(seed=0, size=(24, 32)):
    return np.random.default_rng(seed).uniform(0, 1, (*size, 3)).astype(np.float32)


def test_equal_pictures_have_distance_zero_and_worse_ones_more(lpips):
    truth = _make_picture()
    similar, different = (truth + blend * (_make_picture(1) - truth) for blend in (0.1, 0.6))

    assert lpips.measure(truth, truth) == 0
    assert 0 < lpips.measure(similar, truth) < lpips.measure(different, truth)
    assert lpips.measure(different, truth) == pytest.approx(
        lpips.measure(truth, different), rel=1e-5
    )


def test_the_distance_of_uniform_pictures_is_that_of_their_colors(tmp_path):
    """Every layer copies its input, so all features are the scaled colors."""
    state, head_weights = _make_scaling_layer(), np.array([0.5, 2.0, 3.0])
    for index, layers in enumerate(_VGG16_CONVOLUTIONS):
        for layer in layers:
            kernel = torch.zeros(3, 3, 3, 3)
            kernel[range(3), range(3), 1, 1] = 1
            state[f"net.slice{index + 1}.{layer}.weight"] = kernel
            state[f"net.slice{index + 1}.{layer}.bias"] = torch.zeros(3)
        state[f"lin{index}.model.1.weight"] = torch.tensor(head_weights)[None, :, None, None]
    torch.save(state, tmp_path / "weights.pth")
    colors = [(0.9, 0.2, 0.4), (0.1, 0.8, 0.3)]
    pictures = [np.full((16, 17, 3), color, dtype=np.float32) for color in colors]

    scaled = (np.array(colors) - _SHIFT) / _SCALE
    first, second = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    expected = len(_VGG16_CONVOLUTIONS) * (head_weights * (first - second) ** 2).sum()
    assert Lpips(tmp_path / "weights.pth").measure(*pictures) == pytest.approx(expected, rel=1e-5)


def test_the_distance_is_that_of_the_layers_of_vgg16(lpips, weights):
    network, input_channels = torch.nn.Sequential(), 3
    for index, layers in enumerate(_VGG16_CONVOLUTIONS):
        if index:
            network.append(torch.nn.MaxPool2d(2))
        for layer in layers:
            convolution = torch.nn.Conv2d(input_channels, _CHANNELS[index], 3, padding=1)
            convolution.requires_grad_(False)
            for kind in ("weight", "bias"):
                getattr(convolution, kind).data = weights[f"net.slice{index + 1}.{layer}.{kind}"]
            assert len(network) == layer
            network.extend([convolution, torch.nn.ReLU()])
            input_channels = _CHANNELS[index]
    pictures = np.stack([_make_picture(), _make_picture(1)])
    features = torch.from_numpy((pictures - np.float32(_SHIFT)) / np.float32(_SCALE))
    features, expected = features.permute(0, 3, 1, 2), 0.0
    for index, layer in enumerate(network):
        features = layer(features)
        if index in (3, 8, 15, 22, 29):  # the last layer of each slice
            norms = features.square().sum(dim=1, keepdim=True).sqrt()
            first, second = features / (norms + 1e-10)
            head = weights[f"lin{(3, 8, 15, 22, 29).index(index)}.model.1.weight"][0]
            expected += float((head * (first - second) ** 2).sum(dim=0).mean())

    assert lpips.measure(*pictures) == pytest.approx(expected, rel=1e-4)


def test_the_variant_names_network_range_and_weights(lpips, weights, tmp_path):
    assert "VGG16" in lpips.variant
    assert "from 0 to 1" in lpips.variant
    torch.save({**weights, "more": torch.zeros(1)}, tmp_path / "others.pth")
    assert Lpips(tmp_path / "others.pth").variant != lpips.variant


def test_files_that_are_not_weights_are_rejected_by_name(weights, tmp_path):
    (tmp_path / "text.pth").write_text("no weights")
    head = "lin4.model.1.weight"
    nan_head, wide_head = torch.full_like(weights[head], torch.nan), torch.ones(1, 9, 1, 1)
    contents = {
        "part": {name: weights[name] for name in weights if name != head},
        "list": [1, 2],
        "number": {**weights, head: 3},
        "shape": {**weights, head: wide_head},
        "nan": {**weights, head: nan_head},
    }
    for name, content in contents.items():
        torch.save(content, tmp_path / f"{name}.pth")

    with pytest.raises(WeightsError, match=r"none\.pth cannot be read"):
        Lpips(tmp_path / "none.pth")
    with pytest.raises(WeightsError, match=r"text\.pth is not a file that torch"):
        Lpips(tmp_path / "text.pth")
    for message in (
        r"part\.pth has no tensor lin4\.model\.1\.weight",
        r"list\.pth has no tensor scaling_layer\.shift",
        r"number\.pth has no tensor lin4\.model\.1\.weight",
        r"shape\.pth: the shapes of the weights are not those of LPIPS",
        r"nan\.pth: not all weights are finite numbers",
    ):
        file_name = message.partition("\\")[0] + ".pth"
        with pytest.raises(WeightsError, match=message):
            Lpips(tmp_path / file_name)


def test_cameras_with_pictures_too_small_for_the_network_are_rejected_by_name(lpips):
    camera = make_cameras()[0]
    lpips.require_sizes([replace(camera, width=40, height=16)])

    with pytest.raises(MismatchError, match=r"16 pixels, but those of cam.* have 40 x 15"):
        lpips.require_sizes([camera, replace(camera, width=40, height=15)])
