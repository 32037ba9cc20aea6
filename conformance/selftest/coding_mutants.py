"""Mistakes in arithmetic and in entropy coding (SPEC 4, 8)."""

from mutant import mutant

_CONTEXTS = "format/coding/contexts.py"
_MOTION = "format/coding/motion_planes.py"
_GAUSSIANS = "format/coding/gaussian_planes.py"
_WEIGHT = "((2 * ones + 1) << WEIGHT_BITS) // (2 * (zeros + ones) + 2)"
_OPENED = "    reader = PlaneReader(section, counts)\n"
_HALVED = "updated[0] + updated[1] > COUNT_LIMIT)"

MUTANTS = (
    mutant(
        "final state of the coder not checked",
        "format/coding/planes.py",
        "        self._bit_decoder.finish()\n",
        "",
    ),
    mutant(
        "a final zero word accepted",
        "format/coding/entropy.py",
        "    return (_decoder_override.get() or make_fastest_decoder)(words)",
        "    return (_decoder_override.get() or make_fastest_decoder)(np.trim_zeros(words, 'b'))",
    ),
    mutant(
        "counts of motion reset in every frame",
        "decoder/frames.py",
        "read_motion(section, contexts, state.motion_counts)",
        "read_motion(section, contexts, type(state.motion_counts)())",
    ),
    mutant(
        "counts of births reset in every frame",
        "decoder/frames.py",
        "read_births(section, header.code_planes, count, state.birth_counts)",
        "read_births(section, header.code_planes, count, type(state.birth_counts)())",
    ),
    mutant("counts never halved", _CONTEXTS, _HALVED, "updated[0] + updated[1] > 1 << 40)"),
    mutant(
        "counts halved at a total that is lower by 1",
        _CONTEXTS,
        _HALVED,
        "updated[0] + updated[1] >= COUNT_LIMIT)",
    ),
    mutant("weights of probabilities larger by 1", _CONTEXTS, _WEIGHT, f"{_WEIGHT} + 1"),
    mutant(
        "planes of sections without words not counted",
        _MOTION,
        _OPENED,
        "    if not section.words.size:\n"
        "        return [np.zeros(a.previous_motion.shape, np.int64) for a in levels], counts\n"
        f"{_OPENED}",
    ),
    mutant(
        "last context class of parents begins at 3 instead of 4",
        _MOTION,
        "_PARENT_CLASSES = _Classes(1, 2, 4)",
        "_PARENT_CLASSES = _Classes(1, 2, 3)",
    ),
    mutant(
        "last context class of signs begins at 9 instead of 8",
        _MOTION,
        "_SIGN_CONTEXTS = _Classes(-7, -3, -1, 0, 1, 2, 4, 8)",
        "_SIGN_CONTEXTS = _Classes(-8, -3, -1, 0, 1, 2, 4, 9)",
    ),
    mutant(
        "magnitudes of symbols limited to 64 instead of 65",
        "format/constants.py",
        "MAGNITUDE_PLANES: Final = 64",
        "MAGNITUDE_PLANES: Final = 63",
    ),
    mutant(
        "one context class too many for SH rest",
        "format/constants.py",
        "REST_CLASSES: Final = 8",
        "REST_CLASSES: Final = 9",
    ),
    mutant(
        "blue coded as difference from red",
        _GAUSSIANS,
        "coded[0] + coded[1], coded[0] + coded[2]\n",
        "coded[0] + coded[1], coded[0] + coded[1] + coded[2]\n",
    ),
    mutant(
        "differences of Morton keys not limited",
        _GAUSSIANS,
        "if differences.max(initial=0) > _DIFFERENCE_LIMIT:",
        "if False:",
    ),
    mutant(
        "positions outside the box accepted",
        _GAUSSIANS,
        "if keys.min(initial=0) < 0 or keys.max(initial=0) >> (3 * chunk.axis_bits):",
        "if False:",
    ),
    mutant(
        "probability code 240 read as 0",
        "format/coding/probability.py",
        "    if code >= PROBABILITY_CODES:",
        "    code %= PROBABILITY_CODES\n    if code >= PROBABILITY_CODES:",
    ),
    mutant(
        "integer square root too large by 1 if a double rounds up",
        "format/arithmetic.py",
        "root: Int64 = estimate - (estimate * estimate > values)",
        "root: Int64 = estimate",
        only_category="unit",
    ),
    mutant(
        "halves rounded to even instead of away from 0",
        "format/arithmetic.py",
        "    return np.sign(numerator) * magnitude",
        "    tie = (2 * np.abs(numerator) + divisor) % (2 * divisor) == 0\n"
        "    return np.sign(numerator) * (magnitude - (tie & (magnitude % 2 == 1)))",
    ),
)
