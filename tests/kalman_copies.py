"""E1 as students write it: right solutions of several tastes, and the lines that a mistake changes."""

PLAIN = """
import numpy as np

class Kalman:
    def __init__(self, F, B, H, Q, R, x0, P0):
        self.F, self.B, self.H, self.Q, self.R = F, B, H, Q, R
        self.x, self.P = x0, P0

    def predire(self, u=None):
        F, Q = self.F, self.Q
        self.x = F @ self.x
        if self.B is not None and u is not None:
            self.x = self.x + self.B @ u
        self.P = F @ self.P @ F.T + Q

    def corriger(self, z):
        H, R = self.H, self.R
        nu = z - H @ self.x
        S = H @ self.P @ H.T + R
        K = self.P @ H.T @ np.linalg.inv(S)
        self.x = self.x + K @ nu
        self.P = (np.eye(len(self.P)) - K @ H) @ self.P
        return float(nu.T @ np.linalg.inv(S) @ nu)


def nis_moyen(kf, mesures, commandes):
    nis = []
    for z, u in zip(mesures, commandes):
        kf.predire(u)
        nis.append(kf.corriger(z))
    return sum(nis) / len(nis)
"""

# the statement's own, near enough: columns, an innovation divided by its σ, squared later
COLUMNS = """
import numpy as np

class Kalman:
    def __init__(self, F, B, H, Q, R, x0, P0):
        self.F = F
        self.B = B
        self.H = H
        self.Q = Q
        self.R = R
        self.x = np.array(x0, dtype=float).reshape(-1, 1)
        self.P = np.array(P0, dtype=float)

    def predire(self, u):
        self.x = np.dot(self.F, self.x) + np.dot(self.B, u).reshape(-1, 1)
        self.P = np.dot(np.dot(self.F, self.P), self.F.T) + self.Q

    def corriger(self, z):
        z = np.array(z, dtype=float).reshape(-1, 1)
        innovation = z - np.dot(self.H, self.x)
        S = np.dot(np.dot(self.H, self.P), self.H.T) + self.R
        K = np.dot(np.dot(self.P, self.H.T), np.linalg.inv(S))
        self.x = self.x + np.dot(K, innovation)
        I = np.eye(self.P.shape[0])
        self.P = np.dot(I - np.dot(K, self.H), self.P)
        return innovation / np.sqrt(np.diag(S)).reshape(-1, 1)


def nis_moyen(kf, mesures, commandes):
    total = 0
    for i in range(len(mesures)):
        kf.predire(commandes[i])
        e = kf.corriger(mesures[i])
        total = total + float(np.sum(e ** 2))
    return total / len(mesures)
"""

# names of one's own, the prediction kept apart, Joseph's form, a tuple returned
APART = """
import numpy as np

class Kalman:
    def __init__(self, F, B, H, Q, R, x0, P0):
        self.mats = F, B, H, Q, R
        self.etat, self.incertitude = np.array(x0), np.array(P0)

    def predire(self, u=None):
        F, B, H, Q, R = self.mats
        self.etat_pred = F @ self.etat if B is None or u is None else F @ self.etat + B @ np.atleast_1d(u)
        self.P_pred = F @ self.incertitude @ F.T + Q

    def corriger(self, z):
        F, B, H, Q, R = self.mats
        nu = np.atleast_1d(z) - H @ self.etat_pred
        S = H @ self.P_pred @ H.T + R
        K = np.linalg.solve(S, H @ self.P_pred).T
        self.etat = self.etat_pred + K @ nu
        A = np.eye(len(self.etat)) - K @ H
        self.incertitude = A @ self.P_pred @ A.T + K @ R @ K.T
        return nu, float(nu @ np.linalg.solve(S, nu))


def nis_moyen(kf, mesures, commandes=None):
    valeurs = []
    for i, z in enumerate(mesures):
        kf.predire(commandes[i] if commandes is not None else None)
        valeurs.append(kf.corriger(z)[1])
    return np.mean(valeurs)
"""

# for one measurement only, with a division
DIVIDED = PLAIN.replace("@ np.linalg.inv(S)\n        self.x", "/ S\n        self.x").replace(
    "float(nu.T @ np.linalg.inv(S) @ nu)", "(nu ** 2 / S).item()"
)

RIGHT = {"plain": PLAIN, "columns": COLUMNS, "apart": APART, "divided": DIVIDED}

S_LINE, K_LINE, NU_LINE = (
    "S = H @ self.P @ H.T + R",
    "K = self.P @ H.T @ np.linalg.inv(S)",
    "nu = z - H @ self.x",
)
P_LINE = "self.P = (np.eye(len(self.P)) - K @ H) @ self.P"
RETURN = "return float(nu.T @ np.linalg.inv(S) @ nu)"
PREDICTED = "self.P = F @ self.P @ F.T + Q"
MEAN = "return sum(nis) / len(nis)"

