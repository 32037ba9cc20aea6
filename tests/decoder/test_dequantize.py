import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.decoder import dequantize
from quarc_ref.decoder.canonical import begin_canonical
from tests import strategies
from tests.small_streams import make_gaussians


@given(data=st.data(), count=st.sampled_from([1, 9, 63, 64, 65, 130]))
def test_every_value_is_its_code_times_its_step_rounded_once(data, count):
    header = data.draw(strategies.headers())
    scene = begin_canonical(header, 0, make_gaussians(header, count)).scene

    splats = dequantize(scene)

    fields = [
        (splats.positions.T, scene.positions, 2.0**-header.lattice_exponent),
        (splats.rotations.T, scene.rotations, 2.0**-22),
        (splats.log_scales.T, scene.codes[:3], header.log_scale_step),
        (splats.opacities[None], scene.codes[3:4], header.opacity_step),
        (splats.sh[:, 0].T, scene.codes[4:7], header.sh_dc_step),
        (splats.sh[:, 1:].reshape(count, -1).T, scene.codes[7:], header.sh_rest_step),
    ]
    for floats, codes, step in fields:
        exact = (codes.astype(np.float64) * step).astype(np.float32)
        assert floats.dtype == np.float32
        assert floats.shape == exact.shape
        assert floats.tobytes() == exact.tobytes()


def test_a_stream_of_degree_0_has_one_coefficient():
    header = strategies.StreamHeader(sh_degree=0)
    scene = begin_canonical(header, 0, make_gaussians(header, 4)).scene

    assert dequantize(scene).sh.shape == (4, 1, 3)
