"""Networks of a few weights, written with `onnx`: what they see is known, and so is what they must say."""

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

SIZE = 64  # px of their input
NAMES = {"names": {0: "red", 1: "blue"}, "stride": 8}  # as an exporter notes them


def save(path, nodes, outputs, weights, *, size=(SIZE, SIZE), notes=None, opset=13):
    """A model with one input `images` (1, 3, height, width)."""
    shapes = {
        name: helper.make_tensor_value_info(name, TensorProto.FLOAT, list(s)) for name, s in outputs.items()
    }
    image = helper.make_tensor_value_info("images", TensorProto.FLOAT, [1, 3, size[1], size[0]])
    tensors = [numpy_helper.from_array(np.ascontiguousarray(array), name) for name, array in weights.items()]
    graph = helper.make_graph(nodes, "small", [image], list(shapes.values()), tensors)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", opset)])
    model.ir_version = 8
    for key, value in (notes or {}).items():
        note = model.metadata_props.add()
        note.key, note.value = key, str(value)
    onnx.checker.check_model(model)
    onnx.save(model, str(path))
    return path


def constant(path, **arrays):
    """A network whose outputs do not depend on the image."""
    nodes = [
        helper.make_node("GlobalAveragePool", ["images"], ["mean"]),
        helper.make_node("ReduceMean", ["mean"], ["one"], axes=[1], keepdims=1),
        helper.make_node("Mul", ["one", "zero"], ["nothing"]),
    ]
    weights = {"zero": np.zeros(1, np.float32)}
    for name, array in arrays.items():
        shape = f"{name}_shape"
        weights |= {f"{name}_values": array.astype(np.float32), shape: np.ones(array.ndim, np.int64)}
        nodes += [
            helper.make_node("Reshape", ["nothing", shape], [f"{name}_nothing"]),
            helper.make_node("Add", [f"{name}_values", f"{name}_nothing"], [name]),
        ]
    return save(path, nodes, {name: array.shape for name, array in arrays.items()}, weights)


def grid(cell=8):
    """Centres and sizes (4, N) of the cells of the canvas, row by row, as YOLO's heads have them."""
    at = np.arange(cell / 2, SIZE, cell)
    y, x = np.meshgrid(at, at, indexing="ij")
    ones = np.full(x.size, 2.0 * cell)
    return np.stack([x.ravel(), y.ravel(), ones, ones]).astype(np.float32)


def colour_detector(path, *, rows_first=False, notes=None):
    """YOLO-like: two classes, red and blue; each cell's score is how much of that colour it has, 0 to 1."""
    cells = grid()
    count = cells.shape[1]
    # channels are red, green, blue: red less the others, blue less the others
    weights = np.array([[1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]], np.float32)[:, :, None, None]
    shape = np.array([1, 2, count], np.int64)
    nodes = [
        helper.make_node("Conv", ["images", "weights"], ["pure"]),
        helper.make_node("Relu", ["pure"], ["positive"]),
        helper.make_node("AveragePool", ["positive"], ["cells"], kernel_shape=[8, 8], strides=[8, 8]),
        helper.make_node("Reshape", ["cells", "shape"], ["scores"]),
    ]
    tensors = {"weights": weights, "shape": shape, "boxes": cells[None]}
    if rows_first:  # YOLOv5: rows of boxes, an objectness of one before the scores
        tensors["boxes"] = np.concatenate([cells, np.ones((1, count), np.float32)])[None]
        nodes += [
            helper.make_node("Concat", ["boxes", "scores"], ["columns"], axis=1),
            helper.make_node("Transpose", ["columns"], ["output0"], perm=[0, 2, 1]),
        ]
        return save(path, nodes, {"output0": (1, count, 7)}, tensors, notes=notes)
    nodes.append(helper.make_node("Concat", ["boxes", "scores"], ["output0"], axis=1))
    return save(path, nodes, {"output0": (1, 6, count)}, tensors, notes=notes)


def colour_instances(path, *, notes=None):
    """YOLO-seg-like: rows of `colour_detector` with their scores again as coefficients of two maps."""
    cells = grid()
    count = cells.shape[1]
    weights = np.array([[1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]], np.float32)[:, :, None, None]
    nodes = [
        helper.make_node("Conv", ["images", "weights"], ["pure"]),
        helper.make_node("Relu", ["pure"], ["positive"]),
        helper.make_node("AveragePool", ["positive"], ["cells"], kernel_shape=[8, 8], strides=[8, 8]),
        helper.make_node("Reshape", ["cells", "shape"], ["scores"]),
        helper.make_node("Concat", ["boxes", "scores", "scores"], ["output0"], axis=1),
        helper.make_node("AveragePool", ["positive"], ["fine"], kernel_shape=[2, 2], strides=[2, 2]),
        helper.make_node("Sub", ["fine", "half"], ["output1"]),
    ]
    tensors = {"weights": weights, "shape": np.array([1, 2, count], np.int64), "boxes": cells[None],
               "half": np.array([0.4], np.float32)}  # fmt: skip
    outputs = {"output0": (1, 8, count), "output1": (1, 2, SIZE // 2, SIZE // 2)}
    return save(path, nodes, outputs, tensors, notes=notes)


def colour_segmenter(path, *, softmax=False, cells=SIZE):
    """Classes background, red and blue: scores are linear in the pixel, on a map of `cells` a side."""
    weights = np.array([[0.0, 0.0, 0.0], [9.0, -9.0, -9.0], [-9.0, -9.0, 9.0]], np.float32)[:, :, None, None]
    bias = np.array([0.0, -3.5, -3.5], np.float32)  # so that half a pixel of the colour is the limit
    step = SIZE // cells
    linear = "scores" if softmax else "map"
    nodes = [
        helper.make_node(
            "AveragePool", ["images"], ["small"], kernel_shape=[step, step], strides=[step, step]
        ),
        helper.make_node("Conv", ["small", "weights", "bias"], [linear]),
    ]
    if softmax:
        nodes.append(helper.make_node("Softmax", ["scores"], ["map"], axis=1))
    return save(path, nodes, {"map": (1, 3, cells, cells)}, {"weights": weights, "bias": bias})


def scene(shape=(120, 200)):
    """A dark BGR image with a red and a blue square, and their boxes left, top, width, height."""
    image = np.full((*shape, 3), 20, np.uint8)
    boxes = {"red": (20, 30, 40, 40), "blue": (130, 50, 40, 40)}
    for name, colour in (("red", (10, 10, 240)), ("blue", (240, 10, 10))):
        left, top, width, height = boxes[name]
        image[top : top + height, left : left + width] = colour
    return image, boxes
