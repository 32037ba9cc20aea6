"""Conditions of a measurement, which are reported with its results.

The values come from the stream, the capture and the installed packages.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version

from quarc_ref import __version__
from quarc_ref.datasets.capture import Capture
from quarc_ref.evaluation.camera_meter import VARIANTS
from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import VERSION_MAJOR, VERSION_MINOR

RENDERER = "numba on the CPU, float32, black background"
_PACKAGES = ("numpy", "numba", "torch", "gsplat")


@dataclass(frozen=True, slots=True)
class Protocol:
    """The conditions of a measurement.

    Attributes:
        capture: Name of the capture.
        fingerprint: Fingerprint of the capture, a digest of its files.
        encoded_from: Fingerprint of the capture from which the stream was encoded; None if the
            stream contains no fingerprint.
        training_cameras: Names of the training cameras.
        held_out_cameras: Names of the measured cameras.
        resolution: Width and height of the first held-out camera.
        first_frame: Ordinal of the first measured frame.
        frame_count: Number of measured frames.
        seed: Seed of all random numbers of the encoder.
        renderer: Description of the renderer.
        versions: Versions of this package, the format and installed libraries.
        metrics: Description of each metric's exact variant, keyed by metric name.
    """

    capture: str
    fingerprint: str
    encoded_from: str | None
    training_cameras: tuple[str, ...]
    held_out_cameras: tuple[str, ...]
    resolution: tuple[int, int]
    first_frame: int
    frame_count: int
    seed: int
    renderer: str
    versions: dict[str, str]
    metrics: dict[str, str]

    @property
    def is_same_capture(self) -> bool | None:
        """Whether the stream comes from this capture; None if the stream has no fingerprint."""
        return None if self.encoded_from is None else self.encoded_from == self.fingerprint

    def as_json(self) -> dict[str, object]:
        """Return the protocol as part of the output of `eval --json`."""
        return {
            "capture": self.capture,
            "fingerprint": self.fingerprint,
            "encoded_from": self.encoded_from,
            "cameras": {
                "training": list(self.training_cameras),
                "held_out": list(self.held_out_cameras),
            },
            "resolution": list(self.resolution),
            "first_frame": self.first_frame,
            "frames": self.frame_count,
            "seed": self.seed,
            "renderer": self.renderer,
            "versions": self.versions,
            "metrics": self.metrics,
        }

    def as_texts(self) -> dict[str, str]:
        """Return the protocol as readable texts by name."""
        source_text = "this capture" if self.is_same_capture else self.encoded_from
        return {
            "capture": f"{self.capture}, fingerprint {self.fingerprint}",
            "encoded from": source_text or "unknown: the stream has no fingerprint",
            "training cameras": ", ".join(self.training_cameras),
            "held-out cameras": ", ".join(self.held_out_cameras),
            "resolution": " x ".join(map(str, self.resolution)),
            "frames": f"{self.frame_count}, from frame {self.first_frame}",
            "seed": str(self.seed),
            "renderer": self.renderer,
            "versions": _format_versions(self.versions),
            "metrics": "; ".join(self.metrics.values()),
        }


def make_protocol(
    capture: Capture,
    cameras: Sequence[Camera],
    frames: Sequence[int],
    seed: int,
    encoded_from: str | None,
) -> Protocol:
    """Return the conditions of a measurement.

    Args:
        capture: The capture whose held-out pictures are the ground truth.
        cameras: Cameras of the stream, at least one of which is held out.
        frames: Ordinals of the measured frames.
        seed: Seed of the stream.
        encoded_from: Fingerprint that the stream contains; None if there is no fingerprint.
    """
    held_out_cameras = [camera for camera in cameras if camera.held_out]
    return Protocol(
        capture.name,
        capture.fingerprint,
        encoded_from,
        tuple(camera.name for camera in cameras if not camera.held_out),
        tuple(camera.name for camera in held_out_cameras),
        (held_out_cameras[0].width, held_out_cameras[0].height),
        frames[0],
        len(frames),
        seed,
        RENDERER,
        list_versions(),
        VARIANTS,
    )


@dataclass(frozen=True, slots=True)
class SharedProtocol:
    """The conditions of a comparison that all its entries share.

    Attributes:
        fingerprint: Fingerprint of the capture; None if the truth is not a capture.
        resolution: Width and height of the first camera.
        renderer: Description of the renderer, with which all entries except renders are drawn.
        versions: Versions of this package, the format and installed libraries.
    """

    fingerprint: str | None
    resolution: tuple[int, int]
    renderer: str
    versions: dict[str, str]

    def as_json(self) -> dict[str, object]:
        """Return the protocol as part of the output of `compare --json`."""
        return {**asdict(self), "resolution": list(self.resolution)}

    def as_texts(self) -> dict[str, str]:
        """Return the protocol as readable texts by name."""
        return {
            "fingerprint of the capture": self.fingerprint or "none: the truth is an entry",
            "resolution": " x ".join(map(str, self.resolution)),
            "renderer": f"{self.renderer}; entries of the kind renders are pictures already",
            "versions": _format_versions(self.versions),
        }


def make_shared_protocol(capture: Capture | None, camera: Camera) -> SharedProtocol:
    """Return the conditions of a comparison.

    Args:
        capture: The capture whose pictures are the ground truth; None if it is an entry.
        camera: First camera of the comparison.
    """
    fingerprint = None if capture is None else capture.fingerprint
    return SharedProtocol(fingerprint, (camera.width, camera.height), RENDERER, list_versions())


def _format_versions(versions: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {number}" for name, number in versions.items())


def list_versions() -> dict[str, str]:
    """Return the versions of this package, the format and installed libraries."""
    versions = {"quarc-ref": __version__, "format": f"{VERSION_MAJOR}.{VERSION_MINOR}"}
    for package in _PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    return versions
