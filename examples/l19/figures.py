"""How the course's figures look, and where they go: drawn with Agg, saved beside `-o`, never shown.

Numbers are shown as French writes them, with a decimal comma: `save` sees to a figure's, `say` to a
sentence's.

Not an example: the scripts of this folder import it.
"""

import argparse
import re
import sys
from pathlib import Path

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import Formatter

# Okabe and Ito's colours, which colour-blind readers can tell apart
TRUTH = {"color": "black", "linewidth": 1.6, "linestyle": "--", "zorder": 4}
READINGS = {"color": "#9a9a9a", "linestyle": "none", "marker": ".", "markersize": 4, "zorder": 1}
BLUE, ORANGE, GREEN, PINK, SKY, GOLD = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#B07C00"

STYLE = {
    "font.size": 9.5,
    "axes.titlesize": 10.5,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "lines.linewidth": 1.5,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
}


def panels(rows=1, columns=1, *, size=(8.0, 4.0), title="", **grid):
    """A figure and its axes in one flat list."""
    mpl.rcParams.update(STYLE)
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    if title:
        figure.suptitle(title, fontsize=12)
    return figure, list(figure.subplots(rows, columns, squeeze=False, **grid).ravel())


class CommaFormatter(Formatter):
    """Tick labels of another formatter, with a decimal comma."""

    def __init__(self, plain):
        self.plain = plain

    def __call__(self, x, pos=None):
        """The label of the tick at x."""
        return french(self.plain(x, pos))

    def format_ticks(self, values):
        """The labels of all ticks."""
        return [french(label) for label in self.plain.format_ticks(values)]

    def get_offset(self):
        """What is written at the axis's end."""
        return french(self.plain.get_offset())


def french(text):
    """The text with a decimal comma in each of its numbers."""
    return re.sub(r"(?<=\d)\.(?=\d)", ",", text)


def say(text):
    """Print a sentence, its numbers as French writes them."""
    print(french(text))


def out_folder():
    """The folder that `-o` names, build/l19 unless given; made when it is missing."""
    parser = argparse.ArgumentParser(description=sys.modules["__main__"].__doc__)
    parser.add_argument("-o", "--out", type=Path, default=Path("build/l19"), help="dossier des figures")
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def files_given():
    """The student's own files: what the command line names besides options, taken out of it."""
    found, rest, words = [], [], iter(sys.argv[1:])
    for word in words:
        if word.startswith("-"):
            rest += [word, next(words)] if word in {"-o", "--out"} else [word]
        else:
            found.append(word)
    for name in found:
        if not Path(name).is_file():
            sys.exit(f"{name} : pas de fichier de ce nom dans {Path.cwd()}")
    sys.argv[1:] = rest
    return found


def script_name():
    """The name of the script that runs, without .py: figures and claims are filed under it."""
    return Path(sys.modules["__main__"].__file__).stem


def save(figure, part=""):
    """Write the figure as SCRIPT.png, or SCRIPT_PART.png, into the folder that `-o` names."""
    path = out_folder() / f"{script_name()}{'_' if part else ''}{part}.png"
    _in_french(figure)
    figure.savefig(path, dpi=110)
    print(f"figure : {path}")


def _in_french(figure):
    """A decimal comma in all that the figure says: its words and its tick labels."""
    for text in figure.findobj(Text):
        text.set_text(french(text.get_text()))
    for axes in figure.axes:
        for axis in filter(None, (axes.xaxis, axes.yaxis, getattr(axes, "zaxis", None))):
            for ticks in (axis.major, axis.minor):
                plain = ticks.formatter
                if not isinstance(plain, CommaFormatter):
                    ticks.formatter = CommaFormatter(plain)
