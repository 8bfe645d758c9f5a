"""Names of the attitude estimators on the command line, and what they are."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from sequential.errors import DataError, ToolMissingError

__all__ = ["DEFAULT", "TITLES", "available", "left_out", "make_estimator"]

TITLES = {
    "error-state": "error-state filter",
    "smoother": "smoother",
    "mahony": "Mahony filter",
    "madgwick": "Madgwick filter",
    "complementary": "complementary filter",
    "kalman": "tilt Kalman filter",
    "c-error-state": "error-state filter in C",
    "c-mahony": "Mahony filter in C",
    "c-mahony-q": "Mahony filter in fixed point",
    "c-complementary": "complementary filter in C",
    "c-complementary-q": "complementary filter in fixed point",
    "c-kalman": "tilt Kalman filter in C",
    "c-kalman-q": "tilt Kalman filter in fixed point",
}
CLASSES = {
    "error-state": "ErrorStateAttitude",
    "smoother": "AttitudeSmoother",
    "mahony": "Mahony",
    "madgwick": "Madgwick",
    "complementary": "ComplementaryAttitude",
    "kalman": "TiltKalman",
    "c-error-state": "CErrorState",
    "c-mahony": "CMahony",
    "c-mahony-q": "CMahonyFixed",
    "c-complementary": "CComplementary",
    "c-complementary-q": "CComplementaryFixed",
    "c-kalman": "CTiltKalman",
    "c-kalman-q": "CTiltKalmanFixed",
}
DEFAULT = "error-state"
IN_C = "c-"  # begins the names of the filters of the firmware


def available() -> tuple[str, ...]:
    """Names of the estimators that can run here, the default first."""
    lacking = left_out()
    return tuple(name for name, kind in CLASSES.items() if hasattr(_room(name), kind) and name not in lacking)


def left_out() -> dict[str, str]:
    """The filters in C with the reason, where their core is not compiled here; mostly none."""
    from sequential.firmware import missing

    reason = missing()
    return {name: reason for name in CLASSES if name.startswith(IN_C)} if reason else {}


def make_estimator(name: str) -> Any:
    """The estimator of a name, with its default settings.

    Raises
    ------
    DataError
        where there is none of that name.
    ToolMissingError
        where its C core is not compiled here.
    """
    if name not in available():
        if reason := left_out().get(name):
            raise ToolMissingError(reason)
        raise DataError(f"there is no attitude estimator {name!r}; there are {', '.join(available())}")
    return getattr(_room(name), CLASSES[name])()


def _room(name: str) -> Any:
    """The module that exports the estimator."""
    return import_module("sequential.firmware" if name.startswith(IN_C) else "sequential.attitude")
