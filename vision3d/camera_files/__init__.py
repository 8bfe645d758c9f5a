"""Camera files of other programs, written and read back: OpenCV, ROS, Kalibr, COLMAP, and our own JSON.

    camera = read_camera("left_intrinsics.yml")         # finds out which format it is
    write_camera(camera, "camera_info.yaml", "ros")

A format that cannot say a lens refuses it in a sentence rather than dropping coefficients.
"""

from vision3d.camera_files.formats import FORMATS, Format, camera_text, formats_for, write_camera
from vision3d.camera_files.reading import read_camera, read_cameras

__all__ = ["FORMATS", "Format", "camera_text", "formats_for", "read_camera", "read_cameras", "write_camera"]
