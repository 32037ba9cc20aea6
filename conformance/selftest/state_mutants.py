"""Mistakes in reconstructing the state of a frame (SPEC 7, 9)."""

from mutant import Mutant, make_mutant

_RECONSTRUCT_FILE = "decoder/reconstruct.py"
_FRAMES_FILE = "decoder/frames.py"
_LIMITS_FILE = "decoder/limits.py"
_RANGES_FILE = "decoder/ranges.py"
_DIGEST_FILE = "decoder/digest.py"
_ROTATION_FILE = "decoder/rotation.py"
_STREAM_FILE = "decoder/stream_decoder.py"
_ROTATED_CODE = "rotated = np.flatnonzero(np.any(sums, axis=0))"
_DEATHS_CODE = 'order = np.argsort(scene.codes[OPACITY.start], kind="stable")'
_DECODING_CODE = "        self._state = decode(chunk, self._seek_target)\n"
_NORMALIZING_CODE = "_normalize(rounded, PRODUCT_GUARD_BITS).astype(np.int32)\n"

MUTANTS = (
    make_mutant(
        "a frame with the maximum number of Gaussians of its level is rejected",
        _LIMITS_FILE,
        "if count > header.limits.gaussians:",
        "if count >= header.limits.gaussians:",
    ),
    make_mutant(
        "a frame with the maximum number of births of its level is rejected",
        _LIMITS_FILE,
        "if count > header.limits.births:",
        "if count >= header.limits.births:",
        only_category="levels",
    ),
    make_mutant(
        "at the unlimited level, memory is allocated for any declared number of Gaussians",
        _LIMITS_FILE,
        '    _decline_above(_DECODER_LIMITS.gaussians, count, "Gaussians")\n',
        "",
        only_category="resource",
    ),
    make_mutant(
        "positions outside the lattice are accepted",
        _RANGES_FILE,
        "    if _any_beyond(positions, POSITION_LIMIT):",
        "    if False:",
    ),
    make_mutant(
        "codes out of range are accepted",
        _RANGES_FILE,
        "    if _any_beyond(codes, CODE_LIMIT):",
        "    if False:",
    ),
    make_mutant(
        "the state CRC is not checked",
        _FRAMES_FILE,
        "    if state_crc(scene) != stored_crc:",
        "    if stored_crc is None:",
    ),
    make_mutant(
        "the state CRC covers all fields in every frame",
        _DIGEST_FILE,
        "covers_all_fields = scene.phase % scene.header.full_crc_interval == 0",
        "covers_all_fields = True",
    ),
    make_mutant(
        "anchors are sampled only after a canonical frame",
        _RECONSTRUCT_FILE,
        "if anchors is None or "
        "previous_scene.phase % previous_scene.header.resample_interval == 0:",
        "if anchors is None:",
    ),
    make_mutant(
        "anchors are sampled one frame early",
        _RECONSTRUCT_FILE,
        "or previous_scene.phase % previous_scene.header.resample_interval == 0:",
        "or scene.phase % scene.header.resample_interval == 0:",
    ),
    Mutant(
        "deaths are chosen after the motion instead of before it",
        (
            (
                _FRAMES_FILE,
                "    state = begin_frame(state, chunk.death_count)\n",
                "    before, state = state, begin_frame(state, 0)\n",
            ),
            (
                _FRAMES_FILE,
                "    state = decode_births(state, chunk.births, chunk.birth_count)\n",
                "    gone = choose_deaths(before.scene, chunk.death_count)\n"
                "    motion = np.delete(state.motion, gone, axis=1)\n"
                "    state = replace(state, scene=state.scene.without(gone), motion=motion)\n"
                "    state = replace(state, anchors=state.anchors.without(gone))\n"
                "    state = decode_births(state, chunk.births, chunk.birth_count)\n",
            ),
            (
                _FRAMES_FILE,
                "from quarc_ref.decoder.digest import",
                "import numpy as np\n"
                "from quarc_ref.decoder.reconstruct import choose_deaths\n"
                "from quarc_ref.decoder.digest import",
            ),
        ),
    ),
    make_mutant(
        "among Gaussians with equal opacities, the one with the highest index dies first",
        _RECONSTRUCT_FILE,
        _DEATHS_CODE,
        "order = np.argsort(scene.codes[OPACITY.start][::-1], kind='stable')\n"
        "    order = scene.count - 1 - order",
    ),
    make_mutant(
        "opacities are compared as unsigned integers",
        _RECONSTRUCT_FILE,
        "np.argsort(scene.codes[OPACITY.start],",
        "np.argsort(scene.codes[OPACITY.start].astype(np.uint16),",
    ),
    make_mutant(
        "new Gaussians are bound to the anchors of their parents",
        _RECONSTRUCT_FILE,
        "anchors.with_births(scene.positions[:, anchors.binding.shape[1] :])\n",
        "replace(state.anchors, binding=np.delete(np.hstack([state.anchors.binding,"
        " state.anchors.binding[:, state.births.parents]"
        " if state.births else state.anchors.binding[:, :0]]), deleted, axis=1))\n",
    ),
    make_mutant(
        "the ids of deleted Gaussians are reused",
        _RECONSTRUCT_FILE,
        "np.append(scene.ids, state.next_id + np.arange(newborn.count))",
        "np.append(scene.ids, int(scene.ids[-1]) + 1 + np.arange(newborn.count))",
    ),
    make_mutant(
        "births are relative to the positions of their parents before the motion",
        _RECONSTRUCT_FILE,
        "scene.positions[:, births.parents] + newborn",
        "scene.positions[:, births.parents]"
        " - state.motion[:3, births.parents] * header.translation_step + newborn",
    ),
    make_mutant(
        "an anchor keeps its previous motion after its Gaussian has been deleted",
        _RECONSTRUCT_FILE,
        "is_alive = state.scene.ids[indices] == owners",
        "is_alive = np.ones(indices.shape, np.bool_)",
    ),
    make_mutant(
        "previous_contexts is ignored",
        _RECONSTRUCT_FILE,
        "level_motion if use_previous else np.zeros_like(level_motion)",
        "level_motion",
    ),
    make_mutant(
        "a canonical frame does not reset the counts",
        _STREAM_FILE,
        _DECODING_CODE,
        "        before = self._state\n"
        f"{_DECODING_CODE}"
        "        if before is not None:\n"
        "            self._state = replace(self._state, motion_counts=before.motion_counts,"
        " birth_counts=before.birth_counts)\n",
        "from typing import Any\n",
        "from dataclasses import replace\nfrom typing import Any\n",
    ),
    make_mutant(
        "rotations are normalized again even if their residuals sum to 0",
        _RECONSTRUCT_FILE,
        _ROTATED_CODE,
        "rotated = np.arange(scene.count)",
        only_category="traps",
    ),
    make_mutant(
        "rotation residuals whose only nonzero component is w are ignored",
        _RECONSTRUCT_FILE,
        _ROTATED_CODE,
        "rotated = np.flatnonzero(np.any(sums[-3:], axis=0))",
    ),
    make_mutant(
        "rotation residuals are multiplied on the left",
        _ROTATION_FILE,
        "    aw, ax, ay, az = rotations.astype(np.int64)\n    bw, bx, by, bz = residuals\n",
        "    aw, ax, ay, az = residuals\n    bw, bx, by, bz = rotations.astype(np.int64)\n",
    ),
    make_mutant(
        "rotations with a negative w are negated",
        _ROTATION_FILE,
        f"    rounded = divide_round(product, ROTATION_ONE)\n    return {_NORMALIZING_CODE}",
        f"    rounded = divide_round(product, ROTATION_ONE)\n    turned = {_NORMALIZING_CODE}"
        "    return np.where(turned[0] < 0, -turned, turned)\n",
    ),
    make_mutant(
        "the components of a rotation are not limited before they are squared",
        _ROTATION_FILE,
        "if np.any(np.abs(coded[1:]) > unity) or ",
        "if ",
    ),
    make_mutant(
        "rotations with a norm above 1 are accepted",
        _ROTATION_FILE,
        " or np.any(squared_largest < 0):",
        ":",
    ),
)
