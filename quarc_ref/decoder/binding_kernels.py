"""The nearest anchor of every Gaussian (SPEC 6.4), compiled; `binding` holds the plain twin.

Gaussians and anchors stand in Morton order, cut into runs that make trees: see
`tree_kernels`. Of a run of Gaussians only those anchors count that are within
the distance from its box within which surely each of it has one: how far at
most that is, the anchors say that stand beside it in Morton order. Those of a
part of the run are among them. So the lists get shorter and finer from run to
part, until 16 Gaussians at a time are held, side by side, against a few dozen
anchors. Equally near anchors are all kept up to there: the least number decides.
"""

import numpy as np

from quarc_ref.decoder.pruning_kernels import (
    ANCHORS,
    LISTS,
    MOST,
    NEARLY,
    RUN,
    UNBOUND,
    apart,
    at_most,
    bound_few,
    box_of,
    box_of_few,
    diagonal_of,
    expand,
    gap_to,
    keep_blocks,
    list_blocks,
    narrow,
)
from quarc_ref.format.compiled import bare, bare_entrance

__all__ = ["LISTS", "MOST", "NEARLY", "RUN", "bind_points", "bind_runs"]
_LEAF = 2  # the depth of the least runs
_FEW = 64  # anchors that need no finer list
_CLOSE = (1 << 30) - (1 << 12)  # less what a bound is rounded up by when a list is made


@bare_entrance
def bind_runs(gaussians, tree, span, room, binding):
    """Bind the Gaussians of runs.

    Args:
        gaussians: int32 `[3, P]` points in Morton order, the order, and the
            runs `[r, 9]` of a walk: box, depth, first point, last point and one.
        tree: The anchors and ranks as `list_anchors` gives them, the blocks
            `[b, 8]` that they are in, and how many of those are the widest.
        span: The run to begin with, one of the largest, and that to end before.
        room: For lists: see `pruning_kernels`.
        binding: int32 `[N]`, of which the runs' part is written.
    """
    points, order, runs = gaussians
    blocks, widest = tree[2], tree[3]
    ids, listed, counts, _, nearest, close, bounds, about = room
    _bound_runs(points, runs, tree, span, counts[0], about, bounds)
    counts[0, 0], counts[1, 0] = widest, 0
    for i in range(widest):
        ids[0, i] = i
    for run in range(span[0], span[1]):
        box, depth, first, last = box_of(runs, run), runs[run, 6], runs[run, 7], runs[run, 8]
        bound = bounds[run - span[0]]
        narrow(box, bound, depth, room, tree[0], blocks)
        if depth < _LEAF:
            continue
        count, anchors = counts[0, depth + 1], listed[depth + 1]
        few = counts[1, depth + 1] == ANCHORS and count <= _FEW
        # The square of a distance from the run to a listed anchor is at most 2 (bound + diagonal),
        # were it not for the rounding: 31 bits are enough.
        if few and bound + diagonal_of(box) < _CLOSE:
            for part in range(first, last, RUN):
                _hold_close(points, part, anchors, count, close[0], close[1])
                for i in range(part, min(part + RUN, last)):
                    binding[order[i]] = close[1, i - part]
            continue
        for part in range(first, last, RUN):
            end = min(part + RUN, last)
            if few:
                nearest[:] = UNBOUND
                _hold(points, part, anchors, 0, count, nearest[0], nearest[1])
            else:
                _search(points, part, end, tree, room)
            for i in range(part, end):
                binding[order[i]] = nearest[1, i - part]


@bare
def _bound_runs(points, runs, tree, span, greatest, best, bounds):
    """Write how far at most the nearest anchor is of any Gaussian of each run, squared."""
    for depth in range(_LEAF + 2):
        greatest[depth] = 0
    for i in range(span[1] - span[0]):
        run = span[1] - 1 - i  # the parts of a run before it
        depth, first, last = runs[run, 6], runs[run, 7], runs[run, 8]
        bound = greatest[depth + 1]
        greatest[depth + 1] = 0
        if depth == _LEAF:
            for part in range(first, last, RUN):
                few = bound_few(points, tree[0], part, min(part + RUN, last), tree[1], best)
                bound = max(bound, few)
        bounds[run - span[0]] = bound
        greatest[depth] = max(greatest[depth], bound)


@bare
def _hold_close(points, first, anchors, count, distances, numbers):
    """Find the nearest of a list for 16 Gaussians; squares of distances fit 31 bits."""
    xs, ys, zs = points[0, first:], points[1, first:], points[2, first:]
    for j in range(RUN):
        distances[j] = numbers[j] = (1 << 31) - 1
    for i in range(count):
        ax, ay, az, number = anchors[0, i], anchors[1, i], anchors[2, i], anchors[3, i]
        for j in range(RUN):
            x, y, z = np.int32(xs[j] - ax), np.int32(ys[j] - ay), np.int32(zs[j] - az)
            distance = np.int32(np.int32(np.int32(x * x) + np.int32(y * y)) + np.int32(z * z))
            tied = min(numbers[j], number) if distance == distances[j] else numbers[j]
            numbers[j] = number if distance < distances[j] else tied
            distances[j] = min(distances[j], distance)


