"""One point through one lens, and back: what every kernel that knows a camera is made of.

Arguments that recur:

    code    int     `vision3d.camera.LENS_CODE[name]`: the constants below
    p       (4+k,)  fx, fy, cx, cy, then the distortion in OpenCV's order
    limit   float   `Camera.limit`: where the lens folds, as x/z radius (fisheye: as angle, rad); np.inf for
                    a solver that must not meet NaN while its parameters move
    x, y, z         the point in the camera frame, any unit of length

Inlined, for use inside other kernels:

    project_one(code, p, limit, x, y, z)                              -> (u, v), NaN where there is no image
    project_point_one(code, p, limit, x, y, z, d_point)               -> (u, v), fills d_point (2, 3)
    project_full_one(code, p, limit, x, y, z, d_point, d_parameters)  -> (u, v), fills (2, 3) and (2, 4+k)
    unproject_one(code, p, limit, u, v)                               -> unit ray (x, y, z), NaN where none

Where a projection is NaN, the Jacobians are filled with NaN.

Sources: Brown 1966, "Decentering distortion of lenses", with OpenCV's rational and thin-prism terms; Kannala
and Brandt 2006, "A generic camera model and calibration method", eq. 6 without its asymmetric terms.
"""

from __future__ import annotations

import math

from vision3d.kernels import inlined

PINHOLE, BROWN1, BROWN2, BROWN4, BROWN5, RATIONAL8, THIN12, FISHEYE4 = range(8)

NEWTON_MAX = 60
INVERTED = 1e-11
"""Error of an inverted distortion that is taken for zero, in units of the focal length."""
RADIUS_MAX = 1e8
"""Largest x/z that the inverse looks for: a ray this flat is parallel to the image."""


@inlined
def radial_terms(code, p, s):
    """Numerator, denominator and their derivatives by s = r² of Brown's radial factor."""
    k1 = p[4] if code >= BROWN1 else 0.0
    k2 = p[5] if code >= BROWN2 else 0.0
    k3 = p[8] if code >= BROWN5 else 0.0
    top = 1.0 + s * (k1 + s * (k2 + s * k3))
    d_top = k1 + s * (2.0 * k2 + s * 3.0 * k3)
    if code < RATIONAL8:
        return top, 1.0, d_top, 0.0
    k4, k5, k6 = p[9], p[10], p[11]
    return top, 1.0 + s * (k4 + s * (k5 + s * k6)), d_top, k4 + s * (2.0 * k5 + s * 3.0 * k6)


@inlined
def bent(code, p, a, b):
    """Brown's distortion of (a, b) = (x/z, y/z), and its derivatives by a and b."""
    s = a * a + b * b
    top, under, d_top, d_under = radial_terms(code, p, s)
    g = top / under
    gs = (d_top - g * d_under) / under
    u, v = a * g, b * g
    ua, ub, vb = g + 2.0 * a * a * gs, 2.0 * a * b * gs, g + 2.0 * b * b * gs
    va = ub
    if code >= BROWN4:
        p1, p2 = p[6], p[7]
        u += 2.0 * p1 * a * b + p2 * (s + 2.0 * a * a)
        v += p1 * (s + 2.0 * b * b) + 2.0 * p2 * a * b
        cross = 2.0 * (p1 * a + p2 * b)
        ua, ub = ua + 2.0 * p1 * b + 6.0 * p2 * a, ub + cross
        va, vb = va + cross, vb + 6.0 * p1 * b + 2.0 * p2 * a
    if code == THIN12:
        u += s * (p[12] + s * p[13])
        v += s * (p[14] + s * p[15])
        du, dv = 2.0 * (p[12] + 2.0 * s * p[13]), 2.0 * (p[14] + 2.0 * s * p[15])
        ua, ub, va, vb = ua + a * du, ub + b * du, va + a * dv, vb + b * dv
    return u, v, ua, ub, va, vb


@inlined
def angular(p, t):
    """The fisheye's image radius at the angle t, and its derivative."""
    s = t * t
    f = t * (1.0 + s * (p[4] + s * (p[5] + s * (p[6] + s * p[7]))))
    d = 1.0 + s * (3.0 * p[4] + s * (5.0 * p[5] + s * (7.0 * p[6] + s * 9.0 * p[7])))
    return f, d


