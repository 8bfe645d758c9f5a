"""The pictures of the documentation: figures out of the reports that the project's own commands write.

`make docs` runs it; with names behind, only those pictures are made. A picture whose recording is not at hand
(`FACTORLAB_DATA`) stays as it is. Chromium draws the figures, and 64 colours keep them small.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "pictures"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
COLOURS = 64
PAGE = "<!doctype html><meta charset=utf-8><style>body{{margin:0}} svg{{display:block;width:100%}}</style>{}"
DATA = "FACTORLAB_DATA"
DRAWING = re.compile(r'<svg[^>]*aria-label="([^"]*)".*?</svg>', re.DOTALL)


@dataclass(frozen=True)
class Picture:
    """One picture: the command whose report holds it, and the heading of the figure there."""

    name: str
    command: str
    heading: str
    width: int = 1100


KITTI = "compare kitti --estimators ekf,ekf_rts,batch"
PHOTOS = f"${DATA}/vision/opencv"
ARUCO = f"${DATA}/vision/aruco"
MARKERS = f"markers {ARUCO}/singlemarkersoriginal.jpg --camera {ARUCO}/tutorial_camera_params.yml --size 50mm"
PICTURES = (
    Picture("compare_error", KITTI, "Error over time"),
    Picture("compare_trajectory", KITTI, "Trajectory"),
    Picture("compare_waiting", KITTI, "What waiting is worth"),
    Picture("allan", f"characterize ${DATA}/imu/mpu6050/example_data_tinit_calc.csv", "Allan"),
    Picture("attitude", "attitude broad:07 --compare error-state,mahony,madgwick", "Against the truth"),
    Picture("calibrate_imu", f"calibrate imu ${DATA}/imu/mpu6050/example_data_calibration.csv", "Dwells"),
    Picture("calibrate_mag", f"calibrate mag ${DATA}/imu/qmc5883l", "Ellipsoid and sphere"),
    Picture("calibrate_camera", f"calibrate camera {PHOTOS}/left*.jpg --board 9x6 --square 25mm", "How sure"),
    Picture("markers", MARKERS, "The picture", width=640),
    Picture("match", f"match {PHOTOS}/box.png {PHOTOS}/box_in_scene.png", "Matches", width=800),
    Picture("depth", "stereo depth --demo", "Depth"),
    Picture("sfm", f"sfm ${DATA}/vision/balbianello", "Cameras and points"),
    Picture("slam", "compare victoria_park --estimators ekf_slam,batch", "Map"),
    Picture("pose_graph", "compare intel", "Map"),
)


def main():
    """Make the pictures, or those that are named."""
    known = {picture.name for picture in PICTURES}
    wanted = set(sys.argv[1:]) or known
    if unknown := wanted - known:
        raise SystemExit(f"no picture is called {', '.join(unknown)}; there are {', '.join(sorted(known))}")
    reports = {}
    for picture in PICTURES:
        if picture.name not in wanted:
            continue
        if DATA not in os.environ and (f"${DATA}" in picture.command or "broad" in picture.command):
            print(f"{picture.name}: left as it is, since {DATA} is not set")
            continue
        if picture.command not in reports:
            reports[picture.command] = report_of(picture.command)
        target = FOLDER / f"{picture.name}.png"
        draw(figure_in(reports[picture.command], picture), target, picture.width)
        print(f"{target.relative_to(ROOT)}  {target.stat().st_size / 1000:.0f} kB")


def report_of(command):
    """What a command's report holds."""
    words = [word for part in command.split() for word in expanded(part)]
    with tempfile.TemporaryDirectory() as folder:
        run = [sys.executable, "-m", "factorlab", *words, "-o", f"{folder}/out"]
        subprocess.run(run, cwd=ROOT, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        return Path(folder, "out", "report.html").read_text(encoding="utf-8")


def expanded(word):
    """A word of a command line as a shell would give it."""
    word = os.path.expandvars(word)
    return sorted(map(str, Path("/").glob(word.lstrip("/")))) if "*" in word else [word]


def figure_in(report, picture):
    """The drawing whose label begins with a heading."""
    drawings = {found[1]: found[0] for found in DRAWING.finditer(report)}
    for label, drawing in drawings.items():
        if label.startswith(picture.heading):
            return drawing
    raise SystemExit(f"`factorlab {picture.command}` draws no {picture.heading!r}, but {list(drawings)}")


def draw(figure, target, width):
    """Let a browser draw it, and keep it small."""
    browser = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if browser is None:
        raise SystemExit("the pictures are drawn by a browser: install Debian's chromium")
    box = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', figure)
    height = round(width * float(box[2]) / float(box[1]))
    with tempfile.TemporaryDirectory() as folder:
        page, shot = Path(folder, "page.html"), Path(folder, "shot.png")
        page.write_text(PAGE.format(figure), encoding="utf-8")
        quiet = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
            f"--user-data-dir={folder}",
        ]
        size = [f"--window-size={width},{height}", f"--screenshot={shot}"]
        subprocess.run([browser, *quiet, *size, page.as_uri()], check=True, capture_output=True)
        drawn = Image.open(shot).convert("RGB").crop((0, 0, width, height))
    drawn.quantize(COLOURS, dither=Image.Dither.NONE).save(target, optimize=True)


if __name__ == "__main__":
    main()
