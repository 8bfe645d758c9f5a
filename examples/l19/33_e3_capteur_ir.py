"""E3. Étalonner un capteur infrarouge : v = a/(d + b) + c.

Un capteur à triangulation rend une tension qui chute avec la distance. `ajuster(d, v)` trouve a, b et c par
Gauss-Newton : à b fixé, a et c sont linéaires, donc un balayage de b donne un bon départ. `distance(v, …)`
inverse la courbe. `incertitude_distance(v, …)` propage deux incertitudes par les dérivées de
d = a/(v - c) - b : celle de la lecture, |∂d/∂v| σ_v = (d + b)²/a · σ_v, et celle des constantes, J Σ Jᵀ, qui
ne baisse pas quand on moyenne.

Retenir : σ_d croît comme d². Le même bruit de tension coûte à 60 cm une trentaine de fois plus qu'à 10 cm.
La plage utile est celle où σ_d reste sous le besoin. En deçà de quelques centimètres la tension
redescend : deux distances donnent la même lecture, et rien dans le signal ne les distingue.
"""

import numpy as np

from sequential.sensors import RangeSensor


def ajuster(d, v):
    """La courbe et sa covariance, par moindres carrés (Gauss-Newton) ; `a`, `b`, `c` sont ses attributs."""
    return RangeSensor().fit(d, v)


def distance(v, courbe):
    """La distance d'une lecture ; NaN si aucune distance ne la donne."""
    return courbe.distance(v)


def incertitude_distance(v, courbe, mesures=1):
    """Écart-type de la distance d'une lecture, ou de la moyenne de plusieurs."""
    return courbe.distance_sigma(v, samples=mesures)


def capteur(d):
    """Un GP2Y0A21 à peu près : d en cm, v en volts ; sous 7 cm la tension redescend."""
    return np.where(d >= 7, 28.0 / (d + 0.5) + 0.1, (28.0 / 7.5 + 0.1) * d / 7)


def main():
    from figures import BLUE, GREEN, ORANGE, READINGS, TRUTH, panels, save

    rng = np.random.default_rng(19)
    sigma_v, besoin = 0.02, 1.0  # V ; cm
    d = np.repeat([3.0, 5, 7, 8, 10, 12, 15, 18, 20, 25, 30, 35, 40, 50, 60, 70, 80], 3)
    v = capteur(d) + sigma_v * rng.standard_normal(len(d))
    courbe = ajuster(d, v)
    sigma = np.sqrt(np.diag(courbe.cov))
    for nom, valeur, s, unite in zip("abc", courbe.parameters, sigma, ("V·cm", "cm", "V"), strict=True):
        print(f"{nom} = {valeur:7.3f} ± {1.96 * s:.3f} {unite}")
    repli = courbe.folded_below
    print(f"bruit de lecture : {courbe.sigma * 1e3:.1f} mV ; la tension redescend sous {repli:g} cm")

    places = np.array([10.0, 60.0])
    ecarts = incertitude_distance(courbe.reading(places), courbe)
    debut, fin = courbe.useful_range(besoin)
    print(f"écart-type à 10 cm : {ecarts[0]:.3f} cm ; à 60 cm : {ecarts[1]:.2f} cm")
    print(f"plage utile (σ ≤ {besoin:g} cm) : {debut:.1f} à {fin:.1f} cm")

    # la vérité : tout refaire mille fois, étalonnage compris
    essais = np.empty((1000, 2))
    table = np.unique(d[d >= 7]).repeat(3)
    for k in range(len(essais)):
        refait = RangeSensor(fold=False, outliers=False).fit(
            table, capteur(table) + sigma_v * rng.standard_normal(len(table))
        )
        essais[k] = distance(capteur(places) + sigma_v * rng.standard_normal(2), refait)
    vus = essais.std(axis=0)
    print(f"mille essais       : {vus[0]:.3f} cm          ; {vus[1]:.2f} cm")

    figure, (gauche, droite) = panels(
        1, 2, size=(10.0, 4.2), title="E3. Un capteur infrarouge et sa plage utile"
    )
    grille = np.linspace(1, 85, 600)
    gauche.plot(grille, capteur(grille), label="vrai capteur", **TRUTH)
    gauche.plot(d, v, label="lectures", **READINGS)
    gauche.plot(grille[grille >= 7], courbe.reading(grille[grille >= 7]), color=BLUE, label="courbe ajustée")
    gauche.plot(d[~courbe.used], v[~courbe.used], "x", color=ORANGE, label="branche repliée, écartée")
    gauche.set(xlabel="distance (cm)", ylabel="tension (V)", title="v = a/(d + b) + c")
    gauche.legend()
    inside = np.linspace(7, 80, 300)
    droite.plot(inside, courbe.sigma_at(inside), color=BLUE, label="une lecture")
    droite.plot(inside, courbe.sigma_at(inside, samples=16), color=GREEN, label="moyenne de 16")
    droite.plot(places, vus, "o", color=ORANGE, label="mille essais")
    droite.axhline(besoin, color="black", linewidth=0.8, linestyle=":")
    droite.axvspan(debut, fin, color="#d6ebe3", zorder=0, label="plage utile")
    droite.set(xlabel="distance (cm)", ylabel="écart-type de d (cm)", title="σ croît comme d²", yscale="log")
    droite.legend(loc="upper left")
    save(figure)

    assert repli in {7.0, 8.0}, "la branche repliée est reconnue"
    assert np.all(np.abs(distance(courbe.reading(places), courbe) - places) < 1e-9), "l'inverse est exacte"
    assert np.all(np.abs(vus / ecarts - 1) < 0.25), "l'écart-type annoncé est celui que l'on observe"
    assert ecarts[1] / ecarts[0] > 20, "σ croît comme d²"
    assert debut < 10 < fin < 60, "à 10 cm le capteur suffit, à 60 cm non"
    assert np.isnan(distance(0.0, courbe)), "aucune distance ne donne une tension sous c"


if __name__ == "__main__":
    main()
