"""PLY: what is written is read back, what others write is read, what is broken is told."""

import struct

import numpy as np
import pytest

from sequential.errors import DataError, FileFormatError, ShapeError
from vision3d.cloud import read_ply, write_ply
from vision3d.cloud.with_open3d import open3d

XYZ = b"property float x\nproperty float y\nproperty float z\n"
POINTS = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.5], [0.0, 1.0, 2.0], [1.0, 1.0, -0.25]])


def test_everything_written_is_read_back(tmp_path):
    colors = np.arange(12, dtype=np.uint8).reshape(4, 3)
    normals = np.tile([0.0, 0.0, -1.0], (4, 1))
    faces = np.array([[0, 1, 2], [1, 3, 2]])
    path = write_ply(
        tmp_path / "a.ply",
        POINTS,
        colors=colors,
        normals=normals,
        scalars={"std_m": np.arange(4.0)},
        faces=faces,
        comment="two lines\nof text",
    )
    back = read_ply(path)
    np.testing.assert_array_equal(back.points, POINTS)
    np.testing.assert_array_equal(back.colors, colors)
    np.testing.assert_array_equal(back.normals, normals)
    np.testing.assert_array_equal(back.scalars["std_m"], np.arange(4.0))
    np.testing.assert_array_equal(back.faces, faces)


def test_open3d_reads_what_is_written_and_the_other_way_round(tmp_path, rng):
    o3d = open3d()
    colors = rng.integers(0, 256, (50, 3), dtype=np.uint8)
    points = rng.standard_normal((50, 3)).astype(np.float32).astype(float)
    theirs = o3d.io.read_point_cloud(str(write_ply(tmp_path / "a.ply", points, colors=colors)))
    np.testing.assert_array_equal(np.asarray(theirs.points), points)
    np.testing.assert_allclose(np.asarray(theirs.colors) * 255.0, colors, atol=1e-9)
    for ascii_ in (False, True):
        o3d.io.write_point_cloud(str(tmp_path / "b.ply"), theirs, write_ascii=ascii_)
        back = read_ply(tmp_path / "b.ply")
        np.testing.assert_allclose(back.points, points, atol=1e-5 if ascii_ else 0.0)
        np.testing.assert_array_equal(back.colors, colors)


def test_no_points_are_written_and_read(tmp_path):
    assert read_ply(write_ply(tmp_path / "none.ply", np.empty((0, 3)))).points.shape == (0, 3)


def test_text_with_polygons_and_unit_colours_is_read(tmp_path):
    text = (
        "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 4\nproperty double x\nproperty double y\n"
        "property double z\nproperty float red\nproperty float green\nproperty float blue\n"
        "element face 2\nproperty list uchar int vertex_index\nend_header\n"
        "0 0 0 1 0 0\n1 0 0 0 1 0\n1 1 0 0 0 1\n0 1 0 1 1 1\n4 0 1 2 3\n3 0 1 2\n"
    )
    (tmp_path / "a.ply").write_text(text)
    cloud = read_ply(tmp_path / "a.ply")
    np.testing.assert_array_equal(cloud.colors[:2], [[255, 0, 0], [0, 255, 0]])
    np.testing.assert_array_equal(cloud.faces, [[0, 1, 2], [0, 2, 3], [0, 1, 2]])


def test_big_endian_with_uneven_polygons_is_read(tmp_path):
    header = (
        b"ply\nformat binary_big_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        b"property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
    )
    body = b"".join(struct.pack(">3f", *p) for p in POINTS)
    body += struct.pack(">B4i", 4, 0, 1, 3, 2) + struct.pack(">B3i", 3, 1, 3, 2)
    (tmp_path / "a.ply").write_bytes(header + body)
    cloud = read_ply(tmp_path / "a.ply")
    np.testing.assert_array_equal(cloud.points, POINTS)
    np.testing.assert_array_equal(cloud.faces, [[0, 1, 3], [0, 3, 2], [1, 3, 2]])


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "no PLY file"),
        (b"OFF\n3 1 0\n", "no PLY file"),
        (b"ply\nformat ascii 1.0\nelement vertex many\nend_header\n", "is not understood"),
        (b"ply\nformat middle_endian 1.0\nelement vertex 0\nend_header\n", "is not known"),
        (b"ply\nformat ascii 1.0\nelement face 0\nend_header\n", "holds no points"),
        (b"ply\nformat ascii 1.0\nelement vertex 2\n" + XYZ + b"end_header\n0 0 0\n1 0\n", "vertex 2 of 2"),
        (b"ply\nformat binary_little_endian 1.0\nelement vertex 9\n" + XYZ + b"end_header\n0000", "cut off"),
    ],
)
def test_a_broken_file_is_told(tmp_path, content, said):
    (tmp_path / "a.ply").write_bytes(content)
    with pytest.raises(FileFormatError, match=said):
        read_ply(tmp_path / "a.ply")


def test_what_cannot_be_a_cloud_is_told(tmp_path):
    with pytest.raises(DataError, match="no such file"):
        read_ply(tmp_path / "nowhere.ply")
    with pytest.raises(ShapeError, match=r"expected \(N, 3\)"):
        write_ply(tmp_path / "a.ply", np.zeros((4, 2)))
    with pytest.raises(DataError, match="1 of 4 are not finite, the first is number 2"):
        write_ply(tmp_path / "a.ply", np.where(np.arange(4)[:, None] == 2, np.nan, POINTS))
    with pytest.raises(ShapeError, match="to go with the points"):
        write_ply(tmp_path / "a.ply", POINTS, colors=np.zeros((3, 3)))
    with pytest.raises(DataError, match="they name points 0 to 4"):
        write_ply(tmp_path / "a.ply", POINTS, faces=[[0, 1, 4]])
    with pytest.raises(DataError, match="cannot name a column"):
        write_ply(tmp_path / "a.ply", POINTS, scalars={"x": np.zeros(4)})
    assert not list(tmp_path.iterdir())
