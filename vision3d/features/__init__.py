"""Points that can be found again in another picture, and which of them belong together.

    a, b = detect_features(left, "sift"), detect_features(right, "sift")
    matches = match_features(a, b)                       # best first
    at, cov, ok = refine_matches(left, right, *matches.points(a, b), warps=matches.warps(a, b))

Importing this loads neither OpenCV nor Numba.
"""

from vision3d.features.consistency import supporters
from vision3d.features.detection import KINDS, detect_features
from vision3d.features.features import Features, Matches
from vision3d.features.guided import guided_matches
from vision3d.features.matching import match_features
from vision3d.features.refining import refine_matches
from vision3d.features.spreading import spread_levels, spread_rows

__all__ = [
    "KINDS",
    "Features",
    "Matches",
    "detect_features",
    "guided_matches",
    "match_features",
    "refine_matches",
    "spread_levels",
    "spread_rows",
    "supporters",
]
