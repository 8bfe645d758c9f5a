"""Clouds of points: thinned, with normals, cleaned, brought together, cut into planes, drawn, written.

Everything here runs on NumPy and SciPy; where open3d is installed (`pip install factorlab[cloud]`), Poisson
surfaces come with it, and the rest can be asked of it through `backend="open3d"`.
"""

from vision3d.cloud.ply import Ply, read_ply, write_ply

__all__ = ["Ply", "read_ply", "write_ply"]
