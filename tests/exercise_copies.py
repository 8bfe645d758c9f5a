"""E2, E3, E4, K3 and D3 as students write them: right solutions of several tastes."""

E2 = """
import numpy as np

def median_glissant(x, k):
    h = k // 2
    y = np.zeros(len(x))
    for i in range(len(x)):
        y[i] = np.median(x[max(0, i - h):i + h + 1])
    return y

def detecter_sauts(x, k, seuil):
    x = np.asarray(x, float)
    h = k // 2
    sauts = []
    for i in range(len(x)):
        fenetre = x[max(0, i - h):i + h + 1]
        m = np.median(fenetre)
        mad = np.median(np.abs(fenetre - m))
        if abs(x[i] - m) > seuil * 1.4826 * mad:
            sauts.append(i)
    return sauts
"""

# the statement's own, near enough: padding, a global MAD, np.where
E2_NAIVE = """
import numpy as np

def median_glissant(x, k):
    demi = k // 2
    complet = np.pad(x, demi, mode="edge")
    return np.array([np.median(complet[i:i + k]) for i in range(len(x))])

def detecter_sauts(x, k, seuil):
    ecart = np.abs(x - median_glissant(x, k))
    mad = np.median(ecart)
    return np.where(ecart > seuil * 1.4826 * mad)
"""

E2_LISTS = """
def median_glissant(x, k):
    resultat = []
    for i in range(len(x)):
        debut, fin = max(0, i - k // 2), min(len(x), i + k // 2 + 1)
        fenetre = sorted(x[debut:fin])
        n = len(fenetre)
        resultat.append(fenetre[n // 2] if n % 2 else (fenetre[n // 2 - 1] + fenetre[n // 2]) / 2)
    return resultat

def detecter_sauts(x, k, seuil):
    m = median_glissant(x, k)
    ecarts = [abs(a - b) for a, b in zip(x, m)]
    mad = median_glissant(ecarts, k)
    return [i for i in range(len(x)) if ecarts[i] > seuil * mad[i]]
"""

E3 = """
import numpy as np

def ajuster(d, v):
    a, b, c = 10.0, 0.0, 0.0
    for _ in range(100):
        r = v - (a / (d + b) + c)
        J = np.column_stack([1 / (d + b), -a / (d + b) ** 2, np.ones(len(d))])
        pas = np.linalg.lstsq(J, r, rcond=None)[0]
        a, b, c = a + pas[0], b + pas[1], c + pas[2]
    return a, b, c

def distance(v, a, b, c):
    return a / (v - c) - b

def incertitude_distance(v, a, b, c, sigma_v):
    return a / (v - c) ** 2 * sigma_v
"""

E3_SCIPY = """
from scipy.optimize import curve_fit

def modele(d, a, b, c):
    return a / (d + b) + c

def ajuster(d, v):
    popt, pcov = curve_fit(modele, d, v, p0=[20.0, 1.0, 0.1])
    return popt, pcov

def distance(v, params):
    a, b, c = params
    return a / (v - c) - b

def incertitude_distance(v, params, sigma=0.02):
    a, b, c = params
    d = distance(v, params)
    return abs((d + b) ** 2 / a) * sigma
"""

E3_DICT = """
import numpy as np

def ajuster(d, v):
    meilleur = None
    bas, haut = 0.0, 20.0
    for _ in range(8):
        for b in np.linspace(bas, haut, 101):
            A = np.column_stack([1 / (d + b), np.ones(len(d))])
            p = np.linalg.lstsq(A, v, rcond=None)[0]
            s = np.sum((A @ p - v) ** 2)
            if meilleur is None or s < meilleur[0]:
                meilleur = s, p[0], b, p[1]
        pas = (haut - bas) / 100
        bas, haut = meilleur[2] - pas, meilleur[2] + pas
    return {"a": meilleur[1], "b": meilleur[2], "c": meilleur[3]}

def distance(v, modele):
    return modele["a"] / (v - modele["c"]) - modele["b"]

def incertitude_distance(v, modele, ecart_type):
    h = 1e-6
    return abs(distance(v + h, modele) - distance(v - h, modele)) / (2 * h) * ecart_type
"""

