"""Two cameras that asked for different lenses: those win that keep the rows of pairs they have not seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from vision3d.stereo.calibration import StereoCalibration
from vision3d.stereo.fit import calibrate_stereo
from vision3d.stereo.held_out import HeldOut, leave_pairs_out
from vision3d.stereo.view_pairs import ViewPair

__all__ = ["calibrate_with_best_lenses"]


def calibrate_with_best_lenses(
    pairs: Sequence[ViewPair], lenses: tuple[str, str], **settings: Any
) -> tuple[StereoCalibration, HeldOut | None]:
    """Calibrate with the lens that each camera asked for, or with either of them for both.

    Cameras of one rig are mostly of one kind, and what one of them shows of its lens the other one's pictures
    may be too few to show.  The calibration whose left-out pairs have their rows nearest together is taken.

    Parameters
    ----------
    pairs : of views of one board
    lenses : that the left and the right camera alone predict their left-out pictures best with
    settings : of `calibrate_stereo`

    Returns
    -------
    tuple
        the calibration, and its pairs predicted from the others (None with too few to leave one out)
    """
    left, right = lenses
    found = calibrate_stereo(pairs, lenses, **settings)
    held = leave_pairs_out(found)
    if held is None:
        return found, None
    for both in {left: (left, left), right: (right, right)}.values() if left != right else ():
        other = calibrate_stereo(pairs, both, **settings)
        tried = leave_pairs_out(other)
        if tried is not None and tried.row_px < held.row_px:
            found, held = other, tried
    return found, held
