"""TP6. Le livrable : un dossier complet, des données brutes à RESULTATS.md, chaque partie par sa commande.

Ce que l'on rend : les données brutes ; la caractérisation (σ, biais, Allan) ; les calibrations de l'IMU et de
la caméra ; les filtres et leurs courbes ; le C qui va sur la carte, avec ses constantes ; la vision et ses
images ; et `RESULTATS.md`.  Qui reçoit le dossier doit pouvoir tout refaire : les scripts y sont, et aucune
figure n'y est sans la commande qui l'a faite (`COMMANDES.txt`).

Ici les enregistrements sont simulés et courts ; remplacez les fichiers de `donnees/` par les vôtres, retapez
les commandes, et le dossier est le vôtre.  Il est écrit dans le dossier des figures, sous `livrable/`.
"""

import contextlib
import json
import shutil
from pathlib import Path

import numpy as np
from click.testing import CliRunner

from factorlab.cli import main as factorlab
from factorlab.l19.results import read_results
from sequential import ImuNoise
from sequential.readers import write_imu
from sequential.sensors import SIX_POSITIONS, ImuErrors, simulate_imu, tumble, waypoints
from vision3d.boards import Checkerboard
from vision3d.camera import Camera
from vision3d.camera_files import read_camera
from vision3d.images import png_bytes, read_image
from vision3d.lines import CameraMount
from vision3d.render import (
    GroundLine,
    Plane,
    board_poses,
    looking_at,
    marker_texture,
    render_ground,
    render_planes,
    render_scene,
    render_set,
    wall,
)

HERE = Path(__file__).resolve().parent
SCRIPTS = ("41_tp1_acquisition.py", "42_tp2_calibration_accelerometre.py", "figures.py", "claims.py")
BOARD = Checkerboard(9, 6, square_m=0.025)
CAMERA = Camera("pinhole", (330.0, 330.0, 159.5, 119.5), (), (320, 240))
NOISE = ImuNoise(1.6e-4, 3.6e-3, 6e-6, 1e-5)
ERRORS = ImuErrors(NOISE, accel_bias=[0.3, -0.2, 0.4], gyro_bias=[0.02, -0.01, 0.01])
COMMANDS = (
    "characterize donnees/repos.csv -o caracterisation",
    "calibrate accel donnees/positions.csv --positions six -o calibration",
    "attitude donnees/secousses.csv --filter kalman --compare complementary -o attitude",
    "calibrate camera donnees/damier --board 9x6 --square 25mm --lens pinhole -o camera",
    "markers donnees/marqueur.png --dictionary 4x4_50 --size 5cm --camera camera/camera.json -o marqueurs",
    "line donnees/ligne.png -o ligne",
    "match donnees/bureau_a.png donnees/bureau_b.png --features orb -o appariement",
    ("l19 rapport -o . --cours scripts --only TP1,TP2 --imu donnees/repos.csv "
     "--positions donnees/positions.csv"),
)  # fmt: skip
PARTS = {  # ce que l'énoncé demande, et le fichier qui le montre
    "données brutes": "donnees/repos.csv",
    "table de σ, biais, Allan": "caracterisation/report.html",
    "calibration de l'accéléromètre": "calibration/calibration.json",
    "filtres avec courbes": "attitude/report.html",
    "firmware en C": "firmware/core",
    "constantes du firmware": "firmware/calibration.h",
    "caméra : K et distorsion": "camera/report.html",
    "marqueurs": "marqueurs/report.html",
    "ligne": "ligne/report.html",
    "deux photos": "appariement/matches.png",
    "scripts": "scripts/41_tp1_acquisition.py",
    "commandes": "COMMANDES.txt",
    "RESULTATS.md": "RESULTATS.md",
    "figures": "figures/41_tp1_acquisition.png",
}


