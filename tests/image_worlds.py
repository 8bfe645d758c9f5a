"""Images on which operations are held to OpenCV's: noise, edges, flat, tiny, of every type."""

import numpy as np

BORDERS = ("constant", "replicate", "reflect", "reflect101")  # OpenCV's filters have no torus
BACKENDS = ("compiled", "numpy", "opencv")
TYPES = ("uint8", "uint16", "int16", "float32", "float64")


def noise(rng, shape=(37, 51), kind="uint8"):
    """Every level as often, positive and negative where the type has a sign."""
    if kind == "uint8":
        return rng.integers(0, 256, shape, dtype=np.uint8)
    if kind.startswith("float"):
        return (rng.standard_normal(shape) * 80).astype(kind)
    return rng.integers(np.iinfo(kind).min // 4, np.iinfo(kind).max // 4, shape).astype(kind)


def blobs(rng, shape=(60, 80), share=0.4, reach=2):
    """A mask of rounded pieces."""
    smooth = rng.random(shape)
    for axis in (0, 1):
        smooth = sum(np.roll(smooth, k, axis) for k in range(-reach, reach + 1))
    return smooth > np.quantile(smooth, 1 - share)


def grey_family(rng):
    """Images of bytes that thresholds and levels could stumble over."""
    return {
        "noise": noise(rng),
        "flat": np.full((9, 7), 77, np.uint8),
        "one pixel": np.array([[3]], np.uint8),
        "two levels": np.where(rng.random((40, 30)) < 0.3, 10, 200).astype(np.uint8),
        "black and white": np.array([[0, 255]], np.uint8),
        "two hills": np.clip(rng.normal(rng.choice([60, 180], (50, 60)), 18), 0, 255).astype(np.uint8),
        "few levels": rng.choice(np.array([3, 90, 91, 201], np.uint8), (20, 20)),
    }
