"""COLMAP's library lives beside others: it is imported late, quietly, and takes no signal for itself."""

import subprocess
import sys

PROGRAM = """
import os, signal, sys
from vision3d.sfm import Reconstruction, SfmSettings, reconstruct
assert "pycolmap" not in sys.modules, "importing the room loads no library"
from vision3d.sfm.library import colmap
colmap()
import zlib
assert len(zlib.decompress(zlib.compress(bytes(100_000)))) == 100_000
os.kill(os.getpid(), signal.SIGTERM)
"""


def test_it_is_quiet_and_leaves_signals_alone():
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=False)
    assert done.returncode == -15
    assert done.stdout + done.stderr == ""
