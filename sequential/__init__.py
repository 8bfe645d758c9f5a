"""The nouns of state estimation, and everything recursive.

>>> import sequential as sq
>>> model = sq.StateSpace(
...     manifold=sq.Vector(2),
...     prior=sq.Gaussian([0.0, 1.0], [1.0, 1.0]),
...     process=sq.ConstantVelocity(0.1),
...     sensors={"position": sq.LinearSensor([[1.0, 0.0]], 0.25)},
... )
>>> log = sq.SensorLog({"position": sq.Stream([0.0, 1.0, 2.0], [0.1, 0.9, 2.2])})
>>> sq.run(sq.KalmanFilter(), model, log).mean.shape
(3, 2)
"""

from sequential.correlated import correlated_noise
from sequential.discretise import van_loan
from sequential.errors import FactorlabError
from sequential.filterpy import from_filterpy
from sequential.filters import (
    CubatureKalmanFilter,
    ExtendedKalmanFilter,
    InteractingMultipleModel,
    IteratedExtendedKalmanFilter,
    KalmanFilter,
    ParticleFilter,
    SigmaPoints,
    UnscentedKalmanFilter,
    resample,
    sigma_points,
)
from sequential.history import Innovations, ModeHistory, ParticleHistory, Prediction, Report, Run
from sequential.log import SensorLog, Stream
from sequential.manifold import SE2, SE3, SO2, SO3, NavState, Product, Vector
from sequential.model import Gaussian, Loss, StateSpace
from sequential.models import (
    ConstantAcceleration,
    ConstantVelocity,
    ContinuousProcess,
    CoordinatedTurn,
    Direction,
    GaussMarkov,
    Independent,
    LinearProcess,
    LinearSensor,
    Position,
    Process,
    RandomWalk,
    Range,
    RangeBearing,
    Sensor,
    Singer,
    Strapdown,
    Unicycle,
    inertial_state,
    tabulated_input,
)
from sequential.noise import ImuNoise, diagonal
from sequential.online import Arrivals, Belief, Innovation, Online, Replay, arrivals, stream
from sequential.run import Estimator, run
from sequential.series import SeriesRun, filter_series, run_many
from sequential.signal import Complementary, Hampel, LowPass, MovingMean, SlidingMedian
from sequential.simulate import Simulation, simulate
from sequential.smoothers import BackwardSimulation, FixedLagSmoother, IteratedSmoother, RauchTungStriebel
from sequential.steady_state import SteadyState, alpha_beta, steady_state
from sequential.timeline import Problem, prepare
from sequential.tuning import (
    Knob,
    Tuning,
    autocovariance_least_squares,
    expectation_maximization,
    noise_from_still,
    tune,
    tune_by_nis,
)

__all__ = [
    "SE2",
    "SE3",
    "SO2",
    "SO3",
    "Arrivals",
    "BackwardSimulation",
    "Belief",
    "Complementary",
    "ConstantAcceleration",
    "ConstantVelocity",
    "ContinuousProcess",
    "CoordinatedTurn",
    "CubatureKalmanFilter",
    "Direction",
    "Estimator",
    "ExtendedKalmanFilter",
    "FactorlabError",
    "FixedLagSmoother",
    "GaussMarkov",
    "Gaussian",
    "Hampel",
    "ImuNoise",
    "Independent",
    "Innovation",
    "Innovations",
    "InteractingMultipleModel",
    "IteratedExtendedKalmanFilter",
    "IteratedSmoother",
    "KalmanFilter",
    "Knob",
    "LinearProcess",
    "LinearSensor",
    "Loss",
    "LowPass",
    "ModeHistory",
    "MovingMean",
    "NavState",
    "Online",
    "ParticleFilter",
    "ParticleHistory",
    "Position",
    "Prediction",
    "Problem",
    "Process",
    "Product",
    "RandomWalk",
    "Range",
    "RangeBearing",
    "RauchTungStriebel",
    "Replay",
    "Report",
    "Run",
    "Sensor",
    "SensorLog",
    "SeriesRun",
    "SigmaPoints",
    "Simulation",
    "Singer",
    "SlidingMedian",
    "StateSpace",
    "SteadyState",
    "Strapdown",
    "Stream",
    "Tuning",
    "Unicycle",
    "UnscentedKalmanFilter",
    "Vector",
    "alpha_beta",
    "arrivals",
    "autocovariance_least_squares",
    "correlated_noise",
    "diagonal",
    "expectation_maximization",
    "filter_series",
    "from_filterpy",
    "inertial_state",
    "noise_from_still",
    "prepare",
    "resample",
    "run",
    "run_many",
    "sigma_points",
    "simulate",
    "steady_state",
    "stream",
    "tabulated_input",
    "tune",
    "tune_by_nis",
    "van_loan",
]
