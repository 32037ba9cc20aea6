"""Mistakes in arithmetic and in entropy coding (SPEC 4, 8)."""

from mutant import make_mutant

_CONTEXTS_FILE = "format/coding/contexts.py"
_MOTION_FILE = "format/coding/motion_planes.py"
_GAUSSIANS_FILE = "format/coding/gaussian_planes.py"
_WEIGHT_CODE = "((2 * ones + 1) << WEIGHT_BITS) // (2 * (zeros + ones) + 2)"
_READER_CODE = "    reader = PlaneReader(section, counts)\n"
_HALVING_CODE = "updated[0] + updated[1] > COUNT_LIMIT)"

MUTANTS = (
    make_mutant(
        "the final state of the coder is not checked",
        "format/coding/planes.py",
        "        self._bit_decoder.finish()\n",
        "",
    ),
    make_mutant(
        "a final zero word is accepted",
        "format/coding/entropy.py",
        "    return (_decoder_override.get() or make_fastest_decoder)(words)",
        "    return (_decoder_override.get() or make_fastest_decoder)(np.trim_zeros(words, 'b'))",
    ),
    make_mutant(
        "the counts of motion are reset in every frame",
        "decoder/frames.py",
        "read_motion(section, contexts, state.motion_counts)",
        "read_motion(section, contexts, type(state.motion_counts)())",
    ),
    make_mutant(
        "the counts of births are reset in every frame",
        "decoder/frames.py",
        "read_births(section, header.code_planes, count, state.birth_counts)",
        "read_births(section, header.code_planes, count, type(state.birth_counts)())",
    ),
    make_mutant(
        "counts are never halved",
        _CONTEXTS_FILE,
        _HALVING_CODE,
        "updated[0] + updated[1] > 1 << 40)",
    ),
    make_mutant(
        "counts are halved when their sum reaches the limit, before it exceeds it",
        _CONTEXTS_FILE,
        _HALVING_CODE,
        "updated[0] + updated[1] >= COUNT_LIMIT)",
    ),
    make_mutant(
        "the weights of ones are 1 too large", _CONTEXTS_FILE, _WEIGHT_CODE, f"{_WEIGHT_CODE} + 1"
    ),
    make_mutant(
        "planes of a section that has no words are not added to the counts",
        _MOTION_FILE,
        _READER_CODE,
        "    if not section.words.size:\n"
        "        return [np.zeros(a.previous_motion.shape, np.int64) for a in levels], counts\n"
        f"{_READER_CODE}",
    ),
    make_mutant(
        "the last context class of parents begins at 3 instead of 4",
        _MOTION_FILE,
        "_PARENT_CLASSES = _Classes(1, 2, 4)",
        "_PARENT_CLASSES = _Classes(1, 2, 3)",
    ),
    make_mutant(
        "the first and last context classes of signs begin at magnitude 9 instead of 8",
        _MOTION_FILE,
        "_SIGN_CONTEXTS = _Classes(-7, -3, -1, 0, 1, 2, 4, 8)",
        "_SIGN_CONTEXTS = _Classes(-8, -3, -1, 0, 1, 2, 4, 9)",
    ),
    make_mutant(
        "the magnitudes of symbols are limited to 64 instead of 65",
        "format/constants.py",
        "MAGNITUDE_PLANES: Final = 64",
        "MAGNITUDE_PLANES: Final = 63",
    ),
    make_mutant(
        "SH rest has one context class too many",
        "format/constants.py",
        "REST_CLASSES: Final = 8",
        "REST_CLASSES: Final = 9",
    ),
    make_mutant(
        "blue is coded relative to red instead of green",
        _GAUSSIANS_FILE,
        "coded[0] + coded[1], coded[0] + coded[2]\n",
        "coded[0] + coded[1], coded[0] + coded[1] + coded[2]\n",
    ),
    make_mutant(
        "the differences of Morton keys are not limited",
        _GAUSSIANS_FILE,
        "if differences.max(initial=0) > _DIFFERENCE_LIMIT:",
        "if False:",
    ),
    make_mutant(
        "a difference of exactly 2^60 is rejected",
        _GAUSSIANS_FILE,
        "if differences.max(initial=0) > _DIFFERENCE_LIMIT:",
        "if differences.max(initial=0) >= _DIFFERENCE_LIMIT:",
    ),
    make_mutant(
        "the log-scales of newborn Gaussians wrap at 16 bits",
        _GAUSSIANS_FILE,
        "    log_scales = np.cumsum(log_scales, axis=0)\n",
        "    log_scales = np.cumsum(log_scales, axis=0).astype(np.int16)\n",
    ),
    make_mutant(
        "the log-scale of y of a newborn Gaussian wraps at 16 bits",
        _GAUSSIANS_FILE,
        "    log_scales = np.cumsum(log_scales, axis=0)\n",
        "    log_scales = np.cumsum(log_scales, axis=0)\n"
        "    log_scales[1] = log_scales[1].astype(np.int16)\n",
    ),
    make_mutant(
        "red and blue wrap at 16 bits",
        _GAUSSIANS_FILE,
        "    return np.stack([red, green, blue])\n",
        "    return np.stack([red, green, blue]).astype(np.int16)\n",
    ),
    make_mutant(
        "positions outside the box are accepted",
        _GAUSSIANS_FILE,
        "if keys.min(initial=0) < 0 or keys.max(initial=0) >> (3 * chunk.axis_bits):",
        "if False:",
    ),
    make_mutant(
        "probability code 240 is read as 0",
        "format/coding/probability.py",
        "    if code >= PROBABILITY_CODES:",
        "    code %= PROBABILITY_CODES\n    if code >= PROBABILITY_CODES:",
    ),
    make_mutant(
        "the integer square root is 1 too large if its floating-point estimate was rounded up",
        "format/arithmetic.py",
        "root: Int64 = estimate - (estimate * estimate > values)",
        "root: Int64 = estimate",
        only_category="unit",
    ),
    make_mutant(
        "halves are rounded to even instead of away from 0",
        "format/arithmetic.py",
        "    return np.sign(numerator) * magnitude",
        "    tie = (2 * np.abs(numerator) + divisor) % (2 * divisor) == 0\n"
        "    return np.sign(numerator) * (magnitude - (tie & (magnitude % 2 == 1)))",
    ),
)
