"""Folders as people have them: what cannot be used is named, and the rest goes on."""

import threading

import cv2
import numpy as np
import pytest
from sfm_worlds import SMALL, rendered

from sequential.errors import DataError, ModelError
from vision3d.sfm import NoModelError, SfmSettings, Stopped, reconstruct


@pytest.fixture
def folder(tmp_path):
    """Five good pictures of a desk."""
    for name, image in rendered("desk")[0].items():
        cv2.imwrite(str(tmp_path / name), image)
    return tmp_path


def test_what_cannot_be_used_is_named_and_the_rest_goes_on(folder):
    whole = (folder / "desk1.png").read_bytes()
    image = cv2.imread(str(folder / "desk0.png"))
    cv2.imwrite(str(folder / "a broken one.jpg"), image)
    content = (folder / "a broken one.jpg").read_bytes()
    (folder / "a broken one.jpg").write_bytes(content[: len(content) // 2])
    (folder / "copy.png").write_bytes(whole)
    (folder / "empty.png").write_bytes(b"")
    cv2.imwrite(str(folder / "pixel.png"), np.zeros((1, 1), np.uint8))
    cv2.imwrite(str(folder / "night.png"), np.zeros((300, 400), np.uint8))
    (folder / "words.jpg").write_text("no picture")
    elsewhere = rendered("elsewhere")[0]["elsewhere0.png"]
    cv2.imwrite(str(folder / "elsewhere.png"), elsewhere[::-1, ::-1].copy())
    model = reconstruct(folder, camera=SMALL)
    assert set(model.names) == {f"desk{k}.png" for k in range(5)} - {"desk1.png"} | {"copy.png"}
    reasons = dict(model.missing)
    expected = {
        "a broken one.jpg": "cut off",
        "desk1.png": "same picture as copy.png",
        "empty.png": "empty",
        "pixel.png": "1x1 px",
        "night.png": "shows too little: 0 features",
        "words.jpg": "cannot be read",
        "elsewhere.png": "overlaps no other picture",
    }
    assert set(reasons) == set(expected)
    for name, words in expected.items():
        assert words in reasons[name], reasons[name]


def test_sizes_may_be_mixed(folder):
    image = cv2.imread(str(folder / "desk2.png"))
    cv2.imwrite(str(folder / "desk2.png"), cv2.resize(image, (800, 600), interpolation=cv2.INTER_CUBIC))
    work = folder / "work"
    model = reconstruct(folder, work=work)
    assert len(model) == 5
    assert [camera.size for camera in model.cameras] == [(400, 300), (800, 600)]
    known = reconstruct(folder, camera=SMALL, work=work)
    assert len(known) == 5
    assert known.cameras[1] == SMALL.resized((800, 600))


def test_pictures_of_another_shape_than_the_camera_are_named(folder):
    image = cv2.imread(str(folder / "desk4.png"))
    cv2.imwrite(str(folder / "desk4.png"), image[:, :300])
    model = reconstruct(folder, camera=SMALL)
    assert len(model) == 4
    assert model.missing == (
        ("desk4.png", "is 300x300 px, and the camera that was given has images of 400x300"),
    )


def test_one_picture_and_none(folder, tmp_path):
    with pytest.raises(DataError, match="needs two pictures or more"):
        reconstruct(folder / "desk0.png")
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(DataError, match="no image in the folder"):
        reconstruct(empty)


def test_the_same_picture_five_times(tmp_path):
    image = rendered("desk")[0]["desk0.png"]
    with pytest.raises(DataError, match=r"of 5 pictures 1 can be used.*same picture as a"):
        reconstruct(dict.fromkeys("abcde", image))


def test_pictures_without_overlap():
    desk, other = rendered("desk")[0]["desk0.png"], rendered("elsewhere")[0]["elsewhere0.png"]
    with pytest.raises(NoModelError, match="no two pictures overlap"):
        reconstruct({"a": desk, "b": other[::-1, ::-1].copy()})


def test_pictures_that_are_bare():
    rng = np.random.default_rng(1)
    grey = {f"{k}": np.clip(rng.normal(128, 1.0, (240, 320)), 0, 255).astype(np.uint8) for k in range(3)}
    with pytest.raises(NoModelError, match="show too little"):
        reconstruct(grey)


def test_work_that_was_ended_goes_on(folder, tmp_path):
    """Features that were found before the end are taken from where they are kept."""
    work, stop = tmp_path / "work", threading.Event()
    told = []

    def progress(what, done, total):
        told.append(what)
        if what == "matches":
            stop.set()

    with pytest.raises(Stopped):
        reconstruct(folder, camera=SMALL, work=work, stop=stop, progress=progress)
    kept = sorted((work / "features").glob("*.npz"))
    assert len(kept) == 5
    stamps = [path.stat().st_mtime_ns for path in kept]
    model = reconstruct(folder, camera=SMALL, work=work)
    assert len(model) == 5
    assert [path.stat().st_mtime_ns for path in kept] == stamps


def test_a_model_that_was_ended_holds_what_had_its_place(tmp_path):
    """A stop while the model grows gives the model so far."""
    stop = threading.Event()

    def progress(what, done, total):
        if what == "growing" and done >= 4:
            stop.set()

    model = reconstruct(rendered("desk")[0], camera=SMALL, stop=stop, progress=progress)
    assert 2 <= len(model) <= 5
    assert len(model.points) > 100
    assert len(model) + len(model.missing) == 5


@pytest.mark.parametrize(
    "changes", [{"mapper": "magic"}, {"lens": "thin12"}, {"max_size": 3}, {"sharing": "all"}]
)
def test_settings_that_mean_nothing(changes):
    with pytest.raises(ModelError):
        SfmSettings(**changes)