def raw_data(folder, rng):
    """Les données brutes : trois enregistrements de l'IMU, et les images."""
    (folder / "damier").mkdir(parents=True)
    still = tumble(70.0, rng, rest=60.0)
    shaken = tumble(30.0, rng, angle=0.1, sway=0.01, period=(2.0, 8.0), rest=10.0)
    motions = {"repos": still, "positions": waypoints(SIX_POSITIONS, 3.0, 1.0), "secousses": shaken}
    for name, motion in motions.items():
        write_imu(simulate_imu(motion, rng, errors=ERRORS, field=None).recording, folder / f"{name}.csv")
    scene, front = wall(rng), [1.0, 0.0, 0.0, 0.0, 0.03, -0.02, 0.5]
    line = GroundLine(np.array([[-1.0, 0.0], [3.0, 0.0]]), 0.03)
    eyes = [looking_at((0.0, 0.0, 0.0), (0.0, 0.0, 2.0)), looking_at((0.5, -0.2, 0.3), (0.1, 0.0, 2.0))]
    marker = Plane(np.array(front), marker_texture("4x4_50", 7, 0.05))
    pictures = {
        "marqueur": render_planes(CAMERA, [marker], rng=rng),
        "ligne": render_ground(CAMERA, CameraMount(0.2, 0.56), line, np.array([0.0, 0.02, 0.1]), rng=rng),
    }
    for name, eye in zip(("bureau_a", "bureau_b"), eyes, strict=True):
        pictures[name] = render_scene(CAMERA, eye, scene, rng=rng).image
    poses = board_poses(CAMERA, BOARD, 8, rng)
    pictures |= {f"damier/{k}": v for k, v in render_set(CAMERA, BOARD, 8, rng, poses=poses).named()}
    for name, image in pictures.items():
        (folder / name).with_suffix(".png").write_bytes(png_bytes(image))


def type_command(words, folder):
    """Une commande, tapée dans le dossier du livrable."""
    with contextlib.chdir(folder):
        done = CliRunner().invoke(factorlab, words.split())
    print(f"factorlab {words} : {'faite' if done.exit_code == 0 else done.output}")
    return done.exit_code == 0


def assemble(folder):
    """Données, scripts, chaque commande, le C : combien de commandes ont réussi."""
    shutil.rmtree(folder, ignore_errors=True)
    raw_data(folder / "donnees", np.random.default_rng(1))
    (folder / "scripts").mkdir()
    for name in SCRIPTS:
        shutil.copy(HERE / name, folder / "scripts")
    done = sum(type_command(words, folder) for words in COMMANDS)
    shutil.copytree(HERE.parents[1] / "firmware" / "core", folder / "firmware" / "core")
    shutil.copy(folder / "calibration" / "calibration.h", folder / "firmware")
    lines = [f"factorlab {words}\n" for words in COMMANDS]
    (folder / "COMMANDES.txt").write_text("".join(lines), encoding="utf-8")
    return done


def main():
    from claims import claim
    from figures import out_folder, panels, save

    folder = out_folder() / "livrable"
    done = assemble(folder)
    missing = [part for part, path in PARTS.items() if not (folder / path).exists()]
    print(f"il manque : {', '.join(missing)}" if missing else f"complet : {folder}")

    shown = {
        "Marqueur et sa pose": "marqueurs/overlay.png",
        "Ligne": "ligne/line.png",
        "Deux photos, ORB et RANSAC": "appariement/matches.png",
        "TP1, dans RESULTATS.md": "figures/41_tp1_acquisition.png",
    }
    figure, axes = panels(2, 2, size=(11.0, 7.4), title="TP6. Le livrable : des images qui en viennent")
    for panel, (title, path) in zip(axes, shown.items(), strict=True):
        panel.imshow(read_image(folder / path, colour=True)[..., ::-1])
        panel.set_title(title)
        panel.axis("off")
    save(figure)

    accel = json.loads((folder / "calibration/calibration.json").read_text(encoding="utf-8"))["accel"]
    camera = read_camera(folder / "camera/camera.json")
    page = read_results(folder / "RESULTATS.md")
    claim("TP6", "parties du livrable présentes", len(PARTS) - len(missing), low=len(PARTS), high=len(PARTS))
    claim("TP6", "commandes réussies", done, low=len(COMMANDS), high=len(COMMANDS))
    claim("TP6", "grandeurs dans son RESULTATS.md", len(page), low=10)
    offset = np.abs(np.array(accel["offset"]) - ERRORS.accel_bias).max()
    claim("TP6", "décalage de l'accéléromètre : pire erreur", offset, "m/s²", high=0.02)
    claim(
        "TP6",
        "focale de la caméra : erreur",
        abs(camera.intrinsics[0] - CAMERA.intrinsics[0]),
        "px",
        high=1.0,
    )


if __name__ == "__main__":
    main()
