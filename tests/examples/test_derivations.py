"""The pages of derivations and their checks: the same names, the same formulas, and MathML for each."""

import importlib.util
import re
from pathlib import Path

import pytest
from latex2mathml.converter import convert

from factorlab.l19.formulas import Checks, read_formulas
from sequential.errors import DataError

ROOT = Path(__file__).resolve().parents[2]
PAGES = {name: ROOT / "docs" / f"{name}.md" for name in ("derivations", "derivations.fr")}
SCRIPTS = ("54_d3_formules_filtre", "55_d3_formules_capteurs")


def load(name):
    spec = importlib.util.spec_from_file_location(f"l19_{name}", ROOT / "examples" / "l19" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def formulas():
    return {name: read_formulas(page) for name, page in PAGES.items()}


def test_every_formula_is_checked_and_every_check_has_its_formula(formulas):
    checked = [name for script in SCRIPTS for name in load(script).checks.by_name]
    assert len(checked) == len(set(checked))
    assert set(checked) == set(formulas["derivations"])


def test_both_languages_say_the_same(formulas):
    """Word for word but for what stands in \\text{…}."""
    plain = [
        {name: re.sub(r"\\text\{[^}]*\}", "", latex) for name, latex in one.items()}
        for one in formulas.values()
    ]
    assert list(plain[0].items()) == list(plain[1].items())


@pytest.mark.parametrize("page", PAGES)
def test_the_page_names_the_scripts_and_has_every_section(page):
    text = PAGES[page].read_text(encoding="utf-8")
    for script in SCRIPTS:
        assert f"examples/l19/{script}.py" in text
    assert re.findall(r"^## (\d+)\.", text, re.MULTILINE) == [str(k) for k in range(1, 13)]
    assert "1960" in text


@pytest.mark.parametrize("page", PAGES)
def test_every_formula_can_be_drawn(page, formulas):
    inline = re.findall(r"(?<!\$)\$([^$\n]+)\$(?!\$)", PAGES[page].read_text(encoding="utf-8"))
    assert len(inline) > 30
    for latex in [*formulas[page].values(), *inline]:
        drawn = convert(latex)
        assert "\\" not in drawn, f"{latex}: a command is not known"


@pytest.mark.slow
def test_the_table_of_both_filters_is_measured():
    """Within the last digit that the page shows, or what another machine's rounding does to lost runs."""
    from factorlab.l19.contest import LOST_M, contest

    measured = []
    for noise in ("strong", "weak"):
        drawn = contest(200, noise=noise)
        for name in ("ekf", "ukf"):
            late = drawn.nees[name][drawn.worst(name) <= LOST_M][:, drawn.late].mean() / 3
            lost, rmse, honesty = 100 * drawn.lost(name), drawn.rmse(name), drawn.anees(name).mean / 3
            measured.append((lost, rmse, honesty, late))
    for page in PAGES.values():
        text = page.read_text(encoding="utf-8")
        rows = re.findall(r"^\| (?:fort|faible|strong|weak) \| [EU]KF \|(.*)\|$", text, re.MULTILINE)
        told = [
            [float(re.search(r"[\d.,]+", c)[0].replace(",", ".")) for c in row.split("|")] for row in rows
        ]
        for row, (lost, rmse, honesty, late) in zip(told, measured, strict=True):
            assert row == [
                pytest.approx(lost, abs=2.0),
                pytest.approx(rmse, rel=0.1),
                pytest.approx(honesty, rel=0.3),
                pytest.approx(late, rel=0.1),
            ]


def test_no_line_ends_inside_a_formula():
    for page in PAGES.values():
        for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
            assert line.count("$") % 2 == 0, f"{page.name}, line {number}"


def test_a_formula_without_a_name_is_refused(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# A\n\n$$\nx = y\n$$\n", encoding="utf-8")
    with pytest.raises(DataError, match="x = y"):
        read_formulas(page)
    twice = '<a id="one"></a>\n\n$$\nx\n$$\n'
    page.write_text(twice + "\n" + twice, encoding="utf-8")
    with pytest.raises(DataError, match="two formulas are called 'one'"):
        read_formulas(page)


def test_checks_run_once_and_name_what_fails():
    checks, calls = Checks(), []

    @checks("a", "b")
    def both():
        calls.append(1)
        return "by hand"

    assert checks.run() == {"a": "by hand", "b": "by hand"}
    assert len(calls) == 1
    assert checks.missing(["a", "c"]) == ["c"]
    with pytest.raises(ValueError, match="'b'"):
        checks("b")(both)

    @checks("wrong")
    def fails():
        raise AssertionError("1 is not 2")

    with pytest.raises(AssertionError, match="wrong: 1 is not 2"):
        checks.run()


def test_a_wrong_formula_would_be_found():
    """The checker's `zero` refuses what is not nothing."""
    module = load(SCRIPTS[0])
    with pytest.raises(AssertionError, match="n'est pas nul"):
        module.zero(module.joseph(module.G) - (module.P - module.G * module.H * module.P))
