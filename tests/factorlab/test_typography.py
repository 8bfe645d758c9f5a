"""French spacing: in a page, in a terminal's lines, and nowhere in English."""

from factorlab.report.document import Document, Verdict, render_document
from factorlab.report.document_text import document_lines
from factorlab.typography import bound

LONG = "Un mot, " * 11 + "et la question : où donc ? ; « là » !"


def test_spaces_that_must_not_end_a_line():
    assert bound("« oui » : non ?").count("\u00a0") == 4
    assert bound("C:/x, a?b; 12:30") == "C:/x, a?b; 12:30"
    assert bound(bound(LONG)) == bound(LONG)


def test_a_french_page_is_bound_and_an_english_one_is_not():
    verdicts = (Verdict("écart", 0.5, None, "PASS", "que dire ?"),)
    assert "que dire\u00a0?" in render_document(Document("Titre : un", "Quoi ?", verdicts, lang="fr"))
    assert "\u00a0" not in render_document(Document("Title", "What ?", verdicts, lang="en"))


def test_no_line_of_a_terminal_begins_with_a_mark():
    for shift in range(12):
        lines = list(document_lines(Document("Titre", "x" * shift + " " + LONG, lang="fr")))
        assert not [line for line in lines if line.lstrip().startswith((":", ";", "?", "!", "»"))]
        assert "\u00a0" not in "".join(lines)
