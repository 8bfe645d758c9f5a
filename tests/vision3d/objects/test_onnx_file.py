"""What a file says of itself, against the library of the format."""

from onnx_worlds import NAMES, SIZE, colour_detector, grid

from vision3d.objects import read_onnx


def test_the_file_s_outside(tmp_path):
    import onnx

    path = colour_detector(tmp_path / "net.onnx", notes=NAMES)
    found = read_onnx(path)
    theirs = onnx.load(str(path)).graph
    assert list(found.inputs) == [one.name for one in theirs.input]
    assert found.inputs["images"] == (1, 3, SIZE, SIZE)
    assert found.outputs == {"output0": (1, 6, grid().shape[1])}
    assert found.image_size == (SIZE, SIZE)
    assert found.class_names == ("red", "blue")
    assert found.notes["stride"] == "8"


def test_open_dimensions_and_weights_among_inputs(tmp_path):
    import onnx
    from onnx import helper

    path = colour_detector(tmp_path / "net.onnx")
    model = onnx.load(str(path))
    for axis, name in ((0, "batch"), (2, "height")):
        model.graph.input[0].type.tensor_type.shape.dim[axis].dim_param = name
    model.graph.input.append(helper.make_tensor_value_info("weights", 1, [2, 3, 1, 1]))
    onnx.save(model, str(path))
    found = read_onnx(path)
    assert found.inputs == {"images": ("batch", 3, "height", SIZE)}
    assert found.image_size is None
    assert found.class_names == ()
    for written, size in (("[320, 640]", (640, 320)), ("[0, 640]", None), ("rm -rf", None), ("640", None)):
        del model.metadata_props[:]
        note = model.metadata_props.add()
        note.key, note.value = "imgsz", written
        onnx.save(model, str(path))
        assert read_onnx(path).image_size == size
