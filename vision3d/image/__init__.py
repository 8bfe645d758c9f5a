"""Images as matrices: filters, gradients, levels, shapes, corners and lines, written to be read.

Every operation stands here three times behind one function: in NumPy, as a student reads it
(`backend="numpy"`), in loops that are compiled (`"compiled"`, the default) and by OpenCV (`"opencv"`); the
tests hold the three equal.
"""

from vision3d.image.borders import Border, pad
from vision3d.image.colour import grey, hsv, lab
from vision3d.image.components import Components, connected_components
from vision3d.image.corners import corners, harris
from vision3d.image.edges import Lines, canny, hough_lines
from vision3d.image.filters import box_blur, box_sums, convolve, correlate
from vision3d.image.gradients import Gradient, derivative_kernels, gradient, sobel
from vision3d.image.levels import adaptive_threshold, equalise, histogram, otsu, threshold
from vision3d.image.morphology import (
    closing,
    dilate,
    erode,
    morphological_gradient,
    opening,
    structuring_element,
)
from vision3d.image.pixels import Backend, Image
from vision3d.image.smoothing import gaussian_blur, gaussian_kernel

__all__ = [
    "Backend",
    "Border",
    "Components",
    "Gradient",
    "Image",
    "Lines",
    "adaptive_threshold",
    "box_blur",
    "box_sums",
    "canny",
    "closing",
    "connected_components",
    "convolve",
    "corners",
    "correlate",
    "derivative_kernels",
    "dilate",
    "equalise",
    "erode",
    "gaussian_blur",
    "gaussian_kernel",
    "gradient",
    "grey",
    "harris",
    "histogram",
    "hough_lines",
    "hsv",
    "lab",
    "morphological_gradient",
    "opening",
    "otsu",
    "pad",
    "sobel",
    "structuring_element",
    "threshold",
]
