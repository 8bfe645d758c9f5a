"""The line task: the truth of a rendered line, its uncertainty, and an answer where there is none."""

import cv2
import numpy as np
import pytest

from factorlab.live.camera.tasks.line import LineTask, spread
from sequential.errors import DataError
from vision3d.frames import Frame

SIZE = (320, 240)


def view(offset_px, heading_rad, rng, *, line=40, ground=190):
    """A straight line seen from above, whose middle in the lowest row is `offset_px` from the image's."""
    x = 159.5 + offset_px
    rows = np.arange(SIZE[1])[:, None]
    middle = x + np.tan(heading_rad) * (SIZE[1] - 1 - rows)
    share = np.clip(0.5 + 14 - np.abs(np.arange(SIZE[0])[None] - middle), 0, 1)
    image = ground + (line - ground) * share + rng.normal(0, 3, (SIZE[1], SIZE[0]))
    return Frame(0, 0, cv2.cvtColor(np.clip(image, 0, 255).astype(np.uint8), cv2.COLOR_GRAY2BGR), "")


@pytest.mark.parametrize("offset_px", [-70.0, 0.0, 40.0])
@pytest.mark.parametrize("heading_deg", [-15.0, 0.0, 20.0])
def test_offset_and_heading_are_the_true_ones(offset_px, heading_deg, rng):
    task = LineTask()
    reading = task.read(view(offset_px, np.radians(heading_deg), rng))
    row = reading.rows[0]
    assert row["found"] == 1
    assert row["offset"] == pytest.approx(offset_px / 160, abs=0.01)
    assert row["heading_deg"] == pytest.approx(heading_deg, abs=1.0)
    assert reading.state in {"good", "warn"}
    assert task.summary() == {"frames": 1, "found": 1}


def test_the_headline_says_where_it_is_and_where_it_leads(rng):
    task = LineTask()
    assert task.read(view(-64, 0.0, rng)).headline == "line 40 % left, straight on"
    assert task.read(view(0, 0.3, rng)).headline == "line in the middle, bears right"
    assert task.read(view(48, -0.3, rng)).headline == "line 30 % right, bears left"


def test_the_spread_is_that_of_many_frames(rng):
    """σ of offset and heading against the scatter of the same scene under new noise."""
    from vision3d.lines import find_line

    found = [find_line(view(20, 0.1, rng).grey) for _ in range(60)]
    stated = np.median([spread(one, SIZE[0]) for one in found], axis=0)
    scatter = np.std([[one.offset, one.heading_rad] for one in found], axis=0)
    assert (stated / scatter > 0.4).all()
    assert (stated / scatter < 4.0).all()


def test_a_scene_without_a_line_says_why(rng):
    frame = Frame(0, 0, rng.normal(128, 3, (240, 320, 3)).astype(np.uint8), "")
    reading = LineTask().read(frame)
    assert (reading.headline, reading.state) == ("no line", "idle")
    assert reading.notes[0]
    assert reading.rows[0]["found"] == 0
    assert reading.to_json()["traces"] == {"offset, %": None, "to the right, °": None}


def test_what_is_looked_for_is_changed_by_a_button(rng):
    task = LineTask()
    dark = view(0, 0.0, rng)
    assert [name for name, _ in task.actions] == ["dark", "light"]
    task.act("light")
    assert task.read(dark).headline == "no line"
    task.act("dark")
    assert task.read(dark).headline.startswith("line in the middle")
    with pytest.raises(DataError, match="a line is auto, dark, light; got 'blue'"):
        task.act("blue")


def test_metres_on_the_ground_are_the_true_ones(rng):
    """A straight line 6 cm to the left, seen from a camera that hangs 20 cm above the ground."""
    from vision3d.camera import Camera
    from vision3d.lines import CameraMount, GroundHomography
    from vision3d.render.ground import GroundLine, render_ground

    camera = Camera("pinhole", [300.0, 300.0, 159.5, 119.5], [], SIZE)
    mount = CameraMount(height_m=0.2, pitch_rad=0.7)
    stripe = GroundLine(np.array([[-1.0, 0.06], [3.0, 0.06]]), width_m=0.04)
    image = render_ground(camera, mount, stripe, np.zeros(3), rng=rng)
    task = LineTask(ground=lambda: GroundHomography.from_camera(camera, mount))
    reading = task.read(Frame(0, 0, cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), ""))
    row = reading.rows[0]
    assert row["left_m"] == pytest.approx(0.06, abs=max(5 * row["left_sigma_m"], 1e-3))
    assert row["ground_heading_deg"] == pytest.approx(0.0, abs=1.0)
    assert [one.name for one in reading.numbers][:2] == ["line on the left by", "leading left by"]
