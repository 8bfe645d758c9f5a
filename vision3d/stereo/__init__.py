"""Two cameras that see the same: their calibration, rectified images, disparity and depth.

rig = read_rig("rig.json")                  # ours, OpenCV's, Kalibr's, ROS's, Middlebury's
pair = rectify(rig)                         # a point of both images lies in one row
left, right = pair.images(left, right)
"""

from vision3d.stereo.back_projection import DepthCloud, back_project, cloud_of
from vision3d.stereo.depth import Depth, depth_of
from vision3d.stereo.disparity import Disparity, StereoSettings, compute_disparity
from vision3d.stereo.rectification import Rectification, rectify
from vision3d.stereo.rig import StereoRig
from vision3d.stereo.rig_files import read_rig, write_rig

__all__ = [
    "Depth",
    "DepthCloud",
    "Disparity",
    "Rectification",
    "StereoRig",
    "StereoSettings",
    "back_project",
    "cloud_of",
    "compute_disparity",
    "depth_of",
    "read_rig",
    "rectify",
    "write_rig",
]
