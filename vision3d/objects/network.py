"""A user's own network in an ONNX file, run by OpenCV: boxes, or a class for every pixel.

network = ObjectNetwork("yolo11n.onnx")
for k in range(len(found := network.detect(image))):
print(found.name(k), found.scores[k], found.boxes[k])
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, FileFormatError, ShapeError
from vision3d.objects.boxes import Detections, non_maximum_suppression
from vision3d.objects.instances import instance_masks
from vision3d.objects.letterbox import Placement, letterbox
from vision3d.objects.onnx_file import read_onnx
from vision3d.objects.outputs import Layout, candidates, class_scores, guess_layout

__all__ = ["ObjectNetwork", "Preparation", "Segmentation"]


@dataclass(frozen=True, slots=True)
class Preparation:
    """How an image becomes a network's input: (level · scale - mean) / deviation, per channel.

    Parameters
    ----------
    size : (width, height) px; None takes what the file says, else 640 x 640
    scale : 1/255 gives 0 to 1
    mean, deviation : of the channels in the network's order, after scaling
    rgb : red first; OpenCV's images are blue first
    keep_shape : a plain border around the image, else it is stretched to fill the canvas
    """

    size: tuple[int, int] | None = None
    scale: float = 1 / 255
    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    deviation: tuple[float, float, float] = (1.0, 1.0, 1.0)
    rgb: bool = True
    keep_shape: bool = True

    def __post_init__(self) -> None:
        if self.size is not None and min(self.size) < 1:
            raise DataError(f"an input of {self.size[0]}x{self.size[1]} pixels; expected one at least")
        if self.scale <= 0 or min(self.deviation) <= 0:
            raise DataError(f"scale {self.scale} and deviation {self.deviation}; expected numbers above zero")


@dataclass(frozen=True)
class Segmentation:
    """A class for every pixel.

    Attributes
    ----------
    labels : (h, w) int32
    confidence : (h, w) float32 probability of that class
    names : of the classes, by number; may be empty
    """

    labels: NDArray[np.int32]
    confidence: NDArray[np.float32]
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self.labels.setflags(write=False)
        self.confidence.setflags(write=False)

    def mask(self, label: int, *, least_confidence: float = 0.0) -> NDArray[np.bool_]:
        """(h, w) where a class is, as sure as that."""
        inside: NDArray[np.bool_] = (self.labels == label) & (self.confidence >= least_confidence)
        return inside

    def name(self, label: int) -> str:
        """What a class is called: its name, or its number."""
        return self.names[label] if 0 <= label < len(self.names) else f"class {label}"


class ObjectNetwork:
    """A network that finds objects.

    Parameters
    ----------
    path : of the ONNX file
    layout : family of its outputs (see `vision3d.objects.outputs`); guessed from their shapes unless given
    names : of its classes; those that the file brings unless given
    preparation : of images

    Raises
    ------
    FileFormatError
        where the file is no network, or one that OpenCV cannot run.
    """

    def __init__(
        self,
        path: Path | str,
        *,
        layout: Layout | None = None,
        names: tuple[str, ...] = (),
        preparation: Preparation | None = None,
    ) -> None:
        self.file = read_onnx(path)
        self.preparation = preparation or Preparation()
        self.names = tuple(names) or self.file.class_names
        self._layout = layout
        self._net = _loaded(Path(path))

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) px of the canvas."""
        return self.preparation.size or self.file.image_size or (640, 640)

    def layout(self, outputs: list[NDArray[np.float32]]) -> Layout:
        """The family of the outputs: the one given, else the one that their shapes tell."""
        return self._layout or guess_layout([one.shape for one in outputs])

    def raw(self, image: ArrayLike) -> tuple[list[NDArray[np.float32]], Placement]:
        """The network's outputs for an image, and where the image lies on the canvas."""
        import cv2

        prepared = self.preparation
        canvas, placement = letterbox(image, self.size, keep_shape=prepared.keep_shape)
        pixels = canvas[:, :, ::-1] if prepared.rgb else canvas
        levels = pixels.astype(np.float32) * np.float32(prepared.scale)
        mean, deviation = (np.array(one, dtype=np.float32) for one in (prepared.mean, prepared.deviation))
        levels = (levels - mean) / deviation
        self._net.setInput(np.ascontiguousarray(levels.transpose(2, 0, 1)[None]))
        try:
            with _silent():
                outputs = self._net.forward(self._net.getUnconnectedOutLayersNames())
        except cv2.error as error:
            shape = next(iter(self.file.inputs.values()))
            raise ShapeError(
                f"{self.file.name} cannot be run on an input of {self.size[0]}x{self.size[1]} pixels and 3"
                f" channels; the file asks for {shape}: give its size ({_reason(error)})"
            ) from error
        return [np.asarray(one, np.float32) for one in outputs], placement

    def detect(
        self, image: ArrayLike, *, least_score: float = 0.25, most_overlap: float = 0.45
    ) -> Detections:
        """Objects in an image, in its own pixels.

        Parameters
        ----------
        image : (h, w, 3) BGR, or (h, w)
        least_score : of what is told
        most_overlap : intersection over union of two boxes of one class that are told both
        """
        outputs, placement = self.raw(image)
        found = candidates(
            outputs, self.layout(outputs), placement.canvas_size, least_score, classes=len(self.names)
        )
        boxes = placement.to_image(found.boxes)
        kept = non_maximum_suppression(
            boxes, found.scores, labels=found.labels, least_score=least_score, most_overlap=most_overlap
        )
        masks, maps = None, [one for one in outputs if one.ndim == 4]
        if found.coefficients.shape[1] and maps:
            masks = instance_masks(found.coefficients[kept], maps[0], boxes[kept], placement)
        return Detections(boxes[kept], found.scores[kept], found.labels[kept], self.names, masks)

    def segment(self, image: ArrayLike) -> Segmentation:
        """A class for every pixel of an image: its network's map, enlarged before the best class is taken."""
        import cv2

        outputs, placement = self.raw(image)
        scores = class_scores(outputs)
        rows, columns = placement.crop((scores.shape[2], scores.shape[1]))
        # channel by channel: OpenCV resizes few at once
        maps = [cv2.resize(np.ascontiguousarray(one[rows, columns]), placement.image_size) for one in scores]
        labels, confidence = np.zeros(maps[0].shape, np.int32), np.asarray(maps[0], np.float32).copy()
        for k, one in enumerate(maps[1:], 1):
            better = one > confidence
            labels[better] = k
            confidence[better] = one[better]
        return Segmentation(labels, confidence, self.names)


@contextmanager
def _silent() -> Iterator[None]:
    """Keep OpenCV from writing pages about an error that is raised anyway."""
    import cv2

    before = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(before)


def _loaded(path: Path) -> Any:
    import cv2

    try:
        with _silent():
            return cv2.dnn.readNetFromONNX(str(path))
    except cv2.error as error:
        raise FileFormatError(
            f"OpenCV {cv2.__version__} cannot run {path.name}: {_reason(error)}; export it for opset 11 to"
            " 17, in single precision, with fixed shapes"
        ) from error


def _reason(error: Any) -> str:
    """The last sentence of OpenCV's, without its place in the source."""
    said = " ".join(str(getattr(error, "err", "") or error).split())
    return said[:160]
