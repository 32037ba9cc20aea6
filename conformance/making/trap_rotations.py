"""Makes vectors in traps/ for rotations (SPEC 7.3, 7.5)."""

from making.changes import Change, CodedGaussian
from making.payloads import Head
from making.scenes import make_cloud
from making.streams import Stream
from making.trap_making import make_trap_streams
from making.vectors import ValidStream


def make_rotation_traps() -> list[ValidStream]:
    """Return the traps for rotations."""
    return make_trap_streams(
        (
            ("signs-of-quaternions", make_negative_w_sums, "7.5 7.3-1"),
            ("sums-of-zero", make_canceling_residuals, "7.5"),
            ("w-alone", make_residuals_with_only_w, "7.5"),
            ("halves", make_rounded_halves, "4.2 7.5"),
            ("moved-without-turning", make_motion_without_rotation, "7.5"),
        )
    )


def make_negative_w_sums() -> Stream:
    """Residual sums have a negative w; the sign of the resulting rotation is kept."""
    fields = {"rotation_components": 4, "rotation_unity": 1, "gaussians_per_anchor": 1}
    head = Head(sh_degree=0, level_count=1, **fields)
    stream = Stream(head).add_canonical(0, make_cloud(16, 9, 0))
    for w in (-3, -2, -1, 2):
        stream.add_frame(Change(lambda _level, anchor, w=w: [0, 0, 0, w, 0, anchor % 3, 1]))
    return stream


# Found by search: about 1 in 10000 rotations changes if it is normalized again.
_ROUNDING_SENSITIVE_GAUSSIAN = CodedGaussian((0, 0, 0), (3, 131, 139, -118))


def make_canceling_residuals() -> Stream:
    """If the symbols of two levels cancel, the rotation is unchanged and is not rounded again."""
    head = Head(sh_degree=0, level_count=2, gaussians_per_anchor=1, anchor_ratio=65535)
    symbols, opposite_symbols = [0, 0, 0, 5, -4, 3], [0, 0, 0, -5, 4, -3]
    stream = Stream(head).add_canonical(0, [*make_cloud(15, 9, 0), _ROUNDING_SENSITIVE_GAUSSIAN])
    stream.add_frame(Change(lambda level, _anchor: symbols if level == 2 else None))
    canceling_change = Change(lambda level, _anchor: symbols if level == 2 else opposite_symbols)
    return stream.add_frame(canceling_change).add_frame(canceling_change)


def make_motion_without_rotation() -> Stream:
    """A Gaussian that moves without turning keeps its rotation, which is not rounded again."""
    head = Head(sh_degree=0, level_count=2, gaussians_per_anchor=1, anchor_ratio=65535)
    scene = [*make_cloud(15, 9, 0), _ROUNDING_SENSITIVE_GAUSSIAN]
    stream, turning = Stream(head).add_canonical(0, scene), [0, 0, 0, 5, -4, 3]
    stream.add_frame(Change(lambda level, _anchor: turning if level == 2 else None))
    return stream.add_frame(Change(lambda _level, anchor: [anchor % 3 - 1, 2, 0, 0, 0, 0]))


def make_residuals_with_only_w() -> Stream:
    """A rotation residual whose only nonzero component is w is applied like any other."""
    stream = Stream(Head(rotation_components=4, sh_degree=0, rotation_unity=3))
    stream.add_canonical(0, make_cloud(16, 9, 0))
    for w in (1, -2, 3, -4):
        stream.add_frame(Change(lambda _level, anchor, w=w: [0, 0, 0, w * (anchor % 2), 0, 0, 0]))
    return stream


def make_rounded_halves() -> Stream:
    """Halves in the components of the product q x d are rounded away from 0."""
    fields = {"rotation_bits": 14, "rotation_unity": 1, "gaussians_per_anchor": 1}
    head = Head(sh_degree=0, level_count=1, **fields)
    stream = Stream(head).add_canonical(0, _make_odd_rotations())
    for signs in ((1, 1, 1), (-1, 1, 1), (1, -1, -1), (-1, -1, -1)):
        stream.add_frame(Change(lambda _level, _anchor, s=signs: [0, 0, 0, *s]))
    return stream


def _make_odd_rotations() -> list[CodedGaussian]:
    """Return Gaussians with rotations whose first component is odd about as often as even."""
    numbered_gaussians = enumerate(make_cloud(24, 10, 0))
    gaussians_and_rotations = (
        (gaussian, (i % 4, *(64 * component + i for component in gaussian.rotation[1:])))
        for i, gaussian in numbered_gaussians
    )
    return [
        CodedGaussian(gaussian.position, rotation, gaussian.codes)
        for gaussian, rotation in gaussians_and_rotations
    ]
