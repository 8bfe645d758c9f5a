"""Where markers hang in a room, and how the camera moved: with an IMU or without.

>>> from factorlab.marker_map import map_markers
>>> found = map_markers(sightings)  # doctest: +SKIP
>>> found.ids, found.poses, found.marker_covs, found.trajectory  # doctest: +SKIP
"""

from factorlab.marker_map.mapping import Inertial, MarkerMap, map_markers

__all__ = ["Inertial", "MarkerMap", "map_markers"]
