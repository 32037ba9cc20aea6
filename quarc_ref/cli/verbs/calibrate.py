"""The `calibrate` command: makes a capture from recordings without poses."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from quarc_ref.cli.errors import UsageError, report_errors
from quarc_ref.cli.options import AsJson, Force, FrameRate, Quiet, check_folder
from quarc_ref.cli.output import (
    TerminalProgress,
    print_columns,
    print_fields,
    print_json,
    print_message,
)
from quarc_ref.cli.targets import reject_input_folder, written_folder

if TYPE_CHECKING:
    from quarc_ref.calibration.calibrate import Calibration
    from quarc_ref.calibration.recordings import Recordings
    from quarc_ref.calibration.world import Distance
    from quarc_ref.datasets.calibration import Lens

ModelName = Literal[
    "auto",
    "SIMPLE_PINHOLE",
    "PINHOLE",
    "SIMPLE_RADIAL",
    "RADIAL",
    "OPENCV",
    "FULL_OPENCV",
    "SIMPLE_RADIAL_FISHEYE",
    "RADIAL_FISHEYE",
    "OPENCV_FISHEYE",
]


def calibrate(
    recordings: Annotated[
        Path,
        typer.Argument(
            metavar="DIR",
            help="Folder with one video, or one folder of pictures, per camera.",
            show_default=False,
            readable=False,
            callback=check_folder,
        ),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="CAPTURE", help="Folder to create.")
    ],
    camera_model: Annotated[
        ModelName,
        typer.Option(
            "--camera-model",
            metavar="NAME",
            help="COLMAP camera model; auto: pinhole, with one distortion coefficient if needed.",
        ),
    ] = "auto",
    lenses: Annotated[
        Literal["shared", "each"],
        typer.Option(
            "--lenses",
            help="shared: cameras with the same picture size have the same intrinsics; each: "
            "every camera has its own.",
        ),
    ] = "shared",
    intrinsics: Annotated[
        Path | None,
        typer.Option(
            "--intrinsics",
            metavar="CAPTURE",
            help="Use the intrinsics of another capture that was made with the same cameras, and "
            "do not optimize them.",
            callback=lambda path: path and check_folder(path),
        ),
    ] = None,
    masks: Annotated[
        Path | None,
        typer.Option(
            "--mask",
            metavar="DIR",
            help="Folder of masks, one picture per camera, such as cam00.png; black pixels are "
            "ignored.",
            callback=lambda path: path and check_folder(path),
        ),
    ] = None,
    moments: Annotated[
        int | None,
        typer.Option(
            "--moments",
            min=1,
            help="Number of time points at which features are detected and matched.",
            show_default="2 to 8, as needed",
        ),
    ] = None,
    sync: Annotated[
        Literal["auto", "sound", "motion", "none"],
        typer.Option(
            "--sync",
            help="How to estimate the time offsets between cameras: from sound, from motion, or "
            "not at all (none). auto uses sound if that of all videos can be decoded, else motion.",
        ),
    ] = "auto",
    fps: FrameRate = None,
    up: Annotated[
        str,
        typer.Option(
            "--up",
            metavar="HOW",
            help="How to find the up axis. level: assume that all cameras are level; plane: "
            "assume that the cameras lie in a horizontal plane; NAME: assume that camera NAME "
            "is level.",
        ),
    ] = "level",
    meters: Annotated[
        tuple[str, str, float] | None,
        typer.Option(
            "--meters",
            metavar="CAM_A CAM_B D",
            help="Distance D in meters between two cameras; sets the scale of the scene.",
        ),
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Make a capture from recordings: find poses, intrinsics and time offsets of the cameras."""
    with report_errors():
        from quarc_ref.calibration.calibrate import CalibrateOptions
        from quarc_ref.calibration.calibrate import calibrate as run_calibration
        from quarc_ref.calibration.errors import UnknownCameraError
        from quarc_ref.calibration.lenses import LensOptions
        from quarc_ref.calibration.masks import read_masks
        from quarc_ref.calibration.offsets import SyncMethod
        from quarc_ref.calibration.report import PAGE_NAME, write_report
        from quarc_ref.calibration.write_capture import write_capture
        from quarc_ref.datasets.errors import MaskNameError

        start_time = time.monotonic()
        distance = _parse_distance(meters)
        reject_input_folder(output, (recordings, intrinsics, masks))
        with (
            TerminalProgress(quiet=quiet) as progress,
            written_folder(output, force=force) as folder,
        ):
            found_recordings = _find_recordings(recordings, fps)
            _reject_unknown_cameras(found_recordings, up, distance)
            known_lenses = _read_known_lenses(intrinsics, found_recordings)
            try:
                options = CalibrateOptions(
                    LensOptions(camera_model, lenses == "shared", known_lenses),
                    moments,
                    read_masks(masks, found_recordings) if masks else {},
                    SyncMethod(sync),
                    up,
                    distance,
                    progress.advance,
                )
                calibration = run_calibration(found_recordings, options)
            except (UnknownCameraError, MaskNameError) as error:
                raise UsageError(str(error)) from error
            write_capture(calibration, folder)
            write_report(calibration, recordings.resolve().name, folder)
        seconds = round(time.monotonic() - start_time, 1)
        _print_result(output, calibration, output / PAGE_NAME, seconds, as_json=as_json)


