"""Connected components: flood from one pixel after the other, or two passes with sets that are united."""

import numba as nb
import numpy as np

from vision3d.kernels import kernel

__all__ = ["breadth_first", "measure", "renumber", "two_passes"]

read, i32 = nb.types.Array(nb.uint8, 2, "C", readonly=True), nb.int32[:, ::1]


@kernel(nb.int64(read, nb.boolean, i32))
def breadth_first(mask, diagonals, labels):
    """Label components in the order of their first pixels; returns how many there are.

    A pixel enters the queue when it gets its label, so at most once.
    """
    height, width = mask.shape
    queue = np.empty(height * width, np.int64)
    neighbours = 8 if diagonals else 4
    dy = np.array([-1, 1, 0, 0, -1, -1, 1, 1])
    dx = np.array([0, 0, -1, 1, -1, 1, -1, 1])
    count = 0
    for y in range(height):
        for x in range(width):
            labels[y, x] = 0
    for y0 in range(height):
        for x0 in range(width):
            if mask[y0, x0] == 0 or labels[y0, x0] != 0:
                continue
            count += 1
            labels[y0, x0] = count
            queue[0] = y0 * width + x0
            head, tail = 0, 1
            while head < tail:
                y, x = queue[head] // width, queue[head] % width
                head += 1
                for k in range(neighbours):
                    v, u = y + dy[k], x + dx[k]
                    if 0 <= v < height and 0 <= u < width and mask[v, u] != 0 and labels[v, u] == 0:
                        labels[v, u] = count
                        queue[tail] = v * width + u
                        tail += 1
    return count


@kernel(nb.int64(read, nb.boolean, i32))
def two_passes(mask, diagonals, labels):
    """The same: provisional labels by row, equal ones united in a forest, then the final ones.

    The smaller root always wins, so roots come in the order of first pixels and stay numbered so.
    """
    height, width = mask.shape
    parents = np.zeros((height * width) // 2 + 2 * width + 2, np.int32)
    used = 1
    for y in range(height):
        for x in range(width):
            if mask[y, x] == 0:
                labels[y, x] = 0
                continue
            root = 0
            for k in range(4 if diagonals else 2):  # left, up, up left, up right: those seen already
                u = x - 1 if k in (0, 2) else (x + 1 if k == 3 else x)
                v = y if k == 0 else y - 1
                if v < 0 or u < 0 or u >= width or mask[v, u] == 0:
                    continue
                other = labels[v, u]
                while parents[other] != other:
                    parents[other] = parents[parents[other]]
                    other = parents[other]
                if root == 0:
                    root = other
                elif other < root:
                    parents[root] = other
                    root = other
                else:
                    parents[other] = root
            if root == 0:
                root = used
                parents[used] = used
                used += 1
            labels[y, x] = root
    count = 0
    for k in range(1, used):
        if parents[k] == k:
            count += 1
            parents[k] = count
        else:
            parents[k] = parents[parents[k]]
    for y in range(height):
        for x in range(width):
            labels[y, x] = parents[labels[y, x]]
    return count


@kernel(nb.void(i32, nb.int64))
def renumber(labels, count):
    """Give components the order of their first pixels, whatever it was."""
    names = np.zeros(count + 1, np.int32)
    used = 0
    height, width = labels.shape
    for y in range(height):
        for x in range(width):
            old = labels[y, x]
            if old > 0:
                if names[old] == 0:
                    used += 1
                    names[old] = used
                labels[y, x] = names[old]


@kernel(nb.void(i32, i32, nb.float64[:, ::1]))
def measure(labels, boxes, sums):
    """Per component: left, top, right and bottom, and the sums of 1, x and y.  Row 0 is the background."""
    for k in range(len(boxes)):
        boxes[k, 0], boxes[k, 1], boxes[k, 2], boxes[k, 3] = labels.shape[1], labels.shape[0], -1, -1
        sums[k, 0] = sums[k, 1] = sums[k, 2] = 0.0
    for y in range(labels.shape[0]):
        for x in range(labels.shape[1]):
            k = labels[y, x]
            sums[k, 0] += 1.0
            sums[k, 1] += x
            sums[k, 2] += y
            boxes[k, 0] = min(boxes[k, 0], x)
            boxes[k, 1] = min(boxes[k, 1], y)
            boxes[k, 2] = max(boxes[k, 2], x)
            boxes[k, 3] = max(boxes[k, 3], y)
