"""Structure from motion: cameras and points from photographs, through COLMAP's mappers."""

from vision3d.sfm.colmap import from_pycolmap, to_pycolmap
from vision3d.sfm.explaining import NoModelError
from vision3d.sfm.patience import Stopped
from vision3d.sfm.pipeline import reconstruct
from vision3d.sfm.reconstruction import Reconstruction
from vision3d.sfm.settings import SfmSettings
from vision3d.sfm.view_graph import ViewGraph

__all__ = [
    "NoModelError",
    "Reconstruction",
    "SfmSettings",
    "Stopped",
    "ViewGraph",
    "from_pycolmap",
    "reconstruct",
    "to_pycolmap",
]
