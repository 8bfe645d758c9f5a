"""Structure from motion: cameras and points from photographs, through COLMAP's mappers."""

from vision3d.sfm.colmap import from_pycolmap, to_pycolmap
from vision3d.sfm.reconstruction import Reconstruction

__all__ = ["Reconstruction", "from_pycolmap", "to_pycolmap"]
