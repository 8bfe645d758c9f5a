"""The pictures of the course's five traps, for the page of questions: what examples/l19/2N_… draw.

`make docs` runs it. The figures are those of the examples on simulated and rendered data, which anybody can
make again; smaller, in few colours.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples" / "l19").glob("2?_p?_*.py"))
WIDTH, COLOURS = 1000, 256


def main():
    """Run the five examples and keep their figures."""
    own = {name: value for name, value in os.environ.items() if name != "FACTORLAB_DATA"}
    for example in EXAMPLES:
        target = ROOT / "docs" / "pictures" / f"trap_{example.stem.split('_')[1]}.png"
        with tempfile.TemporaryDirectory() as folder:
            run = [sys.executable, example, "-o", folder]
            subprocess.run(run, cwd=ROOT, env=own, check=True, stdout=subprocess.DEVNULL)
            drawn = Image.open(Path(folder, f"{example.stem}.png")).convert("RGB")
        small = drawn.resize((WIDTH, round(WIDTH * drawn.height / drawn.width)), Image.Resampling.LANCZOS)
        few = small.quantize(COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
        few.save(target, optimize=True)
        print(f"{target.relative_to(ROOT)}  {target.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
