"""Recordings by name: what may be used, what a result is scored against, and a model that fits.

>>> from factorlab.datasets import load
>>> (kitti,) = load("kitti", use_every=5)
>>> len(kitti.log["gps"]), len(kitti.held_out)
(93, 375)
"""

from __future__ import annotations

from collections.abc import Callable
from difflib import get_close_matches
from pathlib import Path

from factorlab.datasets.city10000 import load_city10000
from factorlab.datasets.dataset import Dataset, Truth
from factorlab.datasets.kitti import load_kitti
from factorlab.datasets.mrclam import load_mrclam
from factorlab.datasets.mrclam_slam import load_mrclam_slam
from factorlab.datasets.planar_monocular import load_planar_monocular
from factorlab.datasets.plaza import load_plaza
from factorlab.datasets.pose_graphs import load_intel, load_mit, load_sphere2500, load_w10000
from factorlab.datasets.rail import load_rail
from factorlab.datasets.slam import SlamDataset
from factorlab.datasets.starry_night import load_starry_night
from factorlab.datasets.starry_night_slam import load_starry_night_slam
from factorlab.datasets.victoria_park import load_victoria_park
from sequential.errors import DataError

__all__ = ["NAMES", "SLAM_NAMES", "Dataset", "SlamDataset", "Truth", "load", "load_slam"]

_LOADERS: dict[str, Callable[[int, Path | None, int | None], list[Dataset]]] = {
    "kitti": lambda use_every, data, _robot: [load_kitti(use_every, data)],
    "plaza1": lambda _use_every, data, _robot: [load_plaza(1, data)],
    "plaza2": lambda _use_every, data, _robot: [load_plaza(2, data)],
    "mrclam": lambda _use_every, data, robot: load_mrclam(data, robot),
    "rail": lambda _use_every, data, _robot: [load_rail(data)],
    "starry_night": lambda _use_every, data, _robot: [load_starry_night(data)],
}
NAMES = tuple(_LOADERS)

_SLAM_LOADERS: dict[str, Callable[[Path | None, int | None], list[SlamDataset]]] = {
    "mrclam": load_mrclam_slam,
    "intel": lambda data, _robot: [load_intel(data)],
    "mit": lambda data, _robot: [load_mit(data)],
    "sphere2500": lambda data, _robot: load_sphere2500(data),
    "w10000": lambda data, _robot: [load_w10000(data)],
    "city10000": lambda data, _robot: [load_city10000(data)],
    "victoria_park": lambda data, _robot: load_victoria_park(data),
    "planar_monocular": lambda data, _robot: load_planar_monocular(data),
    "starry_night": lambda data, _robot: [load_starry_night_slam(data)],
}
SLAM_NAMES = tuple(_SLAM_LOADERS)


def load(
    name: str, *, use_every: int = 5, data: str | Path | None = None, robot: int | None = None
) -> list[Dataset]:
    """Load a recording by its name; one `Dataset` for each vehicle in it.

    Parameters
    ----------
    name : one of `NAMES`
    use_every : where held-out readings score the result (kitti), one in this many is used and the others
        are held out; 1 holds nothing out.  Recordings with a truth of their own use all.
    data : folder of the files, where it is not the usual one
    robot : only this vehicle, where the recording has several

    Raises
    ------
    DataError
        for an unknown name or missing files; the message says where they come from.
    """
    _require_known(name, NAMES)
    return _LOADERS[name](use_every, None if data is None else Path(data), robot)


def load_slam(name: str, *, data: str | Path | None = None, robot: int | None = None) -> list[SlamDataset]:
    """Load a SLAM problem by its name; one `SlamDataset` for each vehicle in it.

    Parameters
    ----------
    name : one of `SLAM_NAMES`
    data : folder of the files, where it is not the usual one
    robot : only this vehicle, where the recording has several

    Raises
    ------
    DataError
        for an unknown name or missing files; the message says where they come from.
    """
    _require_known(name, SLAM_NAMES)
    return _SLAM_LOADERS[name](None if data is None else Path(data), robot)


def _require_known(name: str, names: tuple[str, ...]) -> None:
    if name not in names:
        near = get_close_matches(name, names, n=1, cutoff=0.4)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        msg = f"there is no dataset {name!r}, only {', '.join(names)}{hint}"
        raise DataError(msg)
