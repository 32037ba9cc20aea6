"""Detects SIFT features at several moments, and matches the cameras' features at each moment.

pycolmap detects the features on the CPU, and a COLMAP database stores them.
"""

from collections.abc import Callable, Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quarc_ref.calibration.fusion import Indices, Keypoints
from quarc_ref.datasets.capture import Image
from quarc_ref.datasets.colmap_import import pycolmap
from quarc_ref.files import write_file

_MAX_FEATURES = 4096  # maximum per picture
_MAX_PICTURE_SIZE = 1600  # pixels: larger pictures are downscaled to this size
_PAIRS_PER_STEP = 64  # matched image pairs between two progress reports

Mask = NDArray[np.bool_]
StepCallback = Callable[[int, int], None]


class Features:
    """Features in the pictures of all cameras of a rig.

    Args:
        folder: An empty working folder.
        masks: `[H, W]` mask of each camera, True where features may be used; None for all pixels.

    Attributes:
        moments: Moments added so far.
        folder: The working folder, which also contains the pictures of the added moments.
    """

    def __init__(self, folder: Path, masks: Sequence[Mask | None]) -> None:
        self.folder = folder
        self.moments: list[int] = []
        self._masks = tuple(masks)
        self._database = folder / "features.db"

    def add_moment(
        self, moment: int, pictures: Sequence[Image], report_progress: StepCallback
    ) -> None:
        """Detect and match the features of one moment.

        Args:
            moment: Unique number of the moment.
            pictures: `[H, W, 3]` sRGB picture of each camera.
            report_progress: Function to call with the number of finished steps and the total
                number.
        """
        names = [_make_file_name(camera, moment) for camera in range(len(pictures))]
        pairs = list(combinations(names, 2))
        total = len(names) + len(pairs)
        for index, (name, picture) in enumerate(zip(names, pictures, strict=True)):
            self._extract_features(name, picture, self._masks[index])
            report_progress(index + 1, total)
        for start in range(0, len(pairs), _PAIRS_PER_STEP):
            self._match_pairs(pairs[start : start + _PAIRS_PER_STEP])
            report_progress(min(len(names) + start + _PAIRS_PER_STEP, total), total)
        self.moments.append(moment)

    def read_keypoints(self, camera: int) -> list[Keypoints]:
        """Return the `[K, 6]` keypoints of a camera at each moment."""
        with pycolmap.Database.open(self._database) as database:
            return [
                np.asarray(
                    database.read_keypoints(self._find_image_id(database, camera, moment)),
                    np.float32,
                )
                for moment in self.moments
            ]

    def read_matches(self, first: int, second: int) -> list[Indices]:
        """Return the `[M, 2]` indices of matching keypoints of two cameras at each moment."""
        with pycolmap.Database.open(self._database) as database:
            return [
                np.asarray(
                    database.read_matches(
                        self._find_image_id(database, first, moment),
                        self._find_image_id(database, second, moment),
                    ),
                    np.int64,
                ).reshape(-1, 2)
                for moment in self.moments
            ]

    def _extract_features(self, name: str, picture: Image, mask: Mask | None) -> None:
        pycolmap.Bitmap.from_array(picture).write(self.folder / name)
        reader_options = pycolmap.ImageReaderOptions()
        if mask is not None:
            mask_folder = self.folder / "masks"
            mask_folder.mkdir(exist_ok=True)
            levels = np.where(mask, np.uint8(255), np.uint8(0))
            pycolmap.Bitmap.from_array(levels).write(mask_folder / f"{name}.png")
            reader_options.mask_path = str(mask_folder)
        options = pycolmap.FeatureExtractionOptions()
        options.max_image_size = _MAX_PICTURE_SIZE
        options.sift.max_num_features = _MAX_FEATURES
        pycolmap.extract_features(
            self._database,
            self.folder,
            image_names=[name],
            reader_options=reader_options,
            extraction_options=options,
            device=pycolmap.Device.cpu,
        )

    def _match_pairs(self, pairs: Sequence[tuple[str, str]]) -> None:
        pair_list_path = self.folder / "pairs.txt"
        write_file(
            pair_list_path, "".join(f"{first} {second}\n" for first, second in pairs).encode()
        )
        matching_options = pycolmap.FeatureMatchingOptions()
        # `match_graph` verifies the matches of all moments together
        matching_options.skip_geometric_verification = True
        pairing_options = pycolmap.ImportedPairingOptions()
        pairing_options.match_list_path = str(pair_list_path)
        pycolmap.match_image_pairs(
            self._database, matching_options, pairing_options, device=pycolmap.Device.cpu
        )

    def _find_image_id(self, database: pycolmap.Database, camera: int, moment: int) -> int:
        image = database.read_image_with_name(_make_file_name(camera, moment))
        if image is None:
            message = f"moment {moment} has not been added"
            raise ValueError(message)
        return int(image.image_id)


def _make_file_name(camera: int, moment: int) -> str:
    return f"{camera:04d}_{moment:06d}.png"
