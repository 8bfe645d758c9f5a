"""C3 (fin de la chaîne). Détecter et segmenter des objets : un réseau, des marqueurs, ou la couleur.

- Détecter : dire quel objet est où (un rectangle, une classe, une note).  Segmenter : dire quels pixels.
- Un détecteur neuronal s'échange dans un fichier ONNX ; OpenCV le fait tourner sans la bibliothèque qui
  l'a appris.  Celui d'ici est minuscule, mais c'en est un : une couche convolutive apprise sur trois images
  étiquetées, puis une fenêtre glissante.  On le lit comme un grand :
  `factorlab objects PHOTO --onnx yolo11n.onnx`.
- Un réseau rend plusieurs rectangles par objet : la suppression des non-maximums (NMS) n'en garde qu'un.
- ArUco : un objet fait pour être détecté.  Ni apprentissage, ni faux positif ou presque, et un numéro.
- Couleur et morphologie : assez dans les cas simples ; réglées sous une lumière, elles s'en souviennent
  (voir P4).  Le réseau, lui, a vu plusieurs lumières quand il a appris.

Qualité : intersection sur union (IoU) du rectangle, ou des pixels, avec la vérité.  Il faut `onnx` pour
écrire le réseau (`pip install onnx`).  Avec FACTORLAB_DATA, les marqueurs sont ceux d'une vraie photographie.
"""

import os
from pathlib import Path

import numpy as np
import onnx
from claims import claim
from figures import BLUE, GREEN, ORANGE, out_folder, panels, save
from onnx import TensorProto, helper, numpy_helper

from vision3d.image import gaussian_blur
from vision3d.images import read_image
from vision3d.markers import detect_markers
from vision3d.objects import ColourRange, ObjectNetwork, find_blobs, iou

WIDTH, HEIGHT, SIDE, STEP = 320, 240, 40, 4  # px : image, objets, pas de la fenêtre glissante
CLASSES = ("fond", "rouge", "bleu")
PAINT = {"rouge": (35, 30, 210), "bleu": (200, 90, 30)}
HUES = {
    "rouge": ColourRange.from_text("hsv:172-8,140-255,60-255"),
    "bleu": ColourRange.from_text("hsv:98-118,140-255,60-255"),
}


def scene(rng, light, count=5):
    """Une table, des balles rouges et bleues, gains B, V, R de la lumière : image, étiquettes, rectangles."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    image = np.full((HEIGHT, WIDTH, 3), (95.0, 120.0, 140.0)) + 15 * np.sin(x / 11.0)[..., None]
    labels, boxes, places = np.zeros(x.shape, int), [], []
    while len(boxes) < count:
        centre = rng.uniform((30, 30), (WIDTH - 30, HEIGHT - 30))
        if any(np.linalg.norm(centre - other) < 50 for other in places):
            continue
        kind = 1 + len(boxes) % 2
        inside = np.hypot(x - centre[0], y - centre[1]) < SIDE / 2
        shade = np.clip(1.1 - np.hypot(x - centre[0] + 6, y - centre[1] + 6) / 60, 0.5, 1)[..., None]
        image = np.where(inside[..., None], shade * np.array(PAINT[CLASSES[kind]]), image)
        labels[inside] = kind
        places.append(centre)
        boxes.append((kind, *(centre - SIDE / 2), SIDE, SIDE))
    noisy = gaussian_blur((image * light).clip(0, 255).astype(np.uint8), 0.8) + 5 * rng.standard_normal(
        image.shape
    )
    return np.clip(noisy, 0, 255).astype(np.uint8), labels, np.array(boxes)


def learn(rng):
    """Poids (3, 3) et biais (3,) d'une couche qui classe un pixel, appris sur trois lumières."""
    lights = ((1.0, 1.0, 1.0), (0.45, 0.45, 0.45), (0.5, 0.75, 1.0))
    pairs = [scene(rng, light)[:2] for light in lights]
    x = np.concatenate([image[..., ::-1].reshape(-1, 3) for image, _ in pairs])[::7] / 255.0  # rouge d'abord
    wanted = np.eye(3)[np.concatenate([labels.ravel() for _, labels in pairs])[::7]]
    balance = wanted @ (1 / wanted.sum(axis=0))  # autant de poids à chaque classe
    weights, bias = np.zeros((3, 3)), np.zeros(3)
    for _ in range(400):  # descente de gradient de l'entropie croisée
        scores = x @ weights.T + bias
        p = np.exp(scores - scores.max(axis=1, keepdims=True))
        p /= p.sum(axis=1, keepdims=True)
        off = (p - wanted) * balance[:, None]
        weights, bias = weights - 40 * off.T @ x, bias - 40 * off.sum(axis=0)
    return weights.astype(np.float32), bias.astype(np.float32)


