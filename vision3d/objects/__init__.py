"""Objects in an image: pieces of a colour, or what a network of the user's finds."""

from vision3d.objects.blobs import (
    Blob,
    Blobs,
    LightMargin,
    find_blobs,
    hue_margin,
    largest_object,
    light_margin,
)
from vision3d.objects.boxes import Detections, iou, non_maximum_suppression
from vision3d.objects.colour import ColourRange, learn_colour
from vision3d.objects.instances import instance_masks
from vision3d.objects.letterbox import Placement, letterbox
from vision3d.objects.network import ObjectNetwork, Preparation, Segmentation
from vision3d.objects.onnx_file import OnnxFile, read_onnx
from vision3d.objects.outputs import LAYOUTS, Candidates, Layout, candidates, class_scores, guess_layout

__all__ = [
    "LAYOUTS",
    "Blob",
    "Blobs",
    "Candidates",
    "ColourRange",
    "Detections",
    "Layout",
    "LightMargin",
    "ObjectNetwork",
    "OnnxFile",
    "Placement",
    "Preparation",
    "Segmentation",
    "candidates",
    "class_scores",
    "find_blobs",
    "guess_layout",
    "hue_margin",
    "instance_masks",
    "iou",
    "largest_object",
    "learn_colour",
    "letterbox",
    "light_margin",
    "non_maximum_suppression",
    "read_onnx",
]
