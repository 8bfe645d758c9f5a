"""Robust fits: the model that most of the rows agree with, how sure it is, and which rows those are.

found = fit_homography(pixels_a, pixels_b, RansacSettings(threshold=3.0))
found.model, found.cov, found.inliers, found.stopped          # "confidence reached" after found.iterations
"""

from vision3d.robust.homography import fit_homography, transfer, transfer_cov
from vision3d.robust.model import Addresses, CompiledModel, NumpyModel, RobustModel
from vision3d.robust.result import RobustFit
from vision3d.robust.search import fit
from vision3d.robust.settings import RansacSettings

__all__ = [
    "Addresses",
    "CompiledModel",
    "NumpyModel",
    "RansacSettings",
    "RobustFit",
    "RobustModel",
    "fit",
    "fit_homography",
    "transfer",
    "transfer_cov",
]
