from paper.quality import measure_quality
from tests.encoder.masked_toys import NoisySource, add_masks
from tests.encoder.toys import make_capture, make_splats


def test_masked_pixels_are_not_measured():
    capture, frames = make_capture(), [(0, make_splats(0)), (1, make_splats(0))]
    clean_capture, noisy_capture = add_masks(capture), add_masks(capture, NoisySource(capture))

    quality = measure_quality(frames, capture.cameras, clean_capture, None)

    assert quality == measure_quality(frames, capture.cameras, noisy_capture, None)
    assert quality.psnr_moving[1] < quality.psnr[1]
