"""One layer of a network for one sample, compiled."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, fastmath={"contract"})
def layer(columns, bias, inputs, rectified, outputs):
    """``bias + inputs @ columns`` (n_out,) for one sample, negative values set to 0 where ``rectified``.

    A network online waits for its weights to come from memory: those of inputs that are 0, which half of the rectified
    units are, are not read.
    """
    active, count = np.empty(len(inputs), np.int64), 0
    for j in range(len(inputs)):
        if inputs[j] != 0.0:
            active[count] = j
            count += 1
    for i in range(len(outputs)):
        outputs[i] = bias[i]
    whole = count - count % 4
    for k in range(0, whole, 4):
        j0, j1, j2, j3 = active[k], active[k + 1], active[k + 2], active[k + 3]
        x0, x1, x2, x3 = inputs[j0], inputs[j1], inputs[j2], inputs[j3]
        for i in range(len(outputs)):
            outputs[i] += x0 * columns[j0, i] + x1 * columns[j1, i] + x2 * columns[j2, i] + x3 * columns[j3, i]
    for k in range(whole, count):
        x0, j0 = inputs[active[k]], active[k]
        for i in range(len(outputs)):
            outputs[i] += x0 * columns[j0, i]
    if rectified:
        for i in range(len(outputs)):
            if outputs[i] < 0.0:
                outputs[i] = 0.0
