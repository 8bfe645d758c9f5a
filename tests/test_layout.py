"""The house rules that a machine can check: names, sizes, docstrings, imports, and what importing costs."""

import importlib
import inspect
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("sequential", "vision3d", "factorlab")
DRAWERS = {"util", "utils", "helper", "helpers", "common", "misc"}
LINES_MAX = 300
HEAVY = {"numba", "gtsam", "matplotlib", "cv2", "pycolmap", "open3d"}

SOURCES = sorted(
    path.relative_to(ROOT)
    for folder in (*PACKAGES, "firmware", "examples", "tests")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in {".py", ".c", ".h"}
)
ROOMS = sorted(
    ".".join(path.parent.parts)
    for path in SOURCES
    if path.name == "__init__.py" and path.parts[0] in PACKAGES
)


def test_no_drawers():
    drawers = [str(path) for path in SOURCES if DRAWERS & {part.split(".")[0] for part in path.parts}]
    assert not drawers, "name the room for what is in it"


def test_files_hold_one_idea():
    lengths = {str(path): len((ROOT / path).read_text(encoding="utf-8").splitlines()) for path in SOURCES}
    assert not {path: n for path, n in lengths.items() if n > LINES_MAX}


@pytest.mark.parametrize("room", ROOMS)
def test_public_names_are_documented(room):
    module = importlib.import_module(room)
    names = getattr(module, "__all__", ())
    assert not [name for name in names if not _is_documented(getattr(module, name))]


def _is_documented(thing):
    if not (inspect.isclass(thing) or inspect.isroutine(thing)):
        return True
    text = vars(thing).get("__doc__") if inspect.isclass(thing) else inspect.getdoc(thing)
    # a dataclass without a docstring gets its own signature as one
    return bool(text) and not text.startswith(f"{thing.__name__}(")


def test_imports_go_one_way():
    tool = Path(sys.executable).with_name("lint-imports")
    done = subprocess.run([tool, "--no-cache"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("package", [name for name in PACKAGES if (ROOT / name).is_dir()])
def test_importing_a_package_is_light(package):
    assert not HEAVY & _modules_after(f"import {package}")


def test_help_is_light():
    assert not HEAVY & _modules_after(
        """
        import contextlib, io, runpy
        sys.argv = ["factorlab", "--help"]
        with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()):
            runpy.run_module("factorlab", run_name="__main__")
        """
    )


def _modules_after(code):
    """Names of the top-level modules that a fresh interpreter holds after running the code."""
    script = f"import json, sys\n{inspect.cleandoc(code)}\nprint(json.dumps(sorted(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return {name.split(".")[0] for name in json.loads(done.stdout)}


def test_readme_shows_the_quickstart():
    blocks = re.findall(
        r"^```python\n(.*?)^```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )
    assert blocks, "README.md shows examples/quickstart.py in a ```python block"
    assert blocks[0] == (ROOT / "examples" / "quickstart.py").read_text(encoding="utf-8")
