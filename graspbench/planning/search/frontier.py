"""The open part of the search: tuples of clusters in the order of their upper bounds."""

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled


@compiled
def push(
    bounds: FloatArray,
    tuples: IntArray,
    size: int,
    new_bounds: FloatArray,
    new_tuples: IntArray,
    lower: float,
) -> int:
    """Add the tuples with bounds above ``lower`` to the heap and return its new size.

    Args:
        bounds: Heap of upper bounds, with room for all new ones.
        tuples: The clusters of each, shape (capacity, n_f).
        size: Number of tuples in the heap.
        new_bounds: Shape (m,).
        new_tuples: Shape (m, n_f).
        lower: Bounds at or below it are left out.
    """
    n_f = tuples.shape[1]
    for m in range(new_bounds.shape[0]):
        bound = new_bounds[m]
        if not bound > lower:
            continue
        k = size
        while k > 0:
            parent = (k - 1) // 2
            if bounds[parent] >= bound:
                break
            bounds[k] = bounds[parent]
            for i in range(n_f):
                tuples[k, i] = tuples[parent, i]
            k = parent
        bounds[k] = bound
        for i in range(n_f):
            tuples[k, i] = new_tuples[m, i]
        size += 1
    return size


@compiled
def expand(
    bounds: FloatArray,
    tuples: IntArray,
    size: int,
    tree: IntArray,
    radii: FloatArray,
    few: int,
    child_tuples: IntArray,
    child_bounds: FloatArray,
    leaf_tuples: IntArray,
    stop_at: float,
) -> tuple[int, int, int]:
    """Take tuples from the top of the heap and split the widest cluster of each.

    Args:
        bounds: Heap of upper bounds.
        tuples: The clusters of each, shape (capacity, n_f).
        size: Number of tuples in the heap.
        tree: See `graspbench.planning.search.bounds.bound_tuples`.
        radii: Radius of each cluster; the widest is split.
        few: A tuple of at most this many grasps is not split.
        child_tuples: Written: tuples that came from splitting, shape (m, n_f).
        child_bounds: Written: the bounds of the tuples they came from, shape (m,).
        leaf_tuples: Written: tuples that hold few grasps, shape (m_leaf, n_f).
        stop_at: Take nothing with a bound at or below it.

    Returns:
        New size of the heap, number of children, number of tuples of few grasps.
    """
    n_f = tuples.shape[1]
    children, leaves = 0, 0
    while size > 0 and bounds[0] > stop_at:
        if children + n_f + 1 > child_bounds.shape[0] or leaves == leaf_tuples.shape[0]:
            break
        split, widest, many = -1, -1.0, 1
        for i in range(n_f):
            cluster = tuples[0, i]
            many *= tree[cluster, 3] - tree[cluster, 2]
            if tree[cluster, 0] >= 0 and radii[cluster] > widest:
                split, widest = cluster, radii[cluster]
        if many <= few:
            for i in range(n_f):
                leaf_tuples[leaves, i] = tuples[0, i]
            leaves += 1
        else:
            many = 0  # contacts in this cluster
            for i in range(n_f):
                many += tuples[0, i] == split
            left, right = tree[split, 0], tree[split, 1]
            for to_left in range(many + 1):
                if (
                    to_left > tree[left, 3] - tree[left, 2]
                    or many - to_left > tree[right, 3] - tree[right, 2]
                ):
                    continue
                seen = 0
                for i in range(n_f):
                    child_tuples[children, i] = tuples[0, i]
                    if tuples[0, i] == split:
                        child_tuples[children, i] = left if seen < to_left else right
                        seen += 1
                child_bounds[children] = bounds[0]
                children += 1
        size -= 1
        bound = bounds[size]
        k = 0
        while True:
            down = 2 * k + 1
            if down >= size:
                break
            if down + 1 < size and bounds[down + 1] > bounds[down]:
                down += 1
            if bounds[down] <= bound:
                break
            bounds[k] = bounds[down]
            for i in range(n_f):
                tuples[k, i] = tuples[down, i]
            k = down
        bounds[k] = bound
        for i in range(n_f):
            tuples[k, i] = tuples[size, i]
    return size, children, leaves
