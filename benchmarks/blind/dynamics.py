"""Rigid-body dynamics of a chain of turning and sliding joints: Newton and Euler in the world frame."""

import numpy as np
from numba import njit


@njit(cache=True)
def _rotation(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = axis[0], axis[1], axis[2]
    r = np.empty((3, 3))
    r[0, 0], r[0, 1], r[0, 2] = c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s
    r[1, 0], r[1, 1], r[1, 2] = y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s
    r[2, 0], r[2, 1], r[2, 2] = z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)
    return r


@njit(cache=True)
def _cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def _times(m, a, out):
    for i in range(3):
        out[i] = m[i, 0] * a[0] + m[i, 1] * a[1] + m[i, 2] * a[2]


@njit(cache=True)
def _slide(z, turned, w, alpha, q, v, place, acc):
    """Move a frame's origin along its sliding axis z; `turned` is w x z."""
    d, t1, t2, t3 = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for k in range(3):
        d[k] = q * z[k]
        place[k] += d[k]
    _cross(alpha, d, t1)
    _cross(w, d, t2)
    _cross(w, t2, t3)
    for k in range(3):
        acc[k] += t1[k] + t3[k] + 2.0 * v * turned[k]


@njit(cache=True)
def mass_and_bias(  # noqa: C901 - one page of Newton-Euler reads better than its pieces
    axes, origins, coms, masses, inertias, slides, gravity, q, v
):
    """Joint-space mass matrix (n, n) and bias force (n) of the open chain (Newton-Euler in the world frame)."""
    n = q.shape[0]
    z, c, o = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    world, force, moment = np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((n, 3))
    lever, spun = np.empty((n, n, 3)), np.empty((n, 3))
    r, d, t1, t2, t3 = np.eye(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    w, alpha, acc, before = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    for k in range(3):
        acc[k] = -gravity[k]
    for i in range(n):
        _times(r, origins[i], d)
        _cross(alpha, d, t1)
        _cross(w, d, t2)
        _cross(w, t2, t3)
        for k in range(3):
            o[i, k] = before[k] + d[k]
            before[k] = o[i, k]
            acc[k] += t1[k] + t3[k]
        turn = _rotation(axes[i], 0.0 if slides[i] else q[i])
        for a in range(3):
            for b in range(3):
                d[b] = r[a, 0] * turn[0, b] + r[a, 1] * turn[1, b] + r[a, 2] * turn[2, b]
            for b in range(3):
                r[a, b] = d[b]
        _times(r, axes[i], z[i])
        _cross(w, z[i], t1)
        if slides[i]:
            _slide(z[i], t1, w, alpha, q[i], v[i], before, acc)
            for k in range(3):
                o[i, k] = before[k]
        else:
            for k in range(3):
                alpha[k] += t1[k] * v[i]
                w[k] += z[i, k] * v[i]
        _times(r, coms[i], d)
        _cross(alpha, d, t1)
        _cross(w, d, t2)
        _cross(w, t2, t3)
        for k in range(3):
            c[i, k] = o[i, k] + d[k]
            force[i, k] = masses[i] * (acc[k] + t1[k] + t3[k])
        for a in range(3):
            for b in range(3):
                world[i, a, b] = 0.0
                for k in range(3):
                    world[i, a, b] += r[a, k] * inertias[i, k] * r[b, k]
        _times(world[i], w, t1)
        _cross(w, t1, t2)
        _times(world[i], alpha, t1)
        for k in range(3):
            moment[i, k] = t1[k] + t2[k]
    mass, bias = np.zeros((n, n)), np.zeros(n)
    for k in range(n):
        for i in range(k + 1):
            for a in range(3):
                d[a] = c[k, a] - o[i, a]
            if slides[i]:
                lever[k, i] = z[i]
                spun[i] = 0.0
                bias[i] += _dot(z[i], force[k])
            else:
                _cross(z[i], d, lever[k, i])
                _times(world[k], z[i], spun[i])
                bias[i] += _dot(lever[k, i], force[k]) + _dot(z[i], moment[k])
            for j in range(i + 1):
                mass[i, j] += masses[k] * _dot(lever[k, i], lever[k, j]) + (0.0 if slides[j] else _dot(z[j], spun[i]))
    for i in range(n):
        for j in range(i):
            mass[j, i] = mass[i, j]
    return mass, bias


@njit(cache=True)
def reduced(mass, bias, select, extra):
    """The same for the actuated joints alone: inverse of S^T M S + diag(extra), and S^T h."""
    n, m = select.shape
    out, h = np.zeros((m, m)), np.zeros(m)
    for a in range(m):
        out[a, a] = extra[a]
        for i in range(n):
            if select[i, a] != 0.0:
                h[a] += select[i, a] * bias[i]
                for b in range(m):
                    for j in range(n):
                        out[a, b] += select[i, a] * mass[i, j] * select[j, b]
    return np.linalg.inv(out), h
