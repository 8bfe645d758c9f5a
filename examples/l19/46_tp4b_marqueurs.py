"""TP4 (b). Les marqueurs ArUco : identité, pose 6-D en temps réel, et l'ambiguïté que personne ne signale.

Quatre coins d'un carré connu donnent sa pose : trois rotations, trois translations. Mais petit ou
lointain, un carré admet deux lectures, symétriques par rapport à la ligne de visée, et le bruit choisit
entre elles : la pose « saute » d'une image à l'autre. Ici chaque pose a deux modes, chacun avec sa
covariance, et une cote (combien de fois le premier est plus probable). Des coins plus précis (droites
ajustées aux quatre côtés) et le mouvement (un filtre à deux hypothèses) font monter la cote jusqu'à la
certitude.

La vidéo est rendue, donc la vérité est connue.  Avec FACTORLAB_DATA, l'image du tutoriel d'OpenCV est lue
aussi.  Sur votre webcam : `factorlab live camera 0 --task markers`.
"""

import os
from pathlib import Path
from time import perf_counter

import cv2
import numpy as np

from sequential.manifold import SE3
from sequential.manifold.quaternion import rotate
from vision3d.camera import Camera
from vision3d.markers import MarkerMotion, MarkerTracker, detect_markers, find_markers, marker_corners
from vision3d.render import Plane, marker_texture, render_planes

CAMERA = Camera("brown5", (530, 531, 322, 240), (-0.28, 0.08, 1e-3, -2e-4, 0.02), (640, 480))
DICTIONARY, NUMBER, SIZE_M, FPS = "4x4_50", 7, 0.05, 25.0
NORMAL = np.array([0.0, 0.0, 1.0])


def course(t):
    """Un marqueur de 20 px, à 1,3 m, qui se balance autour d'une inclinaison de 14°."""
    base = np.array([1.0, 0.0, 0.0, 0.0, 0.12, -0.06, 1.3])
    turn = np.array([0.24 + 0.2 * np.sin(1.9 * t), 0.2 * np.sin(2.6 * t + 1.0), 0.3 * np.sin(0.8 * t)])
    return SE3().retract(base, np.concatenate([turn, 0.02 * np.sin([1.1 * t, 0.7 * t, 0.5 * t])]))


def photograph(pose, rng):
    """Une webcam ordinaire : flou et bruit."""
    plane = Plane(pose, marker_texture(DICTIONARY, NUMBER, SIZE_M))
    return render_planes(CAMERA, [plane], rng=rng, noise=5.0, blur_px=0.8)


