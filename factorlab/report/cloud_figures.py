"""Pictures of clouds for a page: from three sides, and two clouds on each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from factorlab.report.style import blank
from vision3d.cloud import splat, viewpoint

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from factorlab.cloud import CloudJob

__all__ = ["cloud_views", "registration_views"]

SIDES = {
    "from the left, above": (0.5, 0.45, 1.0),
    "from above": (0.0, 1.0, 0.02),
    "from the right": (-1.0, 0.15, 0.3),
}
PAINTS = np.array(
    [
        *([150, 155, 165], [0, 114, 178], [213, 94, 0], [0, 158, 115]),
        *([204, 121, 167], [86, 180, 233], [230, 159, 0]),
    ],
    np.uint8,
)


def cloud_views(job: CloudJob) -> Figure:
    """The cloud from three sides, in its colours, or coloured by its planes."""
    colors = job.colors
    if job.planes:
        number = np.zeros(len(job.points), np.int64)
        for k, plane in enumerate(job.planes, 1):
            number[plane.inliers] = 1 + (k - 1) % (len(PAINTS) - 1)
        colors = PAINTS[number]
    figure, axes = blank(3.2, 1, len(SIDES))
    for ax, (title, forward) in zip(axes[0], SIDES.items(), strict=True):
        show(ax, job.points, colors, forward)
        ax.set_title(title)
    return figure


def registration_views(job: CloudJob) -> Figure | None:
    """Both clouds, before and after."""
    from factorlab.cloud.job import aligned

    if job.target is None:
        return None
    figure, axes = blank(4.0, 1, 2)
    for ax, title, points in ((axes[0, 0], "before", job.points), (axes[0, 1], "after", aligned(job))):
        both = np.concatenate([job.target.points, points])
        colors = np.repeat(PAINTS[[0, 2]], [len(job.target.points), len(points)], axis=0)
        show(ax, both, colors, SIDES["from the left, above"])
        ax.set_title(title)
    return figure


def show(
    ax: object, points: NDArray[np.float64], colors: NDArray[np.uint8] | None, forward: tuple[float, ...]
) -> None:
    """Draw a cloud into axes: one disc a point, large enough to touch its neighbours."""
    camera, camera_T_world = viewpoint(points, size=(900, 760), forward=forward)
    radius = float(np.clip(0.35 * np.sqrt(900 * 760 / max(len(points), 1)), 0.6, 4.0))
    ax.imshow(splat(points, colors, camera, camera_T_world, radius_px=radius))  # type: ignore[attr-defined]
    ax.set_axis_off()  # type: ignore[attr-defined]
