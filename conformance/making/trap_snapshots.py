"""Makes vectors in traps/ for snapshots (SPEC 7.9, 8.9)."""

from making.changes import Change, CodedGaussian, Survivor
from making.scenes import choose_some_codes, make_births, make_cloud, make_moving_symbols
from making.snapshot_scenes import (
    REQUIRED_CAPABILITY,
    make_differences,
    make_random_survivors,
    make_snapshot_head,
)
from making.streams import Stream
from making.trap_making import make_distinct_motion, make_distinct_symbols, make_trap_streams
from making.update_scenes import make_random_updates
from making.vectors import ValidStream

_SCENE = make_cloud(10, 60, 0, limit=30)


def make_snapshot_traps() -> list[ValidStream]:
    """Return the traps for snapshots."""
    return make_trap_streams(
        (
            ("snapshots-of-the-canonical-frame", make_snapshots_of_canonical, "7.9-2"),
            ("snapshots-have-no-past", make_snapshots_that_reset_contexts, "7.9 8.2"),
            ("snapshots-sort-anew", make_sorted_snapshots, "7.9"),
            ("equal-places-in-order", make_equal_positions_in_order, "7.9"),
            ("ids-begin-anew", make_ids_after_snapshot, "7.9 7.6-5"),
            ("snapshot-steps", make_snapshot_position_steps, "7.9"),
            ("differences-of-neighbors", make_relative_position_differences, "8.9"),
            ("sums-of-what-is-coded", make_difference_contexts_by_field, "8.9"),
            ("snapshots-sample-anew", make_sampling_after_snapshot, "7.9 7.4"),
            ("stated-survivors-are-counted", make_survivor_counts_with_codes, "8.1 8.2 8.9"),
            ("differences-add-up", make_large_position_differences, "7.9 8.9"),
            ("differences-of-all-classes", make_differences_of_all_classes, "8.9"),
        ),
        **REQUIRED_CAPABILITY,
    )


def make_snapshots_of_canonical() -> Stream:
    """A snapshot is coded against the CANO, not against the frame or the snapshot before it."""
    stream = (
        Stream(make_snapshot_head(sh_degree=0))
        .add_canonical(0, _SCENE)
        .add_frame(make_distinct_motion())
    )
    stream.add_snapshot(make_random_survivors(range(0, 10, 2), 1)).add_frame(make_distinct_motion())
    return stream.add_snapshot(make_random_survivors(range(10), 2)).add_frame(
        make_distinct_motion()
    )


def make_snapshots_that_reset_contexts() -> Stream:
    """A snapshot resets counts, motion and recency."""
    stream = Stream(make_snapshot_head(sh_degree=0, incompatible_features=6)).add_canonical(
        0, _SCENE
    )
    for frame in range(1, 4):
        change = Change(
            make_moving_symbols(6, frame),
            make_births([2, 5], frame, 0),
            2,
            updates=make_random_updates(8, frame),
        )
        stream.add_frame(change)
    stream.add_snapshot(make_random_survivors(range(9), 3))
    return stream.add_frame(
        Change(make_moving_symbols(6, 3), updates=make_random_updates(9, 3))
    ).add_frame(make_distinct_motion())


def make_sorted_snapshots() -> Stream:
    """Survivors and new Gaussians are sorted together, in Morton order of their positions."""
    stream = Stream(make_snapshot_head(sh_degree=0)).add_canonical(0, _SCENE)
    moved_survivors = [
        Survivor(i, make_differences(position=(40 - 9 * i, 7 * i, -5 * i))) for i in range(10)
    ]
    return stream.add_snapshot(moved_survivors, make_cloud(6, 61, 0, limit=50)).add_frame(
        make_distinct_motion()
    )


def make_equal_positions_in_order() -> Stream:
    """Survivors precede new Gaussians at the same position, and keep the order of the CANO."""
    gaussians = [CodedGaussian((i, 0, 0), codes=(-40, -40, -40, 5 - i, i, 0, 0)) for i in range(4)]
    stream = Stream(make_snapshot_head(sh_degree=0, gaussians_per_anchor=1)).add_canonical(
        0, gaussians
    )
    moved_survivors = [Survivor(i, make_differences(position=(3 - i, 0, 0))) for i in range(4)]
    births = [CodedGaussian((3, 0, 0), codes=(-30, -30, -30, k, k, k, k)) for k in (9, 8)]
    return stream.add_snapshot(moved_survivors, births).add_frame(make_distinct_motion())


