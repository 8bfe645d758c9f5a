"""Markers in pictures and videos: who is there, where, and how surely."""

from factorlab.markers.document import markers_document
from factorlab.markers.export import poses_csv, tracks_csv
from factorlab.markers.job import MarkerReading, MarkersRead, MarkersSettings, read_markers

__all__ = [
    "MarkerReading",
    "MarkersRead",
    "MarkersSettings",
    "markers_document",
    "poses_csv",
    "read_markers",
    "tracks_csv",
]