def _find_recordings(folder: Path, frames_per_second: float | None) -> "Recordings":
    """Find the recordings in a folder, and print which ones are left out."""
    from quarc_ref.calibration.recordings import find_recordings

    recordings = find_recordings(folder, frames_per_second)
    for name, reason in recordings.left_out.items():
        print_message(f"camera {name} is left out: {reason}")
    return recordings


def _read_known_lenses(capture: Path | None, recordings: "Recordings") -> "dict[str, Lens] | None":
    """Return the lens of each camera from another capture; None without a capture."""
    from quarc_ref.calibration.lenses import read_lenses

    if capture is None:
        return None
    return read_lenses(capture, recordings.names, recordings.pictures.sizes)


def _parse_distance(meters: tuple[str, str, float] | None) -> "Distance | None":
    from quarc_ref.calibration.world import Distance

    if meters is None:
        return None
    if not 0 < meters[2] < float("inf"):
        message = f"--meters: the distance {meters[2]:g} is not a number above 0"
        raise UsageError(message)
    if meters[0] == meters[1]:
        message = f"--meters: camera {meters[0]} is given twice; name two different cameras"
        raise UsageError(message)
    return Distance(*meters)


def _reject_unknown_cameras(recordings: "Recordings", up: str, distance: "Distance | None") -> None:
    """Raise UsageError before calibration starts if an option names an unknown camera."""
    from quarc_ref.calibration.world import UP_FROM_CAMERA_PLANE, UP_FROM_LEVEL_CAMERAS

    option_by_camera = {} if up in (UP_FROM_LEVEL_CAMERAS, UP_FROM_CAMERA_PLANE) else {up: "--up"}
    option_by_camera |= (
        dict.fromkeys((distance.first, distance.second), "--meters") if distance else {}
    )
    for name, option in option_by_camera.items():
        if name not in recordings.names:
            message = (
                f"{option}: there is no camera {name}; choose one of {', '.join(recordings.names)}"
            )
            raise UsageError(message)


def _print_result(
    output: Path, calibration: "Calibration", page: Path, seconds: float, *, as_json: bool
) -> None:
    from quarc_ref.calibration.report import CAMERA_HEADINGS, make_camera_rows

    if as_json:
        values = {**_as_json(calibration), "report": str(page), "seconds": seconds}
        print_json("calibrate/2", {"folder": str(output), **values})
        return
    solution = calibration.solution
    for name, reason in solution.left_out.items():
        print_message(f"camera {name} could not be calibrated: {reason}")
    for name in calibration.unreliable_cameras:
        print_message(
            f"the pose of camera {name} depends on only {solution.fits[name].support} points "
            "and may be inaccurate: use more pictures (--moments 16)"
        )
    unreliable_names = [
        name for name in calibration.offsets.unreliable_cameras if name not in solution.left_out
    ]
    if unreliable_names:
        print_message(
            f"the time offsets of {', '.join(unreliable_names)} could not be estimated reliably: "
            "offset 0 is used"
        )
    fields = {
        "cameras": f"{len(solution.cameras)} of {calibration.camera_count}",
        "reprojection error": f"{solution.mean_error:.2f} px",
        "points": f"{len(calibration.points.positions):,}",
        "offsets": _describe_offsets(calibration),
        "up from": calibration.world.up_source,
        "seconds": f"{seconds}",
        "report": str(page),
    }
    print_fields(output.name, fields)
    first_heading, *other_headings = CAMERA_HEADINGS
    print_columns("Cameras", [f"<{first_heading}", *other_headings], make_camera_rows(calibration))


def _describe_offsets(calibration: "Calibration") -> str:
    from quarc_ref.calibration.offsets import MIN_MOTION_FRAMES, SyncMethod

    method, problem = calibration.offsets.method, calibration.offsets.sound_problem
    remark = f"; {problem}" if problem else ""
    if method is not SyncMethod.NONE:
        return f"from {method.value}{remark}"
    is_short = min(calibration.recordings.pictures.lengths) < MIN_MOTION_FRAMES
    reason = f" (--sync motion needs {MIN_MOTION_FRAMES} frames)" if is_short else ""
    return f"not estimated; all are 0{reason}{remark}"


def _as_json(calibration: "Calibration") -> dict[str, object]:
    """Return a calibration in the form that `docs/schemas/calibrate.json` describes."""
    confidence = calibration.offsets.confidence
    return {
        "cameras": {
            name: {
                "mean_error": fit.mean_error,
                "median_error": fit.median_error,
                "points": fit.point_count,
                "supported_points": fit.support,
                "offset": calibration.offsets.frame_offsets[name],
                "confidence": confidence.get(name),
            }
            for name, fit in calibration.solution.fits.items()
        },
        "left_out": calibration.left_out,
        "mean_error": calibration.solution.mean_error,
        "points": len(calibration.points.positions),
        "moments": calibration.moment_count,
        "sync": str(calibration.offsets.method),
        "up": list(calibration.world.up),
        "meters_per_unit": calibration.world.meters_per_unit,
    }
