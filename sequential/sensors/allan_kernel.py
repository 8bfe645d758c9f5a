"""Long sums over the differences of a phase, for the Allan family."""

from __future__ import annotations

from numba import njit, types

import sequential.kernels  # noqa: F401 - compiled code is kept where a digest of all of it says

__all__ = ["lag_one", "second_differences", "summed_differences", "third_differences"]

_f2 = types.Array(types.float64, 2, "C", readonly=True)
_i1 = types.Array(types.int64, 1, "C", readonly=True)
_w1, _w2 = types.float64[::1], types.float64[:, ::1]
_SQUARES = types.void(_f2, _i1, types.boolean, _w2)
# A sum may be taken in any order, which lets it run in vector registers.
_ANY_ORDER = {"reassoc", "contract", "nsz"}
_BLOCK = 2048  # samples that every tau passes over while they are in the nearest cache
_RESTART = 1024
_FEWEST, _MOST = 128, 16384


@njit(cache=True, error_model="numpy", forceinline=True)
def _stretches(x, start, m, size):
    """Four neighbouring averages' ends: `size` phases each, m apart; what is beyond the record is empty."""
    x1, x2, x3 = x[start + m :], x[start + 2 * m :], x[start + 3 * m :]
    return x[start : start + size], x1[:size], x2[:size], x3[:size]


@njit(_SQUARES, cache=True, error_model="numpy", nogil=True, fastmath=_ANY_ORDER)
def second_differences(phase, m, overlapping, out):
    """Sum of (x[i+2m] - 2 x[i+m] + x[i])² for axes (k, n) and factors (T,) into (T, k)."""
    axes, n = phase.shape
    for a in range(axes):
        x = phase[a]
        for s in range(0, n, _BLOCK):
            for j in range(len(m)):
                size = min(_BLOCK, n - 2 * m[j] - s)
                if size <= 0:
                    continue
                # equal lengths from index 0 on: no index can be negative, and the loop becomes vectors
                x0, x1, x2, _ = _stretches(x, s, m[j], size)
                total = 0.0
                if overlapping:
                    for i in range(size):
                        d = x2[i] - 2.0 * x1[i] + x0[i]
                        total += d * d
                else:
                    for i in range(-s % m[j], size, m[j]):
                        d = x2[i] - 2.0 * x1[i] + x0[i]
                        total += d * d
                out[j, a] += total


@njit(_SQUARES, cache=True, error_model="numpy", nogil=True, fastmath=_ANY_ORDER)
def third_differences(phase, m, overlapping, out):
    """Sum of (x[i+3m] - 3 x[i+2m] + 3 x[i+m] - x[i])²."""
    axes, n = phase.shape
    for a in range(axes):
        x = phase[a]
        for s in range(0, n, _BLOCK):
            for j in range(len(m)):
                size = min(_BLOCK, n - 3 * m[j] - s)
                if size <= 0:
                    continue
                x0, x1, x2, x3 = _stretches(x, s, m[j], size)
                total = 0.0
                for i in range(size):
                    d = (x3[i] - x0[i]) - 3.0 * (x2[i] - x1[i])
                    total += d * d
                out[j, a] += total


@njit(
    types.float64(_f2, types.int64, types.int64, types.int64),
    cache=True,
    error_model="numpy",
    fastmath=_ANY_ORDER,
)
def _window(phase, a, at, m):
    """Sum of m neighbouring second differences from `at` on."""
    total = 0.0
    for i in range(at, at + m):
        total += phase[a, i + 2 * m] - 2.0 * phase[a, i + m] + phase[a, i]
    return total


@njit(_SQUARES, cache=True, error_model="numpy", nogil=True)
def summed_differences(phase, m, overlapping, out):
    """Sum of squares of m neighbouring second differences added up, as the modified variance takes them.

    The running sum begins anew every so often, so that its rounding does not grow with the record.
    """
    axes, n = phase.shape
    for a in range(axes):
        x = phase[a]
        for j in range(len(m)):
            step = m[j]
            x1, x2, x3 = x[step:], x[2 * step :], x[3 * step :]
            count = n - 3 * step + 1
            stride = max(step, _RESTART)
            total = 0.0
            for s in range(0, count, stride):
                v = _window(phase, a, s, step)
                part = v * v
                for i in range(s, min(s + stride, count) - 1):
                    v += (x3[i] - x[i]) - 3.0 * (x2[i] - x1[i])
                    part += v * v
                total += part
            out[j, a] = total


@njit(types.void(_w1, types.int64), cache=True, error_model="numpy")
def _remove_parabola(z, count):
    """Take the least-squares parabola out of z[:count], by polynomials orthogonal on equal steps."""
    middle = 0.5 * (count - 1)
    spread = (count * count - 1.0) / 12.0
    mean, slope, bend, slope_norm, bend_norm = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(count):
        u = i - middle
        w = u * u - spread
        mean += z[i]
        slope += u * z[i]
        bend += w * z[i]
        slope_norm += u * u
        bend_norm += w * w
    mean, slope, bend = mean / count, slope / slope_norm, bend / bend_norm
    for i in range(count):
        u = i - middle
        z[i] -= mean + slope * u + bend * (u * u - spread)


@njit(types.float64(_w1, types.int64), cache=True, error_model="numpy")
def _correlation(z, count):
    """Correlation of neighbours about the mean; 0 for a constant."""
    mean = 0.0
    for i in range(count):
        mean += z[i]
    mean /= count
    near, own = 0.0, (z[count - 1] - mean) ** 2
    for i in range(count - 1):
        near += (z[i] - mean) * (z[i + 1] - mean)
        own += (z[i] - mean) ** 2
    return near / own if own > 0.0 else 0.0


@njit(types.void(_f2, _i1, types.int64, _w2), cache=True, error_model="numpy", nogil=True)
def lag_one(phase, m, most, out):
    """Exponent of the phase's spectrum at every m[j], for axes (k, n), into (T, k): NaN where too short.

    Differences are taken, `most` at the most, until neighbours are hardly correlated.  The first 16384 of
    the decimated samples decide, which leaves less than a hundredth of doubt.  Riley and Greenhall allow 30,
    of which one record in ten gets a colour that is wrong.
    """
    axes, n = phase.shape
    z = phase[0, : min(n, _MOST)].copy()
    for a in range(axes):
        for j in range(len(m)):
            count = min((n - 1) // m[j] + 1, _MOST)
            out[j, a] = float("nan")
            if count < _FEWEST:
                continue
            for i in range(count):
                z[i] = phase[a, i * m[j]]
            _remove_parabola(z, count)
            taken = 0
            while True:
                r = _correlation(z, count)
                rho = r / (1.0 + r)
                if rho < 0.25 or taken >= most:
                    break
                count -= 1
                taken += 1
                for i in range(count):
                    z[i] = z[i + 1] - z[i]
            out[j, a] = -2.0 * (rho + taken)
