"""Operations on images beside OpenCV's, in one run: are they equal, and how much longer do they take?

`python image.py [--json] [--quick]`; --quick runs a tenth of the rounds.  Figures `…_apart` are the largest
difference from OpenCV's answer in levels, over photographs under FACTORLAB_DATA (noise without), in all
borders and for all backends; `…_over_cv2` is the compiled backend's CPU time over OpenCV's on 640x480, both
in one thread, medians of interleaved rounds.  Ends with exit code 3 when a must is missed.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from measure.figures import Figure, publish, say
from measure.timing import cpu_seconds

from vision3d import image as im
from vision3d.image.borders import cv2_border
from vision3d.images import read_image
from vision3d.objects import non_maximum_suppression

BORDERS = ("constant", "replicate", "reflect", "reflect101")
BACKENDS = ("compiled", "numpy", "opencv")
PHOTOGRAPHS = ("building.jpg", "home.jpg", "sudoku.png", "notes.png", "left01.jpg", "box_in_scene.png")
SIZE = (480, 640)
WINDOW = np.array([[-2.0, -1, 0], [-1, 1, 1], [0, 1, 2]])  # an emboss
Picture = np.ndarray


def photographs() -> list[Picture]:
    """Grey pictures: those of the data, or noise and hills of the same size."""
    folder = Path(os.environ.get("FACTORLAB_DATA", "")) / "vision" / "opencv"
    found = [read_image(folder / name) for name in PHOTOGRAPHS if (folder / name).is_file()]
    if found:
        return found
    say("no photographs: FACTORLAB_DATA is not set; noise and hills instead")
    rng = np.random.default_rng(0)
    noise = rng.integers(0, 256, SIZE, dtype=np.uint8)
    return [
        noise,
        cv2.GaussianBlur(noise, (0, 0), 4.0),
        cv2.equalizeHist(cv2.GaussianBlur(noise, (0, 0), 9.0)),
    ]


def apart(ours: object, theirs: object) -> float:
    """The largest difference, infinite where shapes or types differ."""
    a, b = np.asarray(ours), np.asarray(theirs)
    if a.shape != b.shape or a.dtype != b.dtype:
        return float("inf")
    return float(np.abs(a.astype(float) - b.astype(float)).max(initial=0.0))


def equality(pictures: list[Picture]) -> dict[str, Figure]:
    """Every operation that OpenCV defines to the bit, over pictures, borders and backends."""
    worst: dict[str, float] = {}

    def hold(name: str, ours: object, theirs: object) -> None:
        worst[name] = max(worst.get(name, 0.0), apart(ours, theirs))

    for picture in pictures:
        for by in BACKENDS:
            for border in BORDERS:
                at = cv2_border(border)
                own = {"border": border, "backend": by}
                hold("conv", im.correlate(picture, WINDOW, **own),
                     cv2.filter2D(picture, -1, WINDOW, borderType=at))  # fmt: skip
                hold("gauss", im.gaussian_blur(picture, 1.5, **own),
                     cv2.GaussianBlur(picture, (0, 0), 1.5, borderType=at))  # fmt: skip
                hold("erode", im.erode(picture, 5, **own), cv2.erode(picture, np.ones((5, 5)), borderType=at))
                for dx, dy, size in ((1, 0, 3), (0, 1, 3), (1, 0, 5), (1, 1, 7)):
                    hold("sobel", im.sobel(picture, dx, dy, size=size, **own),
                         cv2.Sobel(picture, cv2.CV_16S, dx, dy, ksize=size, borderType=at))  # fmt: skip
            hold(
                "otsu", im.otsu(picture, backend=by), int(cv2.threshold(picture, 0, 255, cv2.THRESH_OTSU)[0])
            )
            hold("equalise", im.equalise(picture, backend=by), cv2.equalizeHist(picture))
            hold("adaptive", im.adaptive_threshold(picture, 31, 5, backend=by),
                 cv2.adaptiveThreshold(picture, 255, cv2.ADAPTIVE_THRESH_MEAN_C, 0, 31, 5))  # fmt: skip
            edges = im.canny(picture, 50, 150, backend=by)
            hold("canny", edges, cv2.Canny(picture, 50, 150))
        binary = im.threshold(picture, "otsu")
        found = im.connected_components(binary, connectivity=8)
        stats = cv2.connectedComponentsWithStats(binary, connectivity=8)[2]
        hold("components", np.sort(found.areas), np.sort(stats[1:, cv2.CC_STAT_AREA].astype(np.int64)))
        lines = im.hough_lines(edges, 120)
        theirs = cv2.HoughLinesWithAccumulator(edges, 1.0, np.pi / 180, 120)
        votes = np.zeros(0) if theirs is None else theirs.reshape(-1, 3)[:, 2]
        hold("hough", lines.votes, votes.astype(np.int32))
    musts = {"conv", "sobel", "otsu"}
    return {
        f"{name}_apart": Figure(
            value,
            "levels",
            f"cv2 {cv2.__version__}, {len(pictures)} pictures",
            0.0 if name in musts else None,
            0.0,
        )
        for name, value in worst.items()
    }


def works(picture: Picture) -> dict[str, tuple[Callable[[], object], Callable[[], object]]]:
    """By name: ours, and OpenCV's."""
    fractions = np.random.default_rng(1).random((5, 5)) / 12.5
    binary, edges = im.threshold(picture, "otsu"), cv2.Canny(picture, 50, 150)
    square, disc = np.ones((5, 5), np.uint8), im.structuring_element(7, "ellipse")
    rng = np.random.default_rng(2)
    boxes, scores = (
        np.column_stack([rng.random((300, 2)) * 500, 20 + rng.random((300, 2)) * 80]),
        rng.random(300),
    )
    return {
        "conv_3x3": (lambda: im.correlate(picture, WINDOW), lambda: cv2.filter2D(picture, -1, WINDOW)),
        "conv_5x5_fractions": (
            lambda: im.correlate(picture, fractions), lambda: cv2.filter2D(picture, -1, fractions)),
        "sobel_3": (lambda: im.sobel(picture, 1, 0), lambda: cv2.Sobel(picture, cv2.CV_16S, 1, 0)),
        "sobel_5": (
            lambda: im.sobel(picture, 1, 0, size=5), lambda: cv2.Sobel(picture, cv2.CV_16S, 1, 0, ksize=5)),
        "otsu": (lambda: im.otsu(picture), lambda: cv2.threshold(picture, 0, 255, cv2.THRESH_OTSU)),
        "gauss": (lambda: im.gaussian_blur(picture, 1.5), lambda: cv2.GaussianBlur(picture, (0, 0), 1.5)),
        "equalise": (lambda: im.equalise(picture), lambda: cv2.equalizeHist(picture)),
        "adaptive": (lambda: im.adaptive_threshold(picture, 31, 5),
                     lambda: cv2.adaptiveThreshold(picture, 255, cv2.ADAPTIVE_THRESH_MEAN_C, 0, 31, 5)),
        "erode_square": (lambda: im.erode(picture, square), lambda: cv2.erode(picture, square)),
        "erode_disc": (lambda: im.erode(picture, disc), lambda: cv2.erode(picture, disc)),
        "components": (lambda: im.connected_components(binary, connectivity=8),
                       lambda: cv2.connectedComponentsWithStats(binary, connectivity=8)),
        "canny": (lambda: im.canny(picture, 50, 150), lambda: cv2.Canny(picture, 50, 150)),
        "hough": (lambda: im.hough_lines(edges, 120), lambda: cv2.HoughLines(edges, 1, np.pi / 180, 120)),
        "harris": (lambda: im.harris(picture), lambda: cv2.cornerHarris(picture, 2, 3, 0.04)),
        "nms_300": (lambda: non_maximum_suppression(boxes, scores),
                    lambda: cv2.dnn.NMSBoxes(boxes, scores, 0.25, 0.45)),
    }  # fmt: skip


