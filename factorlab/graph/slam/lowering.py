"""What a factor model looks like among GTSAM's own factors; the registry is a `singledispatch` on its type.

    @native_factor.register
    def _(model: MyModel) -> NativeFactor | None: ...

A model without an entry, or whose entry gives None, is linearised in one vectorised pass instead
(`factorlab.graph.slam.rows`); a Python callback never goes into a C++ optimiser.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import singledispatch
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.native import noise_model
from factorlab.graph.slam.rows import loss_of
from factorlab.graph.slam.variables import keys_of
from sequential.model import Loss
from sequential.slam import FactorModel, Factors

__all__ = ["NativeFactor", "native_factor", "native_factors", "noise_models"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class NativeFactor:
    """How to make the native factors of one model.

    Parameters
    ----------
    make : `make(key, …, reading, noise)`, mostly GTSAM's class itself
    readings : measurements (N, size) as GTSAM wants them, one object each
    order : GTSAM's order of the components of the error, where it is not ours
    raises : whether it raises where our model gives a large error, as for a point behind the camera; engines
        that grow, whose points still move, then take our rows instead
    """

    make: Callable[..., Any]
    readings: Callable[[Array], list[Any]]
    order: tuple[int, ...] | None = None
    raises: bool = False


@singledispatch
def native_factor(model: FactorModel) -> NativeFactor | None:
    """The native factor of a model, or None."""
    return None


def native_factors(group: Factors, loss: Loss | None = None) -> list[Any] | None:
    """A native factor for each measurement of a group, or None where its model has none.

    `loss` is for groups that bring none of their own.
    """
    native = lowered(group.model)
    if native is None or group.unknown is not None:
        return None
    columns = [keys_of(slot, np.asarray(group.index)[:, k]) for k, slot in enumerate(group.slots)]
    noises = noise_models(group, native.order, loss_of(group, loss))
    return list(map(native.make, *columns, native.readings(np.asarray(group.z)), noises))


def lowered(model: FactorModel) -> NativeFactor | None:
    """The registry's answer, with every room registered."""
    import factorlab.graph.slam.floor_factors
    import factorlab.graph.slam.planar_factors
    import factorlab.graph.slam.spatial_factors  # noqa: F401

    return native_factor(model)


def noise_models(group: Factors, order: tuple[int, ...] | None, loss: Loss | None) -> list[Any]:
    """One noise model for each measurement; equal covariances share one."""
    noise = np.asarray(group.noise_cov)
    if noise.ndim == 2:
        return [_noise(noise, order, loss)] * len(group)
    distinct, which = np.unique(noise.reshape(len(noise), -1), axis=0, return_inverse=True)
    models = [_noise(one.reshape(noise.shape[1:]), order, loss) for one in distinct]
    return [models[i] for i in which.ravel().tolist()]


def _noise(cov: Array, order: tuple[int, ...] | None, loss: Loss | None) -> Any:
    if order is not None:
        cov = cov[np.ix_(order, order)]
    if loss is None and not np.any(cov - np.diag(np.diag(cov))):
        return gtsam.noiseModel.Diagonal.Sigmas(np.sqrt(np.diag(cov)))
    return noise_model(cov, loss)
