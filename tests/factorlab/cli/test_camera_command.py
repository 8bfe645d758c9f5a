"""What `factorlab camera` says of a camera file, and what it writes."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from lens_family import EVERY_CAMERA, camera_of

from factorlab.cli import main
from factorlab.cli.camera import FORMATS as CHOICES
from vision3d.camera import Camera
from vision3d.camera_files import FORMATS, formats_for, read_camera, write_camera
from vision3d.camera_summary import summarise


def run(*arguments):
    return CliRunner().invoke(main, ["camera", *map(str, arguments)])


def test_the_formats_are_those_of_the_library():
    assert tuple(FORMATS) == CHOICES


def test_a_camera_in_words(tmp_path):
    done = run(write_camera(camera_of("brown5"), tmp_path / "camera.yml"))
    assert done.exit_code == 0, done.stderr
    first, *rest = done.stdout.splitlines()
    assert first == "Brown-Conrady, 3 radial and 2 tangential (brown5), 640x480 px"
    assert rest[0].strip() == "fx 532.8  fy 531.9  cx 342.5  cy 233.9 px"
    assert "its axis meets the image 23.0 px right of and 5.6 px above the middle" in done.stdout


@pytest.mark.parametrize("camera", EVERY_CAMERA, ids=lambda camera: camera.lens)
@pytest.mark.parametrize("name", FORMATS)
def test_from_every_format_to_every_other(camera, name, tmp_path):
    source = write_camera(camera, tmp_path / "camera.json")
    target = tmp_path / f"to_{FORMATS[name].file_name}"
    done = run(source, "--to", name, "-o", target)
    if name not in {one.name for one in formats_for(camera)}:
        assert done.exit_code == 1
        assert "calibrate with" in done.stderr
        assert not target.exists()
        return
    assert done.exit_code == 0, done.stderr
    np.testing.assert_allclose(read_camera(target).parameters, camera.parameters, rtol=1e-15)


def test_the_document(tmp_path):
    done = run(write_camera(camera_of("fisheye4"), tmp_path / "camera.json"), "--json")
    (record,) = json.loads(done.stdout)["cameras"].values()
    assert record["lens"] == "fisheye4"
    assert record["formats"] == ["json", "opencv", "ros", "kalibr", "colmap"]
    summary = summarise(camera_of("fisheye4"))
    assert record["view_deg"]["across"] == pytest.approx(np.degrees(summary.across_rad))


def test_angles_of_view():
    """A pinhole of 90 degrees, and a fisheye that sees 200."""
    flat = summarise(Camera("pinhole", (320.0, 320.0, 319.5, 239.5), (), (640, 480)))
    assert np.degrees(flat.across_rad) == pytest.approx(90.0)
    assert flat.down_rad == pytest.approx(2.0 * np.arctan(240.0 / 320.0))
    assert flat.corner_rad == pytest.approx(2.0 * np.arctan(400.0 / 320.0))
    assert flat.bend_px == pytest.approx(0.0, abs=1e-9)
    assert flat.pixel_rad == pytest.approx(np.arctan(1.0 / 320.0))
    focal = 320.0 / np.radians(100.0)
    wide = summarise(Camera("fisheye4", (focal, focal, 319.5, 319.5), (0.0, 0.0, 0.0, 0.0), (640, 640)))
    assert np.degrees(wide.across_rad) == pytest.approx(200.0)


def test_several_cameras(data_dir):
    pair = data_dir / "vision" / "opencv" / "intrinsics.yml"
    done = run(pair)
    assert done.exit_code == 1
    assert "does not say how large its images are" in done.stderr
    done = run(pair, "--size", "640x480")
    assert done.exit_code == 0
    assert done.stdout.startswith("left: ")
    assert "some corners have no ray" in done.stdout
    assert run(pair, "--size", "640x480", "--check").exit_code == 3
    assert run(pair, "--size", "640x480", "--which", "middle").exit_code == 1


def test_whatever_is_wrong_is_a_sentence(tmp_path):
    source = write_camera(camera_of("brown5"), tmp_path / "camera.json")
    target = tmp_path / "camera.yml"
    assert run(source, "-o", target).exit_code == 0
    done = run(source, "-o", target)
    assert (done.exit_code, "is there already" in done.stderr) == (1, True)
    assert run(source, "-o", target, "--force").exit_code == 0
    assert run(source, "-o", tmp_path / "camera.ini").exit_code == 1
    assert run(source, "--size", "big").exit_code == 2
    done = run(source, "-o", tmp_path / "none" / "camera.yml")
    assert done.exit_code == 1
    assert "No such file or directory" in done.stderr
    assert run(tmp_path / "gone.yml").exit_code == 1
