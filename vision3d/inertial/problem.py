"""Readings of a camera-IMU calibration, and the linearised residuals of a state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import rotation_matrix
from sequential.manifold.so3 import skew
from vision3d.camera import Camera
from vision3d.inertial.basis import weights
from vision3d.inertial.rotation_spline import turning
from vision3d.inertial.rows import Rows
from vision3d.inertial.state import Constants, State

__all__ = ["Corners", "Imu", "Linear", "Problem"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
FAR_SIGMAS = 1e3  # of a corner without a projection
NEGLIGIBLE = 1e-10


@dataclass(frozen=True, eq=False)
class Imu:
    """Readings of the IMU: t (N,) s by its clock, gyro (N, 3) rad/s, accel (N, 3) m/s²."""

    t: Array
    gyro: Array
    accel: Array

    def select(self, rows: NDArray[np.bool_]) -> Imu:
        """Some of the readings."""
        return Imu(self.t[rows], self.gyro[rows], self.accel[rows])


@dataclass(frozen=True, eq=False)
class Corners:
    """Corners of all frames.

    Parameters
    ----------
    t : (F,) s of the frames, by the camera's clock
    frame : (C,) frame of every corner
    points : (C, 3) on the board, m
    pixels : (C, 2)
    sigma_px : (C,)
    """

    t: Array
    frame: Integers
    points: Array
    pixels: Array
    sigma_px: Array

    def select(self, frames: NDArray[np.bool_]) -> Corners:
        """Some of the frames."""
        kept = frames[self.frame]
        number = np.cumsum(frames) - 1
        return Corners(
            self.t[frames], number[self.frame[kept]], self.points[kept], self.pixels[kept],
            self.sigma_px[kept],
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Linear:
    """Whitened rows of gyro, accelerometer and frames, and residuals of the corners (C, 2) in px."""

    gyro: Rows
    accel: Rows
    frames: Rows
    residuals_px: Array
    corner_cost: float

    @property
    def cost(self) -> float:
        """Half the weighted sum of squares of all readings."""
        return self.gyro.cost + self.accel.cost + self.corner_cost


@dataclass(frozen=True, eq=False)
class Problem:
    """Readings, their noise, and how far each is believed.

    Parameters
    ----------
    camera : with known intrinsics
    corners, imu : what was read
    constants : what is estimated besides trajectory and biases
    gyro_sigma, accel_sigma : of one sample, rad/s and m/s²
    corner_scale : standard deviation of corners over what their detection states
    gyro_weight, accel_weight, corner_weight : (N,), (N,), (C,)
    """

    camera: Camera
    corners: Corners
    imu: Imu
    constants: Constants
    gyro_sigma: float
    accel_sigma: float
    corner_scale: float
    gyro_weight: Array
    accel_weight: Array
    corner_weight: Array

    def linear(self, state: State) -> Linear:
        """All residuals and their Jacobians at a state."""
        gyro, accel = self._inertial(state)
        frames, residuals, cost = self._frames(state)
        return Linear(gyro, accel, frames, residuals, cost)

    def _inertial(self, state: State) -> tuple[Rows, Rows]:
        grid, own = state.grid, self.constants
        at = grid.locate(self.imu.t)
        n, order, q = len(self.imu.t), grid.order, own.count
        spin = turning(state.rotations, at.first, at.u, at.step_s, order)
        acting = weights(order, at.u, 2) / at.step_s[:, None] ** 2
        near = state.positions[at.first[:, None] + np.arange(order)]
        body_R_board = np.swapaxes(spin.R, -1, -2)
        lift = np.einsum("nk,nki->ni", acting, near) - state.gravity
        force = np.einsum("nij,nj->ni", body_R_board, lift)
        bias_gyro, bias_accel = state.biases(self.imu.t)
        e_gyro = spin.rate @ state.gyro_matrix.T + bias_gyro - self.imu.gyro
        e_accel = force @ state.accel_matrix.T + bias_accel - self.imu.accel
        J_gyro, J_accel = np.zeros((n, 3, 6 * order + q + 12)), np.zeros((n, 3, 6 * order + q + 12))
        knots_gyro, knots_accel = np.zeros((n, 3, order, 6)), np.zeros((n, 3, order, 6))
        knots_gyro[..., :3] = np.einsum("ij,nkjl->nikl", state.gyro_matrix, spin.d_rate)
        tilted = state.accel_matrix @ skew(force)
        knots_accel[..., :3] = np.einsum("nij,nkjl->nikl", tilted, spin.d_R)
        pushed = state.accel_matrix @ body_R_board
        knots_accel[..., 3:] = np.einsum("nk,nij->nikj", acting, pushed)
        J_gyro[:, :, : 6 * order] = knots_gyro.reshape(n, 3, -1)
        J_accel[:, :, : 6 * order] = knots_accel.reshape(n, 3, -1)
        first = 6 * order
        J_accel[:, :, first + 7 : first + 9] = -pushed @ state.gravity_plane
        for J, value, (rows, columns), place in (
            (J_accel, force, own.accel_entries, own.matrix_columns[0]),
            (J_gyro, spin.rate, own.gyro_entries, own.matrix_columns[1]),
        ):
            J[:, rows, first + np.arange(place.start, place.stop)] = value[:, columns]
        for J, place_in_node in ((J_gyro, 0), (J_accel, 3)):
            for node, share in ((0, 1.0 - at.share), (6, at.share)):
                for i in range(3):
                    J[:, i, first + q + node + place_in_node + i] = share
        return (
            Rows(at, J_gyro / self.gyro_sigma, e_gyro / self.gyro_sigma, self.gyro_weight),
            Rows(at, J_accel / self.accel_sigma, e_accel / self.accel_sigma, self.accel_weight),
        )

    def _frames(self, state: State) -> tuple[Rows, Array, float]:
        """Frames with their corners condensed into seven rows each: turn, shift and scale of the board."""
        grid, own, corners = state.grid, self.constants, self.corners
        at = grid.locate(corners.t + state.time_offset_s)
        order, q, count = grid.order, own.count, len(corners.t)
        spin = turning(state.rotations, at.first, at.u, at.step_s, order)
        acting = weights(order, at.u)
        near = state.positions[at.first[:, None] + np.arange(order)]
        position = np.einsum("nk,nki->ni", acting, near)
        velocity = np.einsum("nk,nki->ni", weights(order, at.u, 1) / at.step_s[:, None], near)
        body_R_board = np.swapaxes(spin.R, -1, -2)
        rows, e, residuals, cost = self._condensed(state, spin.R, position)
        turn, shift, grown = rows[..., :3], rows[..., 3:6], rows[..., 6]
        J = np.zeros((count, 7, 6 * order + q + 12))
        knots = np.empty((count, 7, order, 6))
        knots[..., :3] = np.einsum("nij,nkjl->nikl", turn, spin.d_R)
        moved = shift @ body_R_board
        knots[..., 3:] = -np.einsum("nk,nij->nikj", acting, moved)
        J[:, :, : 6 * order] = knots.reshape(count, 7, -1)
        first = 6 * order
        J[:, :, first : first + 3] = -turn
        J[:, :, first + 3 : first + 6] = shift
        J[:, :, first + 6] = np.einsum("nij,nj->ni", turn, spin.rate) - np.einsum(
            "nij,nj->ni", moved, velocity
        )
        if own.board_scale:
            J[:, :, first + own.scale_column] = grown + np.einsum("nij,nj->ni", moved, position)
        return Rows(at, J, e, np.ones(count)), residuals, cost

    def _condensed(self, state: State, R: Array, position: Array) -> tuple[Array, Array, Array, float]:
        """Square roots (F, 7, 7) of the information of every frame, its residuals (F, 7); those of corners.

        A corner at Y in the body moves by [Y]× turn + shift + grown Y, whatever moves it.
        """
        corners = self.corners
        of = corners.frame
        points = state.board_scale * corners.points
        Y = np.einsum("nji,nj->ni", R[of], points - position[of])
        camera_R_imu = rotation_matrix(state.camera_T_imu[:4])
        pixels, d_point, _ = self.camera.project_jacobians(Y @ camera_R_imu.T + state.camera_T_imu[4:])
        seen = np.isfinite(pixels[:, 0]) & np.isfinite(d_point).all(axis=(1, 2))
        sigma = self.corner_scale * corners.sigma_px
        residuals = np.where(seen[:, None], pixels - corners.pixels, FAR_SIGMAS * sigma[:, None])
        weight = np.where(seen, self.corner_weight, 0.0) / sigma**2
        by_body = np.where(seen[:, None, None], d_point, 0.0) @ camera_R_imu
        J = np.concatenate([by_body @ skew(Y), by_body, by_body @ Y[..., None]], axis=-1)
        count = len(corners.t)
        information, gradient = np.zeros((count, 7, 7)), np.zeros((count, 7))
        weighted = J * weight[:, None, None]
        np.add.at(information, of, np.swapaxes(weighted, -1, -2) @ J)
        np.add.at(gradient, of, np.einsum("nij,ni->nj", weighted, np.where(seen[:, None], residuals, 0.0)))
        cost = 0.5 * float(np.sum(self.corner_weight[:, None] * (residuals / sigma[:, None]) ** 2))
        return *_square_root(information, gradient), residuals, cost


def _square_root(information: Array, gradient: Array) -> tuple[Array, Array]:
    """A (F, 7, 7) and e (F, 7) with AᵀA the information and Aᵀe the gradient."""
    scale = np.sqrt(np.maximum(np.einsum("nii->ni", information), 1e-300))
    values, vectors = np.linalg.eigh(information / (scale[:, :, None] * scale[:, None, :]))
    kept = values > NEGLIGIBLE * np.maximum(values[:, -1:], 1e-300)
    root = np.where(kept, np.sqrt(np.maximum(values, 0.0)), 0.0)
    A = root[..., None] * np.swapaxes(vectors, -1, -2) * scale[:, None, :]
    inverse = np.where(kept, 1.0 / np.where(kept, root, 1.0), 0.0)
    e = inverse * np.einsum("nji,nj->ni", vectors, gradient / scale)
    return A, e
