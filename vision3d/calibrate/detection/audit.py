"""From found points to a view that says how far each of them can be trusted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vision3d.boards import Board, MarkerBoard
from vision3d.calibrate.detection.found import Found
from vision3d.calibrate.detection.lattice import Array, spacing_px
from vision3d.calibrate.detection.refine import allowed_px
from vision3d.calibrate.detection.smooth import fit_smooth
from vision3d.views import View, ViewAudit

__all__ = ["audited"]

STRANGE, STRANGE_PX = 5.0, 0.25
"""Standard deviations and pixels beyond which a residual is no chance."""
CARRIED_PX = 0.5
JUDGED_FROM = 6
"""Points from which a view says anything about its own scatter."""
SOFT_PX, FAINT = 3.0, 12.0


def audited(
    name: str, grey: NDArray[np.uint8], board: Board, found: Found, window: int | None
) -> tuple[View, ViewAudit]:
    """Judge the points of one image.

    The standard deviation of a point is that of the noise around it, and of what the whole view scatters
    beyond its noise: a board that is not flat, a print that is not true, an image that was compressed.
    """
    size = (grey.shape[1], grey.shape[0])
    refined, ids = found.refined, found.ids
    points, pixels, sigma = board.points[ids], refined.pixels, refined.sigma_px
    spacing, allowed = spacing_px(pixels), allowed_px(pixels)
    reach = refined.reach_px
    moved: tuple[tuple[int, float], ...] = ()
    if window is not None:
        from vision3d.cv import refine_corners

        forced = refine_corners(grey, pixels, window, iterations=60)
        moved = _moved(ids, forced - pixels, sigma)
        pixels, reach = forced, np.full(len(ids), float(window))
    smooth = fit_smooth(points, pixels, size) if len(ids) >= JUDGED_FROM else None
    noise = float(np.sqrt(np.mean(sigma**2)))
    extra, residuals, scatter = 0.0, np.empty((0, 2)), float("nan")
    strange: tuple[int, ...] = ()
    if smooth is not None:
        residuals, scatter = smooth.residuals, smooth.scale_px
        extra = float(np.sqrt(max(scatter**2 - noise**2, 0.0)))
        total = np.sqrt(sigma**2 + extra**2)
        sizes = np.linalg.norm(residuals, axis=1) / np.sqrt(1.0 - smooth.leverage)
        strange = tuple(int(i) for i in ids[(sizes > STRANGE * total) & (sizes > STRANGE_PX)])
    audit = ViewAudit(
        name=name, finder=found.finder, spacing_px=spacing, window_px=reach, allowed_px=allowed,
        residuals=residuals, scatter_px=scatter, noise_px=noise,
        blur_px=float(np.median(refined.blur_px)), contrast=float(np.median(np.abs(refined.contrast))),
        suspicious=strange, lost=found.lost, moved=moved, mirrored=found.mirrored,
    )  # fmt: skip
    findings = (*found.notes, *_findings(board, audit, forced=window is not None))
    return View(name, size, points, pixels, ids, np.hypot(sigma, extra), findings), audit


def _moved(ids: NDArray[np.int64], by: Array, sigma: Array) -> tuple[tuple[int, float], ...]:
    """Points that a forced window carries away, farthest first."""
    far = np.linalg.norm(by, axis=1)
    order = np.argsort(-far)
    return tuple(
        (int(ids[i]), float(far[i])) for i in order if far[i] > max(CARRIED_PX, STRANGE * float(sigma[i]))
    )


def _findings(board: Board, audit: ViewAudit, *, forced: bool) -> tuple[str, ...]:
    said = []
    if forced and audit.window_too_large:
        worst = int(np.argmin(audit.allowed_px))
        carried = (
            f"; it moves {_corners(board, [i for i, _ in audit.moved])} by up to {audit.moved[0][1]:.1f} px"
            if audit.moved
            else ""
        )
        said.append(
            f"the window of ±{audit.window_px[worst]:.0f} px is too large: corners stand "
            f"{audit.spacing_px[worst]:.1f} px apart, which allows ±{audit.allowed_px[worst]:.0f} px{carried}"
        )
    elif audit.suspicious:
        lie = "lies" if len(audit.suspicious) == 1 else "lie"
        said.append(
            f"{_corners(board, audit.suspicious)} {lie} more than {STRANGE:.0f} standard deviations from "
            "where the rest of the view says: look for glare, dirt or something in front of the board"
        )
    if audit.lost:
        said.append(f"{_corners(board, audit.lost)} could not be refined and are left out")
    if audit.blur_px > SOFT_PX:
        said.append(f"edges are blurred by {audit.blur_px:.1f} px (standard deviation): focus, or hold still")
    if audit.contrast < FAINT:
        said.append(f"dark and light differ by only {2 * audit.contrast:.0f} grey levels: give more light")
    return tuple(said)


def _corners(board: Board, ids: list[int] | tuple[int, ...]) -> str:
    """Name points by column and row, or by marker: `corner (3, 0)`, `2 corners 0 of marker 7, …`."""
    columns = board.shape[0]
    if isinstance(board, MarkerBoard):
        named = ", ".join(f"{i % 4} of marker {board.ids[i // 4]}" for i in ids[:4])
    else:
        named = ", ".join(f"({i % columns}, {i // columns})" for i in ids[:4])
    more = ", …" if len(ids) > 4 else ""
    return f"corner {named}" if len(ids) == 1 else f"{len(ids)} corners {named}{more}"
