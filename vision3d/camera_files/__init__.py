"""Camera files of other programs: OpenCV, ROS, Kalibr, COLMAP, and our own JSON."""
