"""Mistakes in updates (SPEC 7.8, 8.8)."""

from mutant import Mutant, make_mutant

_UPDATES_FILE = "decoder/updates.py"
_PLANES_FILE = "format/coding/update_planes.py"
_RECONSTRUCT_FILE = "decoder/reconstruct.py"
_FRAMES_FILE = "decoder/frames.py"
_WIRE_FILE = "format/wire.py"

MUTANTS: tuple[Mutant, ...] = (
    make_mutant(
        "updates are ignored",
        _FRAMES_FILE,
        "state = decode_updates(state, chunk.updates)",
        "pass",
    ),
    make_mutant(
        "the minor version decides whether frames have updates, not the feature bit",
        _WIRE_FILE,
        "        parsed[name] = bool(version.incompatible_features & bit)\n",
        "        parsed[name] = version.version_minor == 1 and bit != 4\n",
    ),
    make_mutant(
        "updates may delete all Gaussians",
        _UPDATES_FILE,
        "if deleted.size == state.scene.count:",
        "if False:",
    ),
    make_mutant(
        "updated positions outside the lattice are accepted",
        _UPDATES_FILE,
        "narrow_positions(new_positions)",
        "new_positions",
    ),
    make_mutant(
        "updated codes out of range are accepted",
        _UPDATES_FILE,
        "narrow_codes(new_codes)",
        "new_codes",
    ),
    make_mutant(
        "rotation residuals of updates are not limited",
        _UPDATES_FILE,
        "if np.abs(residuals).max(initial=0) > ROTATION_UNITY_LIMIT:",
        "if False:",
    ),
    make_mutant(
        "rotation residuals of 256 are rejected",
        _UPDATES_FILE,
        "max(initial=0) > ROTATION_UNITY_LIMIT:",
        "max(initial=0) >= ROTATION_UNITY_LIMIT:",
    ),
    make_mutant(
        "rotation residuals of updates are relative to L x rotation_unity",
        _UPDATES_FILE,
        "np.full_like(residuals[:1], scene.header.rotation_unity)",
        "np.full_like(residuals[:1], scene.header.rotation_unity * scene.header.level_count)",
    ),
    make_mutant(
        "updates normalize rotations again even if the rotation residual is 0",
        _UPDATES_FILE,
        "rotated_columns = np.flatnonzero(np.any(residuals[ROTATION], axis=0))",
        "rotated_columns = np.arange(indices.size)",
    ),
    make_mutant(
        "the translations of updates are in position steps",
        _UPDATES_FILE,
        "residuals[TRANSLATION] * scene.header.translation_step",
        "residuals[TRANSLATION] * scene.header.position_step",
    ),
    make_mutant(
        "recency grows beyond its maximum",
        _UPDATES_FILE,
        "np.minimum(state.required_recency + 1, RECENCY_LIMIT)",
        "np.minimum(state.required_recency + 1, 9)",
    ),
    make_mutant(
        "recency is at its maximum one frame after an update",
        _UPDATES_FILE,
        "np.minimum(state.required_recency + 1, RECENCY_LIMIT)",
        "np.full(state.scene.count, RECENCY_LIMIT)",
    ),
    make_mutant(
        "an update whose residuals are all 0 does not reset recency",
        _UPDATES_FILE,
        "    recency[updates.gaussians] = 0\n",
        "    there = updates.dies | np.any(updates.residuals, axis=0)\n"
        "    recency[updates.gaussians[there]] = 0\n",
    ),
    make_mutant(
        "recency does not grow in frames without updates",
        _UPDATES_FILE,
        "np.minimum(state.required_recency + 1, RECENCY_LIMIT)",
        "np.minimum(state.required_recency + bool(updates.count), RECENCY_LIMIT)",
    ),
    make_mutant(
        "new Gaussians start with the maximum recency",
        _RECONSTRUCT_FILE,
        "recency = np.append(recency, np.zeros(newborn.count, dtype=np.int16))",
        "recency = np.append(recency, np.full(newborn.count, 3, dtype=np.int16))",
    ),
    make_mutant(
        "Gaussians of canonical frames start with recency 0",
        "decoder/canonical.py",
        "recency = np.full(count, RECENCY_LIMIT, dtype=np.int16)",
        "recency = np.zeros(count, dtype=np.int16)",
    ),
    make_mutant(
        "after a deletion, bindings are assigned to the wrong Gaussians",
        _UPDATES_FILE,
        "anchors=state.required_anchors.without(deleted)",
        "anchors=replace(state.required_anchors,"
        " binding=state.required_anchors.binding[:, : scene.count])",
    ),
    make_mutant(
        "after a deletion, motion is assigned to the wrong Gaussians",
        _UPDATES_FILE,
        "        motion=np.delete(state.motion, deleted, axis=1),\n",
        "        motion=state.motion[:, : scene.count].copy(),\n",
    ),
    make_mutant(
        "the indices of updates are counted after deletions instead of before them",
        _UPDATES_FILE,
        "    surviving -= np.searchsorted(deleted, surviving)\n",
        "    surviving = np.minimum(surviving, state.scene.count - deleted.size - 1)\n",
    ),
    make_mutant(
        "the counts of updates are reset in every frame",
        _FRAMES_FILE,
        "return apply_updates(replace(state, update_counts=counts), updates)",
        "return apply_updates(state, updates)",
    ),
    make_mutant(
        "the contexts of updates do not depend on motion",
        _PLANES_FILE,
        "(1 + (motion_sums > 1) + (motion_sums > _LARGE_MOTION))",
        "0",
    ),
    make_mutant(
        "the contexts of updates do not depend on the last of seven channels of motion",
        _PLANES_FILE,
        "np.abs(context.motion[:, moved])",
        "np.abs(context.motion[:6, moved])",
    ),
    make_mutant(
        "motion of 3 steps is coded in the context of larger motion",
        _PLANES_FILE,
        "_LARGE_MOTION = 3\n",
        "_LARGE_MOTION = 2\n",
    ),
    make_mutant(
        "the contexts of deletions do not depend on recency",
        _PLANES_FILE,
        "context.recency[changed].astype(np.int64), dies[changed]",
        "np.zeros_like(changed), dies[changed]",
    ),
    make_mutant(
        "the field bits of updates are all coded in context 0",
        _PLANES_FILE,
        'planes.code(f"updates, {name}", changed_fields, is_changed)',
        'planes.code(f"updates, {name}", np.zeros_like(changed_fields), is_changed)',
    ),
    make_mutant(
        "the context of a residual depends only on the residual before it",
        _PLANES_FILE,
        "            residual_sums += coded[row, changed]\n",
        "            residual_sums = coded[row, changed]\n",
    ),
    make_mutant(
        "the contexts of residuals do not depend on other residuals",
        _PLANES_FILE,
        "contexts = 3 * row + 1 + np.sign(residual_sums)",
        "contexts = 3 * row + 1 + 0 * residual_sums",
    ),
    make_mutant(
        "the residuals of all rows share contexts",
        _PLANES_FILE,
        "contexts = 3 * row + 1 + np.sign(residual_sums)",
        "contexts = 1 + np.sign(residual_sums)",
    ),
)
