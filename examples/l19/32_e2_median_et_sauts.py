"""E2. Médiane glissante et détection des sauts.

`median_glissant(x, k)` : chaque valeur devient la médiane de sa fenêtre centrée de k mesures, raccourcie
aux bords.  La version naïve trie chaque fenêtre, en O(n·k log k) ; celle de la bibliothèque est en
O(n log k).

`detecter_sauts(x, k, seuil)` : les indices où |x - médiane locale| > seuil · σ, où σ = 1,4826 · MAD
locale (l'écart absolu médian vaut 0,6745 σ pour un bruit gaussien).  Une MAD globale ne suffit pas : si
le bruit change au cours de l'enregistrement, elle est trop grande ici et trop petite là.  Si plus de la
moitié de la fenêtre est constante, la MAD est nulle : alors tout ce qui diffère de cette constante est un
saut.

Votre solution se vérifie par `factorlab l19 check MON_FICHIER.py`.
"""

import time

import numpy as np

import sequential as sq


def median_glissant(x, k):
    """Médiane de chaque fenêtre centrée de k mesures ; NaN est une mesure manquante."""
    return sq.SlidingMedian(k, centred=True)(x)


def detecter_sauts(x, k, seuil):
    """Indices des mesures à plus de `seuil` écarts-types locaux de la médiane locale."""
    return np.flatnonzero(sq.Hampel(k, centred=True, threshold=seuil).outliers(x))


def naive_median(x, k):
    """La même médiane, écrite comme on la lit."""
    behind, ahead = k // 2, (k - 1) // 2
    return np.array([np.median(x[max(0, i - behind) : i + ahead + 1]) for i in range(len(x))])


def main():
    from claims import claim
    from figures import BLUE, GREEN, ORANGE, READINGS, panels, save, say

    rng = np.random.default_rng(6)
    for k in (1, 2, 5, 8, 31):
        x = rng.standard_normal(500)
        np.testing.assert_array_equal(median_glissant(x, k), naive_median(x, k))

    x = rng.standard_normal(100_000)
    seconds = {}
    for name, function, part in (("naïve", naive_median, x[:5000]), ("bibliothèque", median_glissant, x)):
        began = time.perf_counter()
        function(part, 101)
        seconds[name] = (time.perf_counter() - began) / len(part)
        say(f"médiane {name:12}, k = 101 : {seconds[name] * 1e6:6.2f} µs par mesure")

    # un signal lent dont le bruit change, avec 20 sauts de 10 fois le bruit local
    t = np.arange(2000) * 0.01
    sigma = np.where(t < 10, 0.05, 0.5)
    x = np.sin(0.3 * t) + sigma * rng.standard_normal(len(t))
    jumps = np.sort(rng.choice(len(t), 20, replace=False))
    x[jumps] += 10.0 * sigma[jumps] * rng.choice([-1.0, 1.0], 20)
    found = detecter_sauts(x, k=41, seuil=5.0)
    residual = x - median_glissant(x, 41)
    global_sigma = 1.4826 * np.median(np.abs(residual - np.median(residual)))
    found_global = np.flatnonzero(np.abs(residual) > 5.0 * global_sigma)
    wrong, wrong_global = (len(np.setxor1d(one, jumps)) for one in (found, found_global))

    figure, (a,) = panels(size=(9.0, 4.2), title="E2. Détecter les sauts avec une échelle locale")
    spread = sq.Hampel(41, centred=True).spread(x)
    a.fill_between(t, spread.median - 5 * spread.sigma, spread.median + 5 * spread.sigma, color="#d6ebe3",
                   label="médiane ± 5 σ locaux")  # fmt: skip
    a.plot(t, x, label="mesures", **READINGS)
    a.plot(t, median_glissant(x, 41), color=BLUE, label="médiane glissante, k = 41")
    a.plot(t[found], x[found], "o", color=ORANGE, markerfacecolor="none", label="sauts détectés")
    for sign in (-1, 1):
        a.plot(t, spread.median + sign * 5 * global_sigma, color=GREEN, linewidth=0.8, linestyle=":",
               label="± 5 σ, MAD globale" if sign > 0 else None)  # fmt: skip
    a.set(xlabel="temps (s)", ylabel="signal (sans unité)", ylim=(-6.5, 9.5))
    a.legend(ncols=2, loc="upper left")
    save(figure)

    claim("E2", "sauts trouvés, sur 20", np.isin(jumps, found).sum(), low=20, high=20)
    claim("E2", "sauts manqués ou de trop, MAD locale", wrong, high=4)
    claim("E2", "sauts manqués ou de trop, MAD globale", wrong_global, low=5)
    claim("E2", "médiane de 101 mesures, naïve sur bibliothèque (durées)",
          seconds["naïve"] / seconds["bibliothèque"])  # fmt: skip
    constant = np.full(30, 2.0)
    constant[12] = 2.5
    assert detecter_sauts(constant, 7, 3.0).tolist() == [12], "une MAD nulle ne cache pas un saut"


if __name__ == "__main__":
    main()
