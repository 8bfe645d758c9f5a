"""Robust fits: the model that most of the rows agree with, how sure it is, and which rows those are.

found = fit_homography(pixels_a, pixels_b, RansacSettings(threshold=3.0))
found.model, found.cov, found.inliers, found.stopped          # "confidence reached" after found.iterations
"""

from vision3d.robust.compare import BackendRow, compare_backends, table_of
from vision3d.robust.essential import fit_essential
from vision3d.robust.flats import fit_line, fit_plane
from vision3d.robust.fundamental import eight_point, epipolar_distances, fit_fundamental
from vision3d.robust.homography import fit_homography, transfer, transfer_cov
from vision3d.robust.model import Addresses, CompiledModel, NumpyModel, RobustModel
from vision3d.robust.pose import fit_pose
from vision3d.robust.result import RobustFit
from vision3d.robust.search import fit
from vision3d.robust.settings import RansacSettings
from vision3d.robust.similarity import fit_similarity

__all__ = [
    "Addresses",
    "BackendRow",
    "CompiledModel",
    "NumpyModel",
    "RansacSettings",
    "RobustFit",
    "RobustModel",
    "compare_backends",
    "eight_point",
    "epipolar_distances",
    "fit",
    "fit_essential",
    "fit_fundamental",
    "fit_homography",
    "fit_line",
    "fit_plane",
    "fit_pose",
    "fit_similarity",
    "table_of",
    "transfer",
    "transfer_cov",
]
