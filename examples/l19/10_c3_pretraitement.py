"""C3 (première moitié). Préparer une image avant d'y chercher quelque chose.

- Gris : 0,299 R + 0,587 V + 0,114 B, et non la moyenne : l'œil, et le capteur, voient surtout le vert.
- Flou : le bruit fait des coins partout ; un flou les ôte, et rentre les vrais d'un ou deux pixels.
- Égalisation : elle étale les niveaux, donc le bruit avec eux ; le rapport du contraste au bruit ne gagne
  rien. Elle ne sert qu'à ce qui a un seuil fixe, comme FAST ; Harris, au seuil relatif, s'en passe.
- Harris : un coin est là où la fenêtre change dans toutes les directions (deux grandes valeurs propres).
- Segmentation simple : couleur, puis ouverture et fermeture ; elle se juge à l'intersection sur l'union.

Deux vues, la détection par un réseau et ORB ou SIFT sont l'autre moitié de la chaîne.
"""

import numpy as np

from vision3d.image import corners, equalise, gaussian_blur, grey
from vision3d.objects import ColourRange, find_blobs

BRUIT = 4.0  # niveaux
CARRES = [(70 + 90 * i, 60 + 90 * j) for j in range(3) for i in range(4)]


def scene(rng):
    """Douze carrés tournés, à peine plus clairs que le fond, et leurs 48 coins (x, y)."""
    y, x = np.mgrid[:300, :400].astype(float)
    image, coins = 20.0 + 0.03 * x, []
    for cx, cy in CARRES:
        angle, demi = rng.uniform(0, np.pi / 2), rng.uniform(16, 26)
        u = np.cos(angle) * (x - cx) + np.sin(angle) * (y - cy)
        v = -np.sin(angle) * (x - cx) + np.cos(angle) * (y - cy)
        # un bord de deux pixels, comme en donne un objectif
        dedans = np.clip(demi - np.abs(u) + 0.5, 0, 1) * np.clip(demi - np.abs(v) + 0.5, 0, 1)
        image += 16.0 * dedans
        for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            coins.append((cx + demi * (a * np.cos(angle) - b * np.sin(angle)),
                          cy + demi * (a * np.sin(angle) + b * np.cos(angle))))  # fmt: skip
    image += BRUIT * rng.standard_normal(image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), np.array(coins)


def juger(trouves, vrais, rayon=3.0):
    """Part des vrais coins retrouvés, part de vrais parmi les trouvés, distance moyenne (px)."""
    if len(trouves) == 0:
        return 0.0, 0.0, np.nan
    distances = np.linalg.norm(trouves[:, None] - vrais, axis=2)
    pres = distances.min(axis=0)
    retrouves = pres <= rayon
    distance = pres[retrouves].mean() if retrouves.any() else np.nan
    return retrouves.mean(), np.mean(distances.min(axis=1) <= rayon), distance


def fast(image, seuil=20):
    """Les coins de FAST (OpenCV) : un arc de cercle plus clair ou plus sombre d'un seuil fixe."""
    import cv2

    points = cv2.FastFeatureDetector_create(seuil).detect(image)
    return np.array([p.pt for p in points]).reshape(-1, 2)


def contraste_sur_bruit(image):
    """Différence entre un carré et le fond, sur l'écart-type du fond."""
    carre = image[CARRES[5][1] - 8 : CARRES[5][1] + 9, CARRES[5][0] - 8 : CARRES[5][0] + 9].astype(float)
    fond = image[:12, 180:220].astype(float)
    return (carre.mean() - fond.mean()) / fond.std(), fond.std()


def balle_rouge(rng):
    """Une balle rouge ombrée, un reflet blanc, du bruit ; et le masque vrai."""
    y, x = np.mgrid[:160, :200]
    vrai = np.hypot(x - 100, y - 80) < 45
    ombre = np.clip(1.15 - np.hypot(x - 85, y - 65) / 110, 0.35, 1.0)
    image = np.where(vrai[..., None], np.array([30, 25, 215]) * ombre[..., None], np.array([95, 110, 90]))
    image[np.hypot(x - 84, y - 62) < 4] = 250
    image[rng.random(vrai.shape) < 0.01] = (40, 30, 200)
    return np.clip(image + 8 * rng.standard_normal(image.shape), 0, 255).astype(np.uint8), vrai


