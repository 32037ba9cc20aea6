import capture
from quarc_ref.inspection.stream_summary import KINDS


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
