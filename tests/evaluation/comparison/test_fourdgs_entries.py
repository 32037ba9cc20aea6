"""Tests of `.4dgs` files as entries of a comparison."""

import numpy as np
import pytest

from quarc_ref.export.errors import UnreadableFramesError
from tests.cli.commands import run


def _list_means(comparison, name="psnr"):
    return [entry.quality.mean()[name] for entry in comparison.measured_entries]


def test_frames_of_fourdgs_have_nearly_the_same_quality(method_outputs, compare, tmp_path):
    fourdgs = pytest.importorskip("fourdgs")
    del fourdgs
    from fourdgs.keyframe_delta_file import write_sequence

    from quarc_ref.streams import decode
    from rate.keyframe_deltas import _make_samples

    samples = list(_make_samples(decode((method_outputs.folder / "a.quarc").read_bytes())))
    (tmp_path / "a.4dgs").write_bytes(write_sequence(samples, 4 * samples[1].t0))
    comparison = compare(
        method_outputs.folder / "plys", tmp_path / "a.4dgs", capture=method_outputs.capture
    )
    ply_psnr, fourdgs_psnr = _list_means(comparison)

    assert comparison.frames == (0, 1, 2, 3)
    assert fourdgs_psnr == pytest.approx(ply_psnr, abs=0.5)


def test_a_fourdgs_file_begins_at_the_frame_in_its_sequence_json(method_outputs, compare, tmp_path):
    pytest.importorskip("fourdgs")
    stream = method_outputs.folder / "a.quarc"
    for name, frames in (("all", "0:4"), ("late", "2:4")):
        options = ("--to", "4dgs", "--frames", frames, "-o", tmp_path / name)
        assert run("decode", stream, *options).exit_code == 0
    comparison = compare(
        *(tmp_path / name / "frames.4dgs" for name in ("all", "late")),
        capture=method_outputs.capture,
    )
    of_all, of_late = _list_means(comparison)

    assert comparison.frames == (2, 3)
    assert of_late == pytest.approx(of_all, abs=1e-3)


def test_a_fourdgs_file_of_births_is_read_with_its_spherical_harmonics(tmp_path):
    fourdgs = pytest.importorskip("fourdgs")
    from quarc_ref.export.fourdgs_file import read_4dgs

    rng = np.random.default_rng(4)
    count = 5
    rotations = np.tile(np.array([0.6, 0, 0, 0.8], dtype=np.float32), (count, 1))
    levels = rng.integers(0, 256, (count, 9), dtype=np.uint8)
    gaussians = fourdgs.GaussianSet(
        positions=rng.uniform(-1, 1, (count, 3)).astype(np.float32),
        scales=np.full((count, 3), 0.1, dtype=np.float32),
        rotations=rotations,
        colors=np.full((count, 4), 0.25, dtype=np.float32),
        motions=np.full((count, 3), 0.5, dtype=np.float32),
        mu_t=np.zeros(count, dtype=np.float32),
        sigma_t=np.full(count, np.inf, dtype=np.float32),
        win_lo=np.zeros(count),
        win_hi=np.full(count, 2.0),
        sh=levels,
        sh_degree=1,
    )
    fourdgs.write(tmp_path / "a.4dgs", gaussians, 2.0)
    sequence = read_4dgs((tmp_path / "a.4dgs").read_bytes(), 1.0)
    (first, _), (later, _) = sequence.read()

    assert sequence.count == 2
    assert later.positions == pytest.approx(first.positions + 0.5, abs=1e-2)
    assert first.rotations == pytest.approx(np.roll(rotations, 1, axis=1), abs=1e-2)
    assert np.exp(first.log_scales) == pytest.approx(np.full((count, 3), 0.1), rel=0.05)
    assert 1 / (1 + np.exp(-first.opacities)) == pytest.approx(np.full(count, 0.25), abs=0.01)
    # The file stores SH by channel and then coefficient; `Splats` by coefficient and then channel.
    written_order = np.lexsort(gaussians.positions.T)
    read_order = np.lexsort(first.positions.T)
    expected = (levels / 255 * 8 - 4).reshape(count, 3, 3).transpose(0, 2, 1)
    assert first.sh[read_order, 1:] == pytest.approx(expected[written_order], abs=0.2)


def test_a_file_that_is_not_fourdgs_is_rejected_by_name(method_outputs, compare, tmp_path):
    pytest.importorskip("fourdgs")
    (tmp_path / "a.4dgs").write_bytes(b"\x00" * 64)

    with pytest.raises(UnreadableFramesError, match=r"a\.4dgs"):
        compare(
            method_outputs.folder / "a.quarc", tmp_path / "a.4dgs", capture=method_outputs.capture
        )
