"""One set of photographs for all tests of this folder."""

import pytest
from camera_photos import photographed


@pytest.fixture(scope="session")
def photos(tmp_path_factory):
    """Ten photographs of a 9x6 board by a known camera."""
    return photographed(tmp_path_factory.mktemp("photos"), 10)
