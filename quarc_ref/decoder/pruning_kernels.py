"""Which anchors may be nearest to any of a run of Gaussians, compiled; for `binding_kernels`.

Anchors are in blocks, and these in wider ones: int32 `[b, 8]`, the box of
each, its first part, and its last and one. There are three tiers of blocks, the
widest 0; tier 3 are anchors themselves.

Lists are kept in a `room` that is there before, one to a depth: uint32
`[LISTS + 1, b]` blocks, the last list for whoever is at work, and int32
`[LISTS, 4, MOST]` anchors; int64 `[2, LISTS]` how many each list has, and of which
tier; uint8 `[RUN]` marks; int64 `[2, RUN]` and int32 the same, the squared distances
and the numbers of the nearest; int64 `[r]` bounds, one to a run; and `[RUN]` squared
distances that are `NEARLY` right.

How far it is to what may be far off is summed up in float32, and rounded up where it
bounds: some anchors more may be looked at, none that counts is not.
"""

import numpy as np

from quarc_ref.format.compiled import bare

ANCHORS = 3
RUN = 16  # Gaussians side by side, anchors side by side
LISTED = 24  # blocks whose parts are listed, at most
MOST = RUN * (LISTED + 1)  # anchors of a list
LISTS = 6
NEARLY = np.float32
UNBOUND = (1 << 63) - 1
_BESIDE = 3
_DE_BRUIJN = 0x077CB531  # times a bit, its 5 highest bits tell which bit that is
_PLACES = np.argsort([(_DE_BRUIJN << place & 0xFFFFFFFF) >> 27 for place in range(32)])
_FAR = np.float32(1 << 62)
_ROUNDED = 1 + 2.0**-20  # three roundings to 24 bits lose less than that


@bare
def box_of(boxes, i):
    """Return one of boxes `[r, 6]` as six int64."""
    return (
        np.int64(boxes[i, 0]), np.int64(boxes[i, 1]), np.int64(boxes[i, 2]),
        np.int64(boxes[i, 3]), np.int64(boxes[i, 4]), np.int64(boxes[i, 5]),
    )  # fmt: skip


@bare
def box_of_few(points, first, last):
    """Return the box of some points, as six int64."""
    x0 = x1 = np.int64(points[0, first])
    y0 = y1 = np.int64(points[1, first])
    z0 = z1 = np.int64(points[2, first])
    for i in range(first + 1, last):
        x, y, z = np.int64(points[0, i]), np.int64(points[1, i]), np.int64(points[2, i])
        x0, y0, z0 = min(x0, x), min(y0, y), min(z0, z)
        x1, y1, z1 = max(x1, x), max(y1, y), max(z1, z)
    return x0, y0, z0, x1, y1, z1


@bare
def diagonal_of(box):
    """Return the square of a box's diagonal."""
    x0, y0, z0, x1, y1, z1 = box
    x, y, z = x1 - x0, y1 - y0, z1 - z0
    return x * x + y * y + z * z


@bare
def apart(least, greatest, low, high):
    """Return how far two intervals of int32 are apart, 0 where they meet."""
    return max(max(np.int32(least - high), np.int32(low - greatest)), np.int32(0))


@bare
def narrow(box, bound, depth, room, anchors, blocks):
    """Make the list of a depth + 1 from that of a depth."""
    ids, listed, counts, reach = room[0], room[1], room[2], room[3]
    length, tier = counts[0, depth], counts[1, depth]
    kept = ids[depth + 1]
    if tier == ANCHORS:
        length = _keep_anchors(box, listed[depth], length, bound, listed[depth + 1], reach)
    else:
        length = keep_blocks(box, blocks, ids[depth], length, bound, kept)
    while tier < ANCHORS and length <= LISTED:
        tier += 1
        if tier == ANCHORS:
            length = _list_anchors(
                box, kept, length, blocks, anchors, bound, listed[depth + 1], reach
            )
        else:
            length = expand(kept, length, blocks, ids[LISTS])
            length = keep_blocks(box, blocks, ids[LISTS], length, bound, kept)
    counts[0, depth + 1], counts[1, depth + 1] = length, tier


@bare
def list_blocks(box, bound, depth, counts, blocks, ids):
    """List the blocks of the least size, at depth + 1, of the list of a depth; return how many."""
    length = counts[0, depth]
    for i in range(length):
        ids[depth + 1, i] = ids[depth, i]
    for _ in range(counts[1, depth], ANCHORS - 1):
        length = expand(ids[depth + 1], length, blocks, ids[LISTS])
        length = keep_blocks(box, blocks, ids[LISTS], length, bound, ids[depth + 1])
    return length


@bare
def expand(ids, count, blocks, parts):
    """List the parts of blocks; return how many."""
    length = 0
    for i in range(count):
        for part in range(blocks[ids[i], 6], blocks[ids[i], 7]):
            parts[length] = part
            length += 1
    return length


