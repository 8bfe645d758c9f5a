import numpy as np

from sequential.sensors.direction_cells import BANDS, CELLS, SECTORS, cell_means, cell_of, cell_words


def sphere(count, rng):
    d = rng.standard_normal((count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def test_cells_have_equal_area(rng):
    count = cell_means(sphere(240_000, rng)).count
    np.testing.assert_allclose(count, 10_000, rtol=0.06)
    assert CELLS == BANDS * SECTORS == 24
    assert cell_of(np.array([[0.0, 0.0, -1.0], [1.0, 1e-9, 0.9]])).tolist() == [3, 5 * 1 + 10 + 6]
    assert cell_words(3) == "elevation -90° to -30°, azimuth 0° to 60°"


def test_an_uneven_norm_has_a_spread(rng):
    directions = sphere(50_000, rng)
    norms = np.where(directions[:, 2] > 0, 1.1, 0.9)
    np.testing.assert_allclose(cell_means(directions, norms).spread, 0.1, rtol=0.01)


def test_the_cell_of_the_words_is_the_cell():
    towards = np.array([[np.cos(np.radians(30)) * 0.5, np.sin(np.radians(30)) * 0.5, -(0.75**0.5)]])
    assert cell_words(int(cell_of(towards)[0])) == "elevation -90° to -30°, azimuth 0° to 60°"
