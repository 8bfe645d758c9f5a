"""A student's own detector in the follower: what it sees, what is wrong with it, and how it is read again."""

import re

import numpy as np
import pytest
from live_worlds import wait_for

from factorlab.live.follower import OwnDetector, state_of
from sequential.errors import DataError

DARK = """import numpy as np

def detecter(image):
    sombre = [np.flatnonzero(image[rangee] < 96) for rangee in (37, 20)]
    return None if min(map(len, sombre)) == 0 else (sombre[0].mean(), sombre[1].mean())

if __name__ == "__main__":
    raise SystemExit("not run")
"""


@pytest.fixture
def written(tmp_path):
    """A file with a detector."""

    def write(text):
        path = tmp_path / "mon_detecteur.py"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_it_steers_the_robot(follower, written):
    session, _ = follower(steps=150, wait=False, bridging_s=0.0, own=OwnDetector(written(DARK)))
    wait_for(session.ended.is_set)
    assert session.journey.lost_s is None
    assert session.journey.rms_m < 0.01
    assert state_of(session)["own"] == "mon_detecteur.py"


def test_it_may_spoil_its_image_and_print(follower, written):
    spoils = DARK.replace("    sombre", "    image = image[:]\n    print(image.sum())\n    sombre") + "\n"
    spoils = spoils.replace("    return None", "    image[:] = 0\n    return None")
    session, _ = follower(steps=20, wait=False, own=OwnDetector(written(spoils)))
    wait_for(session.ended.is_set)
    assert session.last.image.max() > 100


def test_one_that_sees_nothing_loses_the_line(follower, written):
    blind = OwnDetector(written("def detecter(image):\n    return None\n"))
    session, _ = follower(steps=60, wait=False, own=blind)
    wait_for(session.ended.is_set)
    assert session.journey.lost_s is not None


def test_starting_anew_reads_the_file_again(follower, written):
    path = written("def detecter(image):\n    return None\n")
    session, _ = follower(steps=60, wait=False, own=OwnDetector(path))
    wait_for(session.ended.is_set)
    path.write_text(DARK, encoding="utf-8")
    session.restart()
    wait_for(session.ended.is_set)
    assert session.journey.lost_s is None
    path.write_text("def detecter(image:\n", encoding="utf-8")
    with pytest.raises(DataError, match="SyntaxError"):
        session.restart()
    assert session.journey.lost_s is None  # the drive before is still there


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "def detecteur(image):\n    return 3\n",
            "ne définit pas detecter(image) ; detecteur en est-il un autre nom ?",
        ),
        ("x = 3\n", "ne définit pas detecter(image)"),
        ("import numpy\ny = 1 / 0\n", "le fichier s'est arrêté (mon_detecteur.py, ligne 2 « y = 1 / 0 »)"),
        ("def detecter(image)\n    return 3\n", "ligne 1 « def detecter(image) ») : SyntaxError"),
        ("raise SystemExit(3)\n", "SystemExit"),
    ],
)
def test_a_file_that_cannot_be_used_is_a_sentence(written, text, told):
    with pytest.raises(DataError, match=re.escape(told)):
        OwnDetector(written(text))


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("x = image[99]", "detecter s'est arrêté (mon_detecteur.py, ligne 2 « x = image[99] ») : IndexError"),
        ("return 3", "doit renvoyer deux colonnes, celles des rangées 37 et 20, ou None ; reçu 3"),
        ("return 'ici', 'là'", "doit renvoyer deux colonnes"),
        ("return (1, 2, 3)", "doit renvoyer deux colonnes"),
    ],
)
def test_one_that_fails_on_an_image_is_told_with_its_line(follower, written, body, told):
    own = OwnDetector(written(f"def detecter(image):\n    {body}\n"))
    with pytest.raises(DataError, match=re.escape(told)):
        own(np.zeros((40, 60), np.uint8))
    session, _ = follower(own=own)
    wait_for(session.ended.is_set)
    assert told in session.fault


def test_the_page_names_it_and_tells_its_fault(window, follower, written):
    path = written(DARK)
    _, server = follower(own=OwnDetector(path))
    window.visit(server.address)
    window.until("document.body.dataset.steps > 5")
    assert (
        window.run("detector.disabled && detector.selectedOptions[0].textContent")
        == "le vôtre : mon_detecteur.py"
    )
    path.write_text("def detecter(image):\n    return image[99]\n", encoding="utf-8")
    window.click("#restart")
    window.until("headline.textContent.includes('ligne 2 «')")
    path.write_text("def detecter(image:\n", encoding="utf-8")
    window.click("#restart")
    window.until("message.textContent.includes('SyntaxError')")
    window.console.clear()  # where the browser says that a command was refused
