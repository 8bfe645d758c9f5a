"""From what a user writes to a source."""

from __future__ import annotations

import os

from vision3d.frames.camera import CameraFrames
from vision3d.frames.files import IMAGE_SUFFIXES, find_images, is_pattern, require_path
from vision3d.frames.images import ImageFrames
from vision3d.frames.source import FrameSource
from vision3d.frames.video import VideoFrames

__all__ = ["open_frames"]


def open_frames(
    source: str | os.PathLike[str],
    *,
    loop: bool = False,
    size: tuple[int, int] | None = None,
    fps: float | None = None,
) -> FrameSource:
    """Open a camera, a video, an image, a folder of images or a pattern of image names.

    Parameters
    ----------
    source : the index of a camera (`0`), an address (`rtsp://…`), or a path; `left*.jpg` is a pattern
    loop : begin again at the end of a video or a folder
    size : (width, height) to ask a camera for; it may give another
    fps : to ask a camera for, or of a folder (by default 10); where every file of a folder is named by its
        time (EuRoC, TUM), that counts

    Raises
    ------
    CameraLostError
        where the camera is not there or gives no frame.
    DataError, FileFormatError
        where there is no such file, no image in the folder, or no video in the file.
    """
    text = os.fspath(source).strip()
    if text.isdecimal() or "://" in text:
        return CameraFrames(text, size, fps)
    if is_pattern(text) or (path := require_path(text)).is_dir():
        return ImageFrames(text, find_images(text), fps, loop=loop)
    if path.suffix.lower() in IMAGE_SUFFIXES:
        return ImageFrames(text, [path], fps, loop=loop)
    return VideoFrames(path, loop=loop)
