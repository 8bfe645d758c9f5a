"""TP4 (c). Suivre une ligne : du niveau de gris au décalage en centimètres.

Le robot regarde le sol ; où est la ligne, et vers où va-t-elle ?

- Un seul seuil pour toute l'image (Otsu) prend l'ombre pour la ligne.  Le seuil adaptatif compare chaque
  pixel à la moyenne autour de lui : la lumière peut varier, la ligne reste.
- L'ouverture ôte les points isolés, la fermeture bouche les trous.
- Le centre de la rangée du bas donne le décalage, celui de la rangée du milieu regarde devant : la droite qui
  les joint donne le cap.
- Quatre marques au sol, mesurées au mètre, donnent l'homographie : les pixels deviennent des centimètres, et
  l'incertitude du pointé suit.

`find_line` fait la même chose en suivant la bande rangée par rangée, avec une confiance : elle sait dire
qu'il n'y a pas de ligne.  Avec FACTORLAB_DATA, on lui montre la photo d'un immeuble.
"""

import os
from pathlib import Path

import numpy as np

from vision3d.camera import Camera
from vision3d.image import adaptive_threshold, closing, opening, otsu
from vision3d.images import read_image
from vision3d.lines import CameraMount, GroundHomography, draw_line, find_line, planar_pose, read_scene
from vision3d.render import GroundLine, drive, random_line, render_ground
from vision3d.rigid import transform

CAMERA = Camera("brown5", (266.0, 266.0, 171.0, 117.0), (-0.28, 0.02, 0.0012, -0.0001, 0.16), (320, 240))
MOUNT = CameraMount(height_m=0.20, pitch_rad=np.radians(32.0))
MARKS = np.array([[0.22, 0.08], [0.22, -0.08], [0.45, 0.12], [0.45, -0.12]])  # mesurées au mètre
BOTTOM, MIDDLE = 239, 120  # rangées


def in_shadow(image):
    """La lumière vient de la gauche ; à droite il n'en reste qu'un quart."""
    columns = np.arange(image.shape[1])
    light = 1.0 - 0.75 / (1.0 + np.exp(-(columns - 200.0) / 35.0))
    return np.clip(image * light, 0, 255).astype(np.uint8)


def mask_of(image):
    """Seuil adaptatif, puis morphologie."""
    dark = adaptive_threshold(image, 81, 12, inverted=True)
    return closing(opening(dark, 3), 5)


def centre(mask, row, half=3):
    """Le centre des pixels allumés autour d'une rangée ; NaN s'il n'y en a pas."""
    lit = np.flatnonzero(mask[max(0, row - half) : row + half + 1].any(axis=0))
    return lit.mean() if len(lit) else np.nan


def by_hand(image):
    """Décalage (−1 à 1) et cap (°) lus sur deux rangées."""
    mask = mask_of(image)
    bottom, middle = centre(mask, BOTTOM - 3), centre(mask, MIDDLE)
    offset = (bottom - 159.5) / 160.0
    return bottom, middle, offset, np.degrees(np.arctan2(middle - bottom, BOTTOM - MIDDLE))


def ground_from_marks(rng, sigma_px=0.3):
    """L'homographie, de quatre marques pointées dans l'image."""
    robot = MOUNT.world_pose(planar_pose(0.0, 0.0, 0.0))
    pixels = CAMERA.project(transform(robot, np.column_stack([MARKS, np.zeros(4)])))
    pointed = pixels + rng.normal(0.0, sigma_px, pixels.shape)
    return GroundHomography.from_points(pointed, MARKS, camera=CAMERA, sigma_px=sigma_px)


def follow(ground, rng):
    """Un trajet : décalage lu et décalage vrai (m), σ annoncé, et les temps."""
    line = random_line(rng, length_m=3.0, width_m=0.03)
    rows = []
    for view in drive(CAMERA, MOUNT, line, rng=rng, fps=8.0, shutter_s=0.01):
        reading = find_line(view.image)
        if not reading.found:
            continue
        metres = ground.read(reading)
        true, _ = line.seen_from(view.pose, metres.near[0])
        rows.append([view.t_s, metres.offset_m, true, np.sqrt(metres.cov[0, 0])])
    return np.array(rows)


