"""Makes the streams in traps/, each of which detects one plausible mistake in a decoder."""

from making.trap_anchors import make_anchor_traps
from making.trap_contexts import make_context_traps
from making.trap_distances import make_distance_traps
from making.trap_lives import make_birth_and_death_traps
from making.trap_rotations import make_rotation_traps
from making.trap_snapshots import make_snapshot_traps
from making.trap_updates import make_update_traps
from making.vectors import ValidStream


def make_traps() -> list[ValidStream]:
    """Return the streams of all traps."""
    return [
        *make_anchor_traps(),
        *make_distance_traps(),
        *make_birth_and_death_traps(),
        *make_rotation_traps(),
        *make_context_traps(),
        *make_update_traps(),
        *make_snapshot_traps(),
    ]
