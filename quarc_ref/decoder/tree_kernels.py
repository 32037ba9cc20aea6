"""Points in Morton order as trees of boxes, compiled; `anchor_trees` puts them together.

A sequence is cut into runs, each the largest cell of the order that holds no
more than so many points, so that a run is compact and its box tight; a crowd at
one place is cut by number. Runs are cut from runs in the same way.
"""

import numpy as np

from quarc_ref.format.compiled import entrance, plain


@entrance
def list_points(positions, order):
    """Return int32 `[3, P]` positions in an order, and 15 more that mean nothing."""
    count = order.size
    points = np.empty((3, count + 15), dtype=np.int32)
    for axis in range(3):
        for i in range(count):
            points[axis, i] = positions[axis, order[i]]
        points[axis, count:] = points[axis, count - 1]
    return points


@entrance
def cut_runs(merges, starts, most):
    """Cut a sequence in Morton order into runs, each the largest cell that is small enough.

    Args:
        merges: uint8 `[n]` as `sort_cells` gives them, of elements of the sequence.
        starts: int32 `[p + 1]` where parts begin that are not to be cut, and the end.
        most: Elements of a run, if it is more than one part.

    Returns:
        int32 `[r + 1]` the number of the part that each run begins with, and
        that of all parts.
    """
    parts = starts.size - 1
    runs = np.empty(parts + 1, dtype=np.int32)
    found, first = 0, 0
    while first < parts:
        runs[found] = first
        found += 1
        own, widest, cut, part = max(merges[starts[first]], 1), -1, first + 1, first + 1
        while part < parts and merges[starts[part]] < own:
            if merges[starts[part]] > widest:
                widest, cut = merges[starts[part]], part
            if starts[part + 1] - starts[first] > most:
                break
            part += 1
        else:
            cut = part
        first = part if widest == 0 and part > first else cut
    runs[found] = parts
    return runs[: found + 1].copy()


@entrance
def bound_points(points, starts):
    """Return int32 `[r, 6]` the least and greatest coordinates of runs of points."""
    boxes = np.empty((starts.size - 1, 6), dtype=np.int32)
    for run in range(starts.size - 1):
        for axis in range(3):
            least = greatest = points[axis, starts[run]]
            for i in range(starts[run] + 1, starts[run + 1]):
                least, greatest = min(least, points[axis, i]), max(greatest, points[axis, i])
            boxes[run, axis], boxes[run, axis + 3] = least, greatest
    return boxes


@entrance
def bound_boxes(boxes, starts):
    """Return int32 `[r, 6]` what bounds runs of boxes."""
    bounds = boxes[starts[:-1]]
    for run in range(starts.size - 1):
        for part in range(starts[run] + 1, starts[run + 1]):
            for axis in range(3):
                bounds[run, axis] = min(bounds[run, axis], boxes[part, axis])
                bounds[run, axis + 3] = max(bounds[run, axis + 3], boxes[part, axis + 3])
    return bounds


@entrance
def list_anchors(chosen, order, merges, points, count):
    """Return the anchors in Morton order, of those at one place the first alone.

    Args:
        chosen: bool `[N]` which Gaussians are anchors, in Morton order.
        order: int32 `[N]` Gaussians in Morton order, those of equal positions ascending.
        merges: uint8 `[N]` as `sort_cells` gives them.
        points: int32 `[3, N]` positions in that order.
        count: How many anchors there are.

    Returns:
        int64 `[count]` indices of the Gaussians that are anchors, ascending; int32
        `[4, b + 16]` positions and numbers, and 16 more that mean nothing; uint8
        `[b]` their merges; and int32 `[N + 1]` how many stand before each Gaussian
        of the order.
    """
    members = np.empty(count + 1, dtype=np.uint32)
    places, widest = np.empty(count + 1, np.uint32), np.empty(count + 1, np.uint8)
    ranks = np.empty(order.size + 1, dtype=np.int32)
    seen, found, merge = np.uint64(0), np.uint64(0), np.uint8(0)
    for place in range(order.size):  # without a branch: what is not taken is written over
        members[seen] = order[place]
        seen += np.uint64(chosen[place])
        ranks[place] = found
        merge = max(merge, merges[place])
        places[found], widest[found] = place, merge
        taken = chosen[place] and merge > 0
        found += np.uint64(taken)
        merge = np.uint8(0) if taken else merge
    ranks[order.size] = found
    indices, number_of = _number(members[:count], order.size)
    last = np.int64(found)
    anchors = np.zeros((4, last + 16), dtype=np.int32)
    for i in range(last):
        for axis in range(3):
            anchors[axis, i] = points[axis, places[i]]
        anchors[3, i] = number_of[order[places[i]]]
    return indices, anchors, widest[:last].copy(), ranks


@plain
def _number(members, size):
    """Return int64 `[count]` members of `size` Gaussians, ascending, and int32 `[size]` numbers."""
    is_member = np.zeros(size, dtype=np.bool_)
    for member in members:
        is_member[member] = True
    indices, number_of = np.empty(members.size + 1, np.int64), np.empty(size, np.int32)
    found = np.uint64(0)
    for i in range(size):
        indices[found] = i
        number_of[i] = found
        found += np.uint64(is_member[i])
    return indices[: members.size].copy(), number_of
