"""What parts of a recording say by themselves: each half alone, and how large the board is to the IMU."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FactorlabError
from sequential.manifold import SE3
from vision3d.inertial import CamImuCalibration
from vision3d.inertial.adjust import Adjusted, adjust
from vision3d.inertial.parts import part_of
from vision3d.inertial.state import Constants

__all__ = ["Checked", "checked"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Checked:
    """Checks of a calibration.

    Parameters
    ----------
    halves : difference (7,) of the second half's calibration from the first's (rotation rad and translation
        m in
        camera_T_imu's chart, offset s); None where a half alone does not determine it
    halves_std : (7,) its standard deviation
    board_scale : true size of the board over the told one, by the accelerometer
    board_scale_std : its standard deviation
    """

    halves: Array | None
    halves_std: Array | None
    board_scale: float | None
    board_scale_std: float | None

    @property
    def halves_sigmas(self) -> float | None:
        """The largest of the seven differences, in sigmas."""
        if self.halves is None or self.halves_std is None:
            return None
        return float(np.max(np.abs(self.halves) / self.halves_std))


def checked(found: CamImuCalibration) -> Checked:
    """Make every check that the recording allows."""
    difference = std = None
    try:
        one, other = (_half(found, late=late) for late in (False, True))
    except FactorlabError:
        pass
    else:
        a, b = one.state, other.state
        difference = np.append(SE3().local(a.camera_T_imu, b.camera_T_imu), b.time_offset_s - a.time_offset_s)
        covs = [adjusted.system.border_cov[:7, :7] for adjusted in (one, other)]
        std = np.sqrt(np.diagonal(covs[0] + covs[1]))
    scale, scale_std = _board(found)
    return Checked(difference, std, scale, scale_std)


def _half(found: CamImuCalibration, *, late: bool) -> Adjusted:
    """Half of the frames alone, noise and weights kept."""
    t = found.problem.corners.t
    middle = float(np.median(t))
    problem, state = part_of(found, t > middle if late else t <= middle)
    return adjust(problem, state, found.walk, iterations=15)


def _board(found: CamImuCalibration) -> tuple[float | None, float | None]:
    constants = Constants(found.problem.constants.imu_model, board_scale=True)
    try:
        grown = adjust(
            replace(found.problem, constants=constants), found.adjusted.state, found.walk, iterations=15
        )
    except FactorlabError:
        return None, None
    std = float(np.sqrt(grown.system.border_cov[constants.scale_column, constants.scale_column]))
    scale = grown.state.board_scale
    return scale, std * scale
