"""Pictures from files: what is read, and the sentence for what is not."""

import cv2
import numpy as np
import pytest

from sequential.errors import DataError, FileFormatError
from vision3d.images import read_image, read_images


@pytest.fixture
def picture(rng):
    """Grey levels (48, 64), smooth enough for JPEG."""
    coarse = rng.integers(0, 256, (6, 8), dtype=np.uint8)
    return cv2.resize(coarse, (64, 48), interpolation=cv2.INTER_CUBIC)


def write(path, image):
    assert cv2.imwrite(str(path), image)
    return path


def with_orientation(jpeg, orientation):
    """A JPEG with an EXIF block that says how to turn it."""
    entry = b"\x01\x12\x00\x03\x00\x00\x00\x01" + orientation.to_bytes(2, "big") + b"\x00\x00"
    tiff = b"MM\x00\x2a\x00\x00\x00\x08" + b"\x00\x01" + entry + b"\x00\x00\x00\x00"
    body = b"Exif\x00\x00" + tiff
    return jpeg[:2] + b"\xff\xe1" + (len(body) + 2).to_bytes(2, "big") + body + jpeg[2:]


def test_grey_levels_and_colours(tmp_path, picture):
    path = write(tmp_path / "a.png", picture)
    np.testing.assert_array_equal(read_image(path), picture)
    assert read_image(path, colour=True).shape == (48, 64, 3)
    colours = np.dstack([picture, picture // 2, 255 - picture])
    path = write(tmp_path / "b.png", colours)
    np.testing.assert_array_equal(read_image(path, colour=True), colours)
    np.testing.assert_array_equal(read_image(path), cv2.cvtColor(colours, cv2.COLOR_BGR2GRAY))


@pytest.mark.parametrize("orientation", [1, 3, 6, 8])
def test_an_orientation_in_exif_is_ignored(tmp_path, picture, orientation):
    plain = write(tmp_path / "plain.jpg", picture)
    turned = tmp_path / "turned.jpg"
    turned.write_bytes(with_orientation(plain.read_bytes(), orientation))
    if orientation in {6, 8}:
        assert cv2.imread(str(turned)).shape[:2] == (64, 48), "OpenCV alone would turn it"
    np.testing.assert_array_equal(read_image(turned), read_image(plain))


@pytest.mark.parametrize("bits", [10, 12, 16])
def test_sixteen_bits_become_eight(tmp_path, picture, bits):
    full = picture.astype(np.uint16)
    full[0, 0] = 255
    path = write(tmp_path / "deep.png", full << (bits - 8))
    np.testing.assert_array_equal(read_image(path), full.astype(np.uint8))


def test_what_is_transparent_lies_on_white(tmp_path, picture):
    opacity = np.full_like(picture, 255)
    opacity[:10], opacity[10:20] = 0, 128
    path = write(tmp_path / "sheet.png", np.dstack([picture, picture, picture, opacity]))
    read = read_image(path)
    assert (read[:10] == 255).all()
    np.testing.assert_allclose(read[10:20], 0.5 * picture[10:20] + 127.5, atol=2.0)
    np.testing.assert_array_equal(read[20:], picture[20:])


def test_names_that_are_not_ascii(tmp_path, picture):
    path = tmp_path / "été 1.png"
    path.write_bytes(cv2.imencode(".png", picture)[1].tobytes())
    np.testing.assert_array_equal(read_image(path), picture)


def test_what_is_no_picture_is_a_sentence(tmp_path, picture):
    with pytest.raises(DataError, match=r"there is no file .*gone\.png"):
        read_image(tmp_path / "gone.png")
    with pytest.raises(DataError, match="it is a folder"):
        read_image(tmp_path)
    (tmp_path / "empty.png").touch()
    with pytest.raises(FileFormatError, match="is empty"):
        read_image(tmp_path / "empty.png")
    (tmp_path / "text.png").write_text("not a picture\n" * 20)
    with pytest.raises(FileFormatError, match="cannot be read as a picture"):
        read_image(tmp_path / "text.png")
    write(tmp_path / "real.tiff", picture.astype(np.float32))
    with pytest.raises(FileFormatError, match="float32 numbers"):
        read_image(tmp_path / "real.tiff")


def test_telephones_and_raw_files_are_told_what_to_do(tmp_path, picture):
    (tmp_path / "IMG_1.HEIC").write_bytes(b"\x00\x00\x00\x18ftypheic" + bytes(100))
    with pytest.raises(FileFormatError, match="it is HEIC, as telephones write it; convert it"):
        read_image(tmp_path / "IMG_1.HEIC")
    tiff = write(tmp_path / "a.tiff", picture)
    tiff.rename(tmp_path / "a.dng")
    with pytest.raises(FileFormatError, match="raw data of a sensor"):
        read_image(tmp_path / "a.dng")


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.95])
def test_a_file_that_is_cut_off_is_told(tmp_path, picture, suffix, share):
    whole = write(tmp_path / f"whole{suffix}", cv2.resize(picture, (640, 480))).read_bytes()
    cut = tmp_path / f"cut{suffix}"
    cut.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(FileFormatError, match="cut off"):
        read_image(cut)


def test_one_bad_picture_costs_no_other(tmp_path, picture):
    for i in range(4):
        write(tmp_path / f"view{i}.png", np.roll(picture, 5 * i))
    (tmp_path / "view2.png").write_bytes(b"\x00" * 100)
    write(tmp_path / "view4.png", picture.T.copy())
    write(tmp_path / "view5.png", picture[:20])
    write(tmp_path / "view6.png", np.roll(picture, 5))
    pictures = read_images(tmp_path)
    assert [name for name, _ in pictures] == ["view0.png", "view1.png", "view3.png"]
    assert pictures.size == (64, 48)
    assert [str(left) for left in pictures.left_out] == [
        "view2.png: cannot be read as a picture; is it one, and whole?",
        "view4.png: is 48x64 px and most pictures are 64x48; it was turned by 90° and saved again",
        "view5.png: is 64x20 px and most pictures are 64x48",
        "view6.png: is the same picture as view1.png, whose corners would count twice",
    ]


def test_folders_patterns_and_files_together(tmp_path, picture):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        for i in (2, 10):
            write(tmp_path / folder / f"{i}.png", np.roll(picture, i if folder == "a" else -i))
    pictures = read_images([tmp_path / "a", str(tmp_path / "b" / "*.png"), tmp_path / "a" / "2.png"])
    assert [name for name, _ in pictures] == [str(tmp_path / f / f"{i}.png") for f in "ab" for i in (2, 10)]
    assert pictures.left_out == ()


def test_a_set_that_is_none_is_a_sentence(tmp_path, picture):
    with pytest.raises(DataError, match="there is no image in the folder"):
        read_images(tmp_path)
    (tmp_path / "bad.jpg").write_text("x")
    with pytest.raises(FileFormatError, match=r"none of the 1 pictures can be read; bad\.jpg cannot"):
        read_images(tmp_path)
    write(tmp_path / "a.png", picture)
    write(tmp_path / "b.png", picture[:40])
    with pytest.raises(DataError, match=r"different sizes \(1 of 64x48, 1 of 64x40\)"):
        read_images(tmp_path)
    with pytest.raises(DataError, match="no picture was given"):
        read_images([])


def test_the_thirteen_left_views(data_dir):
    pictures = read_images(str(data_dir / "vision" / "opencv" / "left*.jpg"))
    assert len(pictures) == 13
    assert pictures.size == (640, 480)
    assert pictures.left_out == ()
