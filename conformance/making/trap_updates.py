"""Makes vectors in traps/ for updates (SPEC 7.8, 8.8)."""

from making.changes import Change, CodedGaussian, Update, choose_no_code
from making.scenes import (
    choose_some_codes,
    choose_varied_codes,
    make_births,
    make_cloud,
    make_moving_symbols,
    select_symbols,
)
from making.streams import Stream
from making.trap_making import make_distinct_motion, make_distinct_symbols, make_trap_streams
from making.update_scenes import (
    REQUIRED_CAPABILITY,
    make_deleting_updates,
    make_equal_updates,
    make_random_updates,
    make_residuals,
    make_update_head,
)
from making.vectors import ValidStream

_SCENE = [
    CodedGaussian((9 * i, 5 * i % 7, 0), codes=(-40, -40, -40, 5 - i, i, 0, 0)) for i in range(10)
]


def make_update_traps() -> list[ValidStream]:
    """Return the traps for updates."""
    return make_trap_streams(
        (
            ("updates-after-the-motion", make_change_contexts_from_motion, "7.8 8.8"),
            ("updates-are-no-motion", make_expected_motion_without_updates, "7.8 8.7"),
            ("updates-do-not-bind", make_updates_that_keep_anchors, "7.8 6.5"),
            ("updates-before-births", make_updates_before_births, "7.8 7.6-1"),
            ("updates-after-deaths", make_updates_after_deaths, "7.4 7.8"),
            ("updates-and-the-next-deaths", make_deaths_by_updated_opacity, "7.4-3 7.8-3"),
            ("updates-of-newborn", make_updates_of_newborn, "7.8"),
            ("updates-without-fields-are-recent", make_recent_updates_without_fields, "7.8 8.8"),
            ("recency-ends-at-three", make_maximum_recency, "7.8 8.8"),
            ("recency-of-the-frame-before", make_deletion_contexts_from_recency, "7.8 8.8"),
            ("recency-begins-anew", make_recency_reset_by_canonical, "7.8 8.8"),
            ("turned-by-one-unity", make_rotations_by_one_unity, "7.8 7.3"),
            ("turned-on-the-right", make_rotations_on_the_right, "7.8 7.5"),
            ("not-turned-by-nothing", make_unchanged_rotations, "7.8"),
            ("anchors-that-leave", make_anchors_of_deleted_gaussians, "7.8 6.5 8.7"),
            ("leaving-at-a-sampling", make_deletions_at_sampling, "7.8 6.1"),
            ("ids-after-leaving", make_ids_after_deletions, "7.8 7.6-5"),
            ("sums-within-a-field", make_residual_contexts_by_field, "8.8"),
            ("counts-of-updates-go-on", make_update_counts_across_frames, "8.2 8.8"),
            ("stated-updates-are-counted", make_update_counts_with_codes, "8.1 8.2 8.8"),
            ("updates-after-seven-channels", make_change_contexts_from_seven_channels, "7.8 8.8"),
        ),
        **REQUIRED_CAPABILITY,
    )


def make_change_contexts_from_motion() -> Stream:
    """Whether a Gaussian changes is coded in the context of its motion in this frame."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(0, _SCENE)
    for frame in range(1, 5):
        stream.add_frame(
            Change(
                make_moving_symbols(6, frame, anchors_per_moving_anchor=3, limit=1),
                updates=make_random_updates(10, frame, updates_per_deletion=99),
            )
        )
    return stream


def make_change_contexts_from_seven_channels() -> Stream:
    """The contexts of updates depend on all channels of the motion, also on w and z of rotation."""
    head = make_update_head(sh_degree=0, rotation_components=4, gaussians_per_anchor=1)
    stream = Stream(head).add_canonical(0, _SCENE)
    for frame, channel in enumerate((3, 6, 3, 6), 1):

        def symbols(level: int, anchor: int, channel: int = channel) -> list[int]:
            return [int(c == channel and level == 1) * (anchor % 5) for c in range(7)]

        stream.add_frame(Change(symbols, updates=make_random_updates(10, frame)))
    return stream


def make_expected_motion_without_updates() -> Stream:
    """The expected motion of an anchor depends on previous motion, not on updates."""
    stream = Stream(make_update_head(sh_degree=0, gaussians_per_anchor=1)).add_canonical(0, _SCENE)
    stream.add_frame(
        Change(
            make_distinct_symbols(),
            updates=make_equal_updates(10, make_residuals(translation=(9, -8, 7))),
        )
    )
    return stream.add_frame(make_distinct_motion()).add_frame(make_distinct_motion())


def make_updates_that_keep_anchors() -> Stream:
    """A Gaussian that an update moves far away keeps its anchors until the next sampling."""
    head = make_update_head(sh_degree=0, gaussians_per_anchor=2, resample_interval=3)
    stream = Stream(head).add_canonical(0, _SCENE)
    far_updates = (
        Update(0, make_residuals(translation=(99, 9, 0))),
        Update(9, make_residuals(translation=(-99, 0, 0))),
    )
    return (
        stream.add_frame(Change(make_distinct_symbols(), updates=far_updates))
        .add_frame(make_distinct_motion())
        .add_frame(make_distinct_motion())
        .add_frame(make_distinct_motion())
    )


def make_updates_before_births() -> Stream:
    """Parent indices and parent positions are those after the updates."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(0, _SCENE)
    updates = (Update(0, None), Update(1, make_residuals(translation=(5, 5, 5))), Update(4, None))
    return stream.add_frame(
        Change(make_distinct_symbols(), make_births([0, 3, 7], 3, 0), updates=updates)
    ).add_frame(make_distinct_motion())