# cause: the lines that are changed
WRONG = {
    "B ignorée": [("self.x = self.x + self.B @ u", "pass")],
    "u ajoutée sans B": [("self.x + self.B @ u", "self.x + u")],
    "F oubliée dans x": [("self.x = F @ self.x", "pass")],
    "F transposée": [("self.x = F @ self.x", "self.x = F.T @ self.x")],
    "signe de la commande": [("self.x + self.B @ u", "self.x - self.B @ u")],
    "Q pas ajoutée": [(PREDICTED, "self.P = F @ self.P @ F.T")],
    "Q ajoutée deux fois": [(PREDICTED, PREDICTED + " + Q")],
    "F P F, sans transposer": [(PREDICTED, "self.P = F @ self.P @ F + Q")],
    "Fᵀ P F, transposée du mauvais côté": [(PREDICTED, "self.P = F.T @ self.P @ F + Q")],
    "P pas prédite": [(PREDICTED, "pass")],
    "F oubliée dans P": [(PREDICTED, "self.P = self.P + Q")],
    "R et Q échangés": [("self.Q, self.R = F, B, H, Q, R", "self.Q, self.R = F, B, H, R, Q")],
    "signe de l'innovation": [(NU_LINE, "nu = H @ self.x - z")],
    "H oubliée dans l'innovation": [(NU_LINE, "nu = z - self.x")],
    "prévision oubliée": [(NU_LINE, "nu = np.atleast_1d(z)")],
    "R oubliée dans S": [(S_LINE, "S = H @ self.P @ H.T")],
    "écart-type au lieu de la variance R": [(S_LINE, "S = H @ self.P @ H.T + R ** 2")],
    "racine de R dans S": [(S_LINE, "S = H @ self.P @ H.T + np.sqrt(R)")],
    "gain sans l'inverse de S": [(K_LINE, "K = self.P @ H.T @ S")],
    "S oublié dans le gain": [(K_LINE, "K = self.P @ H.T")],
    "gain transposé": [(K_LINE, "K = (self.P @ H.T @ np.linalg.inv(S)).T")],
    "Hᵀ oubliée dans le gain": [(K_LINE, "K = self.P @ np.linalg.inv(S)")],
    "x pas corrigé": [("self.x = self.x + K @ nu", "pass")],
    "P pas corrigée": [(P_LINE, "pass")],
    "signe dans I - K H": [(P_LINE, P_LINE.replace("- K", "+ K"))],
    "I oubliée": [(P_LINE, "self.P = K @ H @ self.P")],
    "1 au lieu de la matrice identité": [(P_LINE, "self.P = (1 - K @ H) @ self.P")],
    "forme de Joseph sans K R Kᵀ": [(P_LINE, "A = np.eye(len(self.P)) - K @ H; self.P = A @ self.P @ A.T")],
    "P mise à jour avant x": [
        ("self.x = self.x + K @ nu", ""),
        (
            P_LINE,
            P_LINE + "; K = self.P @ H.T @ np.linalg.inv(H @ self.P @ H.T + R); self.x = self.x + K @ nu",
        ),
    ],
    "produit élément par élément": [("self.x = F @ self.x", "self.x = F * self.x")],
    "l'innovation n'est pas normalisée": [(RETURN, "return nu")],
    "NIS non normalisé (ν² au lieu de ν²/S)": [(RETURN, "return float(nu @ nu)")],
    "NIS avec la S d'après la correction": [(RETURN, "S = H @ self.P @ H.T + R; " + RETURN)],
    "innovation calculée après la correction": [(RETURN, "nu = z - H @ self.x; " + RETURN)],
    "normalisée par R seulement": [(RETURN, "return float(nu.T @ np.linalg.inv(R) @ nu)")],
    "ν/S au lieu de ν/√S": [(RETURN, "return np.linalg.inv(S) @ nu")],
    "return oublié": [(RETURN, "self.nis = float(nu.T @ np.linalg.inv(S) @ nu)")],
    "argument modifié": [
        ("self.x = self.x + K @ nu", "self.x += K @ nu"),
        ("self.x = F @ self.x", "self.x[:] = F @ self.x"),
    ],
    "predire oublié": [("        kf.predire(u)\n", "")],
    "commandes oubliées": [("kf.predire(u)", "kf.predire()")],
    "corriger avant predire": [
        (
            "        kf.predire(u)\n        nis.append(kf.corriger(z))",
            "        nis.append(kf.corriger(z))\n        kf.predire(u)",
        )
    ],
    "somme au lieu de la moyenne": [(MEAN, "return sum(nis)")],
    "racine du NIS moyen": [(MEAN, "return np.sqrt(np.mean(nis))")],
    "NIS élevé au carré deux fois": [(MEAN, "return np.mean(np.square(nis))")],
    "liste au lieu de la moyenne": [(MEAN, "return nis")],
}
