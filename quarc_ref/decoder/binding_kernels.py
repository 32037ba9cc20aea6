"""The nearest anchor of every Gaussian (SPEC 6.4), compiled; `binding` holds the plain twin.

Gaussians and anchors stand in Morton order, cut into runs that make trees: see
`tree_kernels`. Of a run of Gaussians only those anchors count that are within
the distance from its box within which surely all of it have one; those of a
part of the run are among them. So the lists get shorter and finer from run to
part, until at most 16 Gaussians are held, side by side, against a few dozen
anchors. Equally near anchors are all kept up to there: the least number decides.
"""

import numpy as np

from quarc_ref.decoder.pruning_kernels import (
    ANCHORS,
    LISTS,
    RUN,
    UNBOUND,
    apart,
    bound_by,
    bound_by_blocks,
    bound_few,
    box_of,
    diagonal_of,
    expand,
    keep_blocks,
    list_blocks,
    narrow,
)
from quarc_ref.format.compiled import bare, bare_entrance

_LEAF = 3  # the depth of the least runs


@bare_entrance
def bind_runs(gaussians, tree, span, room, binding):
    """Bind the Gaussians of runs.

    Args:
        gaussians: int32 `[3, P]` points in Morton order, the order, and the
            runs `[r, 9]` of a walk: box, depth, first point, last point and one.
        tree: The anchors and ranks as `list_anchors` gives them, the blocks
            `[b, 8]` that they are in, how many of those are the widest, and
            the bits of an anchor's number.
        span: The run to begin with, one of the largest, and that to end before.
        room: For lists: see `pruning_kernels`.
        binding: int32 `[N]`, of which the runs' part is written.
    """
    points, order, runs = gaussians
    anchors, ranks, blocks, widest, number_bits = tree
    ids, listed, counts, best, _ = room
    counts[0, 0], counts[1, 0] = widest, 0
    for i in range(widest):
        ids[0, i] = i
    limit = 1 << (61 - number_bits)
    for run in range(span[0], span[1]):
        box, depth, first, last = box_of(runs, run), runs[run, 6], runs[run, 7], runs[run, 8]
        if depth < _LEAF:
            bound = bound_by(box, anchors, ranks[first], ranks[last])
            narrow(box, bound, depth, room, anchors, blocks)
            continue
        bound = bound_few(points, anchors, first, last, ranks, best)
        if last - first > RUN or bound + diagonal_of(box) >= limit:
            for i in range(first, last):
                binding[order[i]] = _bind_alone(points, i, anchors, blocks, widest, ids)
            continue
        narrow(box, bound, depth, room, anchors, blocks)
        for j in range(RUN):
            best[j] = ((best[j] + 1) << number_bits) - 1 if j < last - first else -1
        if counts[1, _LEAF + 1] == ANCHORS:
            count = counts[0, _LEAF + 1]
            _hold(points, first, listed[_LEAF + 1], 0, count, number_bits, best)
        else:
            count = list_blocks(box, bound, _LEAF + 1, counts, blocks, ids)
            _hold_near(points, first, anchors, blocks, ids[_LEAF + 2], count, number_bits, best)
        for i in range(first, last):
            binding[order[i]] = best[i - first] & ((1 << number_bits) - 1)


@bare
def _hold_near(points, first, anchors, blocks, ids, count, number_bits, best):
    """Hold 16 Gaussians, what is known of each in `best`, against blocks that may have nearer."""
    xs, ys, zs = points[0, first:], points[1, first:], points[2, first:]
    for i in range(count):
        block = ids[i]
        x0, y0, z0 = blocks[block, 0], blocks[block, 1], blocks[block, 2]
        x1, y1, z1 = blocks[block, 3], blocks[block, 4], blocks[block, 5]
        reached = False
        for j in range(RUN):
            x = apart(xs[j], xs[j], x0, x1)
            y = apart(ys[j], ys[j], y0, y1)
            z = apart(zs[j], zs[j], z0, z1)
            reached |= (x * x + y * y + z * z) << number_bits <= best[j]
        if reached:
            anchor, end = blocks[block, 6], blocks[block, 7]
            _hold(points, first, anchors, anchor, end, number_bits, best)


@bare
def _hold(points, first, anchors, anchor, end, number_bits, best):
    """Hold 16 Gaussians against anchors; a distance and a number fit 63 bits together."""
    # Slices, as a subscript that may be negative would keep the loop from vectors.
    xs, ys, zs = points[0, first:], points[1, first:], points[2, first:]
    for i in range(anchor, end):
        ax, ay, az, number = anchors[0, i], anchors[1, i], anchors[2, i], np.int64(anchors[3, i])
        for j in range(RUN):
            x = np.int64(np.int32(xs[j] - ax))
            y = np.int64(np.int32(ys[j] - ay))
            z = np.int64(np.int32(zs[j] - az))
            best[j] = min(best[j], ((x * x + y * y + z * z) << number_bits) | number)


@bare_entrance
def bind_points(points, tree, room, binding):
    """Write the numbers of the nearest anchors of points int32 `[3, n]` to int64 `[n]`."""
    anchors, blocks, widest = tree
    for i in range(points.shape[1]):
        binding[i] = _bind_alone(points, i, anchors, blocks, widest, room[0])


@bare
def _bind_alone(points, i, anchors, blocks, widest, ids):
    """Return the number of one Gaussian's nearest anchor."""
    x, y, z = np.int64(points[0, i]), np.int64(points[1, i]), np.int64(points[2, i])
    box, bound, length = (x, y, z, x, y, z), np.int64(UNBOUND), widest
    asked, kept = ids[LISTS], ids[LISTS - 1]
    for block in range(widest):
        asked[block] = block
    for tier in range(ANCHORS):
        if tier > 0:
            length = expand(kept, length, blocks, asked)
        bound = bound_by_blocks(box, blocks, asked, length, bound)
        length = keep_blocks(box, blocks, asked, length, bound, kept)
    best, who = np.int64(UNBOUND), np.int64(UNBOUND)
    for b in range(length):
        for a in range(blocks[kept[b], 6], blocks[kept[b], 7]):
            dx, dy, dz = anchors[0, a] - x, anchors[1, a] - y, anchors[2, a] - z
            distance, number = dx * dx + dy * dy + dz * dz, np.int64(anchors[3, a])
            if distance < best or (distance == best and number < who):
                best, who = distance, number
    return who