def speed(picture: Picture) -> dict[str, Figure]:
    """Ratios of CPU time; the NumPy texts beside, for those who read them."""
    rounds = 3 if "--quick" in sys.argv[1:] else 21
    cv2.setNumThreads(1)
    figures = {}
    for name, (ours, theirs) in works(picture).items():
        seconds = cpu_seconds({"ours": ours, "cv2": theirs}, rounds)
        bar = 5.0 if name.startswith(("conv", "sobel", "otsu")) else None
        said = f"cv2 {1e6 * seconds['cv2']:.0f} µs, ours {1e6 * seconds['ours']:.0f} µs"
        figures[f"{name}_over_cv2"] = Figure(seconds["ours"] / seconds["cv2"], "x", said, None, bar)
    texts = {
        "conv_3x3": lambda: im.correlate(picture, WINDOW, backend="numpy"),
        "sobel_3": lambda: im.sobel(picture, 1, 0, backend="numpy"),
        "otsu": lambda: im.otsu(picture, backend="numpy"),
    }
    both = works(picture)
    for name, text in texts.items():
        seconds = cpu_seconds({"numpy": text, "cv2": both[name][1]}, rounds)
        figures[f"{name}_numpy_over_cv2"] = Figure(
            seconds["numpy"] / seconds["cv2"], "x", "the text to be read; the reference's Sobel took 21x"
        )
    return figures


def main() -> int:
    """Measure and publish."""
    pictures = photographs()
    say(f"equality on {len(pictures)} pictures, OpenCV {cv2.__version__}")
    figures = equality(pictures)
    say("speed")
    largest = max(pictures, key=lambda one: one.size)
    picture = np.ascontiguousarray(cv2.resize(largest, SIZE[::-1], interpolation=cv2.INTER_AREA))
    return publish(figures | speed(picture))


if __name__ == "__main__":
    sys.exit(main())
