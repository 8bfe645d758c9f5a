"""Clouds of points: thinned, with normals, cleaned, brought together, cut into planes, drawn, written.

Everything here runs on NumPy and SciPy.  Where open3d is installed (`pip install 'factorlab[cloud]'`),
Poisson surfaces come with it, and the rest can be asked of it by `backend="open3d"`.
"""

from vision3d.cloud.normals import Normals, estimate_normals
from vision3d.cloud.outliers import outliers_by_radius, remove_outliers
from vision3d.cloud.planes import CloudPlane, fit_cloud_plane, segment_planes
from vision3d.cloud.ply import Ply, read_ply, write_ply
from vision3d.cloud.registration import IcpResult, icp
from vision3d.cloud.splat import splat, viewpoint
from vision3d.cloud.surface import Mesh, poisson_mesh
from vision3d.cloud.thinning import Voxels, voxel_downsample

__all__ = [
    "CloudPlane",
    "IcpResult",
    "Mesh",
    "Normals",
    "Ply",
    "Voxels",
    "estimate_normals",
    "fit_cloud_plane",
    "icp",
    "outliers_by_radius",
    "poisson_mesh",
    "read_ply",
    "remove_outliers",
    "segment_planes",
    "splat",
    "viewpoint",
    "voxel_downsample",
    "write_ply",
]
