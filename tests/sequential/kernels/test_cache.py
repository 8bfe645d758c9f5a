"""Compiled code is kept, and thrown away when a source that went into it has changed."""

import re
from pathlib import Path

from sequential import kernels

FOLDER = Path(kernels.__file__).parent


def test_every_kernel_that_others_inline_is_part_of_the_digest():
    imported = set()
    for path in FOLDER.glob("*.py"):
        imported |= set(
            re.findall(r"^from sequential\.kernels\.(\w+) import", path.read_text(), re.MULTILINE)
        )
    assert {f"kernels/{name}.py" for name in imported} <= set(kernels.INLINED)
    assert all((FOLDER.parent / name).exists() for name in kernels.INLINED)


def test_the_folder_can_be_chosen(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "mine"))
    assert kernels.cache_folder() == tmp_path / "mine"
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert kernels.cache_folder().parent == tmp_path / "factorlab"


def test_a_changed_source_gets_another_folder(monkeypatch, tmp_path):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    before = kernels.cache_folder()
    monkeypatch.setattr(kernels, "INLINED", kernels.INLINED[1:])
    assert kernels.cache_folder() != before