@bare
def _search(points, first, last, tree, room):
    """Find the nearest anchors of at most 16 Gaussians of a least run."""
    anchors, ranks, blocks, _ = tree
    ids, listed, counts, _, nearest, _, _, about = room
    distances, numbers = nearest[0], nearest[1]
    box = box_of_few(points, first, last)
    bound = bound_few(points, anchors, first, last, ranks, about)
    narrow(box, bound, _LEAF + 1, room, anchors, blocks)
    for j in range(RUN):
        distances[j] = at_most(about[j]) + 1 if j < last - first else -1
        numbers[j] = UNBOUND
    if counts[1, _LEAF + 2] == ANCHORS:
        _hold(points, first, listed[_LEAF + 2], 0, counts[0, _LEAF + 2], distances, numbers)
    else:
        count = list_blocks(box, bound, _LEAF + 2, counts, blocks, ids)
        _hold_near(points, first, anchors, blocks, ids[LISTS - 1], count, distances, numbers)


@bare
def _hold_near(points, first, anchors, blocks, ids, count, distances, numbers):
    """Hold 16 Gaussians against those blocks that may have nearer than what is known of one."""
    xs, ys, zs = points[0, first:], points[1, first:], points[2, first:]
    for i in range(count):
        block = ids[i]
        x0, y0, z0 = blocks[block, 0], blocks[block, 1], blocks[block, 2]
        x1, y1, z1 = blocks[block, 3], blocks[block, 4], blocks[block, 5]
        reached = False
        for j in range(RUN):
            x = np.int64(apart(xs[j], xs[j], x0, x1))
            y = np.int64(apart(ys[j], ys[j], y0, y1))
            z = np.int64(apart(zs[j], zs[j], z0, z1))
            reached |= x * x + y * y + z * z <= distances[j]
        if reached:
            anchor, end = blocks[block, 6], blocks[block, 7]
            _hold(points, first, anchors, anchor, end, distances, numbers)


@bare
def _hold(points, first, anchors, anchor, end, distances, numbers):
    """Hold 16 Gaussians against anchors, at whatever distance."""
    # Slices, as a subscript that may be negative would keep the loop from vectors.
    xs, ys, zs = points[0, first:], points[1, first:], points[2, first:]
    for i in range(anchor, end):
        ax, ay, az, number = anchors[0, i], anchors[1, i], anchors[2, i], np.int64(anchors[3, i])
        for j in range(RUN):
            x = np.int64(np.int32(xs[j] - ax))
            y = np.int64(np.int32(ys[j] - ay))
            z = np.int64(np.int32(zs[j] - az))
            distance = x * x + y * y + z * z
            tied = min(numbers[j], number) if distance == distances[j] else numbers[j]
            numbers[j] = number if distance < distances[j] else tied
            distances[j] = min(distances[j], distance)


@bare_entrance
def bind_points(points, tree, lists, binding):
    """Write the numbers of the nearest anchors of points int32 `[3, n]` to int64 `[n]`.

    Args:
        points: Lattice units.
        tree: The anchors as `list_anchors` gives them, the blocks `[b, 8]` that they are in,
            and how many of those are the widest.
        lists: uint32 `[2, b]` to work in.
        binding: Written.
    """
    anchors, blocks, widest = tree
    for i in range(points.shape[1]):
        binding[i] = _bind_alone(points, i, anchors, blocks, widest, lists[0], lists[1])


@bare
def _bind_alone(points, i, anchors, blocks, widest, asked, kept):
    """Return the number of one Gaussian's nearest anchor."""
    x, y, z = np.int64(points[0, i]), np.int64(points[1, i]), np.int64(points[2, i])
    box, bound, length = (x, y, z, x, y, z), _reach(x, y, z, anchors, blocks, widest), widest
    for block in range(widest):
        asked[block] = block
    for tier in range(ANCHORS):
        if tier > 0:
            length = expand(kept, length, blocks, asked)
        length = keep_blocks(box, blocks, asked, length, bound, kept)
    best, who = bound, np.int64(UNBOUND)
    for b in range(length):
        if gap_to(x, y, z, blocks, kept[b]) > best:
            continue
        for a in range(blocks[kept[b], 6], blocks[kept[b], 7]):
            dx, dy, dz = anchors[0, a] - x, anchors[1, a] - y, anchors[2, a] - z
            distance, number = dx * dx + dy * dy + dz * dz, np.int64(anchors[3, a])
            if distance < best or (distance == best and number < who):
                best, who = distance, number
    return who


@bare
def _reach(x, y, z, anchors, blocks, widest):
    """Return the least squared distance to an anchor of the block that is nearest, tier by tier."""
    first, last, bound = 0, widest, np.int64(UNBOUND)
    for _ in range(ANCHORS):
        best, block = np.int64(UNBOUND), first
        for b in range(first, last):
            gap = gap_to(x, y, z, blocks, b)
            if gap < best:
                best, block = gap, b
        first, last = blocks[block, 6], blocks[block, 7]
    for a in range(first, last):
        dx, dy, dz = anchors[0, a] - x, anchors[1, a] - y, anchors[2, a] - z
        bound = min(bound, dx * dx + dy * dy + dz * dz)
    return bound
