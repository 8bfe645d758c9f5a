"""Names of the attitude estimators on the command line, and what they are."""

from __future__ import annotations

from typing import Any

from sequential.errors import DataError

__all__ = ["DEFAULT", "TITLES", "available", "make_estimator"]

TITLES = {
    "error-state": "error-state filter",
    "smoother": "smoother",
    "mahony": "Mahony filter",
    "madgwick": "Madgwick filter",
    "complementary": "complementary filter",
    "kalman": "tilt Kalman filter",
}
CLASSES = {
    "error-state": "ErrorStateAttitude",
    "smoother": "AttitudeSmoother",
    "mahony": "Mahony",
    "madgwick": "Madgwick",
    "complementary": "ComplementaryAttitude",
    "kalman": "TiltKalman",
}
DEFAULT = "error-state"


def available() -> tuple[str, ...]:
    """Names of the estimators that this installation has, the default first."""
    from sequential import attitude

    return tuple(name for name, kind in CLASSES.items() if hasattr(attitude, kind))


def make_estimator(name: str) -> Any:
    """The estimator of a name, with its default settings.

    Raises
    ------
    DataError
        where there is none of that name.
    """
    from sequential import attitude

    if name not in available():
        raise DataError(f"there is no attitude estimator {name!r}; there are {', '.join(available())}")
    return getattr(attitude, CLASSES[name])()
