"""C2. Exemple traité : le gain de Kalman 1-D, démontré par la règle de Bayes.

Avant la mesure : x ~ N(m, σ0²).  Mesure : z = x + bruit, bruit ~ N(0, r²).
Bayes : p(x | z) ∝ p(z | x) p(x), soit

    -2 ln p(x | z) = (x - m)²/σ0² + (z - x)²/r² + constante.

C'est une parabole en x, donc x | z est gaussien.  Le coefficient de x² donne la précision (l'inverse de la
variance) : 1/σ² = 1/σ0² + 1/r² : **les précisions s'ajoutent**.  Le terme en x donne la moyenne :
m⁺/σ² = m/σ0² + z/r², que l'on réécrit

    m⁺ = m + K (z - m),   K = σ0² / (σ0² + r²),   σ² = (1 - K) σ0².

Comme 0 < K < 1, σ² < σ0² et σ² < r² : **la variance diminue toujours**, même avec une mauvaise mesure.
"""

import numpy as np


def bayes(mean, sigma0, z, r):
    """Moyenne, écart-type et gain après la mesure z."""
    gain = sigma0**2 / (sigma0**2 + r**2)
    return mean + gain * (z - mean), np.sqrt(1.0 - gain) * sigma0, gain


def density(x, mean, sigma):
    """Densité gaussienne."""
    return np.exp(-0.5 * ((x - mean) / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi))


def main():
    from claims import claim
    from figures import BLUE, GREEN, ORANGE, panels, save, say

    mean, sigma0, z, r = 20.0, 2.0, 23.0, 1.0
    after, sigma, gain = bayes(mean, sigma0, z, r)
    say(f"K = {gain:.2f} : {mean} ± {sigma0} et {z} ± {r} donnent {after:.2f} ± {sigma:.3f} °C")

    # la règle de Bayes sans formule : multiplier les deux courbes point par point, puis normaliser
    x = np.linspace(5.0, 40.0, 20_001)
    product = density(x, mean, sigma0) * density(z, x, r)
    product /= np.sum(product) * (x[1] - x[0])
    grid_mean = np.sum(x * product) * (x[1] - x[0])
    grid_sigma = np.sqrt(np.sum((x - grid_mean) ** 2 * product) * (x[1] - x[0]))

    figure, (a, b) = panels(
        1, 2, size=(10.5, 3.9), title="C2. Bayes en une dimension : les précisions s'ajoutent"
    )
    a.plot(x, density(x, mean, sigma0), color=BLUE, label=f"avant : {mean:g} ± {sigma0:g} °C")
    a.plot(x, density(x, z, r), color=ORANGE, label=f"mesure : {z:g} ± {r:g} °C")
    a.plot(x, product, color=GREEN, linewidth=3.5, alpha=0.5, label="produit des deux courbes, normalisé")
    a.plot(
        x,
        density(x, after, sigma),
        color="black",
        linestyle="--",
        label=f"formule : {after:.1f} ± {sigma:.2f} °C",
    )
    a.set(title=f"Fusion, K = {gain:.2f}", xlabel="température (°C)", ylabel="densité (1/°C)", xlim=(12, 28))
    a.set_ylim(0, 0.62)
    a.legend(loc="upper left", fontsize=8)
    ratio = np.logspace(-2, 2, 200)
    b.semilogx(ratio, 1 / (1 + ratio**2), color=BLUE, label="K")
    b.semilogx(ratio, np.sqrt(1 - 1 / (1 + ratio**2)), color=GREEN, label="σ / σ0 après la mesure")
    b.set(title="Bonne mesure : K → 1 ; mauvaise : K → 0", xlabel="r / σ0", ylabel="K, σ / σ0 (sans unité)")
    b.legend()
    save(figure)

    claim("C2", "gain K, avant ± 2 °C, mesure ± 1 °C (4/5)", gain, low=0.7999, high=0.8001)
    off = max(abs(grid_mean - after), abs(grid_sigma - sigma))
    claim("C2", "écart entre la formule et le produit des deux courbes", off, "°C", high=1e-6)
    claim("C2", "écart-type après la mesure (√0,8)", sigma, "°C", low=0.894, high=0.895)
    assert np.isclose(1 / sigma**2, 1 / sigma0**2 + 1 / r**2), "les précisions s'ajoutent"
    for worse in (1.0, 10.0, 1000.0):
        assert bayes(mean, sigma0, z, worse)[1] < sigma0, "la variance diminue toujours"


if __name__ == "__main__":
    main()
