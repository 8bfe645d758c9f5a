import pytest

from sequential.errors import FileFormatError
from sequential.readers import read_imu
from sequential.readers.imu.sections import read_labels, read_section_list


def test_labels_are_numbered_as_the_recording_is(tmp_path):
    """Sample numbers out of order: the reader sorts them, and so do the labels."""
    path = tmp_path / "parts.csv"
    rows = [("b", 3), ("b", 4), ("a", 1), ("a", 2), ("", 5)]
    path.write_text(
        "part,samples,ax,ay,az\n" + "".join(f"{part},{k},{k}.5,0,9.8\n" for part, k in rows),
        encoding="utf-8",
    )
    labels = read_labels(path)
    assert {name: rows.tolist() for name, rows in labels.items()} == {"a": [0, 1], "b": [2, 3]}
    recording = read_imu(path, rate=10.0, units="accel=m/s^2")
    assert recording.accel[labels["b"], 0].tolist() == [3.5, 4.5]


def test_a_file_without_labels_has_none(tmp_path):
    path = tmp_path / "plain.csv"
    path.write_text("t,ax,ay,az\n0,1,2,3\n1,1,2,3\n", encoding="utf-8")
    assert read_labels(path) == {}


def test_a_list_of_sections(tmp_path):
    path = tmp_path / "sections.json"
    path.write_text('{"x_p": {"start": 5, "end": 9}, "x_a": [10, 20]}', encoding="utf-8")
    assert read_section_list(path) == {"x_p": slice(5, 9), "x_a": slice(10, 20)}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("{", "not JSON"),
        ("[1, 2]", "sections by name"),
        ('{"x_p": {"start": 9, "end": 5}}', "x_p: expected the samples"),
        ('{"x_p": {"start": true, "end": 5}}', "x_p: expected"),
        ('{"x_p": "all"}', "got 'all'"),
    ],
)
def test_a_bad_list_is_told(tmp_path, text, sentence):
    path = tmp_path / "sections.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FileFormatError, match=sentence):
        read_section_list(path)
