"""Mistakes in arithmetic and in entropy coding (SPEC 4, 8)."""

from mutant import make_mutant

_CONTEXTS_FILE = "format/coding/contexts.py"
_MOTION_FILE = "format/coding/motion_planes.py"
_GAUSSIANS_FILE = "format/coding/gaussian_planes.py"
_WEIGHT_CODE = "((2 * ones + 1) << WEIGHT_BITS) // (2 * (zeros + ones) + 2)"
_OPENED_CODE = "    reader = PlaneReader(section, counts)\n"
_HALVED_CODE = "updated[0] + updated[1] > COUNT_LIMIT)"

MUTANTS = (
    make_mutant(
        "final state of the coder not checked",
        "format/coding/planes.py",
        "        self._bit_decoder.finish()\n",
        "",
    ),
    make_mutant(
        "a final zero word accepted",
        "format/coding/entropy.py",
        "    return (_decoder_override.get() or make_fastest_decoder)(words)",
        "    return (_decoder_override.get() or make_fastest_decoder)(np.trim_zeros(words, 'b'))",
    ),
    make_mutant(
        "counts of motion reset in every frame",
        "decoder/frames.py",
        "read_motion(section, contexts, state.motion_counts)",
        "read_motion(section, contexts, type(state.motion_counts)())",
    ),
    make_mutant(
        "counts of births reset in every frame",
        "decoder/frames.py",
        "read_births(section, header.code_planes, count, state.birth_counts)",
        "read_births(section, header.code_planes, count, type(state.birth_counts)())",
    ),
    make_mutant(
        "counts never halved", _CONTEXTS_FILE, _HALVED_CODE, "updated[0] + updated[1] > 1 << 40)"
    ),
    make_mutant(
        "counts halved at a total that is lower by 1",
        _CONTEXTS_FILE,
        _HALVED_CODE,
        "updated[0] + updated[1] >= COUNT_LIMIT)",
    ),
    make_mutant(
        "weights of probabilities larger by 1", _CONTEXTS_FILE, _WEIGHT_CODE, f"{_WEIGHT_CODE} + 1"
    ),
    make_mutant(
        "planes of sections without words not counted",
        _MOTION_FILE,
        _OPENED_CODE,
        "    if not section.words.size:\n"
        "        return [np.zeros(a.previous_motion.shape, np.int64) for a in levels], counts\n"
        f"{_OPENED_CODE}",
    ),
    make_mutant(
        "last context class of parents begins at 3 instead of 4",
        _MOTION_FILE,
        "_PARENT_CLASSES = _Classes(1, 2, 4)",
        "_PARENT_CLASSES = _Classes(1, 2, 3)",
    ),
    make_mutant(
        "last context class of signs begins at 9 instead of 8",
        _MOTION_FILE,
        "_SIGN_CONTEXTS = _Classes(-7, -3, -1, 0, 1, 2, 4, 8)",
        "_SIGN_CONTEXTS = _Classes(-8, -3, -1, 0, 1, 2, 4, 9)",
    ),
    make_mutant(
        "magnitudes of symbols limited to 64 instead of 65",
        "format/constants.py",
        "MAGNITUDE_PLANES: Final = 64",
        "MAGNITUDE_PLANES: Final = 63",
    ),
    make_mutant(
        "one context class too many for SH rest",
        "format/constants.py",
        "REST_CLASSES: Final = 8",
        "REST_CLASSES: Final = 9",
    ),
    make_mutant(
        "blue coded as difference from red",
        _GAUSSIANS_FILE,
        "coded[0] + coded[1], coded[0] + coded[2]\n",
        "coded[0] + coded[1], coded[0] + coded[1] + coded[2]\n",
    ),
    make_mutant(
        "differences of Morton keys not limited",
        _GAUSSIANS_FILE,
        "if differences.max(initial=0) > _DIFFERENCE_LIMIT:",
        "if False:",
    ),
    make_mutant(
        "positions outside the box accepted",
        _GAUSSIANS_FILE,
        "if keys.min(initial=0) < 0 or keys.max(initial=0) >> (3 * chunk.axis_bits):",
        "if False:",
    ),
    make_mutant(
        "probability code 240 read as 0",
        "format/coding/probability.py",
        "    if code >= PROBABILITY_CODES:",
        "    code %= PROBABILITY_CODES\n    if code >= PROBABILITY_CODES:",
    ),
    make_mutant(
        "integer square root too large by 1 if a double rounds up",
        "format/arithmetic.py",
        "root: Int64 = estimate - (estimate * estimate > values)",
        "root: Int64 = estimate",
        only_category="unit",
    ),
    make_mutant(
        "halves rounded to even instead of away from 0",
        "format/arithmetic.py",
        "    return np.sign(numerator) * magnitude",
        "    tie = (2 * np.abs(numerator) + divisor) % (2 * divisor) == 0\n"
        "    return np.sign(numerator) * (magnitude - (tie & (magnitude % 2 == 1)))",
    ),
)
