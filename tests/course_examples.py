"""Little examples of a course of one's own, for tests of what runs and gathers them."""

import json
from pathlib import Path

PART = """
import json, sys
from pathlib import Path
out = Path(sys.argv[sys.argv.index("-o") + 1])
def claim(item, quantity, value, unit="", low=None, high=None, source="simulé"):
    row = dict(item=item, quantity=quantity, value=value, unit=unit, low=low, high=high, source=source)
    with (out / (Path(sys.argv[0]).stem + ".jsonl")).open("a") as file:
        file.write(json.dumps(row) + "\\n")
    assert low is None or value >= low, quantity
    assert high is None or value <= high, quantity
"""


def example(folder, name, *lines):
    """Write one example; `claim` and `out` are there."""
    path = Path(folder) / name
    path.write_text('"""Un exemple."""' + PART + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def picture(name, size=(900, 500)):
    """A line that draws a noisy picture with a thin blue line."""
    return f"""
from PIL import Image
import random
image = Image.frombytes("RGB", {size}, random.Random(0).randbytes({3 * size[0] * size[1]}))
image.paste((0, 114, 178), (0, 10, {size[0]}, 60))
image.save(out / {name!r})
"""


def claims_file(path, *rows):
    """A SCRIPT.jsonl of claims given as dictionaries."""
    path.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    return path
