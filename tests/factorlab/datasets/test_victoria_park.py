"""Victoria Park: what the file holds, and that an incremental start leads where dead reckoning does not."""

import numpy as np
import pytest

from factorlab.datasets import load_slam
from factorlab.datasets.victoria_park import FILE, load_victoria_park
from factorlab.datasets.wheel import gtsam_data
from factorlab.graph.slam import BatchSlam
from sequential.errors import DataError
from sequential.slam.beginnings import placed
from sequential.slam.revisits import loop_errors


def test_the_file_is_what_the_literature_says():
    (park,) = load_slam("victoria_park")
    _, odometry, laser = park.problem.factors
    assert (len(odometry), len(laser)) == (6968, 3640)
    assert len(park.problem.indices("l")) == 151
    assert park.truth is None
    assert park.aligned == "none"


def test_sightings_are_turned_with_their_covariance():
    (park,) = load_victoria_park(steps=200)
    laser = park.problem.factors[2]
    line = next(
        line for line in (gtsam_data() / FILE).read_text().splitlines() if line.startswith("LANDMARK")
    )
    place = np.array([float(word) for word in line.split()[3:5]])
    distance, bearing = np.asarray(laser.z)[0]
    np.testing.assert_allclose(distance * np.array([np.cos(bearing), np.sin(bearing)]), place)
    np.testing.assert_allclose(laser.covs()[0], np.diag([0.4, 0.4 / distance**2]), atol=1e-15)


def test_an_incremental_start_leads_to_the_best_cost():
    (park,) = load_victoria_park(steps=2000)
    grown = BatchSlam(**park.graph_options, covariance=False).solve(park.problem)
    dead = loop_errors(park.problem, placed(park.problem))
    closed = loop_errors(park.problem, grown.values)
    assert grown.report.details["chi2"] == pytest.approx(2393.78465, rel=1e-6)
    assert closed.rms < 0.1 * dead.rms
    assert closed.rms < 0.7


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("ODOMETRY 1 2 x 0 0 1 0 0 1 0 1", "line 2: expected ODOMETRY"),
        ("LANDMARK 1 5 2 3 0.4 0", "line 2: expected ODOMETRY with 11 numbers or LANDMARK with 7"),
        ("TREE 1 5 2 3 0.4 0 0.4", "line 2"),
        ("ODOMETRY 1 2 nan 0 0 1 0 0 1 0 1", "line 2"),
        ("ODOMETRY 3 4 1 0 0 1 0 0 1 0 1", "a gap or a jump"),
        ("LANDMARK 7 5 2 3 0.4 0 0.4", "from pose 7, which no line"),
        ("", "no line of LANDMARK"),
    ],
)
def test_a_bad_line_is_named(tmp_path, line, said):
    good = "ODOMETRY 0 1 1 0 0 1 0 0 1 0 1\n"
    more = "" if "LANDMARK" in line or not line else "\nLANDMARK 1 5 2 3 0.4 0 0.4\n"
    (tmp_path / FILE).write_text(good + line + more)
    with pytest.raises(DataError, match=said):
        load_victoria_park(tmp_path)


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(DataError, match="gtsam wheel"):
        load_victoria_park(tmp_path)