def make_ids_after_snapshot() -> Stream:
    """The first Gaussian born after a snapshot of N Gaussians gets id N."""
    stream = Stream(make_snapshot_head(sh_degree=0)).add_canonical(0, _SCENE)
    stream.add_frame(Change(births=make_births([1, 2, 3], 1, 0)))
    stream.add_snapshot(make_random_survivors(range(5), 4)).add_frame(
        Change(births=make_births([0, 4], 2, 0))
    )
    return stream.add_frame(make_distinct_motion())


def make_snapshot_position_steps() -> Stream:
    """Position differences are in position steps, not in translation steps."""
    head = make_snapshot_head(sh_degree=0, position_step=3, translation_step=11)
    stream = Stream(head).add_canonical(0, _SCENE)
    moved_survivors = [Survivor(i, make_differences(position=(i, -i, 1))) for i in range(10)]
    return stream.add_snapshot(moved_survivors).add_frame(make_distinct_motion())


def make_relative_position_differences() -> Stream:
    """A position difference is coded relative to the one before it."""
    stream = Stream(make_snapshot_head(sh_degree=0)).add_canonical(0, _SCENE)
    moved_survivors = [
        Survivor(i, make_differences(position=(9 + i, 9 - i, 9)) if i % 3 else (0,) * 14)
        for i in range(10)
    ]
    return stream.add_snapshot(moved_survivors).add_frame(make_distinct_motion())


def make_difference_contexts_by_field() -> Stream:
    """Contexts depend on the sums of coded magnitudes, which start at 0 in every field."""
    stream = Stream(make_snapshot_head(sh_degree=0)).add_canonical(0, _SCENE)
    changed_survivors = [
        Survivor(i, (3 * i, -2 * i, i, 0, i % 5, 1 - i % 3, 2, i, -i, i % 2, -3, i, 4 - i, 1))
        for i in range(10)
    ]
    return stream.add_snapshot(changed_survivors).add_frame(make_distinct_motion())


def make_sampling_after_snapshot() -> Stream:
    """The frame after a snapshot has phase 1 and samples anchors."""
    head = make_snapshot_head(sh_degree=0, resample_interval=4, full_crc_interval=2)
    stream = (
        Stream(head)
        .add_canonical(0, _SCENE)
        .add_frame(make_distinct_motion())
        .add_frame(make_distinct_motion())
    )
    stream.add_snapshot(make_random_survivors(range(10), 6)).add_frame(
        Change(make_distinct_symbols())
    ).add_frame(make_distinct_motion())
    return stream


def make_survivor_counts_with_codes() -> Stream:
    """The bits of survivors are counted, too, if their probability is stated."""
    stream = Stream(make_snapshot_head(sh_degree=0)).add_canonical(0, _SCENE)
    stream.add_snapshot(
        make_random_survivors(range(10), 7), make_cloud(6, 61, 0), choose_some_codes
    )
    return stream.add_frame(make_distinct_motion())


def make_large_position_differences() -> Stream:
    """Position differences are sums of coded numbers, so they can exceed 16 bits."""
    head = make_snapshot_head(sh_degree=0, position_step=1)
    stream = Stream(head).add_canonical(0, _SCENE)
    moved_survivors = [
        Survivor(i, make_differences(position=(32767 * i, -32767 * i, 20000 * i)))
        for i in range(10)
    ]
    return stream.add_snapshot(moved_survivors).add_frame(make_distinct_motion())


def make_differences_of_all_classes() -> Stream:
    """The magnitudes of differences have many classes, and so do the contexts."""
    stream = Stream(make_snapshot_head(sh_degree=0)).add_canonical(0, _SCENE)
    changed_survivors = []
    for i in range(10):
        size = 1 << i
        scales, colors = (size, -size, i), (-size, 2 * size, i - 5)
        differences = make_differences(
            position=(size, size, -i), log_scales=scales, opacity=i, sh_dc=colors
        )
        changed_survivors.append(Survivor(i, differences))
    return stream.add_snapshot(changed_survivors).add_frame(make_distinct_motion())
