"""Tables of what was read, and the picture with markers drawn into it."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from factorlab.markers.job import MarkerReading, MarkersRead

if TYPE_CHECKING:
    from vision3d.markers import MarkerPose, Mode

__all__ = ["marker_files", "mode_numbers", "overlay", "pose_numbers", "poses_csv", "tracks_csv"]

POSE = ("qw", "qx", "qy", "qz", "px_m", "py_m", "pz_m")
SIGMAS = ("sigma_rx_rad", "sigma_ry_rad", "sigma_rz_rad", "sigma_px_m", "sigma_py_m", "sigma_pz_m")
CORNERS = tuple(f"{axis}{k}_px" for k in range(4) for axis in "xy")
AXIS_COLOURS = ((70, 70, 235), (80, 190, 60), (235, 130, 40))  # BGR of x, y, z
OUTLINE, DOUBTFUL = (60, 220, 90), (40, 140, 255)


def poses_csv(read: MarkersRead) -> str:
    """Corners of every marker in every frame, and both readings of its pose, one line a reading."""
    rows: list[tuple[Any, ...]] = [
        ("frame", "t_s", "picture", "id", "seen", "mode", "probability", "certain", *POSE, *SIGMAS,
         "tilt_deg", "distance_m", "rms_px", "sigma_px", *CORNERS)
    ]  # fmt: skip
    for one in read.readings:
        first = (one.frame, f"{one.t_s:.6f}", one.name, one.id, int(one.seen))
        marker = one.marker
        corners = [""] * 9
        if marker is not None:
            corners = [
                f"{float(np.mean(marker.sigma_px)):.4f}",
                *(f"{v:.4f}" for v in marker.corners.ravel()),
            ]
        if one.pose is None:
            rows.append((*first, *[""] * 19, *corners))
            continue
        for k, mode in enumerate(one.pose.modes):
            told = mode_numbers(mode)
            rows.append(
                (*first, k, f"{mode.probability:.6g}", int(one.pose.certain),
                 *(f"{v:.9g}" for v in mode.camera_T_marker),
                 *(f"{v:.4g}" for v in np.sqrt(np.diagonal(mode.cov))),
                 f"{told['tilt_deg']:.3f}", f"{told['distance_m']:.6g}", f"{mode.rms_px:.4f}", *corners)
            )  # fmt: skip
    return _lines(rows)


def tracks_csv(read: MarkersRead) -> str:
    """The likelier pose of every marker, one line a frame and marker: what most programs want."""
    rows: list[tuple[Any, ...]] = [("t_s", "id", "seen", "odds", *POSE)]
    for one in read.readings:
        if one.pose is not None:
            odds = f"{min(one.pose.odds, 1e12):.6g}"
            pose = (f"{v:.9g}" for v in one.pose.camera_T_marker)
            rows.append((f"{one.t_s:.6f}", str(one.id), str(int(one.seen)), odds, *pose))
    return _lines(rows)


def mode_numbers(mode: Mode) -> dict[str, Any]:
    """What one reading says, for a machine."""
    return {
        "probability": mode.probability,
        "camera_T_marker": mode.camera_T_marker.tolist(),
        "cov": mode.cov.tolist(),
        "sigma_rotation_deg": np.degrees(np.sqrt(np.diagonal(mode.cov)[:3])).tolist(),
        "sigma_position_m": np.sqrt(np.diagonal(mode.cov)[3:]).tolist(),
        "tilt_deg": float(np.degrees(mode.tilt_rad)),
        "distance_m": mode.distance_m,
        "rms_px": mode.rms_px,
    }


def marker_files(read: MarkersRead) -> dict[str, str | bytes]:
    """Files of the output folder."""
    import cv2

    files: dict[str, str | bytes] = {"markers.csv": poses_csv(read)}
    if any(one.pose is not None for one in read.readings):
        files["poses.csv"] = tracks_csv(read)
    if (drawn := overlay(read)) is not None:
        files["overlay.png"] = cv2.imencode(".png", drawn)[1].tobytes()
    return files


def overlay(read: MarkersRead) -> NDArray[np.uint8] | None:
    """The frame with most markers, their outlines, numbers and axes drawn into it, (h, w, 3) BGR."""
    if read.picture is None:
        return None
    import cv2

    image = np.array(read.picture)
    scale = max(1, round(max(image.shape[:2]) / 700))
    found = read.in_picture()
    for one in found:
        if one.marker is None:
            continue
        sure = one.pose is None or one.pose.certain
        corners = np.round(one.marker.corners * 16).astype(np.int32)
        colour = OUTLINE if sure else DOUBTFUL
        cv2.polylines(
            image, [corners], isClosed=True, color=colour, thickness=scale, lineType=cv2.LINE_AA, shift=4
        )
        cv2.circle(image, corners[0].tolist(), 40 * scale, OUTLINE, -1, cv2.LINE_AA, 4)
        if one.pose is not None:
            for mode in one.pose.modes[: 1 if sure else 2][::-1]:
                _draw_axes(image, read, mode, thick=mode is one.pose.modes[0], scale=scale)
    for one in found:
        _draw_number(image, one, scale)
    return image


def _draw_axes(image: NDArray[np.uint8], read: MarkersRead, mode: Mode, *, thick: bool, scale: int) -> None:
    """Axes of half a side; the one out of the marker is drawn for z, which itself goes into it."""
    import cv2

    from sequential.manifold.quaternion import rotate

    if read.camera is None or read.settings.size_m is None:
        return
    tips = 0.5 * read.settings.size_m * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, -1]])
    pixels = read.camera.project(rotate(mode.camera_T_marker[:4], tips) + mode.camera_T_marker[4:])
    if not np.isfinite(pixels).all():
        return
    ends = np.round(pixels * 16).astype(np.int32).tolist()
    for tip, colour in zip(ends[1:], AXIS_COLOURS, strict=True):
        cv2.line(image, ends[0], tip, colour, 2 * scale if thick else scale, cv2.LINE_AA, 4)


def _draw_number(image: NDArray[np.uint8], one: MarkerReading, scale: int) -> None:
    import cv2

    if one.marker is None:
        return
    corners, text = one.marker.corners, str(one.id)
    x = round(float(corners[:, 0].mean()) - 5.0 * len(text) * scale)
    y = round(float(corners[:, 1].min()) - 6.0 * scale)
    y = y if y > 14 * scale else round(float(corners[:, 1].max()) + 18.0 * scale)
    for colour, width in (((255, 255, 255), 4 * scale), ((160, 30, 30), scale + 1)):
        cv2.putText(image, text, (x, y), cv2.FONT_HERSHEY_SIMPLEX, 0.55 * scale, colour, width, cv2.LINE_AA)


def _lines(rows: list[tuple[Any, ...]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def pose_numbers(pose: MarkerPose | None) -> dict[str, Any] | None:
    """Both readings, for a machine; odds are null where there is no second."""
    if pose is None:
        return None
    return {"odds": pose.odds, "certain": pose.certain, "modes": [mode_numbers(one) for one in pose.modes]}
