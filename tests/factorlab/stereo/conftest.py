"""One set of pairs, and one calibration from it, for all tests of this folder."""

import pytest
from stereo_photos import OPTIONS, answer, calibrate, photographed_pairs


@pytest.fixture(scope="session")
def pairs(tmp_path_factory):
    """Ten pairs of photographs of a 9x6 board by a known rig."""
    return photographed_pairs(tmp_path_factory.mktemp("pairs"), 10)


@pytest.fixture(scope="session")
def calibrated(pairs, tmp_path_factory):
    """The calibration's document, and the folder that it was written to."""
    out = tmp_path_factory.mktemp("calibrated") / "out"
    return answer(calibrate(*pairs.patterns, *OPTIONS, "--lens", "brown5", "--json", "-o", out)), out
