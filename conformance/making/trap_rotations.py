"""traps/: rotations (SPEC 7.3, 7.5)."""

from making.changes import Change, Coded
from making.payloads import Head
from making.scenes import cloud
from making.streams import Stream
from making.trap_making import make_trap_vectors
from making.vectors import Valid


def make_rotation_traps() -> list[Valid]:
    """Return all vectors."""
    return make_trap_vectors(
        (
            (signs_of_quaternions, "7.5 7.3-1"),
            (sums_of_zero, "7.5"),
            (w_alone, "7.5"),
            (halves, "4.2 7.5"),
        )
    )


def signs_of_quaternions() -> Stream:
    """Sums with a negative w: the signs of rotations are not normalized."""
    fields = {"rotation_components": 4, "rotation_unity": 1, "gaussians_per_anchor": 1}
    head = Head(sh_degree=0, level_count=1, **fields)
    stream = Stream(head).canonical(0, cloud(16, 9, 0))
    for w in (-3, -2, -1, 2):
        stream.frame(Change(lambda _level, anchor, w=w: [0, 0, 0, w, 0, anchor % 3, 1]))
    return stream


def sums_of_zero() -> Stream:
    """Symbols of two levels that cancel: the rotation stays, although rounding would change it."""
    head = Head(sh_degree=0, level_count=2, gaussians_per_anchor=1, anchor_ratio=65535)
    turn, back = [0, 0, 0, 5, -4, 3], [0, 0, 0, -5, 4, -3]
    # Found by search; one in about ten thousand: the rotated result is not what it is normalized
    # to.
    rare = Coded((0, 0, 0), (3, 131, 139, -118))
    stream = Stream(head).canonical(0, [*cloud(15, 9, 0), rare])
    stream.frame(Change(lambda level, _anchor: turn if level == 2 else None))
    cancel = Change(lambda level, _anchor: turn if level == 2 else back)
    return stream.frame(cancel).frame(cancel)


def w_alone() -> Stream:
    """A residual of only w is also processed by the formula."""
    stream = Stream(Head(rotation_components=4, sh_degree=0, rotation_unity=3))
    stream.canonical(0, cloud(16, 9, 0))
    for w in (1, -2, 3, -4):
        stream.frame(Change(lambda _level, anchor, w=w: [0, 0, 0, w * (anchor % 2), 0, 0, 0]))
    return stream


def halves() -> Stream:
    """Components of q x d with a fraction of one half are rounded away from 0."""
    fields = {"rotation_bits": 14, "rotation_unity": 1, "gaussians_per_anchor": 1}
    head = Head(sh_degree=0, level_count=1, **fields)
    stream = Stream(head).canonical(0, _odd())
    for signs in ((1, 1, 1), (-1, 1, 1), (1, -1, -1), (-1, -1, -1)):
        stream.frame(Change(lambda _level, _anchor, s=signs: [0, 0, 0, *s]))
    return stream


def _odd() -> list[Coded]:
    """Rotations whose first component is odd about as often as even."""
    drawn = enumerate(cloud(24, 10, 0))
    turned = ((g, (i % 4, *(64 * c + i for c in g.rotation[1:]))) for i, g in drawn)
    return [Coded(g.position, rotation, g.codes) for g, rotation in turned]
