"""Examples run as child processes: what they leave, what a fault says, pictures made small."""

from dataclasses import replace

import pytest
from course_examples import example, picture
from PIL import Image

from factorlab.l19.results import Work, run_scripts, scripts_of, write_results
from factorlab.l19.results.pictures import small_png
from factorlab.report.folder import OutputExistsError
from sequential.errors import DataError


@pytest.fixture
def course(tmp_path):
    folder = tmp_path / "cours"
    folder.mkdir()
    example(folder, "05_k1_bon.py", 'claim("K1", "NIS moyen", 1.0, low=0.9, high=1.1)')
    example(folder, "06_k2_hors.py", 'claim("K2", "RMS", 2.0, "m", high=1.0)')
    drawn = picture("41_tp1_image.png")
    example(folder, "41_tp1_image.py", 'claim("TP1", "σ", 0.03, "m/s²", low=0.02)', drawn)
    example(folder, "07_k3_tombe.py", "def f():", '    raise ValueError("pas carrée")', "f()")
    example(folder, "08_i1_muet.py", "print('rien')")
    (folder / "claims.py").write_text("", encoding="utf-8")
    return folder


def outcomes(course, tmp_path, **rest):
    found = run_scripts(scripts_of(course), tmp_path / "out", **rest)
    return {one.item: one for one in found}


def test_what_each_leaves(course, tmp_path):
    found = outcomes(course, tmp_path)
    assert list(found) == ["K1", "K2", "K3", "I1", "TP1"], "in the order of the course's numbers"
    assert found["K1"].good
    assert found["K1"].title == "Un exemple."
    assert not found["K2"].good
    assert found["K2"].fault == "RMS"
    assert found["K2"].claims[0].value == 2.0, "the figure that failed is told"
    assert found["K3"].fault == "pas carrée"
    assert not found["I1"].good
    assert not found["I1"].fault
    assert [path.name for path in found["TP1"].pictures] == ["41_tp1_image.png"]


def test_progress_is_told_once_each(course, tmp_path):
    told = []
    outcomes(course, tmp_path, progress=lambda _, done, total: told.append((done, total)))
    assert told == [(k, 5) for k in range(1, 6)]


def test_what_a_student_gives_reaches_the_script(tmp_path):
    script = example(tmp_path, "41_tp1_x.py", 'claim("TP1", sys.argv[1], 1.0)')
    (one,) = run_scripts([script], tmp_path / "out", arguments={script.name: ["mon fichier.csv"]})
    assert one.claims[0].quantity == "mon fichier.csv"


def test_only_some(course):
    assert [path.name[:2] for path in scripts_of(course, ["tp1", "K1"])] == ["05", "41"]
    assert scripts_of(course, ["TP4"]) == []
    with pytest.raises(DataError, match="ne connaît que"):
        scripts_of(course, ["Z9"])
    with pytest.raises(DataError, match="--cours"):
        scripts_of(course / "claims")


def test_the_page_and_its_pictures(course, tmp_path):
    found = list(outcomes(course, tmp_path).values())
    page = write_results(Work(found, whole=False), tmp_path / "rendu")
    text = page.read_text(encoding="utf-8")
    (file,) = (tmp_path / "rendu" / "figures").iterdir()
    assert f"](figures/{file.name})" in text
    assert file.stat().st_size < 120_000, "noise is the worst case"
    assert "`05_k1_bon.py`" in text
    assert "](../cours" not in text, "what is handed in does not link to what is not"
    # a page elsewhere than its pictures, then one without: the old picture goes
    page = write_results(Work(found, whole=False), tmp_path / "R.md", tmp_path / "docs" / "images")
    assert "](docs/images/41_tp1_image.png)" in page.read_text(encoding="utf-8")
    assert "[`05_k1_bon.py`](cours/05_k1_bon.py)" in page.read_text(encoding="utf-8")
    assert (tmp_path / "docs" / "images" / "41_tp1_image.png").is_file()
    (tmp_path / "docs" / "images" / "autre.png").write_bytes(b"kept")
    bare = [replace(one, pictures=()) for one in found]
    write_results(Work(bare, whole=False), tmp_path / "R.md", tmp_path / "docs" / "images")
    assert [path.name for path in (tmp_path / "docs" / "images").iterdir()] == ["autre.png"]


def test_few_colours_keep_those_of_lines(tmp_path):
    image = Image.effect_noise((900, 500), 80).convert("RGB")
    image.paste((0, 158, 115), (100, 200, 800, 206))
    image.save(tmp_path / "a.png")
    (tmp_path / "b.png").write_bytes(small_png(tmp_path / "a.png"))
    with Image.open(tmp_path / "b.png") as small:
        assert small.mode == "P"
        middle = small.convert("RGB").getpixel((small.width // 2, round(small.height * 203 / 500)))
    assert max(abs(a - b) for a, b in zip(middle, (0, 158, 115), strict=True)) < 12


def test_a_page_in_the_way(course, tmp_path):
    from factorlab.l19.results.writing import require_page

    (tmp_path / "RESULTATS.md").write_text("déjà", encoding="utf-8")
    with pytest.raises(OutputExistsError, match="--force"):
        require_page(tmp_path, force=False)
    require_page(tmp_path, force=True)
    with pytest.raises(OutputExistsError, match="n'est pas un dossier"):
        require_page(tmp_path / "RESULTATS.md" / "dessous", force=True)
