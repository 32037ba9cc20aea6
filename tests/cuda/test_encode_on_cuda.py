"""The encoder on a simulated CUDA device (`simulated_device`)."""

import io
import sys
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor
from torch.overrides import TorchFunctionMode

from quarc_ref.decoder import dequantize
from quarc_ref.encoder import EncodeOptions, description, encode
from quarc_ref.encoder.forecast import forecast
from quarc_ref.encoder.resume import checkpoint
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import PRESETS
from quarc_ref.encoder.stream_file import encode_file
from quarc_ref.rendering import raster_gsplat
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.streams import decode
from quarc_ref.streams.chunk_reader import split_chunks
from tests.cuda import simulated_gsplat
from tests.cuda.simulated_device import CudaTensor, simulate_cuda
from tests.encoder.masked_toys import add_masks
from tests.encoder.toys import make_capture
from tests.marks import thorough


def _shorten(preset: EncoderConfig) -> EncoderConfig:
    """Return a preset with few iterations and Gaussians, in which everything happens."""
    canonical = replace(
        preset.canonical, iterations=20, initial_gaussians=100, max_gaussians=130,
        max_gaussians_from_views=0, sh_from_iter=16, densify_from_iter=4, densify_until_iter=14,
        densification_interval=4, densify_grad_threshold=1e-6, quantize_from=0.8,
        half_resolution_until_iter=4, exposure_from_iter=2,
    )  # fmt: skip
    births = replace(
        preset.births, iterations=4, error_threshold=1e-3, grad_threshold=1e-6, split_iters=(2,),
        max_births=8, max_parent_scale=1.0,
    )  # fmt: skip
    motion = replace(preset.motion, iterations=6)
    return replace(preset, canonical=canonical, motion=motion, births=births)


_MAIN = _shorten(PRESETS["main"])


@pytest.fixture(autouse=True)
def _cuda(monkeypatch):
    monkeypatch.setitem(sys.modules, "gsplat", simulated_gsplat)
    monkeypatch.setattr(raster_gsplat, "_has_kernels", lambda: True)
    monkeypatch.setattr(description, "version", lambda _: "1")
    with simulate_cuda(monkeypatch):
        yield


def _encode(config, device, capture=None):
    sink = io.BytesIO()
    encode(capture or make_capture(3), sink, EncodeOptions(config, device=device))
    return sink.getvalue()


def _measure_errors(data):
    """Return the mean squared error of each frame on the training views."""
    capture, errors = make_capture(3), []
    for scene in decode(data):
        splats = dequantize(scene)
        pictures = [render_picture(splats, capture.cameras[view]) for view in capture.training]
        truths = [capture.image(view, scene.frame) / 255 for view in capture.training]
        errors.append(float(np.square(np.clip(pictures, 0, 1) - truths).mean()))
    return errors


def _list_kinds(data):
    return [chunk.kind for chunk in split_chunks(data)]


def test_tensors_of_different_devices_do_not_mix():
    tensor = torch.arange(3.0, device="cuda")

    assert isinstance(tensor * 2 + torch.tensor(1.0), CudaTensor)
    with pytest.raises(RuntimeError, match="same device"):
        tensor + torch.ones(3)
    with pytest.raises(RuntimeError, match="same device"):
        torch.ones(3)[tensor.long()]
    with pytest.raises(TypeError, match="numpy"):
        tensor.numpy()
    assert tensor[torch.tensor([2])].cpu().numpy() == [2]


@pytest.mark.parametrize(
    ("preset", "interval"), [("main", "snapshot_interval"), thorough("paper", "keyframe_interval")]
)
def test_a_stream_encoded_on_cuda_is_as_good_as_one_of_the_cpu(preset, interval):
    config = _shorten(PRESETS[preset])
    config = replace(config, canonical=replace(config.canonical, **{interval: 2}))

    data, expected = _encode(config, "cuda"), _encode(config, "cpu")

    assert _measure_errors(data) == pytest.approx(_measure_errors(expected), rel=0.25)
    assert _list_kinds(data) == _list_kinds(expected)


@pytest.mark.thorough
def test_an_interrupted_encode_on_cuda_resumes_to_the_same_bytes(tmp_path, monkeypatch):
    monkeypatch.setattr(checkpoint, "_SAVE_INTERVAL_SECONDS", 0.0)
    config = replace(_MAIN, motion=replace(_MAIN.motion, iterations=2))
    expected = _encode(config, "cuda", add_masks(make_capture(2)))
    path = tmp_path / "toy.quarc"
    with pytest.raises(KeyboardInterrupt):
        encode_file(
            add_masks(make_capture(2)), path, EncodeOptions(config, 2, "cuda", _Interrupt())
        )

    encode_file(add_masks(make_capture(2)), path, EncodeOptions(config, 2, "cuda"))

    assert path.read_bytes() == expected


@pytest.mark.thorough
def test_an_encode_on_cuda_is_forecast():
    assert forecast(make_capture(2), _MAIN, device="cuda").seconds > 0


def test_the_encoder_does_not_wait_for_the_gpu_in_an_iteration(monkeypatch):
    rasterize, counter = simulated_gsplat.rasterization, _WaitCounter()

    def rasterize_uncounted(*args, **kwargs):
        waits = list(counter.waits)
        results = rasterize(*args, **kwargs)
        counter.waits = waits
        return results

    monkeypatch.setattr(simulated_gsplat, "rasterization", rasterize_uncounted)
    with counter:
        encode(make_capture(3), io.BytesIO(), EncodeOptions(_MAIN, device="cuda", progress=counter))

    assert counter.last_waits == {"motion": [], "births": []}


_WAITING = (
    torch.tensor, Tensor.new_tensor, Tensor.cpu, Tensor.tolist, Tensor.item, Tensor.nonzero,
    torch.nonzero, Tensor.__bool__, Tensor.__int__, Tensor.__float__,
)  # fmt: skip


class _WaitCounter(TorchFunctionMode):
    """Progress that lists the operations in the last iteration of a stage that wait for a GPU."""

    def __init__(self):
        super().__init__()
        self.last_waits, self.waits = {}, []

    def __torch_function__(self, func, types, args=(), kwargs=None):
        result = func(*args, **(kwargs or {}))
        first, has_moved = args[0], False
        if func is Tensor.to:
            has_moved = isinstance(first, CudaTensor) != isinstance(result, CudaTensor)
        elif func is Tensor.__getitem__:
            has_moved = isinstance(args[1], CudaTensor) and args[1].dtype == torch.bool
        elif func in _WAITING:
            has_moved = isinstance(first, CudaTensor) or isinstance(result, CudaTensor)
        if has_moved:
            self.waits.append(func.__name__)
        return result

    def advance(self, stage, _done, _total):
        if stage in ("motion", "births"):
            self.last_waits[stage] = self.waits
        self.waits = []


class _Interrupt:
    """Progress that interrupts the training of frame 0 after densification."""

    def advance(self, stage, done, _total):
        if stage == "canonical" and done == 15:
            raise KeyboardInterrupt
