import numpy as np
import torch

from quarc_ref.decoder import dequantize
from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.format.records import StreamHeader
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.rendering.raster_numba import NumbaRasterizer
from tests.rendering.scenes import make_camera
from tests.small_streams import make_gaussians


def test_pictures_are_the_same_with_and_without_torch():
    scene = begin_canonical(StreamHeader(), 0, make_gaussians(StreamHeader(), 300)).scene
    splats, camera = dequantize(scene), make_camera(60, 40, near=0.01)

    picture = render_picture(splats, camera)

    attributes = from_splats(splats, torch.device("cpu"))
    torch_picture = NumbaRasterizer().render(attributes.activated(), camera, torch.zeros(3)).image
    assert picture.max() > 0.1
    # exp and sigmoid of torch and NumPy differ in the last bit.
    assert np.abs(picture - torch_picture.numpy()).max() < 1e-5