def main():
    from figures import BLUE, GREEN, ORANGE, panels, save

    rng = np.random.default_rng(3)
    feuille = np.array([[[40, 160, 40], [40, 40, 160]]], np.uint8)  # BGR : vert, rouge ; même moyenne
    vert, rouge = grey(feuille)[0].tolist()
    print(f"vert et rouge de même moyenne (80) : {vert} et {rouge} en gris")

    image, vrais = scene(rng)
    flou = gaussian_blur(image, 1.5)
    etalee = equalise(flou)
    rapports = {nom: contraste_sur_bruit(i) for nom, i in {"flou": flou, "égalisée": etalee}.items()}
    for nom, (rapport, bruit) in rapports.items():
        print(f"image {nom:9} : contraste/bruit {rapport:5.1f}, bruit {bruit:5.2f} niveaux")

    essais = {
        "Harris, brute": corners(image, quality=0.1, min_distance_px=6),
        "Harris, floue": corners(flou, quality=0.1, min_distance_px=6),
        "FAST, floue": fast(flou),
        "FAST, égalisée": fast(etalee),
    }
    notes = {nom: juger(points, vrais) for nom, points in essais.items()}
    for nom, (rappel, precision, distance) in notes.items():
        print(f"{nom:15} : {len(essais[nom]):4d} coins, {100 * rappel:3.0f} % des vrais, "
              f"{100 * precision:3.0f} % de justes, à {distance:.1f} px")  # fmt: skip

    balle, masque = balle_rouge(rng)
    rouges = ColourRange.from_text("hsv:172-8,130-255,50-255")
    brut = rouges.mask(balle) > 0
    net = find_blobs(balle, rouges, open_px=5, close_px=11, least_area=200).mask > 0
    iou = {nom: (m & masque).sum() / (m | masque).sum() for nom, m in {"brut": brut, "net": net}.items()}
    print(f"segmentation, intersection sur union : {iou['brut']:.3f} brute, {iou['net']:.3f} nettoyée")

    figure, axes = panels(2, 3, size=(12.0, 6.6), title="C3. Préparer une image")
    for ax, montree, titre, nom, couleur in (
        (axes[0], image, "sombre et bruitée : Harris", "Harris, brute", ORANGE),
        (axes[1], flou, "floue : Harris", "Harris, floue", BLUE),
        (axes[2], etalee, "floue, égalisée : FAST à seuil fixe", "FAST, égalisée", GREEN),
    ):
        ax.imshow(montree, cmap="gray", vmin=0, vmax=255 if montree is etalee else 60)
        ax.plot(*essais[nom].T, "o", color=couleur, markerfacecolor="none", markersize=5)
        ax.set(title=titre)
        ax.axis("off")
    for niveaux, couleur, nom in ((flou, BLUE, "floue"), (etalee, GREEN, "égalisée")):
        axes[3].hist(niveaux.ravel(), bins=np.arange(0, 257, 4), color=couleur, alpha=0.6, label=nom)
    axes[3].set(title="histogrammes", xlabel="niveau", yscale="log")
    axes[3].legend()
    axes[4].imshow(balle[:, :, ::-1])
    axes[4].contour(net, levels=[0.5], colors="white", linewidths=1.5)
    axes[4].set(title=f"couleur et morphologie : IoU {iou['net']:.2f}".replace(".", ","))
    axes[5].imshow(brut, cmap="gray")
    axes[5].set(title=f"couleur seule : IoU {iou['brut']:.2f}".replace(".", ","))
    for ax in axes[4:]:
        ax.axis("off")
    save(figure)

    assert vert > rouge + 30, "la moyenne des canaux les confondrait"
    assert notes["Harris, floue"][0] > 0.9, "presque tous les coins, sans égaliser"
    assert notes["Harris, floue"][1] > 0.9, "et peu d'autres"
    assert notes["Harris, brute"][1] < 0.5, "sans flou, le bruit fait des coins"
    assert notes["FAST, floue"][0] < 0.1, "un seuil fixe ne voit rien dans le sombre"
    assert notes["FAST, égalisée"][0] > 0.7, "l'égalisation lui rend les coins"
    assert notes["FAST, égalisée"][1] < 0.5, "et lui donne ceux du bruit étalé"
    assert rapports["égalisée"][1] > 3 * rapports["flou"][1], "mais elle étale aussi le bruit"
    assert rapports["égalisée"][0] < 1.2 * rapports["flou"][0], "et n'ajoute aucune information"
    assert iou["net"] > 0.98, "l'ouverture ôte les grains, la fermeture bouche le reflet"
    assert iou["brut"] < 0.97, "la couleur seule garde les uns et perd l'autre"


if __name__ == "__main__":
    main()
