"""Which anchors may be nearest to any of a run of Gaussians, compiled; for `binding_kernels`.

Boxes of anchors are of three tiers, the widest 0; tier 3 are anchors themselves.
"""

import numpy as np

from quarc_ref.format.compiled import plain

_EXPANDED = 16
LISTED = 256
_SAMPLES = 8
RUN = 16
UNBOUND = (1 << 63) - 1
ANCHORS = 3


@plain
def box_of(boxes, i):
    """Return one of boxes `[r, 6]` as six int64."""
    return (
        np.int64(boxes[i, 0]), np.int64(boxes[i, 1]), np.int64(boxes[i, 2]),
        np.int64(boxes[i, 3]), np.int64(boxes[i, 4]), np.int64(boxes[i, 5]),
    )  # fmt: skip


@plain
def diagonal_of(box):
    """Return the square of a box's diagonal."""
    x0, y0, z0, x1, y1, z1 = box
    x, y, z = x1 - x0, y1 - y0, z1 - z0
    return x * x + y * y + z * z


@plain
def narrow(box, bound, depth, state, tree):
    """Make the list of a depth + 1 from that of a depth."""
    ids, listed, lengths, tiers, spare = state
    anchors, wide_starts, wide_boxes, block_starts, block_boxes, leaf_starts, anchor_boxes = tree
    tier, length = tiers[depth], lengths[depth]
    if tier == ANCHORS:
        length = _keep_anchors(box, listed, depth, length, bound, depth + 1)
    elif tier == 2:
        length = keep_blocks(box, anchor_boxes, ids, depth, length, bound, ids, depth + 1)
    elif tier == 1:
        length = keep_blocks(box, block_boxes, ids, depth, length, bound, ids, depth + 1)
    else:
        length = keep_blocks(box, wide_boxes, ids, depth, length, bound, ids, depth + 1)
    if tier == 0 and length <= _EXPANDED:
        length = expand(ids, depth + 1, length, wide_starts, spare, 0)
        length = keep_blocks(box, block_boxes, spare, 0, length, bound, ids, depth + 1)
        tier = 1
    if tier == 1 and length <= _EXPANDED:
        length = expand(ids, depth + 1, length, block_starts, spare, 0)
        length = keep_blocks(box, anchor_boxes, spare, 0, length, bound, ids, depth + 1)
        tier = 2
    if tier == 2 and length <= _EXPANDED:
        length = _keep_anchors_of(box, ids, depth + 1, length, leaf_starts, anchors, bound, listed)
        tier = ANCHORS
    tiers[depth + 1], lengths[depth + 1] = tier, length


@plain
def expand(ids, row, count, starts, children, to):
    """List the parts of runs; return how many."""
    length = 0
    for i in range(count):
        for child in range(starts[ids[row, i]], starts[ids[row, i] + 1]):
            children[to, length] = child
            length += 1
    return length


@plain
def _keep_anchors_of(box, ids, row, count, starts, anchors, bound, listed):
    """List the anchors of some boxes that are within a bound; return how many."""
    x0, y0, z0, x1, y1, z1 = box
    found = 0
    for i in range(count):
        for a in range(starts[ids[row, i]], starts[ids[row, i] + 1]):
            px, py, pz, number = anchors[a, 0], anchors[a, 1], anchors[a, 2], anchors[a, 3]
            x = max(max(px - x1, x0 - px), 0)
            y = max(max(py - y1, y0 - py), 0)
            z = max(max(pz - z1, z0 - pz), 0)
            listed[row, found, 0], listed[row, found, 1] = px, py
            listed[row, found, 2], listed[row, found, 3] = pz, number
            found += x * x + y * y + z * z <= bound
    return found


@plain
def bound_by(box, anchors, first, last):
    """Return the least squared distance within which all of a box have one of some anchors."""
    x0, y0, z0, x1, y1, z1 = box
    bound = UNBOUND
    first, last = max(first - 1, 0), min(last + 1, anchors.shape[0])
    for a in range(first, last, 1 + (last - first) // _SAMPLES):
        px, py, pz = np.int64(anchors[a, 0]), np.int64(anchors[a, 1]), np.int64(anchors[a, 2])
        x, y, z = max(px - x0, x1 - px), max(py - y0, y1 - py), max(pz - z0, z1 - pz)
        bound = min(bound, x * x + y * y + z * z)
    return bound


@plain
def bound_few(points, anchors, first, last, ranks, best):
    """Return the least squared distance within which each of a few has one of some anchors."""
    xs, ys, zs = points[0, first:], points[1, first:], points[2, first:]
    for j in range(RUN):
        best[j] = UNBOUND
    low, high = max(ranks[first] - 2, 0), min(ranks[last] + 2, anchors.shape[0])
    for a in range(low, high, 1 + (high - low) // _SAMPLES):
        ax, ay, az = anchors[a, 0], anchors[a, 1], anchors[a, 2]
        for j in range(RUN):
            x = np.int64(np.int32(xs[j] - ax))
            y = np.int64(np.int32(ys[j] - ay))
            z = np.int64(np.int32(zs[j] - az))
            best[j] = min(best[j], x * x + y * y + z * z)
    bound = np.int64(0)
    for j in range(min(last - first, RUN)):
        bound = max(bound, best[j])
    return bound if last - first <= RUN else UNBOUND


@plain
def keep_blocks(box, blocks, asked, row, count, bound, kept, to):
    """List the blocks that reach within a bound; return how many."""
    x0, y0, z0, x1, y1, z1 = box
    found = 0
    for i in range(count):
        b = asked[row, i]
        x = max(max(blocks[b, 0] - x1, x0 - blocks[b, 3]), 0)
        y = max(max(blocks[b, 1] - y1, y0 - blocks[b, 4]), 0)
        z = max(max(blocks[b, 2] - z1, z0 - blocks[b, 5]), 0)
        kept[to, found] = b
        found += x * x + y * y + z * z <= bound
    return found


@plain
def _keep_anchors(box, listed, row, count, bound, to):
    """List the anchors within a bound; return how many."""
    x0, y0, z0, x1, y1, z1 = box
    found = 0
    for i in range(count):
        px, py, pz, number = (
            listed[row, i, 0],
            listed[row, i, 1],
            listed[row, i, 2],
            listed[row, i, 3],
        )
        x = max(max(px - x1, x0 - px), 0)
        y = max(max(py - y1, y0 - py), 0)
        z = max(max(pz - z1, z0 - pz), 0)
        listed[to, found, 0], listed[to, found, 1] = px, py
        listed[to, found, 2], listed[to, found, 3] = pz, number
        found += x * x + y * y + z * z <= bound
    return found


@plain
def bound_by_boxes(box, boxes, asked, count, bound):
    """Return a bound that is not above what it was: each of some boxes holds an anchor."""
    x0, y0, z0, x1, y1, z1 = box
    for i in range(count):
        b = asked[0, i]
        x = max(boxes[b, 3] - x0, x1 - boxes[b, 0])
        y = max(boxes[b, 4] - y0, y1 - boxes[b, 1])
        z = max(boxes[b, 5] - z0, z1 - boxes[b, 2])
        bound = min(bound, x * x + y * y + z * z)
    return bound
