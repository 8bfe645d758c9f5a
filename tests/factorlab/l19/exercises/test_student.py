"""A student's file in a process of its own: whatever it does, its line is told and nothing hangs."""

import textwrap
import time
from pathlib import Path

import pytest

from factorlab.l19.exercises import run_student
from factorlab.l19.exercises.calling import Caller
from factorlab.l19.exercises.fault import Stumble


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).resolve().parents[3]))

    def of(text, job="names_of", *, name="copie.py", **options):
        path = tmp_path / name
        path.write_text(textwrap.dedent(text), encoding="utf-8")
        return run_student(path, f"student_jobs:{job}", {"path": str(path)}, **options)

    return of


def test_names_and_arguments_go_through(run):
    done = run("import math\na, b = 1, 2\nif __name__ == '__main__':\n    c = 3\n")
    assert done.events[0] == ["a", "b", "math"]
    assert set(done.events[1]) == {"path"}
    assert (done.stopped, done.fault, done.printed) == (None, None, "")


def test_what_it_prints_is_kept_apart_and_cut(run):
    done = run(
        """
        import os, sys
        print("bonjour")
        sys.stderr.write("et là")
        os.write(1, b'["event", "faux"]')
        print("x" * 10_000)
        """
    )
    assert done.printed.startswith("bonjour\net là")
    assert len(done.printed) == 2000
    assert "faux" not in done.events


def test_it_runs_from_its_own_folder_beside_its_own_modules(run, tmp_path):
    (tmp_path / "voisin.py").write_text("SEPT = 7\n")
    (tmp_path / "mesures.csv").write_text("1,2\n")
    done = run(
        "from voisin import SEPT\nlu = open('mesures.csv').read()\ndef f(): return [SEPT, lu]", "call_f"
    )
    assert done.events == ({"value": [7, "1,2\n"]},)


def test_drawing_without_a_window(run):
    done = run(
        """
        import matplotlib.pyplot as plt
        plt.plot([1, 2])
        plt.show()
        fini = True
        """
    )
    assert done.stopped is None
    assert "fini" in done.events[0]


@pytest.mark.parametrize(
    ("text", "kind", "line", "word"),
    [
        ("while True:\n    pass\n", "durée", None, "boucle sans fin"),
        (
            "while True:\n    try:\n        x = 1\n    except Exception:\n        pass\n",
            "durée",
            None,
            "sans fin",
        ),
        ("import sys\nsys.exit(3)\n", "SystemExit", 3, "s'arrête de lui-même"),
        ("quit()\n", "SystemExit", 2, "s'arrête de lui-même"),
        ("n = input('combien ?')\n", "EOFError", 2, "clavier"),
        ("import numpy as np\nnp.ones(2) @ np.ones(3)\n", "ValueError", 3, "dimensions"),
        ("1 / 0\n", "ZeroDivisionError", 2, "division par zéro"),
        ("open('absent.csv')\n", "FileNotFoundError", 2, "dossier"),
        ("import absent_de_partout\n", "ModuleNotFoundError", 2, "installé"),
        ("def g(n):\n    return g(n + 1)\ng(0)\n", "RecursionError", 3, "récursifs"),
    ],
)
def test_a_file_that_stops_keeps_its_first_names(run, text, kind, line, word):
    done = run("avant = 1\n" + text, loading_s=0.5)
    assert done.stopped.kind == kind
    assert word in done.stopped.said
    assert done.stopped.line == line or (line is None and done.stopped.line > 1)
    assert done.stopped.code
    assert "avant" in done.events[0]


def test_a_call_that_raises_shows_their_deepest_line(run):
    done = run(
        """
        import numpy as np
        def g(x):
            return np.linalg.inv(x)  # ici
        def f():
            return g(np.zeros((2, 2)))
        """,
        "call_f",
    )
    fault = done.events[0]["fault"]
    assert (fault["kind"], fault["line"]) == ("LinAlgError", 4)
    assert fault["code"].endswith("# ici")


def test_a_call_without_end_is_ended(run):
    done = run("def f():\n    while True:\n        pass\n", "call_f")
    assert done.events[0]["fault"]["kind"] == "durée"
    assert done.events[0]["fault"]["line"] in {2, 3}


@pytest.mark.parametrize(
    "text",
    [
        "def f():\n    while True:\n        try:\n            pass\n        except:\n            pass\n",
        "import signal, time\ndef f():\n    signal.setitimer(signal.ITIMER_REAL, 0); time.sleep(60)\n",
    ],
)
def test_nothing_outlives_the_limit_of_the_process(run, text):
    began = time.monotonic()
    done = run(text, "call_f", limit_s=2.0)
    assert time.monotonic() - began < 20  # not the minute it asks for
    told = done.fault.to_json() if done.fault else done.events[0]["fault"]
    assert told["kind"] == "durée"


@pytest.mark.parametrize("text", ["import os\nos._exit(5)\n", "import os\nos.kill(os.getpid(), 11)\n"])
def test_a_process_that_dies_says_how(run, text):
    done = run(text)
    assert done.fault.kind == "mort"
    assert "code 5" in done.fault.said or "signal 11" in done.fault.said


def test_a_job_of_ours_that_breaks_is_no_silence(run):
    done = run("a = 1", "broken")
    assert done.events == ("avant",)
    assert "le vérificateur lui-même" in done.fault.said


def test_a_caller_gives_values_and_stumbles(tmp_path):
    call = Caller(tmp_path / "x.py", limit_s=0.1)
    assert call(lambda a: a + 1, 2) == 3
    with pytest.raises(Stumble, match="ZeroDivisionError"):
        call(lambda: 1 / 0)
    with pytest.raises(Stumble, match=r"après 0.1 s"):
        call(time.sleep, 5)
    assert call.tried(lambda: 1 / 0) is None
