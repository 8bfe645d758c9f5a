"""A camera: where points of space appear in its image, which ray a pixel looks along, and how both change.

    camera = Camera("brown4", (532.8, 532.9, 342.5, 233.9), (-0.28, 0.12, 0.0012, -0.0001), (640, 480))
    camera.project(points)          # (N, 3) in the camera frame -> (N, 2) px
    camera.unproject(pixels)        # (N, 2) px -> (N, 3) unit rays

Pixels count from the centre of the top-left pixel, x right, y down; the camera looks along +z.  Distortion
coefficients have OpenCV's names, order and meaning.  Importing this module loads neither Numba nor OpenCV.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, NotFiniteError, ShapeError
from vision3d.lenses import LENS_CODE, LENSES, Lens

if TYPE_CHECKING:
    from vision3d.folding import Fold

__all__ = ["LENSES", "LENS_CODE", "Array", "Camera", "Lens"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Camera:
    """Intrinsic parameters of one camera.

    Parameters
    ----------
    lens : name in `LENSES`
    intrinsics : (4,) fx, fy, cx, cy, px
    distortion : (k,) coefficients in OpenCV's order, as many as the lens has
    size : (width, height) of its images, px

    Raises
    ------
    ModelError
        for an unknown lens, a focal length or a size that is not positive.
    ShapeError
        for a wrong number of coefficients.
    NotFiniteError
        for NaN or infinity.
    """

    lens: str
    intrinsics: Array
    distortion: Array
    size: tuple[int, int]

    def __init__(
        self,
        lens: str,
        intrinsics: Sequence[float] | Array,
        distortion: Sequence[float] | Array = (),
        size: Sequence[int] = (640, 480),
    ) -> None:
        if lens not in LENSES:
            raise ModelError(f"no lens {lens!r}; known are {', '.join(LENSES)}")
        names = LENSES[lens].distortion
        own = {
            "intrinsics": _row(intrinsics, ("fx", "fy", "cx", "cy"), "the intrinsics of a camera"),
            "distortion": _row(distortion, names, f"the distortion of the lens {lens!r}"),
        }
        if not (own["intrinsics"][:2] > 0.0).all():
            raise ModelError(f"focal lengths are positive, got fx, fy = {own['intrinsics'][:2].tolist()} px")
        width, height = (int(side) for side in size)
        if width < 1 or height < 1:
            raise ModelError(f"the size of an image is (width, height) in pixels, got {tuple(size)}")
        for name, value in {"lens": lens, **own, "size": (width, height)}.items():
            object.__setattr__(self, name, value)

    @classmethod
    def from_matrix(
        cls, matrix: Array, distortion: Any = (), size: Sequence[int] = (640, 480), *, lens: str | None = None
    ) -> Camera:
        """Take OpenCV's camera matrix (3, 3) and distortion vector.

        Without a name of a lens the length decides: 0, 4, 5, 8 or 12 coefficients, or 14 with zero tilt.

        Raises
        ------
        ModelError
            for a skewed matrix, or a distortion that no lens here can say.
        """
        from vision3d.camera_files.opencv_vector import lens_of_vector, split_matrix

        name, coefficients = lens_of_vector(distortion, lens)
        return cls(name, split_matrix(matrix), coefficients, size)

    @cached_property
    def parameters(self) -> Array:
        """(4+k,) fx, fy, cx, cy, then the distortion; read-only."""
        return _frozen(np.concatenate([self.intrinsics, self.distortion]))

    def with_parameters(self, parameters: Array) -> Camera:
        """The same lens and size with other parameters (4+k,)."""
        return Camera(self.lens, parameters[:4], parameters[4:], self.size)

    def resized(self, size: Sequence[int]) -> Camera:
        """The camera of its images after they were scaled to (width, height)."""
        sx, sy = size[0] / self.size[0], size[1] / self.size[1]
        fx, fy, cx, cy = self.intrinsics
        # corners of images coincide, and the first pixel's centre is half a pixel from its corner
        scaled = (fx * sx, fy * sy, (cx + 0.5) * sx - 0.5, (cy + 0.5) * sy - 0.5)
        return Camera(self.lens, scaled, self.distortion, size)

    @cached_property
    def matrix(self) -> Array:
        """(3, 3) camera matrix K; read-only."""
        fx, fy, cx, cy = self.intrinsics
        return _frozen(np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]))

    @property
    def count(self) -> int:
        """Number of parameters, 4 + k."""
        return 4 + len(self.distortion)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return LENSES[self.lens].parameters

    @property
    def code(self) -> int:
        """What kernels call this lens."""
        return LENS_CODE[self.lens]

    @cached_property
    def distortion_opencv(self) -> Array:
        """The distortion as OpenCV takes it: at least four coefficients (0 where the lens has fewer)."""
        return _frozen(np.concatenate([self.distortion, np.zeros(max(0, 4 - len(self.distortion)))]))

    @cached_property
    def limit(self) -> float:
        """Where the radial distortion folds: x/z radius, or angle (rad) of a fisheye; inf where nowhere."""
        from vision3d.folding import radial_limit

        return radial_limit(self.lens, self.parameters)

    def project(self, points_camera: Array) -> Array:
        """Pixels (N, 2) of points (N, 3) in the camera frame.

        NaN behind the camera (a perspective lens sees z > 0 only), and where the distortion has folded: there
        the polynomial gives a pixel, but no lens would.
        """
        from vision3d.kernels import projection

        points, shape = _columns(points_camera, 3, "points")
        pixels = np.empty((len(points), 2))
        projection.project(self.code, self.parameters, self.limit, points, pixels)
        return pixels.reshape(*shape, 2)

    def project_jacobians(self, points_camera: Array) -> tuple[Array, Array, Array]:
        """Pixels (N, 2) of points (N, 3), and how they move.

        Returns
        -------
        tuple
            pixels (N, 2), d_point (N, 2, 3) in px per unit of the points, d_parameters (N, 2, 4+k).
        """
        from vision3d.kernels import projection

        points, shape = _columns(points_camera, 3, "points")
        n = len(points)
        pixels, d_point, d_parameters = np.empty((n, 2)), np.empty((n, 2, 3)), np.empty((n, 2, self.count))
        projection.project_jacobians(
            self.code, self.parameters, self.limit, points, pixels, d_point, d_parameters
        )
        return (
            pixels.reshape(*shape, 2),
            d_point.reshape(*shape, 2, 3),
            d_parameters.reshape(*shape, 2, self.count),
        )

    def unproject(self, pixels: Array) -> Array:
        """Unit rays (N, 3) that pixels (N, 2) look along; NaN where the lens has no ray."""
        from vision3d.kernels import projection

        own, shape = _columns(pixels, 2, "pixels")
        rays = np.empty((len(own), 3))
        projection.unproject(self.code, self.parameters, self.limit, own, rays)
        return rays.reshape(*shape, 3)

    def undistort_points(self, pixels: Array) -> Array:
        """Normalised coordinates (N, 2), x/z and y/z, of pixels (N, 2); NaN where no ray with z > 0 is."""
        rays = self.unproject(pixels)
        with np.errstate(divide="ignore", invalid="ignore"):
            normalised: Array = rays[..., :2] / np.where(rays[..., 2:] > 0.0, rays[..., 2:], np.nan)
        return normalised

    def undistort(self, image: NDArray[Any], *, view: str = "same") -> tuple[NDArray[Any], Camera]:
        """Undistorted image, and the pinhole camera that it is an image of.

        See `vision3d.undistort.undistort` for `view`: `"same"`, `"inside"`, `"all"`.
        """
        from vision3d.undistort import undistort

        return undistort(self, image, view=view)

    def fold_radius(self) -> float:
        """Distance from the principal point at which the radial distortion folds, px; inf where nowhere."""
        return self.check_monotonic().radius_px

    def check_monotonic(self) -> Fold:
        """Whether the distortion is one-to-one over the whole image: see `vision3d.folding.Fold`."""
        from vision3d.folding import check_monotonic

        return check_monotonic(self)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Camera) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    @property
    def _key(self) -> tuple[Any, ...]:
        return self.lens, self.size, *self.parameters.tolist()

    def __repr__(self) -> str:
        values = ", ".join(
            f"{name}={value:.7g}" for name, value in zip(self.names, self.parameters, strict=True)
        )
        return f"Camera({self.lens}, {self.size[0]}x{self.size[1]}, {values})"


def _row(values: Any, names: tuple[str, ...], what: str) -> Array:
    """A frozen copy of as many finite numbers as there are names."""
    row = np.array(values, dtype=np.float64).reshape(-1)
    if len(row) != len(names):
        listed = ", ".join(names) or "none"
        raise ShapeError(f"{what} is {len(names)} numbers ({listed}), got {len(row)}")
    if not np.isfinite(row).all():
        bad = names[int(np.argmin(np.isfinite(row)))]
        raise NotFiniteError(f"{what} has {bad} = {row[names.index(bad)]}, which is no finite number")
    return _frozen(row)


def _columns(values: Any, width: int, what: str) -> tuple[Array, tuple[int, ...]]:
    """Contiguous (N, width) float64, and the leading shape to give back."""
    rows = np.asarray(values, dtype=np.float64)
    if rows.ndim < 1 or rows.shape[-1] != width:
        raise ShapeError(f"{what} are an array (N, {width}), got shape {rows.shape}")
    return np.ascontiguousarray(rows.reshape(-1, width)), rows.shape[:-1]


def _frozen(values: Array) -> Array:
    values.flags.writeable = False
    return values