@inlined
def angle_over_radius(x, y, z):
    """Angle from the axis, radius across it, and their ratio, which on the axis is 1 / z."""
    r = math.sqrt(x * x + y * y)
    t = math.atan2(r, z)
    return t, r, t / r if r > 1e-9 * abs(z) else 1.0 / z


@inlined
def project_one(code, p, limit, x, y, z):
    """Image of one point, px."""
    if code == FISHEYE4:
        t, r, q = angle_over_radius(x, y, z)
        if t > limit or (z <= 0.0 and r <= -1e-9 * z):
            return math.nan, math.nan
        q *= angular(p, t)[0] / t if t > 0.0 else 1.0
        return p[0] * x * q + p[2], p[1] * y * q + p[3]
    if not z > 0.0:
        return math.nan, math.nan
    a, b = x / z, y / z
    if a * a + b * b > limit * limit:
        return math.nan, math.nan
    u, v, _, _, _, _ = bent(code, p, a, b)
    return p[0] * u + p[2], p[1] * v + p[3]


@inlined
def project_point_one(code, p, limit, x, y, z, d_point):
    """Image of one point, px, and its derivatives by the point."""
    u, v = project_one(code, p, limit, x, y, z)
    if math.isnan(u) or math.isnan(v):
        d_point[:, :] = math.nan
        return u, v
    if code == FISHEYE4:
        t, r, _ = angle_over_radius(x, y, z)
        f, d = angular(p, t)
        across = r * r + z * z
        on_axis = r <= 1e-9 * abs(z)
        ex, ey = (0.0, 0.0) if on_axis else (x / r, y / r)
        along, around = d * z / across, 1.0 / z if on_axis else f / r
        bend = along - around
        d_point[0, 0], d_point[0, 1] = p[0] * (around + bend * ex * ex), p[0] * bend * ex * ey
        d_point[1, 0], d_point[1, 1] = p[1] * bend * ex * ey, p[1] * (around + bend * ey * ey)
        d_point[0, 2], d_point[1, 2] = -p[0] * d * x / across, -p[1] * d * y / across
        return u, v
    a, b = x / z, y / z
    _, _, ua, ub, va, vb = bent(code, p, a, b)
    fx, fy = p[0] / z, p[1] / z
    d_point[0, 0], d_point[0, 1], d_point[0, 2] = fx * ua, fx * ub, -fx * (a * ua + b * ub)
    d_point[1, 0], d_point[1, 1], d_point[1, 2] = fy * va, fy * vb, -fy * (a * va + b * vb)
    return u, v


@inlined
def project_full_one(code, p, limit, x, y, z, d_point, d_parameters):
    """Image of one point, px, and its derivatives by the point and by the parameters."""
    u, v = project_point_one(code, p, limit, x, y, z, d_point)
    if math.isnan(u) or math.isnan(v):
        d_parameters[:, :] = math.nan
        return u, v
    fx, fy = p[0], p[1]
    d_parameters[0, 0], d_parameters[0, 1], d_parameters[0, 2], d_parameters[0, 3] = (u - p[2]) / fx, 0, 1, 0
    d_parameters[1, 0], d_parameters[1, 1], d_parameters[1, 2], d_parameters[1, 3] = 0, (v - p[3]) / fy, 0, 1
    if code == FISHEYE4:
        t, _, q = angle_over_radius(x, y, z)
        power = q
        for k in range(4):
            power *= t * t
            d_parameters[0, 4 + k], d_parameters[1, 4 + k] = fx * x * power, fy * y * power
        return u, v
    if code == PINHOLE:
        return u, v
    a, b = x / z, y / z
    s = a * a + b * b
    top, under, _, _ = radial_terms(code, p, s)
    power = s / under
    for k in range(1, 4):
        i = 3 + k if k < 3 else 8
        if (k == 2 and code < BROWN2) or (k == 3 and code < BROWN5):
            break
        d_parameters[0, i], d_parameters[1, i] = fx * a * power, fy * b * power
        power *= s
    if code >= BROWN4:
        d_parameters[0, 6], d_parameters[1, 6] = 2.0 * fx * a * b, fy * (s + 2.0 * b * b)
        d_parameters[0, 7], d_parameters[1, 7] = fx * (s + 2.0 * a * a), 2.0 * fy * a * b
    if code >= RATIONAL8:
        power = -s * top / (under * under)
        for i in range(9, 12):
            d_parameters[0, i], d_parameters[1, i] = fx * a * power, fy * b * power
            power *= s
    if code == THIN12:
        d_parameters[:, 12:16] = 0.0
        d_parameters[0, 12], d_parameters[0, 13] = fx * s, fx * s * s
        d_parameters[1, 14], d_parameters[1, 15] = fy * s, fy * s * s
    return u, v