@bare
def keep_blocks(box, blocks, asked, count, bound, kept):
    """List the blocks that reach within a bound; return how many."""
    x0, y0, z0 = np.int32(box[0]), np.int32(box[1]), np.int32(box[2])
    x1, y1, z1 = np.int32(box[3]), np.int32(box[4]), np.int32(box[5])
    found = np.uint64(0)  # as a number without a sign is looked up at once
    for i in range(count):
        b = asked[i]
        x = np.int64(apart(blocks[b, 0], blocks[b, 3], x0, x1))
        y = np.int64(apart(blocks[b, 1], blocks[b, 4], y0, y1))
        z = np.int64(apart(blocks[b, 2], blocks[b, 5], z0, z1))
        kept[found] = b
        found += np.uint64(x * x + y * y + z * z <= bound)
    return np.int64(found)


@bare
def _list_anchors(box, ids, count, blocks, anchors, bound, listed, reach):
    """List the anchors of some blocks that are within a bound; return how many."""
    found = 0
    for i in range(count):
        first, last = blocks[ids[i], 6], blocks[ids[i], 7]
        found = _keep_run(box, anchors, first, last, bound, listed, found, reach)
    return found


@bare
def _keep_anchors(box, listed, count, bound, kept, reach):
    """List the anchors within a bound; return how many."""
    found = 0
    for first in range(0, count, RUN):
        last = min(first + RUN, count)
        found = _keep_run(box, listed, first, last, bound, kept, found, reach)
    return found


@bare
def _keep_run(box, anchors, first, last, bound, kept, found, reach):
    """Add those of at most 16 anchors that are within a bound to a list; return its length."""
    xs, ys, zs = anchors[0, first:], anchors[1, first:], anchors[2, first:]
    _mark(box, xs, ys, zs, bound, reach)
    numbers = anchors[3, first:]
    to_x, to_y, to_z, to_number = kept[0], kept[1], kept[2], kept[3]
    near = np.uint32(0)
    for i in range(RUN):
        near |= np.uint32(reach[i]) << np.uint32(i)
    near &= np.uint32((1 << (last - first)) - 1)
    place = np.uint64(found)
    while near != 0:
        lowest = near & -near
        i = _PLACES[np.uint32(lowest * np.uint32(_DE_BRUIJN)) >> np.uint32(27)]
        to_x[place], to_y[place], to_z[place], to_number[place] = xs[i], ys[i], zs[i], numbers[i]
        near ^= lowest
        place += np.uint64(1)
    return np.int64(place)


@bare
def _mark(box, xs, ys, zs, bound, reach):
    """Mark which of 16 anchors are within a bound of a box."""
    x0, y0, z0 = np.int32(box[0]), np.int32(box[1]), np.int32(box[2])
    x1, y1, z1 = np.int32(box[3]), np.int32(box[4]), np.int32(box[5])
    near = np.float32(np.float64(bound) * _ROUNDED)
    for i in range(RUN):
        x = np.float32(apart(xs[i], xs[i], x0, x1))
        y = np.float32(apart(ys[i], ys[i], y0, y1))
        z = np.float32(apart(zs[i], zs[i], z0, z1))
        reach[i] = x * x + y * y + z * z <= near


@bare
def bound_few(points, anchors, first, last, ranks, best):
    """Return the least squared distance within which each of a few has one of some anchors.

    These are those that stand among the few in Morton order, and beside them.

    Args:
        points: int32 `[3, P]` in Morton order.
        anchors: int32 `[4, b + 16]` the same.
        first: The first of the few.
        last: The one after the last of them, at most 16.
        ranks: int32 `[N + 1]` how many anchors stand before each of the points.
        best: float32 `[16]` how far it is for each, nearly; written.
    """
    xs, ys, zs = points[0, first:], points[1, first:], points[2, first:]
    for j in range(RUN):
        best[j] = _FAR
    low = max(ranks[first] - _BESIDE, 0)
    high = min(ranks[last] + _BESIDE, anchors.shape[1] - RUN)
    for a in range(low, high):
        ax, ay, az = anchors[0, a], anchors[1, a], anchors[2, a]
        for j in range(RUN):
            x = np.float32(np.int32(xs[j] - ax))
            y = np.float32(np.int32(ys[j] - ay))
            z = np.float32(np.int32(zs[j] - az))
            best[j] = min(best[j], x * x + y * y + z * z)
    bound = np.float32(0)
    for j in range(min(last - first, RUN)):
        bound = max(bound, best[j])
    return at_most(bound)


@bare
def at_most(nearly):
    """Return what a squared distance is not above that was summed up in float32."""
    return np.int64(np.float64(nearly) * _ROUNDED) + 1


@bare
def gap_to(px, py, pz, blocks, b):
    """Return the squared distance from a point to a block, 0 within."""
    x = max(max(np.int64(blocks[b, 0]) - px, px - np.int64(blocks[b, 3])), np.int64(0))
    y = max(max(np.int64(blocks[b, 1]) - py, py - np.int64(blocks[b, 4])), np.int64(0))
    z = max(max(np.int64(blocks[b, 2]) - pz, pz - np.int64(blocks[b, 5])), np.int64(0))
    return x * x + y * y + z * z
