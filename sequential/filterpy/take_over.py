"""The door: recognise a FilterPy object by its class and take it over."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from sequential.errors import ModelError

__all__ = ["from_filterpy"]

INSTEAD = {
    "MMAEFilterBank": "an IMMEstimator whose matrix M is the identity weighs a fixed set of filters",
    "EnsembleKalmanFilter": "declare the model once and run sequential.UnscentedKalmanFilter() on the log",
    "FadingKalmanFilter": "FilterPy's KalmanFilter has the same memory as its attribute alpha",
    "FadingMemoryFilter": "sequential.signal has the simple filters",
    "HInfinityFilter": "take a KalmanFilter, with a larger Q where the model is in doubt",
    "LeastSquaresFilter": "take a KalmanFilter with Q = 0",
    "GHFilter": "take a KalmanFilter and its predict_steadystate and update_steadystate",
    "GHKFilter": "take a KalmanFilter and its predict_steadystate and update_steadystate",
}


def taken_over() -> dict[str, type[Any]]:
    """What takes over which class of FilterPy; brings in compiled code, so it waits until it is asked for."""
    from sequential.filterpy.cubature import FilterpyCubature
    from sequential.filterpy.extended import FilterpyExtended
    from sequential.filterpy.fixed_lag import FilterpyFixedLag
    from sequential.filterpy.information import FilterpyInformation
    from sequential.filterpy.kalman import FilterpyKalman
    from sequential.filterpy.mixing import FilterpyMixing
    from sequential.filterpy.square_root import FilterpySquareRoot
    from sequential.filterpy.unscented import FilterpyUnscented

    return {
        "KalmanFilter": FilterpyKalman,
        "SquareRootKalmanFilter": FilterpySquareRoot,
        "InformationFilter": FilterpyInformation,
        "ExtendedKalmanFilter": FilterpyExtended,
        "UnscentedKalmanFilter": FilterpyUnscented,
        "CubatureKalmanFilter": FilterpyCubature,
        "FixedLagSmoother": FilterpyFixedLag,
        "IMMEstimator": FilterpyMixing,
    }


def from_filterpy(kf: Any) -> Any:
    """Take over a configured FilterPy filter: the rest of a script that was written for it runs unchanged.

    Parameters
    ----------
    kf : a `KalmanFilter`, `SquareRootKalmanFilter`, `InformationFilter`, `ExtendedKalmanFilter`,
        `UnscentedKalmanFilter`, `CubatureKalmanFilter`, `IMMEstimator` or `FixedLagSmoother` of FilterPy, or
        of a class derived from one of these.  It is copied, and not changed.

    Returns
    -------
    object
        with the same attributes and methods; where its numbers differ is told in `sequential.filterpy`.  A
        linear filter has `model(dt)` and `log(zs, dt)` as well: the same problem for every estimator here.

    Raises
    ------
    ModelError, ShapeError
        where this is no FilterPy filter, or one that is not taken over, or its matrices do not fit.

    Examples
    --------
    >>> from filterpy.kalman import KalmanFilter  # doctest: +SKIP
    >>> kf = KalmanFilter(dim_x=2, dim_z=1)  # doctest: +SKIP
    >>> kf = sequential.from_filterpy(kf)  # doctest: +SKIP
    """
    from sequential.filterpy.recursion import TakenOver

    if isinstance(kf, TakenOver):
        return kf
    lineage = type(kf).__mro__
    home = next((i for i, cls in enumerate(lineage) if is_filterpy(cls)), None)
    if home is None:
        raise ModelError(f"from_filterpy takes a filter of FilterPy, got a {type(kf).__name__}")
    name, taken = lineage[home].__name__, taken_over()
    if name == "IMMEstimator":
        return taken[name](kf, [from_filterpy(f) for f in kf.filters])
    if name not in taken:
        hint = INSTEAD.get(name, f"from_filterpy takes {', '.join(taken)}")
        raise ModelError(f"a {name} of FilterPy is not taken over: {hint}")
    return with_methods_of(lineage[:home], taken[name])(kf)


def is_filterpy(cls: type) -> bool:
    """True for a class that FilterPy, or its fork `bayesian_filters`, defines."""
    return cls.__module__.partition(".")[0] in {"filterpy", "bayesian_filters"}


def with_methods_of(lineage: tuple[type, ...], taken: type[Any]) -> Callable[[Any], Any]:
    """`taken` with what classes derived from FilterPy's define themselves, nearest first."""
    own: dict[str, Any] = {}
    for cls in reversed(lineage):
        for name, member in vars(cls).items():
            if name in {"__init__", "__module__", "__dict__", "__weakref__", "__doc__", "__qualname__"}:
                continue
            if inspect.isfunction(member) and "__class__" in member.__code__.co_freevars:
                raise ModelError(
                    f"{cls.__name__}.{name} calls super(), which leads back into FilterPy; call "
                    "from_filterpy on a plain filter, and keep the class as a wrapper around it"
                )
            own[name] = member
    return type(lineage[0].__name__, (taken,), own) if own else taken
