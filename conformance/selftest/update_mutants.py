"""Mistakes in updates (SPEC 7.8, 8.8)."""

from mutant import Mutant, mutant

_UPDATES = "decoder/updates.py"
_PLANES = "format/coding/update_planes.py"
_RECONSTRUCT = "decoder/reconstruct.py"
_FRAMES = "decoder/frames.py"
_WIRE = "format/wire.py"

MUTANTS: tuple[Mutant, ...] = (
    mutant(
        "updates ignored",
        _FRAMES,
        "state = decode_updates(state, chunk.updates)",
        "pass",
    ),
    mutant(
        "updates expected by the minor version instead of the feature bit",
        _WIRE,
        "        parsed[name] = bool(version.incompatible_features & bit)\n",
        "        parsed[name] = version.version_minor == 1 and bit != 4\n",
    ),
    mutant(
        "updates may delete all Gaussians",
        _UPDATES,
        "if deleted.size == state.scene.count:",
        "if False:",
    ),
    mutant(
        "updated positions outside the lattice accepted",
        _UPDATES,
        "narrow_positions(new_positions)",
        "new_positions",
    ),
    mutant(
        "updated codes out of range accepted",
        _UPDATES,
        "narrow_codes(new_codes)",
        "new_codes",
    ),
    mutant(
        "rotation residuals not limited",
        _UPDATES,
        "if np.abs(residuals).max(initial=0) > ROTATION_UNITY_LIMIT:",
        "if False:",
    ),
    mutant(
        "rotation residuals of 256 rejected",
        _UPDATES,
        "max(initial=0) > ROTATION_UNITY_LIMIT:",
        "max(initial=0) >= ROTATION_UNITY_LIMIT:",
    ),
    mutant(
        "rotation residuals relative to L times unity",
        _UPDATES,
        "np.full_like(residuals[:1], scene.header.rotation_unity)",
        "np.full_like(residuals[:1], scene.header.rotation_unity * scene.header.level_count)",
    ),
    mutant(
        "rotations normalized again even if their residual is 0",
        _UPDATES,
        "rotated_columns = np.flatnonzero(np.any(residuals[ROTATION], axis=0))",
        "rotated_columns = np.arange(indices.size)",
    ),
    mutant(
        "translations of updates in position steps",
        _UPDATES,
        "residuals[TRANSLATION] * scene.header.translation_step",
        "residuals[TRANSLATION] * scene.header.position_step",
    ),
    mutant(
        "recency grows beyond its maximum",
        _UPDATES,
        "np.minimum(state.known_recency + 1, RECENCY_LIMIT)",
        "np.minimum(state.known_recency + 1, 9)",
    ),
    mutant(
        "recency forgotten after one frame",
        _UPDATES,
        "np.minimum(state.known_recency + 1, RECENCY_LIMIT)",
        "np.full(state.scene.count, RECENCY_LIMIT)",
    ),
    mutant(
        "recency reset only for Gaussians with a residual",
        _UPDATES,
        "    recency[updates.gaussians] = 0\n",
        "    there = updates.dies | np.any(updates.residuals, axis=0)\n"
        "    recency[updates.gaussians[there]] = 0\n",
    ),
    mutant(
        "recency unchanged in frames without updates",
        _UPDATES,
        "np.minimum(state.known_recency + 1, RECENCY_LIMIT)",
        "np.minimum(state.known_recency + bool(updates.count), RECENCY_LIMIT)",
    ),
    mutant(
        "new Gaussians start with the maximum recency",
        _RECONSTRUCT,
        "recency = np.append(recency, np.zeros(newborn.count, dtype=np.int16))",
        "recency = np.append(recency, np.full(newborn.count, 3, dtype=np.int16))",
    ),
    mutant(
        "Gaussians of canonical frames start with recency 0",
        "decoder/canonical.py",
        "recency = np.full(count, RECENCY_LIMIT, dtype=np.int16)",
        "recency = np.zeros(count, dtype=np.int16)",
    ),
    mutant(
        "bindings assigned to the wrong Gaussians after a deletion",
        _UPDATES,
        "anchors=state.known_anchors.without(deleted)",
        "anchors=replace(state.known_anchors,"
        " binding=state.known_anchors.binding[:, : scene.count])",
    ),
    mutant(
        "motion assigned to the wrong Gaussians after a deletion",
        _UPDATES,
        "        motion=np.delete(state.motion, deleted, axis=1),\n",
        "        motion=state.motion[:, : scene.count].copy(),\n",
    ),
    mutant(
        "indices of updates counted after deletions instead of before",
        _UPDATES,
        "    surviving -= np.searchsorted(deleted, surviving)\n",
        "    surviving = np.minimum(surviving, state.scene.count - deleted.size - 1)\n",
    ),
    mutant(
        "counts of updates reset in every frame",
        _FRAMES,
        "return apply_updates(replace(state, update_counts=counts), updates)",
        "return update(state, updates)",
    ),
    mutant(
        "contexts of updates do not depend on motion",
        _PLANES,
        "(1 + (motion_sums > 1) + (motion_sums > _LARGE_MOTION))",
        "0",
    ),
    mutant(
        "motion of 3 steps coded in the context of far motion",
        _PLANES,
        "_LARGE_MOTION = 3\n",
        "_LARGE_MOTION = 2\n",
    ),
    mutant(
        "contexts of deletions do not depend on recency",
        _PLANES,
        "context.recency[changed].astype(np.int64), dies[changed]",
        "np.zeros_like(changed), dies[changed]",
    ),
    mutant(
        "field bits of updates coded without contexts",
        _PLANES,
        'planes.code(f"updates, {name}", changed_fields, is_changed)',
        'planes.code(f"updates, {name}", np.zeros_like(changed_fields), is_changed)',
    ),
    mutant(
        "contexts of residuals depend only on the last residual",
        _PLANES,
        "            residual_sums += coded[row, changed]\n",
        "            residual_sums = coded[row, changed]\n",
    ),
    mutant(
        "contexts of residuals do not depend on other residuals",
        _PLANES,
        "contexts = 3 * row + 1 + np.sign(residual_sums)",
        "contexts = 3 * row + 1 + 0 * residual_sums",
    ),
    mutant(
        "residuals of all rows share contexts",
        _PLANES,
        "contexts = 3 * row + 1 + np.sign(residual_sums)",
        "contexts = 1 + np.sign(residual_sums)",
    ),
)
