"""The C core is compiled for Python where it can be; where it cannot, one sentence says what is missing."""

import ctypes
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sequential.errors import ToolMissingError
from sequential.firmware import build, library

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A small firmware folder, and a place for the shared object."""
    folder = tmp_path / "firmware"
    for part in build.PARTS:
        (folder / part).mkdir(parents=True)
    (folder / "core" / "answer.h").write_text("int answer(void);\n")
    (folder / "binding" / "answer.c").write_text('#include "answer.h"\nint answer(void) { return 42; }\n')
    made = tmp_path / "package" / "_core.so"
    for room in (library, build):
        monkeypatch.setattr(room, "source_folder", lambda: folder)
        monkeypatch.setattr(room, "library_path", lambda: made)
    library.loaded.cache_clear()
    yield folder, made
    library.loaded.cache_clear()


def test_a_checkout_compiles_itself(checkout, c_compiler):
    _, made = checkout
    assert library.load_library().answer() == 42
    assert made.exists()
    assert not library.missing()
    assert [path.name for path in made.parent.iterdir()] == [made.name], "no scratch is left"


def test_what_changed_is_compiled_anew(checkout, c_compiler):
    folder, made = checkout
    library.load_library()
    before = made.stat().st_mtime_ns
    library.loaded.cache_clear()
    library.load_library()
    assert made.stat().st_mtime_ns == before, "nothing changed"
    header = folder / "core" / "answer.h"
    header.write_text("#define CHANGED 1\nint answer(void);\n")
    os.utime(header, ns=(before + 10**9, before + 10**9))
    library.loaded.cache_clear()
    library.load_library()
    assert made.stat().st_mtime_ns != before


def test_no_compiler_is_said_in_one_sentence(checkout, monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.delenv("CC", raising=False)
    with pytest.raises(ToolMissingError, match=r"apt install gcc.*python -m sequential\.firmware`"):
        library.load_library()
    assert "\n" not in library.missing()


def test_an_error_of_the_compiler_is_quoted(checkout, c_compiler):
    folder, _ = checkout
    (folder / "binding" / "answer.c").write_text("int answer(void) { return missing_name; }\n")
    with pytest.raises(ToolMissingError, match="missing_name"):
        library.load_library()


def test_without_sources_the_way_out_is_named(checkout, monkeypatch):
    monkeypatch.setattr(library, "source_folder", lambda: None)
    with pytest.raises(ToolMissingError, match="install factorlab from its repository"):
        library.load_library()


def test_what_does_not_load_is_said(checkout):
    _, made = checkout
    made.parent.mkdir()
    made.write_bytes(b"not a library")
    os.utime(made, ns=(2**62, 2**62))
    with pytest.raises(ToolMissingError, match="does not load"):
        library.load_library()


def test_the_real_core_is_whole(tmp_path, c_compiler):
    """Every symbol of every file is there, so that loading never stops half way."""
    made = build.compile_core(build.source_folder(), tmp_path / "whole.so")
    ctypes.CDLL(str(made), mode=os.RTLD_NOW)


def test_the_command_says_where(checkout, c_compiler, capsys):
    _, made = checkout
    assert build.main() == 0
    assert capsys.readouterr().out.strip() == str(made)


def test_the_build_file_runs_alone():
    """The installation executes it without the package's dependencies."""
    script = f"import runpy; print(runpy.run_path({str(Path(build.__file__))!r})['source_folder']())"
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", script], capture_output=True, text=True, check=True
    )
    assert Path(done.stdout.strip()) == ROOT / "firmware"
