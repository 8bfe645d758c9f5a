"""Where compiled loops over pixels are kept."""

from vision3d.kernels import cache_folder, digest


def test_a_module_that_others_import_is_part_of_the_folder_s_name(tmp_path):
    (tmp_path / "leaf.py").write_text("from vision3d.kernels.shared import f\n")
    (tmp_path / "shared.py").write_text("a = 1\n")
    before = digest(tmp_path)
    (tmp_path / "leaf.py").write_text("from vision3d.kernels.shared import f, g\n")
    assert digest(tmp_path) == before, "Numba looks at a kernel's own file itself"
    (tmp_path / "shared.py").write_text("a = 2\n")
    assert digest(tmp_path) != before


def test_the_folder_can_be_chosen(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert cache_folder() == tmp_path


def test_the_other_rooms_keep_their_folder():
    import numba

    import sequential.kernels  # noqa: F401
    from vision3d.kernels import inlined

    before = numba.config.CACHE_DIR
    inlined(len_of_nothing)
    assert before == numba.config.CACHE_DIR


def len_of_nothing():
    return 0
