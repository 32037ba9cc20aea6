"""Meanings of the columns and rows of printed tables, for the end of `--help`.

docs/guides/comparing.md and docs/guides/streams.md explain them in more detail.
"""

from collections.abc import Mapping

_QUALITY = {
    "PSNR": "dB against the camera's picture, mean over frames; higher is better, at most 100.",
    "cc": "the previous column after fitting the picture's colors to the truth.",
    "SSIM": "structural similarity, up to 1; higher is better.",
    "moving, static": "PSNR of pixels that differ from the static background, and of others.",
    "flicker": "mean change of static pixels between frames, in levels of 255.",
    "of truth": "flicker of the capture's pictures, which is caused by noise.",
    "LPIPS": "perceptual distance; lower is better.",
}
EVAL = _QUALITY
COMPARE = {
    "entry": "METHOD@POINT; kind of entry: stream, PLY per frame, renders, 4dgs.",
    "runs": "number of entries of METHOD@POINT; values of several runs are mean ± deviation.",
    "PSNR, SSIM, LPIPS": "against the truth, mean over frames and cameras; PSNR is at most 100 dB.",
    "cc PSNR": "PSNR after fitting the picture's colors to the truth.",
    "moving, static": _QUALITY["moving, static"],
    "flicker": _QUALITY["flicker"],
    "bytes, KB / frame": "size of all frames of the entry; a KB is 1024 bytes.",
    "Mb/s": "megabits per second at the capture's frame rate.",
    "dB to first": "mean difference in PSNR from the first entry over all views.",
    "better": "share of the views in which the entry has the higher PSNR.",
    "BD-rate": "difference in bytes from the first method at equal quality; negative is better.",
    "BD-PSNR": "difference in PSNR from the first method at equal bytes.",
}
INFO = {
    "anchors": "points whose motion is coded; they are sampled again at regular intervals.",
    "canonical, snapshots": "bytes of the frames at which decoding can start.",
    "motion, updates, births": "bytes of other frames: anchors, updated Gaussians, new Gaussians.",
    "zero-order estimate": "the paper's entropy estimate for the same symbols.",
    "overhead": "headers, cameras, metadata and checksums.",
    "KB per frame": "without and with the bytes of canonical frames.",
}


def explain(meanings: Mapping[str, str]) -> str:
    """Format the meanings as the epilog of a command, one per line."""
    return "\n\n".join(f"{name}: {meaning}" for name, meaning in meanings.items())
