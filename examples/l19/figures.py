"""How the course's figures look, and where they go: drawn with Agg, saved beside `-o`, never shown.

Not an example: the scripts of this folder import it.
"""

import argparse
import sys
from pathlib import Path

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

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


def out_folder():
    """The folder that `-o` names, build/l19 unless given; made when it is missing."""
    parser = argparse.ArgumentParser(description=sys.modules["__main__"].__doc__)
    parser.add_argument("-o", "--out", type=Path, default=Path("build/l19"), help="dossier des figures")
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def script_name():
    """The name of the script that runs, without .py: figures and claims are filed under it."""
    return Path(sys.modules["__main__"].__file__).stem


def save(figure, part=""):
    """Write the figure as SCRIPT.png, or SCRIPT_PART.png, into the folder that `-o` names."""
    path = out_folder() / f"{script_name()}{'_' if part else ''}{part}.png"
    figure.savefig(path, dpi=110)
    print(f"figure : {path}")
