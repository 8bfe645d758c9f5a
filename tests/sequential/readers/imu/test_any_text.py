"""Whatever is in a file: a recording comes out, or one of our own errors, and nothing else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from imu_tables import rows

from sequential.errors import FactorlabError
from sequential.readers import read_imu
from sequential.sensors import ImuRecording, simulate_imu, tumble
from sequential.sensors.health import inspect

SOUND = simulate_imu(tumble(3.0, np.random.default_rng(1)), np.random.default_rng(2), rate=50.0).recording
LINES = ["t,ax,ay,az,gx,gy,gz", *rows(SOUND)]
CELLS = st.sampled_from(
    ["", "nan", "inf", "-1", "1e400", "abc", "1;2", "1,5", '"', "#", "\t", "2026-01-01", "é", "ax [g]"]
)
ENDINGS = st.sampled_from([".csv", ".csv", ".csv", ".txt", ".npz", ".mat", ".zip", ".ulg", ".json", ".hdf5"])


@st.composite
def spoilt(draw):
    """A sound table in which some cells were exchanged, rows doubled or lost, columns cut out."""
    lines = LINES[: draw(st.integers(1, len(LINES)))]
    for _ in range(draw(st.integers(0, 4))):
        at = draw(st.integers(0, len(lines) - 1))
        cells = lines[at].split(",")
        k = draw(st.integers(0, len(cells) - 1))
        kind = draw(st.sampled_from(["cell", "double", "more", "column", "separator"]))
        if kind == "double":
            lines.insert(at, lines[draw(st.integers(0, len(lines) - 1))])
        elif kind == "column":
            lines = [",".join(c for j, c in enumerate(line.split(",")) if j != k) for line in lines]
        elif kind == "separator":
            lines = [line.replace(",", draw(st.sampled_from([";", " ", "\t"]))) for line in lines]
        else:
            cells[k : k + (kind == "cell")] = [draw(CELLS)]
            lines[at] = ",".join(cells)
    return "\n".join(lines).encode()


@given(content=spoilt() | st.binary(max_size=300), ending=ENDINGS, rate=st.sampled_from([None, 100.0]))
def test_nothing_but_a_recording_or_a_sentence(tmp_path_factory, content, ending, rate):
    path = tmp_path_factory.mktemp("any") / f"x{ending}"
    path.write_bytes(content)
    try:
        imu = read_imu(path, rate=rate)
    except FactorlabError:
        return
    assert isinstance(imu, ImuRecording)
    assert (np.diff(imu.t) > 0).all()
    assert all(str(finding) for finding in inspect(imu))


def test_the_table_is_sound_to_begin_with(tmp_path):
    (tmp_path / "x.csv").write_text("\n".join(LINES))
    assert read_imu(tmp_path / "x.csv").accel == pytest.approx(SOUND.accel, abs=1e-6)
