"""What a calibration says: the camera, the poses of the board, how sure both are, and what did not fit."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from vision3d.camera import Camera
from vision3d.views import View

__all__ = ["Calibration", "SolveReport"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SolveReport:
    """How the solve went.

    Attributes
    ----------
    message : str
        One sentence for a person.
    converged : bool
        Whether the last step promised nothing more.
    iterations : int
        Steps of all stages together.
    condition : float
        Condition number of the camera's information matrix, scaled to a unit diagonal: 1 is best; beyond 1e8
        some combination of parameters is hardly told by the views.
    weakest : str
        The parameters that make up that combination.
    findings : tuple[str, ...]
        What a careful user should know: a fold inside the image, views that do not fit, weak parameters.
    remarks : tuple[str, ...]
        Those of them that tell what the standard deviations have in them.
    """

    message: str
    converged: bool
    iterations: int
    condition: float
    weakest: str
    findings: tuple[str, ...]
    remarks: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Calibration:
    """A camera calibrated from V views with N_v corners each.

    Attributes
    ----------
    camera : Camera
        Lens, parameters and image size.
    cov : Array
        Covariance of `camera.parameters`, (p, p).  Where the corners of one view err together, the scatter
        of the views is in it: see `vision3d.calibrate.covariance`.
    cov_independent : Array
        The same if the corners' errors were independent: what OpenCV and others state.
    inflation : float
        Standard deviations in `cov` over those in `cov_independent`, root of the mean square; 1 where
        independent errors explain the scatter of the views.
    poses : Array
        `camera_T_board` of every view, (V, 7).
    pose_covs : Array
        Their covariances (V, 6, 6), rotation then translation in the board's frame; the camera's share is in.
    pose_follows : Array
        (V, 6, q): how poses follow θ = (parameters, warp), so that the covariance of everything is known:
        ``cov(ξ_v, θ) = pose_follows[v] @ joint_cov``.
    pose_alone : Array
        (V, 6, 6): covariance of every pose when θ is known.
    joint_cov : Array
        Covariance of θ, (q, q) with q = p + 2.
    warp : Array
        How far the board is bent, (2,) m: the rise of its middle over its ends along x and along y, towards
        +z (away from the camera).  Zero unless asked for.
    views : tuple[View, ...]
        What was fitted.
    residuals : tuple[Array, ...]
        Corner minus projection of every view, (N_v, 2) px.
    weights : tuple[Array, ...]
        Weight of every corner of every view, (N_v,), relative to one at its stated sigma; 0: left out.
    floor_px : float
        What is added in squares to the views' `sigma_px`, where they understate the least or overstate the
        most certain corners; 0 where nothing shows that.
    sigma_scale : float
        Standard deviation of the residuals in units of that sigma, judged by the freedom left.
    sigma_px : float
        Standard deviation of a typical corner, per axis.
    rms_px : float
        Root mean square distance (OpenCV's definition) over the corners that count in full.
    rms_all_px : float
        The same over all corners.
    view_rms : Array
        The same for every view, all its corners, (V,).
    outliers : tuple[tuple[int, int], ...]
        Corners left out: number of the view, number of the corner on the board (`View.ids`).
    outlier_views : tuple[int, ...]
        Views that fit much worse than the others; they count little.
    report : SolveReport
        How the solve went.
    """

    camera: Camera
    cov: Array
    cov_independent: Array
    inflation: float
    poses: Array
    pose_covs: Array
    pose_follows: Array
    pose_alone: Array
    joint_cov: Array
    warp: Array
    views: tuple[View, ...]
    residuals: tuple[Array, ...]
    weights: tuple[Array, ...]
    floor_px: float
    sigma_scale: float
    sigma_px: float
    rms_px: float
    rms_all_px: float
    view_rms: Array
    outliers: tuple[tuple[int, int], ...]
    outlier_views: tuple[int, ...]
    report: SolveReport

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            for array in value if isinstance(value, tuple) else (value,):
                if isinstance(array, np.ndarray):
                    array.flags.writeable = False

    @property
    def std(self) -> Array:
        """Standard deviations of `camera.parameters`, (p,)."""
        deviations: Array = np.sqrt(np.diag(self.cov))
        return deviations

    @property
    def names(self) -> tuple[str, ...]:
        """Names of `camera.parameters`."""
        return self.camera.names

    @property
    def warp_std(self) -> Array:
        """Standard deviations of `warp`, (2,) m; zero where the board was taken for flat."""
        deviations: Array = np.sqrt(np.diag(self.joint_cov)[-2:])
        return deviations

    @property
    def corner_count(self) -> int:
        """Corners of all views."""
        return sum(len(view) for view in self.views)

    def cov_full(self) -> Array:
        """Covariance of θ and of all poses, (q + 6V, q + 6V): parameters, warp, then pose after pose."""
        V, _, q = self.pose_follows.shape
        onto = np.concatenate([np.eye(q), self.pose_follows.reshape(6 * V, q)])
        full: Array = onto @ self.joint_cov @ onto.T
        for v in range(V):
            rows = slice(q + 6 * v, q + 6 * v + 6)
            full[rows, rows] += self.pose_alone[v]
        return full
