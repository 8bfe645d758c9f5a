"""A stereo camera driven past known points: what filters, smoothers and graphs of it are held to."""

from dataclasses import dataclass, replace

import numpy as np

import sequential as sq
from sequential.driven_pose import DrivenPose
from sequential.model import evaluate

INTRINSICS, BASELINE = (480.0, 470.0, 320.0, 240.0), 0.24
# the camera looks along the body's x: its x is -y of the body, its y is -z
MOUNT = np.array([0.5, -0.5, 0.5, -0.5, 0.1, 0.02, -0.05])
POINTS = np.array([[2.0, y, z] for y in (-0.8, 0.0, 0.7) for z in (-0.5, 0.4)]) + np.array([0.3, 0.0, 0.0])
DENSITY = np.array([2e-4, 3e-4, 4e-4, 1e-4, 2e-4, 1e-4])
PRIOR = sq.Gaussian(np.array([1.0, 0, 0, 0, 0, 0, 0]), np.full(6, 0.02**2))
INTERVAL = 0.1


@dataclass(frozen=True)
class Night:
    """One draw: model, log, and the true poses (N, 7) at t (N,)."""

    model: sq.StateSpace
    log: sq.SensorLog
    t: np.ndarray
    truth: np.ndarray


def model(loss=None, noise=(1.0, 1.2, 0.8), prior=PRIOR, density=DENSITY):
    sensor = sq.StereoPixels(POINTS, noise, INTRINSICS, BASELINE, MOUNT, shared_row=True, loss=loss)
    return sq.StateSpace(sq.SE3(), prior, DrivenPose(density), {"stereo": sensor}, "twist", 0.0)


def twists(count):
    """A swing in front of the points (count, 6)."""
    t = INTERVAL * np.arange(count)
    turn = 0.25 * np.stack([np.sin(0.9 * t), np.cos(0.7 * t), np.sin(0.5 * t + 1.0)], axis=1)
    move = 0.15 * np.stack([np.cos(0.6 * t + 1.0), np.sin(0.8 * t), np.cos(t)], axis=1)
    return np.hstack([turn, move])


def night(rng, count=60, points=4, **told):
    """`points` of the six are seen in every picture but the first, in turn."""
    declared = model(**told)
    stamps = INTERVAL * np.arange(count)
    blind = replace(declared, sensors={})
    drawn = sq.simulate(blind, stamps, rng, inputs=twists(count))
    sensor = declared.sensor_functions["stereo"]
    picture = np.repeat(np.arange(1, count), points)
    which = np.concatenate([(k + np.arange(points)) % len(POINTS) for k in range(count - 1)])
    seen = np.stack(
        [
            evaluate(sensor.value, drawn.truth[k], np.array([float(i)]), 0.0, sensor.params, 3)
            for k, i in zip(picture, which, strict=True)
        ]
    )
    noise = rng.standard_normal(seen.shape) * np.sqrt(np.diag(declared.sensors["stereo"].noise_cov))
    stereo = sq.Stream(drawn.t[picture], seen + noise, which[:, None].astype(float))
    log = sq.SensorLog({"twist": drawn.log["twist"], "stereo": stereo}, "night")
    return Night(declared, log, drawn.t, drawn.truth)
