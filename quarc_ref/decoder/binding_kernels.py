"""The nearest anchor of every Gaussian (SPEC 6.4), compiled; `binding` holds the plain twin.

Gaussians and anchors stand in Morton order, cut into runs that make trees: see
`tree_kernels`. Of a run of Gaussians only those anchors count that are within
the distance from its box within which surely all of it have one; those of a
part of the run are among them. So the lists get shorter and finer from run to
part, until at most 16 Gaussians are held against a few dozen anchors. Equally
near anchors are all kept up to there: the least number decides.
"""

import numpy as np

from quarc_ref.decoder.pruning_kernels import (
    ANCHORS,
    LISTED,
    RUN,
    UNBOUND,
    bound_by,
    bound_by_boxes,
    bound_few,
    box_of,
    diagonal_of,
    expand,
    keep_blocks,
    narrow,
)
from quarc_ref.format.compiled import entrance, plain

_PART = 4


@entrance
def bind_runs(gaussians, tree, span, binding):
    """Bind the Gaussians of top runs.

    Args:
        gaussians: int32 `[3, P]` points in Morton order, the order, and their
            runs, of four sizes, the largest first: where their parts begin,
            and their boxes.
        tree: The anchors and ranks as `list_anchors` gives them, and the
            anchors' runs of three sizes.
        span: The top run to begin with, and that to end before.
        binding: int64 `[N]`, of which the runs' part is written.
    """
    points, order, runs = gaussians
    anchors, ranks, blocks = tree
    (tops, top_boxes), (mids, mid_boxes), (lows, low_boxes), (leaves, leaf_boxes) = runs
    (wide_starts, wide_boxes), (block_starts, block_boxes), (leaf_starts, anchor_boxes) = blocks
    number_bits = 1
    while anchors[:, 3].max() >> number_bits:
        number_bits += 1
    limit = np.int64(1) << (61 - number_bits)
    ids = np.empty((6, anchor_boxes.shape[0]), dtype=np.int32)
    listed = np.empty((6, LISTED + 1, 4), dtype=np.int32)
    spare = np.empty((2, anchor_boxes.shape[0]), dtype=np.int32)
    lengths, tiers = np.zeros(6, dtype=np.int64), np.zeros(6, dtype=np.int64)
    best = np.empty(RUN, dtype=np.int64)
    lengths[0] = wide_boxes.shape[0]
    for i in range(lengths[0]):
        ids[0, i] = i
    state = (ids, listed, lengths, tiers, spare)
    tree = (anchors, wide_starts, wide_boxes, block_starts, block_boxes, leaf_starts, anchor_boxes)
    for top in range(span[0], span[1]):
        a, b = leaves[lows[mids[tops[top]]]], leaves[lows[mids[tops[top + 1]]]]
        box = box_of(top_boxes, top)
        narrow(box, bound_by(box, anchors, ranks[a], ranks[b]), 0, state, tree)
        for mid in range(tops[top], tops[top + 1]):
            a, b = leaves[lows[mids[mid]]], leaves[lows[mids[mid + 1]]]
            box = box_of(mid_boxes, mid)
            narrow(box, bound_by(box, anchors, ranks[a], ranks[b]), 1, state, tree)
            for low in range(mids[mid], mids[mid + 1]):
                a, b = leaves[lows[low]], leaves[lows[low + 1]]
                box = box_of(low_boxes, low)
                narrow(box, bound_by(box, anchors, ranks[a], ranks[b]), 2, state, tree)
                for leaf in range(lows[low], lows[low + 1]):
                    a, b = leaves[leaf], leaves[leaf + 1]
                    box = box_of(leaf_boxes, leaf)
                    bound = bound_few(points, anchors, a, b, ranks, best)
                    narrow(box, bound, 3, state, tree)
                    if tiers[4] != ANCHORS:
                        few = (points, order, ranks)
                        for i in range(a, b, _PART):
                            _bind_part(few, i, min(i + _PART, b), state, tree, best, binding)
                    elif bound + diagonal_of(box) < limit and 1 < b - a <= RUN:
                        _bind_few(points, listed, lengths[4], number_bits, a, best)
                        for i in range(a, b):
                            binding[order[i]] = best[i - a] & ((np.int64(1) << number_bits) - 1)
                    else:
                        for i in range(a, b):
                            binding[order[i]] = _bind_one(points, i, listed, 4, lengths[4])


@plain
def _bind_few(points, listed, count, number_bits, first, best):
    """Hold 16 Gaussians against anchors; a distance and a number fit 63 bits together."""
    # Slices, as a subscript that may be negative would keep the inner loop from vectors.
    xs, ys, zs = points[0, first:], points[1, first:], points[2, first:]
    for j in range(RUN):
        best[j] = UNBOUND
    for i in range(count):
        ax, ay, az = listed[4, i, 0], listed[4, i, 1], listed[4, i, 2]
        number = np.int64(listed[4, i, 3])
        for j in range(RUN):
            x = np.int64(np.int32(xs[j] - ax))
            y = np.int64(np.int32(ys[j] - ay))
            z = np.int64(np.int32(zs[j] - az))
            best[j] = min(best[j], ((x * x + y * y + z * z) << number_bits) | number)


