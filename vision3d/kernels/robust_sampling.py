"""Random numbers and samples of the robust loop: the same on every machine for the same seed.

SplitMix64 (Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators"); PROSAC's growing set
(Chum, Matas 2005, "Matching with PROSAC", equations 3-6).
"""

from __future__ import annotations

import numpy as np

from vision3d.kernels import inlined

__all__ = ["below", "draw", "draw_growing", "mix"]

GOLDEN, FIRST, SECOND = (
    np.uint64(0x9E3779B97F4A7C15),
    np.uint64(0xBF58476D1CE4E5B9),
    np.uint64(0x94D049BB133111EB),
)
S27, S30, S31, S32 = np.uint64(27), np.uint64(30), np.uint64(31), np.uint64(32)


@inlined
def below(random, n):
    """A whole number from 0 to n - 1 (n below 2³²); moves the state random (1,) on."""
    random[0] += GOLDEN
    z = random[0]
    z = (z ^ (z >> S30)) * FIRST
    z = (z ^ (z >> S27)) * SECOND
    z ^= z >> S31
    return np.int64(((z >> S32) * np.uint64(n)) >> S32)


@inlined
def draw(random, n, first, last, sample):
    """Fill sample[first:last] with numbers below n that differ from each other and from those before."""
    i = first
    while i < last:
        sample[i] = below(random, n)
        new = True
        for j in range(i):
            new = new and sample[j] != sample[i]
        if new:
            i += 1


@inlined
def draw_growing(random, trial, n, growth, sample):
    """PROSAC's sample number `trial` (from 1): rows come best first; growth (3,) holds its n, T_n and T'_n.

    While the set grows, its newest member is in every sample; later, any rows are.
    """
    m = sample.shape[0]
    size = np.int64(growth[0])
    while trial > growth[2] and size < n:
        size += 1
        longer = growth[1] * size / (size - m)
        growth[2] += np.ceil(longer - growth[1])
        growth[1] = longer
    growth[0] = size
    if trial > growth[2]:
        draw(random, n, 0, m, sample)
        return
    sample[0] = size - 1
    draw(random, size - 1, 1, m, sample)


@inlined
def mix(random, order):
    """Shuffle the numbers in order (n,), by Fisher and Yates."""
    for i in range(order.shape[0] - 1, 0, -1):
        j = below(random, i + 1)
        order[i], order[j] = order[j], order[i]
