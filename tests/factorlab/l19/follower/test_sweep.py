"""Levels at which the line is kept, and their limit."""

import numpy as np
import pytest

from factorlab.l19.follower import FollowerSettings, Sweep, sweep
from sequential.errors import ModelError


def test_the_limit_is_the_last_level_before_the_first_that_fails():
    kept = np.array([[1.0, 1.0], [0.95, 0.5], [0.9, 1.0], [1.0, 1.0]])
    table = Sweep(np.array([0.0, 10, 20, 30]), np.array([0.0, 0.1]), kept, 0 * kept, 20, 500)
    assert table.noise_limit() == 10.0
    assert table.noise_limit(1) == 0.0
    assert table.blur_limit(1) == 0.0
    assert np.isnan(Sweep(table.noises, table.blurs, 0 * kept, kept, 20, 500).noise_limit())
    assert table.rows()[3] == {"noise": 10.0, "blur_s": 0.1, "kept": 0.5, "rms_m": 0.0}


def test_a_first_try_is_lost_where_bands_hold():
    own = {"bridging_s": 0.0}
    naive, bands = (
        sweep([10.0, 60.0], seeds=2, settings=FollowerSettings(detector=name, **own), steps=150)
        for name in ("threshold", "bands")
    )
    assert naive.noise_limit() == 10.0
    assert bands.noise_limit() == 60.0
    assert (bands.rms_m < 0.01).all()


@pytest.mark.parametrize(
    "wrong", [([], [0.0], 1), ([5.0, 5.0], [0.0], 1), ([0.0], [0.1, 0.0], 1), ([0.0], [0.0], 0)]
)
def test_refuses_levels_that_do_not_increase(wrong):
    with pytest.raises(ModelError, match="a sweep takes"):
        sweep(*wrong)
