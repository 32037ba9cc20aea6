"""Explanations of table columns and rows, shown at the end of a command's `--help`.

docs/guides/comparing.md explains the columns of `eval` and `compare` in more detail.
"""

from collections.abc import Mapping

_QUALITY_COLUMNS = {
    "PSNR": "in dB against the camera's picture, mean over frames; higher is better, at most 100.",
    "cc": "the metric to its left after color correction: colors are fitted to the truth.",
    "SSIM": "structural similarity, up to 1; higher is better.",
    "moving, static": "PSNR of foreground pixels, where the truth differs from the "
    "background, and PSNR of all other pixels.",
    "flicker": "mean change of static pixels from frame to frame, in 8-bit levels.",
    "of truth": "flicker of the capture's own pictures, caused by camera noise.",
    "LPIPS": "perceptual distance; lower is better.",
}
EVAL_COLUMNS = _QUALITY_COLUMNS
COMPARE_COLUMNS = {
    "entry, kind": "METHOD@POINT; what the entry is: stream, PLY per frame, renders, 4dgs.",
    "runs": "number of entries with this METHOD@POINT; if above 1, figures are mean ± deviation.",
    "PSNR, SSIM, LPIPS": "against the truth, mean over frames and cameras; PSNR is at most 100 dB.",
    "cc PSNR": "PSNR after color correction, which fits the rendered colors to the truth.",
    "moving, static": _QUALITY_COLUMNS["moving, static"],
    "flicker": _QUALITY_COLUMNS["flicker"],
    "bytes, KB / frame": "size of all frames of the entry; a KB is 1024 bytes.",
    "Mb/s": "megabits per second at the capture's frame rate.",
    "dB to first": "difference in PSNR from the first entry, computed for each view and averaged.",
    "better": "share of the views in which the entry has a higher PSNR than the first entry; a "
    "difference below 0.005 dB counts as half a view.",
    "BD-rate": "difference in bytes from the first method at equal PSNR; negative means fewer.",
    "BD-rate by SSIM": "the same difference in bytes, but at equal SSIM.",
    "BD-PSNR": "difference in PSNR from the first method at equal bytes.",
}
INFO_ROWS = {
    "Gaussians": "their number in the last frame; inspect lists that of every frame.",
    "anchors": "points whose motion is coded: the largest number in a frame; they are resampled at "
    "a regular interval.",
    "canonical, snapshots": "bytes of the frames at which decoding can start.",
    "motion, updates, births": "bytes of other frames: moving anchors, changed and new Gaussians.",
    "zero-order estimate": "the paper's estimate of the size of the same symbols (entropy).",
    "overhead": "headers, cameras, metadata and checksums.",
    "KB per frame": "mean size of the frames that are not keyframes; then the size of the whole "
    "stream divided by the number of frames; a KB is 1024 bytes.",
}


def format_explanations(explanations: Mapping[str, str]) -> str:
    """Return the explanations, one per line, as the epilog of a command's `--help`."""
    return "\n\n".join(f"{name}: {explanation}" for name, explanation in explanations.items())