@inlined
def radial_one(code, p, t):
    """Image radius in focal lengths at the object radius (fisheye: angle) t, and its derivative."""
    if code == FISHEYE4:
        return angular(p, t)
    s = t * t
    top, under, d_top, d_under = radial_terms(code, p, s)
    g = top / under
    return t * g, g + 2.0 * s * (d_top - g * d_under) / under


@inlined
def invert_radial(code, p, limit, target):
    """The t in [0, limit] whose image radius is `target`: Newton, kept inside a shrinking bracket."""
    low, high = 0.0, limit
    if not high < RADIUS_MAX:
        high = max(1.0, target)
        while radial_one(code, p, high)[0] < target:
            low, high = high, 2.0 * high
            if high > RADIUS_MAX:
                return math.nan
    elif not radial_one(code, p, high)[0] >= target:
        return math.nan
    t = min(max(target, low), high)
    before = high - low
    for _ in range(NEWTON_MAX):
        f, d = radial_one(code, p, t)
        if f > target:
            high = t
        else:
            low = t
        step = (target - f) / d if d != 0.0 else math.inf
        ahead = t + step
        # between two flat ends Newton may go to and fro: steps that do not shrink give way to halving
        if not low <= ahead <= high or abs(step) > 0.5 * before:
            ahead = 0.5 * (low + high)
        before = abs(ahead - t)
        if before <= 2e-16 * (1.0 + t):
            return ahead
        t = ahead
    return t


@inlined
def straighten(code, p, limit, u, v):
    """Undo Brown's distortion: (x/z, y/z) whose image is (u, v) in focal lengths; NaN where there is none."""
    far = math.sqrt(u * u + v * v)
    if far == 0.0 and code < BROWN4:
        return 0.0, 0.0
    start = invert_radial(code, p, limit, far)
    if math.isnan(start):
        # the other terms may reach a little beyond the radial fold
        start = min(limit, far)
    a, b = (u * start / far, v * start / far) if far > 0.0 else (0.0, 0.0)
    fu, fv, ua, ub, va, vb = bent(code, p, a, b)
    eu, ev = u - fu, v - fv
    error = eu * eu + ev * ev
    for _ in range(NEWTON_MAX):
        det = ua * vb - ub * va
        if error < 1e-32 or det == 0.0:
            break
        da, db = (vb * eu - ub * ev) / det, (ua * ev - va * eu) / det
        share, better = 1.0, False
        while share > 1e-3:
            na, nb = a + share * da, b + share * db
            fu, fv, ua, ub, va, vb = bent(code, p, na, nb)
            nu, nv = u - fu, v - fv
            if nu * nu + nv * nv < error and na * na + nb * nb <= limit * limit:
                better = True
                break
            share *= 0.5
        if not better:
            break
        a, b, eu, ev = na, nb, nu, nv
        error = eu * eu + ev * ev
    fu, fv, ua, ub, va, vb = bent(code, p, a, b)
    unique = ua * vb - ub * va > 0.0
    if error > INVERTED * INVERTED * (1.0 + far * far) or not unique:
        return math.nan, math.nan
    return a, b


@inlined
def unproject_one(code, p, limit, u, v):
    """Unit ray of one pixel."""
    a, b = (u - p[2]) / p[0], (v - p[3]) / p[1]
    if code == FISHEYE4:
        far = math.sqrt(a * a + b * b)
        t = invert_radial(code, p, limit, far)
        q = math.sin(t) / far if far > 0.0 else 0.0
        return a * q, b * q, math.cos(t)
    if code != PINHOLE:
        a, b = straighten(code, p, limit, a, b)
    z = 1.0 / math.sqrt(1.0 + a * a + b * b)
    return a * z, b * z, z