def make_updates_after_deaths() -> Stream:
    """The indices of updates are counted after the deaths."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(0, _SCENE)
    updates = (Update(0, make_residuals(opacity=3)), Update(6, make_residuals(sh_dc=(1, 2, 3))))
    return stream.add_frame(
        Change(make_distinct_symbols(), death_count=3, updates=updates)
    ).add_frame(make_distinct_motion())


def make_deaths_by_updated_opacity() -> Stream:
    """Which Gaussians die next depends on the updated opacities."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(0, _SCENE)
    updates = (Update(0, make_residuals(opacity=-50)), Update(9, make_residuals(opacity=50)))
    return (
        stream.add_frame(Change(updates=updates))
        .add_frame(Change(death_count=2))
        .add_frame(make_distinct_motion())
    )


def make_updates_of_newborn() -> Stream:
    """New Gaussians have recency 0 in the next frame, which can update them."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(0, _SCENE)
    stream.add_frame(Change(births=make_births([0, 4, 9], 2, 0)))
    updates = (
        Update(3, make_residuals(opacity=1)),
        Update(11, make_residuals(opacity=2)),
        Update(12, None),
    )
    return stream.add_frame(Change(make_distinct_symbols(), updates=updates)).add_frame(
        Change(updates=make_random_updates(12, 5))
    )


def make_recent_updates_without_fields() -> Stream:
    """A Gaussian coded as changing has recency 0 afterwards, even if all residuals are 0."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(0, _SCENE)
    stream.add_frame(Change(updates=(Update(2), Update(5, field_mask=8), Update(7))))
    return stream.add_frame(
        Change(updates=make_random_updates(10, 6, gaussians_per_update=2, updates_per_deletion=99))
    ).add_frame(make_distinct_motion())


def make_maximum_recency() -> Stream:
    """A change three or more frames ago has the same recency as no change at all."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(0, _SCENE)
    stream.add_frame(Change(updates=(Update(1, make_residuals(opacity=1)),)))
    for _ in range(4):
        stream.add_frame(Change(updates=(Update(8, make_residuals(opacity=1)),)))
    return stream.add_frame(Change(updates=make_random_updates(10, 7, updates_per_deletion=99)))


def make_deletion_contexts_from_recency() -> Stream:
    """Whether a Gaussian is deleted is coded in the context of its recency before this frame."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(0, _SCENE)
    stream.add_frame(Change(updates=tuple(Update(i, make_residuals(opacity=1)) for i in (0, 2, 4))))
    stream.add_frame(Change(updates=(Update(0, None), Update(1, None), Update(2), Update(3))))
    return stream.add_frame(Change(updates=make_random_updates(8, 8, gaussians_per_update=2)))


def make_recency_reset_by_canonical() -> Stream:
    """A canonical frame resets recency and the counts of updates."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(0, _SCENE)
    stream.add_frame(
        Change(updates=make_random_updates(10, 9, gaussians_per_update=2, updates_per_deletion=99))
    )
    stream.add_canonical(2, _SCENE)
    return stream.add_frame(
        Change(updates=make_random_updates(10, 9, gaussians_per_update=2, updates_per_deletion=99))
    )


def make_rotations_by_one_unity() -> Stream:
    """Rotation residuals of updates are relative to rotation_unity, not to L x rotation_unity."""
    stream = Stream(make_update_head(sh_degree=0, level_count=3)).add_canonical(
        0, make_cloud(8, 90, 0)
    )
    rotation_updates = tuple(
        Update(i, make_residuals(rotation=(40 - 9 * i, 5 * i, -60))) for i in range(8)
    )
    return stream.add_frame(Change(updates=rotation_updates))


def make_rotations_on_the_right() -> Stream:
    """Rotations are multiplied on the right, first by the motion, then by the updates."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(0, make_cloud(8, 91, 0))
    rotation_updates = tuple(
        Update(i, make_residuals(rotation=(50, -20 * i, 3 * i))) for i in range(8)
    )
    return stream.add_frame(Change(make_distinct_symbols(), updates=rotation_updates)).add_frame(
        Change(make_distinct_symbols(), updates=rotation_updates)
    )


