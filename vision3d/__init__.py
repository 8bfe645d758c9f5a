"""From images to geometry: cameras, calibration that knows how sure it is, markers and lines.

Importing this package loads neither OpenCV nor Numba: rooms are imported by name
(`from vision3d.camera import Camera`), heavy libraries where they are used.
"""
