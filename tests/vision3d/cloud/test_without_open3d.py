"""Everything but Poisson surfaces works where open3d is missing, and what needs it says so in a sentence."""

import subprocess
import sys

import numpy as np
import pytest

from sequential.errors import ToolMissingError
from vision3d.cloud import with_open3d

PROGRAM = """
import sys
sys.modules["open3d"] = None
import numpy as np
from vision3d.cloud import *
points = np.random.default_rng(0).uniform(size=(500, 3))
camera, pose = viewpoint(points)
splat(points, None, camera, pose)
remove_outliers(points); estimate_normals(points); voxel_downsample(points, 0.2); icp(points, points)
read_ply(write_ply(sys.argv[1], points))
assert not any(name.startswith(("cv2", "matplotlib")) for name in sys.modules)
"""


def test_the_rest_works_in_an_interpreter_that_has_none(tmp_path):
    subprocess.run([sys.executable, "-c", PROGRAM, str(tmp_path / "a.ply")], check=True)


def test_what_needs_it_says_how_to_get_it(monkeypatch):
    with_open3d.open3d.cache_clear()
    monkeypatch.setattr(with_open3d, "has_open3d", lambda: False)
    with pytest.raises(ToolMissingError, match=r"factorlab\[cloud\]"):
        with_open3d.open3d()


def test_a_library_that_the_system_lacks_is_named(monkeypatch):
    with_open3d.open3d.cache_clear()
    monkeypatch.setattr(with_open3d, "has_open3d", lambda: True)
    monkeypatch.setitem(sys.modules, "open3d", None)  # what an import of it then raises
    with pytest.raises(ToolMissingError, match="it needs libEGL, libGL"):
        with_open3d.open3d()


def test_libusb_is_taken_from_pypi_where_the_system_has_none(monkeypatch):
    asked = []

    def load(name, mode):
        asked.append(name)
        if name == "libusb-1.0.so.0":
            raise OSError(name)

    monkeypatch.setattr(with_open3d.ctypes, "CDLL", load)
    with_open3d._libusb()
    assert len(asked) == 2
    assert "libusb" in asked[1]
    assert np.char.endswith(asked[1], ".so") or ".so." in asked[1]
