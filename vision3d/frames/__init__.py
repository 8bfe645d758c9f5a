"""Frames of a camera, a video file or a folder of images, one after the other, with their times.

    with open_frames("0") as source:            # a webcam; or "drive.avi", "frames/", "left*.jpg", "rtsp://…"
        for frame in source:
            frame.index, frame.t_ns, frame.image

A source that breaks off (a camera that is unplugged, a video that was cut) ends like one that is over, so
that whatever was taken from it can be finished; `source.fault` then says in a sentence what happened.
"""

from vision3d.frames.camera import CameraLostError
from vision3d.frames.opening import open_frames
from vision3d.frames.source import Frame, FrameSource

__all__ = ["CameraLostError", "Frame", "FrameSource", "open_frames"]