def main():
    from claims import claim
    from figures import panels, save, say

    rng = np.random.default_rng(4)
    straight = GroundLine(np.array([[-1.0, 0.0], [3.0, 0.0]]), 0.03)
    pose = np.array([0.0, -0.02, 0.1])
    image = in_shadow(render_ground(CAMERA, MOUNT, straight, pose, rng=rng, noise=3.0))

    single = image <= otsu(image)
    bottom, middle, offset, heading = by_hand(image)
    reading = find_line(image)
    say(f"Otsu seul : {100 * single.mean():.0f} % de l'image serait la ligne")
    say(f"à la main : décalage {offset:+.3f}, cap {heading:+.1f}°")
    say(
        f"find_line : décalage {reading.offset:+.3f}, cap {np.degrees(reading.heading_rad):+.1f}°, "
        f"confiance {reading.confidence:.2f}"
    )

    ground = ground_from_marks(rng)
    metres = ground.read(reading)
    true, true_heading = straight.seen_from(pose, metres.near[0])
    sigma = np.sqrt(np.diag(metres.cov))
    say(
        f"au sol, à {100 * metres.near[0]:.0f} cm : {1000 * metres.offset_m:+.1f} ± {1000 * sigma[0]:.1f} mm "
        f"(vrai {1000 * true:+.1f}), cap {np.degrees(metres.heading_rad):+.1f} ± {np.degrees(sigma[1]):.1f}° "
        f"(vrai {np.degrees(true_heading):+.1f})"
    )
    path = follow(ground, rng)
    rms = np.sqrt(np.mean((path[:, 1] - path[:, 2]) ** 2))
    say(f"en route : {len(path)} images, erreur RMS {1000 * rms:.1f} mm")

    figure, axes = panels(2, 3, size=(13.0, 7.4), title="TP4 (c). Suivre une ligne")
    for ax, shown, title in (
        (axes[0], image, "L'image : il fait sombre à droite"),
        (axes[1], 255 * ~single, "Un seul seuil (Otsu) : l'ombre est « ligne »"),
        (axes[2], 255 - mask_of(image), "Seuil adaptatif, ouverture, fermeture"),
        (axes[3], draw_line(image, reading)[..., ::-1], "Centres du bas et du milieu"),
        (axes[4], above(ground, image, reading), "Le sol vu de dessus"),
    ):
        ax.imshow(shown, cmap="gray", vmin=0, vmax=255)
        ax.set_title(title)
        ax.axis("off")
    axes[2].plot([bottom, middle], [BOTTOM - 3, MIDDLE], "o-", color="#D55E00")
    draw_path(axes[5], path)
    save(figure)

    claim("TP4c", "en route, au sol : erreur RMS du décalage", 1e3 * rms, "mm", high=2.0)
    claim(
        "TP4c",
        "Otsu seul : part de l'image prise pour la ligne",
        100 * single.mean(),
        "%",
        low=25.0,
    )
    claim("TP4c", "à la main et find_line : écart du décalage", abs(offset - reading.offset), high=0.05)
    claim(
        "TP4c",
        "décalage au sol : erreur en σ annoncés",
        abs(metres.offset_m - true) / sigma[0],
        "σ",
        high=4.0,
    )
    assert abs(metres.heading_rad - true_heading) < 4 * sigma[1] + 0.01
    assert not find_line(np.full((240, 320), 120, np.uint8)).found, "sans ligne, elle le dit"
    building()


def above(ground, image, reading):
    """L'image redressée, avec ce qui a été trouvé."""
    drawn = draw_line(image, reading)
    return ground.bird_eye(drawn, x_m=(0.16, 0.55), y_m=(-0.22, 0.22), px_per_m=700.0)[..., ::-1]


def building():
    """La photo d'un immeuble n'a pas de ligne à suivre."""
    from claims import claim

    photo = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision/opencv/building.jpg"
    if not photo.is_file():
        return
    image = read_image(photo)
    reading, scene = find_line(image), read_scene(image)
    seen = f"{len(scene.segments)} segments, {len(scene.points)} points de fuite"
    print(f"immeuble : {'une' if reading.found else 'pas de'} ligne à suivre ; {seen}")
    claim(
        "TP4c",
        "lignes à suivre trouvées sur la photo d'un immeuble",
        reading.found,
        high=0,
        source="photo OpenCV",
    )
    assert scene.built


def draw_path(axes, path):
    """Le décalage le long d'un trajet, et la vérité."""
    import figures

    t, read, true, sigma = path.T
    axes.fill_between(t, 100 * (read - 2 * sigma), 100 * (read + 2 * sigma), color=figures.BLUE, alpha=0.25)
    axes.plot(t, 100 * read, color=figures.BLUE, label="lu, ±2σ")
    axes.plot(t, 100 * true, label="vérité", **figures.TRUTH)
    axes.set(title="Le décalage en route", xlabel="temps (s)", ylabel="décalage à gauche (cm)")
    axes.legend(loc="upper right")


if __name__ == "__main__":
    main()