def usual_pose(image):
    """Ce que fait un programme ordinaire : les coins d'OpenCV, puis la meilleure reprojection."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    corners, _, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(image)
    if not len(corners):
        return None
    pixels = np.asarray(corners[0], dtype=np.float64).reshape(4, 2)
    _, turns, _, errors = cv2.solvePnPGeneric(
        marker_corners(SIZE_M), pixels, CAMERA.matrix, CAMERA.distortion_opencv, flags=cv2.SOLVEPNP_IPPE
    )
    return cv2.Rodrigues(turns[int(np.argmin(np.ravel(errors)))])[0] @ NORMAL


def off(normal, truth):
    """Angle entre une normale et la vraie, degrés."""
    return np.degrees(np.arccos(np.clip(normal @ rotate(truth[:4], NORMAL), -1.0, 1.0)))


def main():
    from claims import claim
    from figures import panels, save, say

    rng = np.random.default_rng(4)
    tracker = MarkerTracker(CAMERA, SIZE_M, MarkerMotion(turning=2.0, moving=0.3))
    rows, seconds = [], 0.0
    detect_markers(photograph(course(0.0), rng), DICTIONARY, camera=CAMERA)  # la première fois compile
    for k in range(100):
        t, truth = k / FPS, course(k / FPS)
        image = photograph(truth, rng)
        began = perf_counter()
        found = tracker.update(t, detect_markers(image, DICTIONARY, camera=CAMERA))
        seconds += perf_counter() - began
        usual = usual_pose(image)
        if not found or not found[0].seen or usual is None:
            continue
        pose, alone = found[0].pose, found[0].measured
        rows.append((t, off(usual, truth), error(alone, truth), error(pose, truth), alone.odds, pose.odds))
    t, usual, single, followed, odds_alone, odds = np.array(rows).T
    flips = float(np.mean(usual > 12.0))
    say(f"{len(rows)} images sur 100, {seconds * 10:.1f} ms par image")
    say(f"OpenCV, meilleure reprojection : normale fausse de plus de 12° dans {100 * flips:.0f} %")
    middle = np.median(single), np.median(odds_alone)
    say(f"une image seule : erreur médiane {middle[0]:.1f}°, cote médiane {middle[1]:.0f}")
    say(f"suivi           : erreur médiane {np.median(followed):.1f}°, cote finale {odds[-1]:.0f}")
    real = tutorial()

    figure, axes = panels(1, 3, size=(13.0, 4.2), title="TP4 (b). Marqueurs : une pose, deux lectures")
    draw_marker(axes[0], image, pose)
    draw_errors(axes[1], t, usual, followed)
    draw_odds(axes[2], t, odds_alone, odds)
    save(figure)

    wrong = (followed > 12.0) & (odds > 20.0)
    claim("TP4b", "suivi à deux hypothèses : erreur médiane", np.median(followed), "°", high=2.5)
    claim("TP4b", "meilleure reprojection d'OpenCV : images où la normale saute", 100 * flips, "%", low=10.0)
    claim("TP4b", "images dites certaines et pourtant fausses", 100 * wrong.mean(), "%", high=2.0)
    claim("TP4b", "cote de la bonne lecture à la fin", odds[-1], low=20.0)
    assert np.median(followed) < np.median(usual), "la normale suivie est meilleure"
    if real is not None:
        claim("TP4b", "marqueurs lus sur la photo", len(real), low=6, high=6, source="photo OpenCV")
        assert real == [23, 40, 62, 98, 124, 203], "et ce sont les bons"
    claim("TP4b", "temps par image", seconds * 1e3 / 100, "ms")


def error(pose, truth):
    """Erreur de la normale du mode le plus probable, degrés."""
    return off(rotate(pose.camera_T_marker[:4], NORMAL), truth)


def tutorial():
    """Les identités lues sur l'image d'OpenCV, si elle est là ; la famille est trouvée toute seule."""
    path = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision/aruco/singlemarkersoriginal.jpg"
    if not path.is_file():
        return None
    markers, dictionary = find_markers(cv2.imread(str(path)))
    numbers = [one.id for one in markers]
    print(f"image du tutoriel : marqueurs {numbers} du dictionnaire {dictionary}")
    return numbers


def draw_marker(axes, image, pose):
    """L'image autour du marqueur, ses axes selon la pose suivie."""
    import figures

    tips = 0.7 * SIZE_M * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, -1]])
    mode = pose.modes[0].camera_T_marker
    x, y = CAMERA.project(rotate(mode[:4], tips) + mode[4:]).T
    axes.imshow(image, cmap="gray", vmin=0, vmax=255, interpolation="nearest")
    colours = (figures.ORANGE, figures.GREEN, figures.SKY)
    for k, (colour, name) in enumerate(zip(colours, ("x", "y", "normale"), strict=True), start=1):
        axes.plot(x[[0, k]], y[[0, k]], color=colour, linewidth=2.5, label=name)
    axes.set(xlim=(x[0] - 30, x[0] + 30), ylim=(y[0] + 26, y[0] - 26), title="Le marqueur, 20 pixels de côté")
    axes.axis("off")
    axes.legend(loc="lower right", facecolor="white", frameon=True)


def draw_errors(axes, t, usual, followed):
    """Les sauts."""
    import figures

    axes.plot(t, usual, ".", color=figures.ORANGE, markersize=5, label="OpenCV, meilleure reprojection")
    axes.plot(t, followed, color=figures.BLUE, label="suivi à deux hypothèses")
    axes.set(title="Erreur de la normale", xlabel="temps (s)", ylabel="erreur (°)")
    axes.set_ylim(0.0, 1.35 * max(usual.max(), followed.max()))
    axes.legend(loc="upper right")


def draw_odds(axes, t, alone, followed):
    """La cote d'une image seule, et celle de toutes jusqu'ici."""
    import figures

    axes.plot(t, np.minimum(alone, 1e6), ".", color=figures.ORANGE, markersize=5, label="image seule")
    axes.plot(t, np.minimum(followed, 1e6), color=figures.BLUE, label="suivi")
    axes.axhline(20.0, color="#666666", linestyle="--", linewidth=1.0, label="20 : certain")
    axes.set(
        title="Cote de la première lecture (plafond : 10⁶)", xlabel="temps (s)", yscale="log", ylim=(0.7, 2e8)
    )
    axes.set_yticks([1, 1e2, 1e4, 1e6])
    axes.legend(loc="upper right", ncols=3)


if __name__ == "__main__":
    main()
