"""Still sensors whose noise coefficients are known: each noise is drawn from its two-sided density."""

import numpy as np


def still_sensor(rng, count, rate, *, N=0.0, B=0.0, K=0.0, Q=0.0, R=0.0):
    """Samples (count,) of a sensor with the coefficients of IEEE Std 952, annex C."""
    x = N * np.sqrt(rate) * rng.standard_normal(count) + R * np.arange(count) / rate
    if B:
        x += B * flicker(rng, count)
    if K:
        x += K / np.sqrt(rate) * np.cumsum(rng.standard_normal(count))
    if Q:
        x += Q * rate * np.diff(rng.standard_normal(count + 1))
    return x


def flicker(rng, count, periods=16):
    """Noise of density 1/(2π f), B = 1, at any rate: part of a record many times as long, drawn in frequency.

    Periods longer than that record are missing; they would hardly bend this part.
    """
    whole = periods * count
    f = np.fft.rfftfreq(whole)
    density = np.zeros_like(f)
    density[1:] = 1.0 / (2.0 * np.pi * f[1:])
    amplitudes = np.sqrt(0.5 * whole * density)
    drawn = rng.standard_normal((2, len(f)))
    return np.fft.irfft(amplitudes * (drawn[0] + 1j * drawn[1]), whole)[:count]
