"""A report in general: the page stands alone, says what the JSON says, and speaks two languages."""

import json
import re
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from factorlab.report.document import Document, Section, Table, Verdict, write_document
from factorlab.report.document_text import document_lines
from factorlab.report.folder import OutputExistsError
from factorlab.report.style import blank
from factorlab.report.words import WORDS, interval, number


def wave():
    figure, axes = blank(2.0)
    axes[0, 0].plot(np.sin(np.arange(50) * 0.3), label="a < b & c")
    return figure


def made(lang="en", **changes):
    return Document(
        **{
            "title": "gyro <left> & right",
            "lead": "Ten minutes at rest.",
            "verdicts": (
                Verdict("σ of gx", 1.25e-3, (1.2e-3, 1.3e-3), "PASS", "white", unit="rad/s"),
                Verdict("bias", -0.5, (-0.6, -0.4), "FAIL", "large", "take it off"),
                Verdict("Allan", "too short", None, "INFO", "20 s cannot show a plateau"),
            ),
            "sections": (
                Section(
                    "Axes",
                    "First.\n\nSecond.",
                    Table(("axis", ("σ", "rad/s"), "n"), (("gx", 1.25e-3, 1000), ("gy", None, 7))),
                ),
                Section("Wave", figure=wave, caption="how to read it"),
                Section("Nothing", figure=lambda: None),
            ),
            "numbers": {"axes": {"gx": {"sigma": 1.25e-3, "none": float("nan")}}},
            "lang": lang,
            "command": "factorlab characterize <log> & run",
            "conclusion": "In short: <good>.",
        }
        | changes
    )


def test_the_page_stands_alone_and_is_well_formed(tmp_path):
    html = write_document(made(), tmp_path / "out").read_text(encoding="utf-8")
    assert not re.findall(r"""(?:src|href|action|poster|data)\s*=\s*["']?\s*(?:https?:)?//""", html)
    assert "<script" not in html
    figures = re.findall(r"<svg.*?</svg>", html, re.DOTALL)
    assert len(figures) == 1, "a figure that draws nothing leaves nothing"
    ET.fromstring(figures[0])  # noqa: S314 - made here, a moment ago
    assert "gyro &lt;left&gt; &amp; right" in html
    assert "factorlab characterize &lt;log&gt; &amp; run" in html
    assert (
        html.index("In short: &lt;good&gt;.")
        < html.index("Verdict")
        < html.index("Axes")
        < html.index("<svg")
    )
    assert html.count("<p>First.</p>") == html.count("<p>Second.</p>") == 1
    for status in ("PASS", "FAIL", "INFO"):
        assert f'class="badge {status}"' in html
    assert '<td class="number">0.00125</td><td class="number">1000</td>' in html


def test_the_json_is_what_the_command_prints_and_names_the_files(tmp_path):
    page = write_document(made(), tmp_path / "out", files={"imu.yaml": "a: 1\n", "deep/x.bin": b"\x00"})
    whole = json.loads((page.parent / "report.json").read_text(encoding="utf-8"))
    assert sorted(whole.pop("files")) == ["deep/x.bin", "imu.yaml", "report.html", "report.json"]
    assert whole == json.loads(json.dumps(made().to_json()))
    assert whole["axes"]["gx"] == {"sigma": 1.25e-3, "none": None}
    assert whole["verdicts"][1]["verdict"] == "FAIL"
    assert (page.parent / "imu.yaml").read_text(encoding="utf-8") == "a: 1\n"


def test_an_earlier_report_is_not_written_over(tmp_path):
    write_document(made(), tmp_path / "out")
    with pytest.raises(OutputExistsError, match="--force"):
        write_document(made(), tmp_path / "out")
    write_document(made(title="again"), tmp_path / "out", force=True)


def test_numbers_may_not_hide_what_every_report_has():
    with pytest.raises(ValueError, match="title already"):
        made(numbers={"title": 1}).to_json()


def test_a_table_is_rectangular():
    with pytest.raises(ValueError, match="row 1 of a table has 1 cells under 2"):
        Table(("a", "b"), ((1.0, 2.0), (1.0,)))


def test_french_has_its_own_words_and_a_decimal_comma(tmp_path):
    html = write_document(made("fr"), tmp_path / "out").read_text(encoding="utf-8")
    assert '<html lang="fr">' in html
    assert '<span class="badge FAIL">MAUVAIS</span>' in html
    assert "0,00125 rad/s" in html
    assert "−0,600 à −0,400" in html
    assert "what it means" not in html
    assert number(0.5, "fr") == "0,500"
    assert interval((0.1, 0.2), "fr") == "0,100 – 0,200"
    assert WORDS["fr"].badges.keys() == WORDS["en"].badges.keys()


def test_a_terminal_shows_tables_and_verdicts():
    lines = list(document_lines(made()))
    assert lines[0] == "gyro <left> & right"
    assert "gx    0.00125  1000" in lines
    assert "gy          –     7" in lines
    assert "PASS  σ of gx  0.00125  [0.00120 – 0.00130] rad/s" in lines
    assert "      -> take it off" in lines
    assert lines[-1] == "In short: <good>.", "the verdict in one sentence is what is read last"
