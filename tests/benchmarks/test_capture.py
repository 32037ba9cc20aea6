import capture
from quarc_ref.encoder import encode_stream
from quarc_ref.encoder.settings.presets import PRESETS
from quarc_ref.encoder.stage_timer import StageTimer
from quarc_ref.inspection.stream_summary import KINDS
from tests.datasets import scenes
from tests.encoder.toys import SMALL


def test_opening_the_capture_does_not_count_as_encoding_and_coding_frame_0_does(
    tmp_path, monkeypatch
):
    """A clock that only these functions advance makes the times exact."""
    folder = scenes.write_n3dv(
        tmp_path / "plane", scenes.make_shots(), 2, scenes.make_plane_points()
    )
    now = 0.0

    def slow_down(module, name, seconds):
        original = getattr(module, name)

        def run(*arguments, **options):
            nonlocal now
            now += seconds
            return original(*arguments, **options)

        monkeypatch.setattr(module, name, run)

    monkeypatch.setattr(capture, "StageTimer", lambda: StageTimer(clock=lambda: now))
    slow_down(capture, "open_capture", 100.0)
    slow_down(encode_stream, "check_first_frame", 10.0)
    slow_down(encode_stream, "fit_births", 1.0)
    monkeypatch.setitem(PRESETS, "small", SMALL)

    row = capture.measure(folder, "small", None)

    assert (row["seconds_canonical"], row["seconds_per_frame"]) == (10.0, 1.0)


def test_the_table_compares_every_kind_of_bytes_with_its_estimate(capsys):
    numbers = dict.fromkeys(
        ("frames", "gaussians", "psnr_first", "psnr_mean", "psnr_worst", "ssim_mean",
         "kb_per_frame", "seconds_canonical", "seconds_per_frame"), 1,
    )  # fmt: skip
    coded_bytes = {kind: 10 * rank for rank, kind in enumerate(KINDS)}
    estimate_bytes = dict.fromkeys(KINDS, 10) | {"snapshots": 0}
    row = {"capture": "plane", "preset": "main", "bytes": coded_bytes, **numbers}

    capture.print_markdown([row | {"estimate_bytes": estimate_bytes}])

    header, _, line = capsys.readouterr().out.splitlines()
    assert ", ".join(KINDS) in header
    assert "| 0.00, none, 2.00, 3.00, 4.00 |" in line


def test_one_frame_has_no_figures_of_later_frames(tmp_path, monkeypatch, capsys):
    folder = scenes.write_n3dv(
        tmp_path / "plane", scenes.make_shots(), 2, scenes.make_plane_points()
    )
    monkeypatch.setitem(PRESETS, "small", SMALL)

    row = capture.measure(folder, "small", 1)
    capture.print_markdown([row])

    assert (row["kb_per_frame"], row["seconds_per_frame"]) == (None, None)
    assert capsys.readouterr().out.endswith("| none |\n")
