"""What `pip install` does with the C core: compile it for Python, and put the sources into the package.

Named in pyproject.toml.  Without a compiler the package installs all the same; what needs the core says so.
"""

import importlib.util
import shutil
from pathlib import Path

from setuptools.command.build_ext import build_ext
from setuptools.command.build_py import build_py
from setuptools.errors import CompileError

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = Path("sequential", "firmware")


class CompileCore(build_ext):
    """The shared object, by the same command as `python -m sequential.firmware`."""

    def build_extension(self, ext):
        """Compile every C file of core and binding; an optional extension that fails is left out."""
        spec = importlib.util.spec_from_file_location("build", ROOT / PACKAGE / "build.py")
        build = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(build)
        try:
            build.compile_core(ROOT / "firmware", Path(self.get_ext_fullpath(ext.name)))
        except (RuntimeError, OSError) as error:
            raise CompileError(str(error)) from error


class CopySources(build_py):
    """The Python packages, and in a wheel the folder `firmware` beside them, so that images can be built."""

    def run(self):
        """Copy; an editable installation reads the checkout itself."""
        super().run()
        if not self.editable_mode:
            target = Path(self.build_lib) / PACKAGE / "sources"
            skipped = shutil.ignore_patterns("__pycache__", "*.o", "*.elf", "*.so", "build", "*.py")
            shutil.copytree(ROOT / "firmware", target, dirs_exist_ok=True, ignore=skipped)
