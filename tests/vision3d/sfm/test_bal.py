"""Files of other bundle adjusters: what is written is read, what is damaged is refused with a sentence."""

import bz2

import numpy as np
import pytest
from bundle_worlds import bundle_world

from sequential.errors import FileFormatError, ModelError
from vision3d.sfm.bal import read_bal, write_bal
from vision3d.sfm.bundler import read_bundler, write_bundler

ROUND_TRIPS = {
    "bal": lambda path, model: read_bal(write_bal(path, model), size=model.cameras[0].size),
    "bundler": lambda path, model: read_bundler(
        write_bundler(path, model), images=model.names, size=model.cameras[0].size
    ),
}


def by_point(model):
    """Residuals sorted by point and image, whatever the order of the file."""
    return model.residuals()[np.lexsort((model.image_index, model.point_index))]


@pytest.mark.parametrize("trip", ROUND_TRIPS.values(), ids=ROUND_TRIPS)
@pytest.mark.parametrize("lens", ["pinhole", "brown1", "brown2"])
def test_what_is_written_is_read(trip, lens, rng, tmp_path):
    model = bundle_world(rng, lens=lens, cameras=2)
    again = trip(tmp_path / "file.txt", model)
    # pixels of Bundler's file have four decimals
    np.testing.assert_allclose(by_point(again), by_point(model), atol=1e-3)
    np.testing.assert_allclose(again.points, model.points, rtol=1e-8)
    np.testing.assert_allclose(again.centres, model.centres, atol=1e-8)
    focal = [camera.intrinsics[0] for camera in again.cameras]
    assert focal == pytest.approx([model.cameras[c].intrinsics[0] for c in model.camera_of], rel=1e-9)


def test_a_camera_at_a_half_turn_survives(rng, tmp_path):
    """Rotation vectors near π are where such files lose attitudes."""
    model = bundle_world(rng)
    poses = np.array(model.cameras_T_world)
    poses[0] = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    again = ROUND_TRIPS["bal"](tmp_path / "bal.txt", model.replaced(cameras_T_world=poses))
    np.testing.assert_allclose(np.abs(again.cameras_T_world[0, :4]), [0.0, 1.0, 0.0, 0.0], atol=1e-12)


def test_compressed_files_are_read(rng, tmp_path):
    model = bundle_world(rng)
    plain = write_bal(tmp_path / "problem.txt", model)
    packed = tmp_path / "problem.txt.bz2"
    packed.write_bytes(bz2.compress(plain.read_bytes()))
    np.testing.assert_array_equal(read_bal(packed).points, read_bal(plain).points)


@pytest.mark.parametrize("write", [write_bal, write_bundler])
def test_a_lens_that_does_not_fit_is_refused(write, rng, tmp_path):
    with pytest.raises(ModelError, match=r"two radial coefficients; a brown4 camera.*undistort"):
        write(tmp_path / "file", bundle_world(rng, lens="brown4"))


DAMAGE = {
    "empty": (lambda _: "", "begins with the numbers|no problem"),
    "cut off": (lambda text: text[: len(text) // 2], "cut off"),
    "a word": (lambda text: text.replace(" ", " x ", 1), "numbers"),
    "a stranger": (lambda text: text.replace("\n0 0 ", "\n9 0 ", 1), "does not exist"),
    "not a number": (lambda text: text.rstrip().rsplit("\n", 1)[0] + "\nnan\n", "NaN"),
}


@pytest.mark.parametrize(("damage", "said"), DAMAGE.values(), ids=DAMAGE)
def test_a_damaged_problem_is_refused_by_name(damage, said, rng, tmp_path):
    path = write_bal(tmp_path / "problem.txt", bundle_world(rng))
    path.write_text(damage(path.read_text()))
    with pytest.raises(FileFormatError, match=f"problem.txt.*({said})"):
        read_bal(path)


BUNDLER_DAMAGE = {
    "another file": (lambda text: "P5\n" + text, "first line"),
    "cut off in the cameras": (lambda text: "\n".join(text.splitlines()[:8]), "cut off"),
    "cut off in the points": (lambda text: "\n".join(text.splitlines()[:-1]), "ends inside point"),
}


@pytest.mark.parametrize(("damage", "said"), BUNDLER_DAMAGE.values(), ids=BUNDLER_DAMAGE)
def test_a_damaged_bundle_file_is_refused_by_name(damage, said, rng, tmp_path):
    path = write_bundler(tmp_path / "bundle.out", bundle_world(rng))
    path.write_text(damage(path.read_text()))
    with pytest.raises(FileFormatError, match=f"bundle.out.*{said}"):
        read_bundler(path)


def test_a_camera_without_a_pose_is_listed(rng, tmp_path):
    path = write_bundler(tmp_path / "bundle.out", bundle_world(rng, views=4))
    lines = path.read_text().splitlines()
    lines[1] = lines[1].replace("4", "5", 1)
    lines[2:2] = ["0 0 0", "0 0 0", "0 0 0", "0 0 0", "0 0 0"]
    # images are counted anew: everything that was seen was seen by the next one
    for at in range(2 + 25 + 2, len(lines), 3):
        words = lines[at].split()
        words[1::4] = [str(int(word) + 1) for word in words[1::4]]
        lines[at] = " ".join(words)
    path.write_text("\n".join(lines) + "\n")
    model = read_bundler(path)
    assert [name for name, _ in model.missing] == ["image 0"]
    assert model.names == ("image 1", "image 2", "image 3", "image 4")
    assert model.rms_px < 2.0


def test_the_dubrovnik_and_balbianello_files(data_dir):
    folder = data_dir / "vision" / "balbianello"
    problem = read_bal(folder / "dubrovnik-3-7-pre.txt")
    assert (len(problem.names), len(problem.points), len(problem.pixels)) == (3, 7, 19)
    assert problem.rms_px == pytest.approx(17.058, abs=1e-3)
    model = read_bundler(folder / "Balbianello.out", size=(640, 427))
    assert (len(model.names), len(model.points), len(model.pixels)) == (5, 544, 1417)
    assert model.rms_px == pytest.approx(0.4233, abs=1e-4)
