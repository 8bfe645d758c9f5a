"""What the hooks of the site do to a page: formulas, docstrings, links out of `docs/`."""

import importlib.util
from types import SimpleNamespace

import pytest
from site_reading import ROOT


def hook(name):
    """A hook, loaded by its path as mkdocs does."""
    spec = importlib.util.spec_from_file_location(
        f"site_hook_{name}", ROOT / "docs" / "_hooks" / f"{name}.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


PAGE = SimpleNamespace(file=SimpleNamespace(src_uri="a.md"))


def test_a_formula_becomes_mathml():
    content = '<p>where <span class="arithmatex">\\(a &lt; \\frac{b}{2}\\)</span> holds</p>'
    drawn = hook("mathml").on_page_content(content, PAGE)
    assert drawn.startswith("<p>where <math")
    assert "<mfrac>" in drawn
    assert "&lt;" in drawn or "&#x0003C;" in drawn
    assert 'display="inline"' in drawn


@pytest.mark.parametrize("latex", [r"\frac", r"\nosuchcommand x"])
def test_a_formula_that_cannot_be_drawn_is_named_with_its_page(latex):
    with pytest.raises(ValueError, match=r"a\.md: no MathML"):
        hook("mathml").on_page_content(f'<div class="arithmatex">\\[{latex}\\]</div>', PAGE)


def test_docstrings_are_told_as_this_house_writes_them():
    text = "Do.\n\n>>> 1 + 1\n2\n\nParameters\n----------\na, b : lengths, m\n    of the sides\nc : a flag"
    thing = SimpleNamespace(docstring=SimpleNamespace(value=text))
    hook("docstrings").HouseDocstrings().on_instance(obj=thing)
    assert thing.docstring.value == (
        "Do.\n\n```pycon\n>>> 1 + 1\n2\n```\n\n"
        "Parameters\n----------\na, b\n    lengths, m\n    of the sides\nc\n    a flag"
    )


def test_docstring_of_a_script_leaves_its_code():
    said, code = hook("outside").told('"""Why:\n- one\n- two\n"""\n\nimport math\n')
    assert said == "Why:\n\n- one\n- two"
    assert code.strip() == "import math"


@pytest.mark.parametrize(
    ("source", "target", "path"),
    [
        ("docs/firmware.md", "../firmware/README.md", "firmware/README.md"),
        ("docs/how_to/tune.md", "../tuning.md", "docs/tuning.md"),
        ("docs/index.md", "nowhere.md", None),
        ("docs/index.md", "../../outside.md", None),
    ],
)
def test_a_link_means_a_file_of_the_project(source, target, path):
    assert hook("outside").resolved(source, target) == path


def test_every_file_has_a_place_of_its_own():
    outside = hook("outside")
    places = [outside.place(path) for path in outside.written()]
    assert len(set(places)) == len(places)
    assert {"l19/index.md", "changelog.md", "examples/quickstart.py.md"} <= set(places)
    assert all((ROOT / outside.origin(place)).is_file() for place in places)
