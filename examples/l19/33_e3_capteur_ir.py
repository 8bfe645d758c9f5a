"""E3. Étalonner un capteur infrarouge : v = a/(d + b) + c.

Un capteur à triangulation rend une tension qui chute avec la distance.  `ajuster(d, v)` trouve a, b et c par
Gauss-Newton : à b fixé, a et c sont linéaires, donc un balayage de b donne un bon départ.  `distance(v, …)`
inverse la courbe.  `incertitude_distance(v, …)` propage deux incertitudes par les dérivées de
d = a/(v - c) - b : celle de la lecture, |∂d/∂v| σ_v = (d + b)²/a · σ_v, et celle des constantes, J Σ Jᵀ, qui
ne baisse pas quand on moyenne.

Retenir : σ_d croît comme d².  Le même bruit de tension coûte à 60 cm une trentaine de fois plus qu'à 10 cm.
La plage utile est celle où σ_d reste sous le besoin.  En deçà de quelques centimètres, la tension
redescend : deux distances donnent la même lecture, et rien dans le signal ne les distingue.

Votre solution se vérifie par `factorlab l19 check MON_FICHIER.py`.
"""

import numpy as np

from sequential.sensors import RangeSensor


def ajuster(d, v):
    """La courbe et sa covariance, par moindres carrés (Gauss-Newton) ; `a`, `b`, `c` sont ses attributs."""
    return RangeSensor().fit(d, v)


def distance(v, curve):
    """La distance d'une lecture ; NaN si aucune distance ne la donne."""
    return curve.distance(v)


def incertitude_distance(v, curve, count=1):
    """Écart-type de la distance d'une lecture, ou de la moyenne de plusieurs."""
    return curve.distance_sigma(v, samples=count)


def sensor(d):
    """Un GP2Y0A21 à peu près : d en cm, v en volts ; sous 7 cm la tension redescend."""
    return np.where(d >= 7, 28.0 / (d + 0.5) + 0.1, (28.0 / 7.5 + 0.1) * d / 7)


def repeat(rng, places, table, sigma_v, count=1000):
    """Écart-type des distances quand on refait tout `count` fois, étalonnage compris."""
    found = np.empty((count, len(places)))
    for k in range(count):
        again = RangeSensor(fold=False, outliers=False).fit(
            table, sensor(table) + sigma_v * rng.standard_normal(len(table))
        )
        found[k] = distance(sensor(places) + sigma_v * rng.standard_normal(len(places)), again)
    return found.std(axis=0)


def main():
    from claims import claim
    from figures import say

    rng = np.random.default_rng(19)
    sigma_v, need = 0.02, 1.0  # V ; cm
    d = np.repeat([3.0, 5, 7, 8, 10, 12, 15, 18, 20, 25, 30, 35, 40, 50, 60, 70, 80], 3)
    v = sensor(d) + sigma_v * rng.standard_normal(len(d))
    curve = ajuster(d, v)
    for name, value, s, unit in zip(
        "abc", curve.parameters, np.sqrt(np.diag(curve.cov)), ("V·cm", "cm", "V"), strict=True
    ):
        say(f"{name} = {value:7.3f} ± {1.96 * s:.3f} {unit}")
    say(
        f"bruit de lecture : {curve.sigma * 1e3:.1f} mV ; la tension redescend sous {curve.folded_below:g} cm"
    )
    places = np.array([10.0, 60.0])
    sigma = incertitude_distance(curve.reading(places), curve)
    near, far = curve.useful_range(need)
    say(f"plage utile (σ ≤ {need:g} cm) : de {near:.1f} à {far:.1f} cm")
    seen = repeat(rng, places, np.unique(d[d >= 7]).repeat(3), sigma_v)
    draw(d, v, curve, need, places, seen)

    claim("E3", "écart-type de la distance à 10 cm", sigma[0], "cm", low=0.06, high=0.1)
    claim("E3", "écart-type de la distance à 60 cm", sigma[1], "cm", low=1.8, high=3.2)
    claim("E3", "observé en mille essais sur annoncé, pire des deux", max(seen / sigma), low=0.8, high=1.25)
    claim("E3", "fin de la plage utile (σ d'un centimètre)", far, "cm", low=30, high=50)
    assert curve.folded_below in {7.0, 8.0}, "la branche repliée est reconnue"
    assert np.all(np.abs(distance(curve.reading(places), curve) - places) < 1e-9), "l'inverse est exacte"
    assert np.isnan(distance(0.0, curve)), "aucune distance ne donne une tension sous c"


def draw(d, v, curve, need, places, seen):
    """La courbe, et l'écart-type selon la distance."""
    from figures import BLUE, GREEN, ORANGE, READINGS, TRUTH, panels, save

    figure, (left, right) = panels(
        1, 2, size=(10.0, 4.2), title="E3. Un capteur infrarouge et sa plage utile"
    )
    grid = np.linspace(1, 85, 600)
    left.plot(grid, sensor(grid), label="vrai capteur", **TRUTH)
    left.plot(d, v, label="lectures", **READINGS)
    left.plot(grid[grid >= 7], curve.reading(grid[grid >= 7]), color=BLUE, label="courbe ajustée")
    left.plot(d[~curve.used], v[~curve.used], "x", color=ORANGE, label="branche repliée, écartée")
    left.set(xlabel="distance (cm)", ylabel="tension (V)", title="v = a/(d + b) + c")
    left.legend()
    inside = np.linspace(7, 80, 300)
    right.plot(inside, curve.sigma_at(inside), color=BLUE, label="une lecture")
    right.plot(inside, curve.sigma_at(inside, samples=16), color=GREEN, label="moyenne de 16")
    right.plot(places, seen, "o", color=ORANGE, label="mille essais")
    right.axhline(need, color="black", linewidth=0.8, linestyle=":", label=f"besoin : {need:g} cm")
    right.axvspan(*curve.useful_range(need), color="#d6ebe3", zorder=0, label="plage utile")
    right.set(xlabel="distance (cm)", ylabel="écart-type de d (cm)", title="σ croît comme d²", yscale="log")
    right.set_ylim(0.005, 10)
    right.legend(loc="lower right", ncols=2)
    save(figure)


if __name__ == "__main__":
    main()
