import numpy as np
import pytest

from sequential.errors import DataError, FileFormatError
from sequential.readers.range_table import read_range_table


def written(tmp_path, text):
    path = tmp_path / "table.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "units"),
    [
        ("distance_cm,voltage_V\n10,2.8\n20,1.5\n", ("cm", "V")),
        ("d (mm);u [mV]\n10;2,8\n20;1,5\n", ("mm", "mV")),
        ("when,reading,Distance\n1,2.8,10\n2,1.5,20\n", ("", "")),
        ("10,2.8\n20,1.5\n", ("", "")),
        ("distance\tadc\n10\t2.8\n\t\n20\t1.5\n", ("", "")),
    ],
)
def test_columns_are_found(tmp_path, text, units):
    table = read_range_table(written(tmp_path, text))
    np.testing.assert_array_equal(table.distances, [10, 20])
    np.testing.assert_array_equal(table.readings, [2.8, 1.5])
    assert (table.unit, table.reading_unit) == units


def test_columns_may_be_named(tmp_path):
    path = written(tmp_path, "d,near,far\n10,1,2\n20,3,4\n")
    assert read_range_table(path, reading="far").readings.tolist() == [2, 4]
    with pytest.raises(FileFormatError, match="no column 'high'"):
        read_range_table(path, distance="high")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("distance,voltage\n10,high\n20,1\n", "line 2, column 'voltage': 'high' is not a number"),
        ("distance,colour\n10,1\n", "no column is named for the reading"),
        ("1,2,3\n4,5,6\n", "no headings"),
        ("", "empty"),
    ],
)
def test_bad_tables_are_told(tmp_path, text, sentence):
    with pytest.raises(FileFormatError, match=sentence):
        read_range_table(written(tmp_path, text))


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(DataError, match="nowhere"):
        read_range_table(tmp_path / "nowhere.csv")
