"""Which pictures belong together."""

import pytest

from factorlab.stereo.pairing import pair_names, split_sides
from sequential.errors import DataError


@pytest.mark.parametrize(
    ("left", "right"),
    [
        (["left01.jpg", "left02.jpg"], ["right01.jpg", "right02.jpg"]),
        (["L1.png", "L2.png"], ["R1.png", "R2.png"]),
        (["img_0001_left.png", "img_0002_left.png"], ["img_0001_right.png", "img_0002_right.png"]),
        (["cam0_7.png", "cam0_8.png"], ["cam1_7.png", "cam1_8.png"]),
        (["gauche_a.png", "gauche_b.png"], ["droite_a.png", "droite_b.png"]),
        (["a.png", "b.png"], ["a.png", "b.png"]),
        (["1403636579763555584.png", "1403636579813555456.png"],) * 2,
    ],
)
def test_names_tell(left, right):
    found = pair_names(left, right)
    assert found.pairs == ((0, 0), (1, 1))
    assert found.how == "by name"


def test_numbers_tell_where_names_do_not():
    found = pair_names(["DSC1007.jpg", "DSC1008.jpg", "DSC1009.jpg"], ["IMG_1008.jpg", "IMG_1009.jpg"])
    assert found.how == "by number"
    assert found.pairs == ((1, 0), (2, 1))
    assert found.left_alone == (0,)


def test_equal_counts_are_paired_in_order():
    assert pair_names(["x.png", "y.png"], ["u.png", "v.png"]).how == "in order"
    assert pair_names(["im0.png"], ["im1.png"]).pairs == ((0, 0),)


def test_a_missing_picture_costs_its_partner_alone():
    found = pair_names(
        [f"left{k:02d}.jpg" for k in range(1, 6)], [f"right{k:02d}.jpg" for k in (1, 3, 4, 5, 9)]
    )
    assert found.pairs == ((0, 0), (2, 1), (3, 2), (4, 3))
    assert found.left_alone == (1,)
    assert found.right_alone == (4,)


def test_what_cannot_be_told_is_refused():
    with pytest.raises(DataError, match="3 left and 2 right pictures, and their names do not tell"):
        pair_names(["a.png", "b.png", "c.png"], ["x.png", "y.png"])


def test_patterns_that_the_shell_spelled_out_are_parted():
    sources = ["d/left01.jpg", "d/left02.jpg", "d/right01.jpg", "d/right02.jpg"]
    assert split_sides(sources) == (sources[:2], sources[2:])
    assert split_sides(["a*", "b*"]) == (["a*"], ["b*"])
    folders = ["run/left/1.png", "run/left/2.png", "run/right/1.png", "run/right/2.png"]
    assert split_sides(folders) == (folders[:2], folders[2:])
    with pytest.raises(DataError, match="put patterns in quotes"):
        split_sides(["1.png", "2.png", "3.png"])
