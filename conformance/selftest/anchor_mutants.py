"""Mistakes in sampling anchors and in binding Gaussians to anchors (SPEC 6)."""

from mutant import make_mutant

_ANCHORS_FILE = "decoder/anchors.py"
_BINDING_FILE = "decoder/binding.py"

MUTANTS = (
    make_mutant(
        "Philox has 7 rounds instead of 10",
        "format/constants.py",
        "PHILOX_ROUNDS: Final = 10",
        "PHILOX_ROUNDS: Final = 7",
    ),
    make_mutant(
        "random ranks depend on the frame ordinal instead of the phase",
        _ANCHORS_FILE,
        "counter[1] = scene.phase",
        "counter[1] = scene.frame",
    ),
    make_mutant(
        "the anchor levels use the random words in reverse order",
        _ANCHORS_FILE,
        "words = philox(counter, scene.header.seed)",
        "words = philox(counter, scene.header.seed)[[2, 1, 0, 3]]",
    ),
    make_mutant(
        "ties between random words are broken in favor of the highest id",
        _ANCHORS_FILE,
        "<< 32) + scene.ids",
        "<< 32) - scene.ids",
    ),
    make_mutant(
        "random words are compared as signed integers",
        _ANCHORS_FILE,
        "return ((words - (1 << 31)) << 32) + scene.ids",
        "return (words << 32) + scene.ids",
    ),
    make_mutant(
        "among equally near anchors, the last one is chosen instead of the first",
        _BINDING_FILE,
        ".argmin(axis=1)",
        "[:, ::-1].argmin(axis=1)",
        "        nearest[start : start + batch_size] = ",
        "        nearest[start : start + batch_size] = anchors.shape[1] - 1 - ",
        "np.append(True, differs_from_previous)",
        "np.append(differs_from_previous, True)",
        "self._order[pair_anchors], _INT64_MAX)",
        "self._order[pair_anchors], -1)",
        "nearest = np.minimum.reduceat(tied_anchors, run_starts)",
        "nearest = np.maximum.reduceat(tied_anchors, run_starts)",
        "& (nearest < best_anchors)",
        "& (nearest > best_anchors)",
    ),
    make_mutant(
        "distances are computed in binary32",
        _BINDING_FILE,
        "    lengths: Int64 = (differences * differences).sum(axis=0)\n",
        "    narrow = differences.astype(np.float32)\n"
        "    lengths: Int64 = (narrow * narrow).sum(axis=0).astype(np.int64)\n",
    ),
    make_mutant(
        "the number of anchors of level 1 is rounded down instead of up",
        _ANCHORS_FILE,
        "-(-gaussian_count // header.gaussians_per_anchor)",
        "max(1, gaussian_count // header.gaussians_per_anchor)",
    ),
    make_mutant(
        "the cell shift is 1 larger than the minimum",
        _ANCHORS_FILE,
        "    starts = np.flatnonzero(merge_shifts > shift)\n",
        "    shift = min(LATTICE_BITS, shift + 1)\n"
        "    starts = np.flatnonzero(merge_shifts > shift)\n",
    ),
)
