"""Scripts written for FilterPy on safer arithmetic: the line `kf = sequential.from_filterpy(kf)` is all.

The object that comes back has the attributes and methods of the one that went in.  FilterPy itself is never
imported: its classes are known by their names.

Numbers are FilterPy's wherever those hold.  They differ, on purpose, in these places:

- updates are Joseph's form, redone in UD form where S is singular or nearly so: R = 0, P = 0 in a direction,
  a Q of low rank and nearly redundant readings work, for sigma points as well;
- a number given for P, Q or R is a variance on every axis, not a number added to every entry;
- NaN in a component of z is a component that was not read, and after `update(None)` the log likelihood is 0;
- an unscented filter that updates twice in a step draws its points anew in between, and a cubature filter
  draws them anew after the process noise: both equal the Kalman filter where the problem is linear;
- where a residual is given and no mean, means are taken about the first sigma point by that residual, and
  the unscented smoother honours `Qs` and `state_add`;
- `FixedLagSmoother` gives what an RTS smoother gives on the same readings;
- `InformationFilter.x` is a state also while nothing is known, and its likelihood is that of the reading;
- `ExtendedKalmanFilter.predict_update` linearises at the prediction, and `SquareRootKalmanFilter.P_post` is
  the covariance after the update.
"""

from sequential.filterpy.take_over import from_filterpy

__all__ = ["from_filterpy"]