def make_unchanged_rotations() -> Stream:
    """If X, Y and Z are 0, the rotation is unchanged and is not rounded again."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(
        0, [*make_cloud(5, 92, 0), _ROUNDING_SENSITIVE_GAUSSIAN]
    )
    index = _find_rounding_sensitive_index(stream)
    stream.add_frame(Change(updates=(Update(index, make_residuals(rotation=(76, -68, -35))),)))
    stream.add_frame(Change(updates=(Update(index, field_mask=2),)))
    return stream.add_frame(Change(updates=(Update(index, make_residuals(translation=(1, 1, 1))),)))


def _find_rounding_sensitive_index(stream: Stream) -> int:
    state = stream.states[0]
    assert state is not None
    return next(i for i, g in enumerate(state.gaussians) if g.codes[4:7] == [77, 0, 0])


# Found by search: about 1 in 10000 rotations changes if its result is normalized again.
_ROUNDING_SENSITIVE_GAUSSIAN = CodedGaussian(
    (0, 0, 0), (3, 131, 139, -118), codes=(-40, -40, -40, 5, 77, 0, 0)
)


def make_anchors_of_deleted_gaussians() -> Stream:
    """An anchor whose Gaussian was deleted still moves its followers; its previous motion is 0."""
    head = make_update_head(sh_degree=0, gaussians_per_anchor=2, resample_interval=4)
    stream = Stream(head).add_canonical(0, _SCENE).add_frame(make_distinct_motion())
    stream.add_frame(
        Change(make_distinct_symbols(), updates=make_deleting_updates((0, 2, 4, 6, 8)))
    )
    return stream.add_frame(make_distinct_motion()).add_frame(make_distinct_motion())


def make_deletions_at_sampling() -> Stream:
    """Anchors are counted and sampled before updates delete Gaussians."""
    head = make_update_head(sh_degree=0, gaussians_per_anchor=2, resample_interval=1)
    stream = Stream(head).add_canonical(0, _SCENE)
    stream.add_frame(
        Change(make_distinct_symbols(), updates=make_deleting_updates((1, 2, 3, 4, 5)))
    )
    return stream.add_frame(make_distinct_motion())


def make_ids_after_deletions() -> Stream:
    """The ids of Gaussians that an update deleted are not reused."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(0, _SCENE)
    stream.add_frame(Change(births=make_births([3, 3], 1, 0))).add_frame(
        Change(updates=make_deleting_updates((10, 11)))
    )
    return stream.add_frame(Change(births=make_births([3, 3], 1, 0))).add_frame(
        make_distinct_motion()
    )


def make_residual_contexts_by_field() -> Stream:
    """The context of a residual is the sign of the sum of earlier residuals in its field."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(0, _SCENE)
    residual_triples = ((5, -2, 1), (-5, 2, 1), (3, -3, 2), (0, 4, -1), (1, 1, 1))
    updates = tuple(
        Update(i, make_residuals(translation=r, rotation=r, log_scales=r, sh_dc=r))
        for i, r in enumerate(residual_triples)
    )
    return stream.add_frame(Change(updates=updates)).add_frame(Change(updates=updates))


def make_update_counts_across_frames() -> Stream:
    """Context counts of updates carry over to later frames, even past frames without updates."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(0, _SCENE)
    stream.add_frame(
        Change(updates=make_random_updates(10, 11, gaussians_per_update=2, updates_per_deletion=99))
    ).add_frame()
    single_symbol = select_symbols((1, 0, [1, 0, 0, 0, 0, 0]))
    return stream.add_frame(
        Change(
            single_symbol,
            updates=make_random_updates(10, 12, gaussians_per_update=2, updates_per_deletion=99),
        )
    )


def make_update_counts_with_codes() -> Stream:
    """The bits of updates are counted, too, if their probability is stated."""
    stream = Stream(make_update_head(sh_degree=0)).add_canonical(0, _SCENE)
    for frame, choose_code in enumerate((choose_varied_codes, choose_no_code, choose_some_codes)):
        updates = make_random_updates(
            10, 20 + frame, gaussians_per_update=2, updates_per_deletion=99
        )
        stream.add_frame(Change(updates=updates, choose_code=choose_code))
    return stream
