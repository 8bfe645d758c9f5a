"""Files appear whole or not at all."""

import stat

import pytest

from sequential.errors import DataError
from sequential.readers import replacing


def fail_half_way(path):
    with replacing(path) as file:
        file.write("half")
        msg = "the disk is full"
        raise RuntimeError(msg)


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "result.txt"
    path.write_text("old")
    with pytest.raises(RuntimeError, match="the disk is full"):
        fail_half_way(path)
    assert [p.name for p in tmp_path.iterdir()] == ["result.txt"]
    assert path.read_text() == "old"


def test_a_file_is_as_readable_as_any_other(tmp_path):
    with replacing(tmp_path / "new.bin", "wb") as file:
        file.write(b"\x00\xff")
    plain = tmp_path / "plain"
    plain.write_bytes(b"")
    assert (tmp_path / "new.bin").read_bytes() == b"\x00\xff"
    assert stat.S_IMODE((tmp_path / "new.bin").stat().st_mode) == stat.S_IMODE(plain.stat().st_mode)


def test_a_missing_folder_is_named(tmp_path):
    with (
        pytest.raises(DataError, match=r"there is no folder .*out; create it first"),
        replacing(tmp_path / "out" / "x"),
    ):
        pass
