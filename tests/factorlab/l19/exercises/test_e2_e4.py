"""E2, E3, E4 and K3: right solutions of several tastes pass, wrong ones are called by name."""

from pathlib import Path

import pytest
from exercise_copies import E2, E2_NAIVE, E3, E4, E4_FLAT, E4_ROWS, RECURSIVE, RIGHT
from exercise_mistakes import WRONG


@pytest.mark.parametrize("solution", RIGHT.values(), ids=RIGHT)
def test_a_right_solution_passes(checked, solution):
    done = checked(solution)
    assert done.verdict != "FAIL", done
    assert done.of("PASS") or done.of("WARN")


@pytest.mark.parametrize(
    ("solution", "cause", "changes"), WRONG, ids=[f"{w[1]}-{k}" for k, w in enumerate(WRONG)]
)
def test_a_wrong_solution_is_called_by_name(changed, solution, cause, changes):
    done = changed(solution, *changes)
    assert done.verdict == "FAIL", done
    assert cause in done.causes, done
    assert all(finding.mend for finding in done.of("FAIL") if finding.cause)


@pytest.mark.parametrize(
    ("solution", "word"),
    [
        (E2_NAIVE, "avec une MAD globale"),
        (E2_NAIVE.replace("np.median(ecart)", "np.median(np.abs(x - np.median(x)))"), "celle de x entier"),
        (E2_NAIVE, "np.where rend un tuple"),
        (E2_NAIVE, "première et la dernière mesure répétées"),
        (E2.replace("1.4826 * ", ""), "sans le facteur 1,4826"),
        (E2.replace("return sauts", "return np.isin(np.arange(len(x)), sauts)"), "masque de booléens"),
        (E2.replace("h = k // 2\n    y", "assert k % 2; h = k // 2\n    y"), "n'accepte pas un k pair"),
        (E3.replace("return a / (v - c) - b", "return (a / (v - c) - b) / 100"), "en mètres"),
        (E4_ROWS, "(ligne, colonne)"),
        (E4_ROWS, "accepté ; « au moins aire_min » s'écrit >="),
        (E4_FLAT, "arrondis"),
        (E4.replace("deque([(i, j)])", "[(i, j)]").replace("file.popleft()", "file.pop(0)"), None),
    ],
)  # fmt: skip
def test_what_the_statement_leaves_open_is_a_remark(checked, solution, word):
    done = checked(solution)
    assert done.verdict != "FAIL", done
    assert word is None or any(word in finding.said for finding in done.of("WARN")), done


def test_a_recursion_dies_of_a_big_image(checked):
    done = checked(RECURSIVE)
    assert "récursion qui dépasse la pile" in done.causes, done


def test_a_deeper_recursion_does_too(checked):
    done = checked("import sys\nsys.setrecursionlimit(10**6)\n" + RECURSIVE)
    assert done.verdict in {"PASS", "WARN"} or any("récursion" in f.said for f in done.of("FAIL")), done


def test_a_wrong_search_does_not_hide_a_right_largest(changed):
    done = changed(
        E4,
        (
            "((1, 0), (-1, 0), (0, 1), (0, -1))",
            "((1, 1), (1, -1), (-1, 1), (-1, -1), (0, 1), (0, -1), (1, 0), (-1, 0))",
        ),
    )
    assert "plus_gros_objet" in {f.check for f in done.of("PASS")}


def test_a_missing_name_is_asked_for(changed):
    done = changed(E2, ("def detecter_sauts", "def detecter_saut"))
    assert any("est-ce `detecter_sauts`" in f.said for f in done.of("FAIL")), done


def test_one_file_may_answer_several_exercises(tmp_path):
    from factorlab.l19.exercises.checking import check_path

    path = tmp_path / "tout.py"
    path.write_text(E2 + E3 + E4, encoding="utf-8")
    (verdict,) = check_path(path)
    assert [(one.exercise, one.verdict) for one in verdict.exercises] == [
        ("E2", "WARN"),
        ("E3", "PASS"),
        ("E4", "PASS"),
    ]


def test_a_mistake_of_the_checker_is_not_the_student_s(tmp_path, monkeypatch):
    from factorlab.l19.exercises import checking

    path = tmp_path / "copie.py"
    path.write_text(E2, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).resolve().parents[3]))  # where student_jobs lies
    monkeypatch.setattr(checking, "JOB", "student_jobs:broken_check")
    (verdict,) = checking.check_path(path)
    assert "Le vérificateur s'est trompé" in verdict.exercises[0].findings[-1].said
