"""The way on: a linear filter that was taken over, as a model and a log for every estimator."""

from __future__ import annotations

from typing import Any

import numpy as np

from sequential.errors import ModelError
from sequential.filterpy.attributes import as_reading
from sequential.filterpy.recursion import Recursion

__all__ = ["LinearRecursion"]


class LinearRecursion(Recursion):
    """A filter of F, Q, H, R and B, which a `StateSpace` can declare.

    ``sequential.run(sequential.RauchTungStriebel(), kf.model(dt), kf.log(zs, dt))`` smooths what
    ``kf.batch_filter(zs)`` filters.
    """

    def model(self, dt: float = 1.0) -> Any:
        """The same problem as a `StateSpace`: this belief at time 0, readings "z" at dt, 2 dt and so on.

        One step of its process is one `predict`; a B is driven by the stream "u".

        Raises
        ------
        ModelError
            where alpha is not 1 or M is not zero, which a declaration has no place for.
        """
        from sequential.manifold import Vector
        from sequential.model import Gaussian, StateSpace
        from sequential.models import LinearProcess, LinearSensor

        if getattr(self, "_alpha_sq", 1.0) != 1.0:
            raise ModelError("a StateSpace has no fading memory; put alpha to 1 and enlarge Q instead")
        kf: Any = self
        if "M" in vars(kf) and np.shape(kf.M) == (kf.dim_x, kf.dim_z) and np.any(kf.M):
            raise ModelError("M correlates process and measurement noise, which is not carried over; zero it")
        driven = kf.B is not None and not np.isscalar(kf.B)
        return StateSpace(
            manifold=Vector(kf.dim_x),
            prior=Gaussian(np.ravel(kf.x), kf.P),
            process=LinearProcess(kf.F, kf.Q, np.reshape(kf.B, (kf.dim_x, -1)) if driven else None),
            sensors={"z": LinearSensor(kf.H, kf.R)},
            input="u" if driven else None,
            start=0.0,
        )

    def log(self, zs: Any, dt: float = 1.0, us: Any = None) -> Any:
        """Readings and inputs of a script as a `SensorLog` for that model; None and NaN are not read."""
        from sequential.log import SensorLog, Stream

        nothing = np.full(self.dim_z, np.nan)
        values = np.array([nothing if z is None else as_reading(z, self.dim_z, 1) for z in zs])
        stamps: Any = dt * np.arange(1, len(values) + 1)
        streams = {"z": Stream(stamps, values)}
        if us is not None:
            driving = np.array([np.ravel(u) for u in us], dtype=np.float64)
            streams["u"] = Stream(stamps, driving, covers="before")
        return SensorLog(streams)