E4 = """
from collections import deque
import numpy as np

def composantes(masque):
    h, w = masque.shape
    vu = np.zeros((h, w), bool)
    res = []
    for i in range(h):
        for j in range(w):
            if masque[i, j] and not vu[i, j]:
                file = deque([(i, j)])
                vu[i, j] = True
                pix = []
                while file:
                    y, x = file.popleft()
                    pix.append((x, y))
                    for dy, dx in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                        a, b = y + dy, x + dx
                        if 0 <= a < h and 0 <= b < w and masque[a, b] and not vu[a, b]:
                            vu[a, b] = True
                            file.append((a, b))
                cx, cy = np.mean(pix, axis=0)
                res.append((len(pix), (cx, cy)))
    res.sort(key=lambda c: c[0], reverse=True)
    return res

def plus_gros_objet(masque, aire_min):
    objets = composantes(masque)
    if not objets or objets[0][0] < aire_min:
        return None
    return objets[0][1]
"""

E4_ROWS = E4.replace("pix.append((x, y))", "pix.append((y, x))").replace("< aire_min", "<= aire_min")

E4_FLAT = E4.replace(
    "res.append((len(pix), (cx, cy)))", "res.append([len(pix), round(cx), round(cy)])"
).replace("objets[0][1]", "objets[0][1:]")

K3 = """
import numpy as np

def replier(a):
    return (a + np.pi) % (2 * np.pi) - np.pi

def innovation(z, prevu):
    return replier(z - prevu)

class KalmanAngle:
    def __init__(self, F, B, H, Q, R, x0, P0):
        self.F, self.B, self.H, self.Q, self.R, self.x, self.P = F, B, H, Q, R, x0, P0

    def predire(self, u):
        self.x = self.F @ self.x + self.B @ u
        self.P = self.F @ self.P @ self.F.T + self.Q

    def corriger(self, z):
        nu = innovation(z, self.H @ self.x)
        S = self.H @ self.P @ self.H.T + self.R
        K = self.P @ self.H.T @ np.linalg.inv(S)
        self.x = self.x + K @ nu
        self.P = self.P - K @ self.H @ self.P
        return nu / np.sqrt(S[0, 0])
"""

D3 = """
import numpy as np

def points_sigma(x, P, kappa):
    n = len(x)
    L = np.linalg.cholesky((n + kappa) * P)
    points = [x]
    for i in range(n):
        points.append(x + L[:, i])
        points.append(x - L[:, i])
    poids = [kappa / (n + kappa)] + 2 * n * [1 / (2 * (n + kappa))]
    return np.array(points), np.array(poids)
"""

RIGHT = {
    "E2": E2, "E2 naïf": E2_NAIVE, "E2 listes": E2_LISTS, "E3": E3, "E3 scipy": E3_SCIPY, "E3 dict": E3_DICT,
    "E4": E4, "E4 lignes": E4_ROWS, "E4 plat": E4_FLAT, "K3": K3, "D3": D3,
    "D3 colonnes": D3.replace("np.array(points),", "np.array(points).T,"),
    "D3 sans poids": D3.replace("return np.array(points), np.array(poids)", "return points"),
}  # fmt: skip

RECURSIVE = """
import numpy as np

def composantes(masque):
    h, w = masque.shape
    vu = np.zeros((h, w), bool)

    def visiter(i, j, pix):
        if 0 <= i < h and 0 <= j < w and masque[i, j] and not vu[i, j]:
            vu[i, j] = True
            pix.append((j, i))
            for p, q in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                visiter(i + p, j + q, pix)
        return pix

    res = []
    for i in range(h):
        for j in range(w):
            pix = visiter(i, j, [])
            if pix:
                res.append((len(pix), tuple(np.mean(pix, axis=0))))
    return sorted(res, reverse=True)

def plus_gros_objet(masque, aire_min):
    objets = composantes(masque)
    return objets[0][1] if objets and objets[0][0] >= aire_min else None
"""