@plain
def _bind_one(points, i, listed, row, count):
    x, y, z = points[0, i], points[1, i], points[2, i]
    best, who = UNBOUND, UNBOUND
    for a in range(count):
        dx, dy, dz = x - listed[row, a, 0], y - listed[row, a, 1], z - listed[row, a, 2]
        distance, number = dx * dx + dy * dy + dz * dz, np.int64(listed[row, a, 3])
        if distance < best or (distance == best and number < who):
            best, who = distance, number
    return who


@plain
def _bind_part(gaussians, first, last, state, tree, best, binding):
    """Bind a few Gaussians that are too far apart from each other to go together."""
    points, order, ranks = gaussians
    ids, listed, lengths, tiers, spare = state
    x0, y0, z0 = np.int64(points[0, first]), np.int64(points[1, first]), np.int64(points[2, first])
    x1, y1, z1 = x0, y0, z0
    for i in range(first + 1, last):
        x, y, z = np.int64(points[0, i]), np.int64(points[1, i]), np.int64(points[2, i])
        x0, y0, z0, x1, y1, z1 = (
            min(x0, x),
            min(y0, y),
            min(z0, z),
            max(x1, x),
            max(y1, y),
            max(z1, z),
        )
    bound = bound_few(points, tree[0], first, last, ranks, best)
    narrow((x0, y0, z0, x1, y1, z1), bound, 4, state, tree)
    for i in range(first, last):
        if tiers[5] == ANCHORS:
            binding[order[i]] = _bind_one(points, i, listed, 5, lengths[5])
            continue
        x, y, z = np.int64(points[0, i]), np.int64(points[1, i]), np.int64(points[2, i])
        box, length = (x, y, z, x, y, z), lengths[5]
        for k in range(length):
            spare[0, k] = ids[5, k]
        bound = bound_by(box, tree[0], ranks[i], ranks[i + 1])
        binding[order[i]] = _bind_alone(box, bound, tiers[5], length, spare, tree)


@entrance
def bind_points(points, anchors, blocks):
    """Return int64 `[n]` the numbers of the nearest anchors of points int32 `[3, n]`."""
    (wide_starts, wide_boxes), (block_starts, block_boxes), (leaf_starts, anchor_boxes) = blocks
    tree = (anchors, wide_starts, wide_boxes, block_starts, block_boxes, leaf_starts, anchor_boxes)
    spare = np.empty((2, anchor_boxes.shape[0]), dtype=np.int32)
    binding = np.empty(points.shape[1], dtype=np.int64)
    for i in range(points.shape[1]):
        for block in range(wide_boxes.shape[0]):
            spare[0, block] = block
        x, y, z = np.int64(points[0, i]), np.int64(points[1, i]), np.int64(points[2, i])
        box = (x, y, z, x, y, z)
        binding[i] = _bind_alone(box, UNBOUND, 0, wide_boxes.shape[0], spare, tree)
    return binding


@plain
def _bind_alone(box, bound, tier, length, spare, tree):
    """Bind one Gaussian, whose box is a point, by the blocks of a tier that are listed."""
    anchors, wide_starts, wide_boxes, block_starts, block_boxes, leaf_starts, anchor_boxes = tree
    x, y, z = box[:3]
    if tier == 0:
        bound = bound_by_boxes(box, wide_boxes, spare, length, bound)
        length = keep_blocks(box, wide_boxes, spare, 0, length, bound, spare, 0)
        length = expand(spare, 0, length, wide_starts, spare, 1)
        for k in range(length):
            spare[0, k] = spare[1, k]
    if tier <= 1:
        bound = bound_by_boxes(box, block_boxes, spare, length, bound)
        length = keep_blocks(box, block_boxes, spare, 0, length, bound, spare, 0)
        length = expand(spare, 0, length, block_starts, spare, 1)
        for k in range(length):
            spare[0, k] = spare[1, k]
    bound = bound_by_boxes(box, anchor_boxes, spare, length, bound)
    length = keep_blocks(box, anchor_boxes, spare, 0, length, bound, spare, 0)
    best, who = UNBOUND, UNBOUND
    for b in range(length):
        for a in range(leaf_starts[spare[0, b]], leaf_starts[spare[0, b] + 1]):
            dx, dy, dz = anchors[a, 0] - x, anchors[a, 1] - y, anchors[a, 2] - z
            distance, number = dx * dx + dy * dy + dz * dz, np.int64(anchors[a, 3])
            if distance < best or (distance == best and number < who):
                best, who = distance, number
    return who