def write_onnx(path, weights, bias, *, detector):
    """Le réseau dans un fichier : des probabilités par pixel, ou des rectangles notés comme en rend YOLO."""
    nodes = [
        helper.make_node("Conv", ["images", "weights", "bias"], ["scores"]),
        helper.make_node("Softmax", ["scores"], ["map"], axis=1),
    ]
    tensors = {"weights": weights[:, :, None, None], "bias": bias}
    shape = (1, len(CLASSES), HEIGHT, WIDTH)
    if detector:  # la part de chaque couleur dans une fenêtre de la taille d'un objet
        columns, rows = (WIDTH - SIDE) // STEP + 1, (HEIGHT - SIDE) // STEP + 1
        v, u = np.mgrid[:rows, :columns] * STEP + SIDE / 2
        size = np.full(u.size, SIDE)
        tensors["boxes"] = np.stack([u.ravel(), v.ravel(), size, size]).astype(np.float32)[None]
        tensors["flat"] = np.array([1, len(CLASSES), rows * columns], np.int64)
        window = {"kernel_shape": [SIDE, SIDE], "strides": [STEP, STEP]}
        nodes += [
            helper.make_node("AveragePool", ["map"], ["windows"], **window),
            helper.make_node("Reshape", ["windows", "flat"], ["shares"]),
            helper.make_node("Concat", ["boxes", "shares"], ["output0"], axis=1),
        ]
        shape = (1, 4 + len(CLASSES), rows * columns)
    put = helper.make_tensor_value_info("images", TensorProto.FLOAT, [1, 3, HEIGHT, WIDTH])
    out = helper.make_tensor_value_info("output0" if detector else "map", TensorProto.FLOAT, list(shape))
    stored = [numpy_helper.from_array(np.ascontiguousarray(a), name) for name, a in tensors.items()]
    graph = helper.make_graph(nodes, "balles", [put], [out], stored)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    onnx.save(model, str(path))
    return path


def found_boxes(image, network):
    """Rectangles et classes rendus par le réseau, le fond excepté."""
    seen = network.detect(image, least_score=0.55, most_overlap=0.2)
    keep = seen.labels > 0
    return seen.boxes[keep], seen.labels[keep]


def score_boxes(boxes, labels, truth):
    """Objets retrouvés (IoU > 0,5, bonne classe), fausses alertes, IoU moyenne des retrouvés."""
    overlap = iou(boxes, truth[:, 1:]) * (labels[:, None] == truth[:, 0])
    best = overlap.max(axis=0) if len(boxes) else np.zeros(len(truth))
    false = int((overlap.max(axis=1) < 0.5).sum()) if len(boxes) else 0
    return int((best > 0.5).sum()), false, float(best[best > 0.5].mean()) if (best > 0.5).any() else 0.0


def mask_iou(mask, truth):
    """Intersection sur union de deux masques."""
    return (mask & truth).sum() / max((mask | truth).sum(), 1)


