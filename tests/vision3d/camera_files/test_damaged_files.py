"""Camera files that are none, or damaged: a sentence that names the file."""

import pytest
from lens_family import EVERY_CAMERA, camera_of

from sequential.errors import DataError, FileFormatError, ModelError
from vision3d.camera_files import camera_text, formats_for, read_camera, read_cameras, write_camera

MODEL = """\
camera_matrix: {data: [500, 0, 320, 0, 500, 240, 0, 0, 1]}
distortion_model: ftheta
distortion_coefficients: {data: [1, 2]}
"""
NEGATIVE = """\
image_width: 640
image_height: 480
camera_matrix: {data: [-500, 0, 320, 0, 500, 240, 0, 0, 1]}
"""
BROKEN = {
    "empty.yml": ("", "is empty"),
    "words.yaml": ("just words", "no camera file of OpenCV"),
    "other.yaml": ("a: 1\nb: 2\n", "it holds a, b"),
    "cut.json": ('{"format": "factorlab camera", "lens":', "line 1 is no JSON"),
    "lens.json": ('{"format": "factorlab camera", "lens": "brown6"}', "no lens 'brown6'"),
    "names.json": (
        '{"format": "factorlab camera", "lens": "pinhole", "intrinsics": {"fx": 1}}',
        "intrinsics of the lens pinhole holds fx, fy, cx, cy",
    ),
    "tabs.yaml": ("a:\n\t- b: [", "damaged at line 2"),
    "ros.yaml": (
        "camera_matrix: {rows: 3, cols: 3, data: [1, 2]}\n",
        "expected 9 numbers for camera_matrix, got 2",
    ),
    "model.yaml": (
        MODEL,
        "distortion_model ftheta with 2 coefficients is not read",
    ),
    "negative.yaml": (
        NEGATIVE,
        "focal lengths are positive",
    ),
    "cameras.txt": ("1 FOV 640 480 500 500 320 240 0.9\n", "is no camera of SIMPLE_PINHOLE"),
    "few.txt": (
        "1 PINHOLE 640 480 500 500 320\n",
        "camera 1: expected 4 numbers for the parameters of PINHOLE",
    ),
    "opencv.yml": ("%YAML:1.0\n---\nK0: 3\n", "has no camera_matrix"),
    "damaged.yml": (
        "%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n",
        "damaged|no camera_matrix",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_no_camera_file_is_a_sentence(tmp_path, name):
    text, message = BROKEN[name]
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(FileFormatError, match=message) as told:
        read_camera(path)
    assert name in str(told.value)


def test_what_is_no_file_is_a_sentence(tmp_path):
    with pytest.raises(DataError, match="there is no file"):
        read_camera(tmp_path / "gone.yml")
    (tmp_path / "picture.yml").write_bytes(b"\xff\xd8\xff\xe0\x00\x10")
    with pytest.raises(FileFormatError, match="is no text"):
        read_camera(tmp_path / "picture.yml")
    with pytest.raises(ModelError, match="does not tell its format"):
        write_camera(camera_of("brown5"), tmp_path / "camera.ini")
    with pytest.raises(ModelError, match="no format 'ini'"):
        camera_text(camera_of("brown5"), "ini")


EDITS = ("nan", "-", ".inf", "[", "]", "{", "}", ": ", "\n", "1e999", "null", "0", "!!", "\t", "é")


def damaged(text, rng):
    """A text after one to three accidents: something cut, changed, inserted, doubled, or the end missing."""
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(text)))
        match int(rng.integers(5)):
            case 0:
                text = text[:at] + text[at + int(rng.integers(1, 30)) :]
            case 1:
                text = text[:at] + str(rng.choice(list("[]{}:,-.0e!%#\"' xN"))) + text[at + 1 :]
            case 2:
                text = text[:at] + str(rng.choice(EDITS)) + text[at:]
            case 3:
                text = text[: at + 1]
            case _:
                text = text[:at] + text[at // 2 : at // 2 + 20] + text[at:]
    return text


@pytest.mark.parametrize("camera", EVERY_CAMERA, ids=lambda camera: camera.lens)
def test_no_accident_is_more_than_a_sentence(camera, tmp_path, rng):
    """Whatever a file has become, it is read or refused; OpenCV's own reader aborts Python on some."""
    told = []
    for one in formats_for(camera):
        path = tmp_path / one.file_name
        for _ in range(60):
            path.write_text(damaged(one.text(camera, "camera"), rng), encoding="utf-8")
            try:
                read_cameras(path, size=(640, 480))
            except FileFormatError as error:
                told.append((one.file_name, str(error)))
    assert all(name in sentence for name, sentence in told)
    assert len(told) > 60, "most accidents are seen"
