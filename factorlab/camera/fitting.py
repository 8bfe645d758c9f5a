"""Which lens, and is the board flat?  Both are decided by pictures that the fit has not seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from factorlab.camera.calibrated import CameraSettings
from vision3d.views import View

if TYPE_CHECKING:
    from vision3d.calibrate import Calibration, LensChoice

__all__ = ["FEWEST", "Fitted", "fitted"]

FEWEST = 3  # views of which none can be left out
FEW_LENS = "brown2"
ENOUGH_TO_BEND = 6  # views from which a bend of the board is looked for
CERTAIN, BETTER = (
    3.0,
    0.99,
)  # standard deviations of the bend, and what it must bring the left-out error down to


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """What was fitted.

    Parameters
    ----------
    calibration : the answer
    choice : the lenses that were tried; None where one was asked for, or views are too few
    flat_px : RMS over left-out pictures with a flat board; None where no bend was looked for
    """

    calibration: Calibration
    choice: LensChoice | None = None
    flat_px: float | None = None


def fitted(views: tuple[View, ...], settings: CameraSettings, say: Callable[[str], None]) -> Fitted:
    """The calibration with the lens asked for, or with the one that predicts best.

    A board that the pictures show to be bent is taken for bent where that predicts left-out pictures better.
    """
    from vision3d.calibrate import calibrate, choose_lens
    from vision3d.calibrate.lens_choice import CANDIDATES

    lenses = CANDIDATES if settings.lens == "auto" else (settings.lens,)
    if len(views) <= FEWEST:
        lens = FEW_LENS if settings.lens == "auto" else settings.lens
        fit = calibrate(views, lens, robust=settings.robust, board_warp=settings.shape == "bent")
        if settings.lens == "auto":
            say(f"{len(views)} pictures are too few to choose a lens by: {FEW_LENS} was taken")
        return Fitted(fit)
    choice = choose_lens(views, lenses, robust=settings.robust, board_warp=settings.shape == "bent")
    flat_px = None
    if settings.shape == "auto" and choice.calibration.inflation > 1.0 and len(views) >= ENOUGH_TO_BEND:
        flat_px = left_out_px(choice)
        bent = choose_lens(views, lenses, robust=settings.robust, board_warp=True)
        if certain(bent.calibration) and left_out_px(bent) < BETTER * flat_px:
            choice = bent
    return Fitted(choice.calibration, choice if settings.lens == "auto" else None, flat_px)


def left_out_px(choice: LensChoice) -> float:
    """RMS over left-out pictures of the lens that was chosen."""
    return choice.score(choice.chosen).held_out_rms_px


def certain(fit: Calibration) -> bool:
    """Whether the bend of the board is more than chance."""
    return bool(np.any(np.abs(fit.warp) > CERTAIN * np.maximum(fit.warp_std, 1e-12)))
