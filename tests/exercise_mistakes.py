"""What a mistake changes in the solutions of E2, E3, E4, K3 and D3, and the name that it has."""

from exercise_copies import D3, E2, E3, E3_SCIPY, E4, K3

MEDIAN = "np.median(x[max(0, i - h):i + h + 1])"
JUMP = "if abs(x[i] - m) > seuil * 1.4826 * mad:"
MAD = "mad = np.median(np.abs(fenetre - m))"
FIT = "return a, b, c"
INVERSE = "return a / (v - c) - b"
SIGMA = "return a / (v - c) ** 2 * sigma_v"
STEPS = "((1, 0), (-1, 0), (0, 1), (0, -1))"
CENTRE = "cx, cy = np.mean(pix, axis=0)"
SORT = "res.sort(key=lambda c: c[0], reverse=True)"
MARK = "                            vu[a, b] = True\n"
BIG = "    return objets[0][1]\n"
FOLD = "return (a + np.pi) % (2 * np.pi) - np.pi"

# (solution, cause, the lines that are changed)
WRONG = [
    (E2, "moyenne au lieu de la médiane", [(MEDIAN, MEDIAN.replace("median", "mean"))]),
    (E2, "fenêtre vers le passé seulement", [(MEDIAN, "np.median(x[max(0, i - k + 1):i + 1])")]),
    (E2, "k pris pour une demi-fenêtre", [("    h = k // 2\n    y", "    h = k\n    y")]),
    (E2, "dernière mesure de la fenêtre oubliée", [(MEDIAN, "np.median(x[max(0, i - h):i + h])")]),
    (E2, "fenêtre pas triée", [(MEDIAN, "x[i]")]),
    (E2, "médiane de valeurs déjà filtrées", [("y = np.zeros(len(x))", "y = x = np.array(x, float)")]),
    (E2, "argument modifié", [("y = np.zeros(len(x))", "y = x")]),
    (E2, "bords coupés", [("    return y", "    return y[h:len(x) - h]")]),
    (E2, "écart-type au lieu de la MAD", [(MAD, "mad = np.std(fenetre) / 1.4826")]),
    (E2, "écart-type global au lieu de la MAD", [(MAD, "mad = np.std(x) / 1.4826")]),
    (E2, "valeur absolue oubliée", [(JUMP, JUMP.replace("abs(x[i] - m)", "x[i] - m"))]),
    (E2, "seuil absolu", [(JUMP, "if abs(x[i] - m) > seuil:")]),
    (E2, "seuil ignoré (σ)", [(JUMP, JUMP.replace("seuil * ", ""))]),
    (E2, "MAD sans valeur absolue", [(MAD, "mad = np.median(fenetre - m)")]),
    (E2, "comparaison à l'envers", [(JUMP, JUMP.replace(">", "<"))]),
    (E2, "valeurs au lieu des indices", [("sauts.append(i)", "sauts.append(x[i])")]),
    (E2, "return oublié", [("    return sauts", "    pass")]),
    (E3, "ordre des constantes (b avant a)", [(FIT, "return b, a, c")]),
    (E3, "b oubliée dans l'ajustement",
     [("-a / (d + b) ** 2, ", ""), ("b + pas[1], c + pas[2]", "b, c + pas[1]")]),
    (E3, "ajustement qui n'a pas convergé", [("range(100)", "range(1)")]),
    (E3, "signe de b", [(FIT, "return a, -b, c")]),
    (E3_SCIPY, "d et v échangés", [("def ajuster(d, v)", "def ajuster(v, d)")]),
    (E3, "b oubliée", [(INVERSE, "return a / (v - c)")]),
    (E3, "signe de b", [(INVERSE, "return a / (v - c) + b")]),
    (E3, "c oubliée", [(INVERSE, "return a / v - b")]),
    (E3, "formule directe au lieu de son inverse", [(INVERSE, "return a / (v + b) + c")]),
    (E3, "incertitude sans la dérivée", [(SIGMA, "return sigma_v")]),
    (E3, "dérivée à l'envers", [(SIGMA, "return (v - c) ** 2 / a * sigma_v")]),
    (E3, "carré oublié", [(SIGMA, "return a / (v - c) * sigma_v")]),
    (E3, "variance au lieu de l'écart-type", [(SIGMA, "return (a / (v - c) ** 2 * sigma_v) ** 2")]),
    (E3, "signe de la dérivée", [(SIGMA, "return -a / (v - c) ** 2 * sigma_v")]),
    (E4, "8-connexité au lieu de la 4-connexité",
     [(STEPS, "[(p, q) for p in (-1, 0, 1) for q in (-1, 0, 1) if p or q]")]),
    (E4, "diagonales au lieu des côtés", [(STEPS, "((1, 1), (1, -1), (-1, 1), (-1, -1))")]),
    (E4, "voisins oubliés (gauche et haut)", [(STEPS, "((1, 0), (0, 1))")]),
    (E4, "bord de l'image dépassé", [("0 <= a < h and 0 <= b < w and ", "")]),
    (E4, "l'image se replie à ses bords", [("0 <= a < h and 0 <= b < w and ", "a < h and b < w and ")]),
    (E4, "bords de l'image oubliés",
     [("0 <= a < h and 0 <= b < w", "0 < a < h - 1 and 0 < b < w - 1"), ("in range(h)", "in range(1, h - 1)"),
      ("in range(w)", "in range(1, w - 1)")]),
    (E4, "de la plus petite à la plus grande", [(SORT, "res.sort(key=lambda c: c[0])")]),
    (E4, "pas triées", [(SORT, "pass")]),
    (E4, "fond compté", [("masque[", "not masque[")]),
    (E4, "pixels comptés plusieurs fois",
     [(MARK, ""), ("file.popleft()\n", "file.popleft(); vu[y, x] = True\n")]),
    (E4, "centre de la boîte au lieu du centre de gravité",
     [(CENTRE, "cx, cy = (np.min(pix, axis=0) + np.max(pix, axis=0)) / 2")]),
    (E4, "premier pixel au lieu du centre de gravité", [(CENTRE, "cx, cy = pix[0]")]),
    (E4, "argument modifié", [("    vu = np.zeros((h, w), bool)\n", ""), ("and not vu[i, j]", ""),
                              ("and not vu[a, b]", ""), ("vu[i, j] = True", "masque[i, j] = 0"),
                              ("vu[a, b] = True", "masque[a, b] = 0")]),
    (E4, "masque comparé à 1", [("if masque[i, j] and", "if masque[i, j] == 1 and"),
                                ("and masque[a, b] and", "and masque[a, b] == 1 and")]),
    (E4, "aire_min ignorée", [(" or objets[0][0] < aire_min", "")]),
    (E4, "autre chose que None", [("        return None", "        return (0, 0)")]),
    (E4, "(aire, centre) au lieu du centre", [(BIG, "    return objets[0]\n")]),
    (E4, "plus petite au lieu de la plus grande", [(BIG, "    return objets[-1][1]\n")]),
    (K3, "angle pas replié", [("return replier(z - prevu)", "return z - prevu")]),
    (K3, "angle pas replié", [(FOLD, "return a")]),
    (K3, "angle pas replié", [("nu = innovation(z, self.H @ self.x)", "nu = z - self.H @ self.x")]),
    (K3, "replié dans [0, 2π[", [(FOLD, "return a % (2 * np.pi)")]),
    (K3, "signe de l'innovation", [("replier(z - prevu)", "replier(prevu - z)")]),
    (K3, "degrés au lieu de radians", [(FOLD, "return (a + 180) % 360 - 180")]),
]  # fmt: skip

WRONG += [
    (D3, "facteur n + κ oublié", [("(n + kappa) * P", "P")]),
    (D3, "n au lieu de n + κ", [("cholesky((n + kappa) * P)", "cholesky(n * P)")]),
    (D3, "lignes au lieu des colonnes de la racine", [("L[:, i]", "L[i]")]),
    (D3, "racine élément par élément", [("np.linalg.cholesky", "np.sqrt")]),
    (D3, "poids", [("1 / (2 * (n + kappa))", "1 / (n + kappa)")]),
    (D3, "return oublié", [("return", "resultat =")]),
]
