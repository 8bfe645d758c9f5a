"""Models of pairs of rays for the robust loop: essential matrix, homography, rotation.

Rows are `vision3d.ray_pairs`': 18 numbers that know their own noise, so that errors are standard deviations.
"""

from __future__ import annotations

from vision3d.robust.model import Addresses, CompiledModel

__all__ = ["ESSENTIAL", "RAY_HOMOGRAPHY", "ROTATION"]


def _load_essential() -> Addresses:
    from vision3d.kernels import robust_rays as kernels

    return Addresses(
        kernels.essential_solve.address, kernels.essential_error.address, kernels.essential_fit.address
    )


def _load_homography() -> Addresses:
    from vision3d.kernels import robust_rays as kernels

    return Addresses(
        kernels.homography_solve.address, kernels.homography_error.address, kernels.homography_fit.address
    )


def _load_rotation() -> Addresses:
    from vision3d.kernels import robust_rays as kernels

    return Addresses(
        kernels.rotation_solve.address, kernels.homography_error.address, kernels.rotation_fit.address
    )


ESSENTIAL = CompiledModel(
    "essential matrix", 5, 18, 9, max_solutions=10, freedom=5, inner_size=14, solve_cost=300,
    load=_load_essential,
)  # fmt: skip
RAY_HOMOGRAPHY = CompiledModel(
    "homography of rays",
    4,
    18,
    9,
    error_dof=2,
    freedom=8,
    inner_size=12,
    solve_cost=10,
    load=_load_homography,
)
ROTATION = CompiledModel(
    "rotation of rays", 2, 18, 9, error_dof=2, freedom=3, inner_size=8, solve_cost=5, load=_load_rotation
)
