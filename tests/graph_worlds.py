"""Worlds whose models have native GTSAM factors: what both routes of a graph are held to."""

import math
from dataclasses import replace

import numpy as np
from worlds import LANDMARKS, World, drive, strapdown, times

import sequential as sq

LOSSES = [None, sq.Loss("huber", 1.0), sq.Loss("cauchy", 1.5)]


def inertial(lever_arm=(0.5, -0.3, 0.8), loss=None, prior_cov=None):
    """The strapdown world with GPS alone."""
    world = strapdown()
    model, noise = world.model, 0.2**2 * np.array([[1.0, 0.2, 0], [0.2, 1.5, 0], [0, 0, 2.0]])
    prior = model.prior if prior_cov is None else sq.Gaussian(model.prior.mean, prior_cov)
    sensors = {"gps": sq.Position(noise, lever_arm=lever_arm, loss=loss)}
    return replace(
        world,
        name=f"strapdown, arm {lever_arm}",
        model=sq.StateSpace(model.manifold, prior, model.process, sensors, "imu", 0.0),
        readings={"gps": 10},
    )


def planar(sensor, *, bias=False, name="planar", context=True):
    """A unicycle with one sensor that reads every third time."""
    manifold, mean = sq.SE2(), np.array([0.5, -1.0, 0.4])
    cov = np.array([[0.09, 0.01, 0.0], [0.01, 0.04, 0.002], [0.0, 0.002, 0.01]])
    if bias:
        manifold = sq.Product(pose=sq.SE2(), bias=sq.Vector(1))
        mean, cov = np.append(mean, 0.2), np.block([[cov, np.zeros((3, 1))], [np.zeros((1, 3)), 0.09]])
    process = sq.Unicycle(0.02, 0.03, 0.02, slip=0.02, turn_slip=0.01)
    model = sq.StateSpace(
        manifold, sq.Gaussian(mean, cov), process, {"seen": sensor}, "odometry", 0.0,
        static=("bias",) if bias else (),
    )  # fmt: skip
    rows = np.arange(2, 121, 3)
    contexts = {"seen": (np.arange(len(rows)) % 4)[:, None]} if context else {}
    return World(name, model, times(121, 0.1), drive(121), {"seen": rows}, contexts)


def ranges(loss=None):
    return planar(sq.Range(LANDMARKS, 0.1**2, loss=loss), name="range")


def biased_ranges(loss=None):
    return planar(sq.Range(LANDMARKS, 0.1**2, bias="bias", loss=loss), bias=True, name="range with a bias")


def sightings(loss=None):
    noise = np.array([[0.01, 0.001], [0.001, 0.0009]])
    return planar(sq.RangeBearing(LANDMARKS, noise, loss=loss), name="range and bearing")


def places(loss=None):
    noise = np.array([[0.04, 0.01], [0.01, 0.09]])
    return planar(sq.Position(noise, axes=2, loss=loss), name="position", context=False)


PLANAR = [ranges, biased_ranges, sightings, places]


def random_pose(rng):
    """A flat planar pose anywhere."""
    return np.array([*(4.0 * rng.standard_normal(2)), rng.uniform(-math.pi, math.pi)])
