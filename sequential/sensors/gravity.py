"""The |g| that an accelerometer is calibrated against: standard, or of a place."""

from __future__ import annotations

import math

from sequential.errors import DataError

__all__ = ["STANDARD_GRAVITY", "local_gravity"]

STANDARD_GRAVITY = 9.80665  # m/s², by definition (3rd CGPM, 1901)
# WGS 84: gravity on the equator, Somigliana's constant, first eccentricity squared, semi-axis (m)
EQUATOR, SOMIGLIANA, ECCENTRICITY2, SEMI_AXIS = 9.7803253359, 0.00193185265241, 0.00669437999013, 6378137.0
FLATTENING, CENTRIFUGAL = 1 / 298.257223563, 0.00344978650684  # and ω²a²b/GM


def local_gravity(latitude: float, height: float = 0.0) -> float:
    """Gravity of the WGS 84 ellipsoid at a latitude (rad) and a height above it (m), m/s².

    Somigliana's closed formula on the ellipsoid and the second-order height correction (NIMA TR8350.2,
    equations 4-1 and 4-3).  What is left out is the local anomaly, some 0.0005 m/s² and rarely 0.002.

    Raises
    ------
    DataError
        where the latitude lies beyond a pole (degrees given for radians?) or the height beyond 100 km.
    """
    if not abs(latitude) <= math.pi / 2:
        raise DataError(f"latitude is {latitude:g} rad, expected -π/2 to π/2; convert degrees to radians")
    if not abs(height) <= 1e5:
        raise DataError(f"height is {height:g} m, expected less than 100 km")
    square = math.sin(latitude) ** 2
    surface = EQUATOR * (1 + SOMIGLIANA * square) / math.sqrt(1 - ECCENTRICITY2 * square)
    slope = 2 / SEMI_AXIS * (1 + FLATTENING + CENTRIFUGAL - 2 * FLATTENING * square)
    return surface * (1 - slope * height + 3 * (height / SEMI_AXIS) ** 2)