def markers():
    """Une photo et ses marqueurs ArUco : la vraie du tutoriel d'OpenCV, ou une planche dessinée."""
    photo = Path(os.environ.get("FACTORLAB_DATA") or "nowhere") / "vision/aruco/singlemarkersoriginal.jpg"
    if photo.is_file():
        return read_image(photo), "6x6_250", {23, 40, 62, 98, 124, 203}, "photo d'OpenCV"
    import cv2

    known = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_250)
    sheet = np.full((240, 340), 200, np.uint8)
    for k, number in enumerate((23, 40, 62, 98, 124, 203)):
        top, left = 20 + 110 * (k // 3), 20 + 110 * (k % 3)
        sheet[top : top + 80, left : left + 80] = cv2.aruco.generateImageMarker(known, number, 80)
    return gaussian_blur(sheet, 1.0), "6x6_250", {23, 40, 62, 98, 124, 203}, "simulé"


def main():
    rng = np.random.default_rng(13)
    weights, bias = learn(rng)
    detector, segmenter = (
        ObjectNetwork(
            write_onnx(out_folder() / f"13_{name}.onnx", weights, bias, detector=name == "rectangles"),
            names=CLASSES,
        )
        for name in ("rectangles", "pixels")
    )
    lights = [
        rng.uniform(0.4, 1.0) * np.array([rng.uniform(0.55, 1), rng.uniform(0.8, 1), 1]) for _ in range(20)
    ]
    tests = [scene(rng, light) for light in lights]
    scores = np.array([score_boxes(*found_boxes(image, detector), truth) for image, _, truth in tests])
    by_net, by_hue = [], []
    for image, labels, _ in tests:
        seen = segmenter.segment(image)
        for kind in (1, 2):
            by_net.append(mask_iou(seen.mask(kind), labels == kind))
            by_hue.append(mask_iou(find_blobs(image, HUES[CLASSES[kind]]).mask > 0, labels == kind))
    total = sum(len(truth) for _, _, truth in tests)
    photo, dictionary, numbers, source = markers()
    seen = detect_markers(photo, dictionary)
    read = {marker.id for marker in seen}

    claim(
        "C3",
        "balles retrouvées par le réseau, 20 lumières jamais vues",
        100 * scores[:, 0].sum() / total,
        "%",
        low=95,
    )
    claim("C3", "fausses alertes du réseau, sur 20 images", scores[:, 1].sum(), low=0, high=3)
    claim("C3", "IoU des rectangles retrouvés", scores[:, 2].mean(), low=0.8)
    claim("C3", "IoU des pixels, réseau", np.mean(by_net), low=0.85)
    claim("C3", "marqueurs ArUco lus, sur 6", len(read & numbers), low=6, high=6, source=source)
    assert read <= numbers, "aucun marqueur qui n'y soit pas"
    assert np.mean(by_net) > np.mean(by_hue), "la couleur seule paie les changements de lumière"
    draw(tests[0], detector, segmenter, by_net, by_hue, photo, seen)


def draw(test, detector, segmenter, by_net, by_hue, photo, seen):
    """Les rectangles, les pixels, les deux segmentations, les marqueurs."""
    image, labels, truth = test
    figure, (a, b, c, d) = panels(
        1, 4, size=(16.0, 3.9), title="C3. Détecter et segmenter : réseau, couleur, marqueurs"
    )
    a.imshow(image[:, :, ::-1])
    raw = detector.detect(image, least_score=0.55, most_overlap=0.95)
    for boxes, colour, width in (
        (raw.boxes[raw.labels > 0], "white", 0.4),
        (found_boxes(image, detector)[0], GREEN, 2.0),
    ):
        for left, top, w, h in boxes:
            a.plot(
                [left, left + w, left + w, left, left],
                [top, top, top + h, top + h, top],
                color=colour,
                linewidth=width,
            )
    a.set(title=f"Réseau : {len(truth)} balles ; en blanc, avant la NMS", xlim=(0, WIDTH), ylim=(HEIGHT, 0))
    b.imshow(segmenter.segment(image).labels, cmap="viridis")
    b.contour(labels > 0, levels=[0.5], colors="white", linewidths=1)
    b.set(title="Réseau : une classe par pixel")
    c.plot(np.sort(by_net), color=GREEN, label=f"réseau : {np.mean(by_net):.2f} en moyenne")
    c.plot(np.sort(by_hue), color=ORANGE, label=f"HSV fixe : {np.mean(by_hue):.2f}")
    c.set(
        title="Segmentation sous 20 lumières",
        xlabel="masque, du pire au meilleur",
        ylabel="IoU",
        ylim=(-0.02, 1.35),
    )
    c.legend(loc="upper left")
    d.imshow(photo, cmap="gray")
    for marker in seen:
        corners = marker.corners
        d.plot(*np.vstack([corners, corners[:1]]).T, color=BLUE)
        label = {"color": ORANGE, "ha": "center", "weight": "bold", "fontsize": 8}
        d.text(marker.centre[0], corners[:, 1].min() - 0.02 * photo.shape[0], str(marker.id), **label)
    d.set(title="ArUco : un numéro pour chacun")
    for axis in (a, b, d):
        axis.axis("off")
    save(figure)


if __name__ == "__main__":
    main()
