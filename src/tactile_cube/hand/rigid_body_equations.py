"""The rigid-body equations of a tree of joints, M(q) a + h(q, v) = tau, as machine code without allocation.

Poses, spins and the accelerations that the links would have at a = 0 follow from parent to child (gravity enters as an
acceleration of the base); h and M then come from the Jacobian columns of the links' centres of mass.
Source: Featherstone, Rigid Body Dynamics Algorithms (2008), ch. 2 and 5, in base coordinates.
"""

from math import cos, sin

import numpy as np
import numpy.typing as npt

from tactile_cube.compiled import compiled_once

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Vector = tuple[float, float, float]

# Columns of the work array (dofs + 1, WORK_COLUMNS): row 0 is the base, row k + 1 link k, all in base coordinates.
ROTATION, ORIGIN, AXIS, CENTRE, SPIN, SPIN_RATE, ACCELERATION = 0, 9, 12, 15, 18, 21, 24
LINEAR, ANGULAR, MOMENTUM, ANGULAR_MOMENTUM = 27, 30, 33, 36
WORK_COLUMNS = 39


@compiled_once
def _at(array: Array, row: int, column: int) -> Vector:
    return array[row, column], array[row, column + 1], array[row, column + 2]


@compiled_once
def _put(array: Array, row: int, column: int, vector: Vector) -> None:
    array[row, column] = vector[0]
    array[row, column + 1] = vector[1]
    array[row, column + 2] = vector[2]


@compiled_once
def _add(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled_once
def _scaled(a: Vector, factor: float) -> Vector:
    return a[0] * factor, a[1] * factor, a[2] * factor


@compiled_once
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled_once
def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled_once
def _rotated(work: Array, row: int, vector: Vector) -> Vector:
    """Return a link's vector in base coordinates."""
    return _dot(_at(work, row, 0), vector), _dot(_at(work, row, 3), vector), _dot(_at(work, row, 6), vector)


@compiled_once
def _carried(spin: Vector, spin_rate: Vector, arm: Vector) -> Vector:
    """Return the acceleration of a point at `arm` from a turning origin, relative to it: w' x r + w x (w x r)."""
    return _add(_cross(spin_rate, arm), _cross(spin, _cross(spin, arm)))


@compiled_once
def _turn(work: Array, before: int, row: int, placement: Array, axis: Vector, angle: float) -> None:
    """Return a link's orientation, parent * placement * rotation about `axis` (Rodrigues), and axis, in the base."""
    co, si = (cos(angle), sin(angle)) if angle != 0.0 else (1.0, 0.0)
    for i in range(3):
        p = _at(work, before, 3 * i)
        a = p[0] * placement[0, 0] + p[1] * placement[1, 0] + p[2] * placement[2, 0]
        b = p[0] * placement[0, 1] + p[1] * placement[1, 1] + p[2] * placement[2, 1]
        c = p[0] * placement[0, 2] + p[1] * placement[1, 2] + p[2] * placement[2, 2]
        along = _dot((a, b, c), axis)
        turned = _add(_scaled((a, b, c), co), _scaled(_cross((a, b, c), axis), si))
        _put(work, row, ROTATION + 3 * i, _add(turned, _scaled(axis, (1.0 - co) * along)))
        work[row, AXIS + i] = along


@compiled_once
def _move(work: Array, before: int, row: int, shift: Vector, slides: int, q: float, v: float) -> None:
    """Return origin, spin and acceleration at zero joint accelerations of a link from those of its parent."""
    axis, spin, spin_rate = _at(work, row, AXIS), _at(work, before, SPIN), _at(work, before, SPIN_RATE)
    arm = _rotated(work, before, shift)
    swung = _scaled(_cross(spin, axis), v)
    acceleration = _at(work, before, ACCELERATION)
    turn = 0.0 if slides else 1.0
    if slides:
        arm = _add(arm, _scaled(axis, q))
        acceleration = _add(acceleration, _scaled(swung, 2.0))
    _put(work, row, SPIN, _add(spin, _scaled(axis, turn * v)))
    _put(work, row, SPIN_RATE, _add(spin_rate, _scaled(swung, turn)))
    _put(work, row, ORIGIN, _add(_at(work, before, ORIGIN), arm))
    _put(work, row, ACCELERATION, _add(acceleration, _carried(spin, spin_rate, arm)))


@compiled_once
def _inertia_times(work: Array, row: int, inertia: Array, vector: Vector) -> Vector:
    """Return R I R^T applied to a vector in base coordinates."""
    x, y, z = _at(work, row, 0), _at(work, row, 3), _at(work, row, 6)
    local = _add(_add(_scaled(x, vector[0]), _scaled(y, vector[1])), _scaled(z, vector[2]))
    a, b, c = _at(inertia, 0, 0), _at(inertia, 1, 0), _at(inertia, 2, 0)
    return _rotated(work, row, (_dot(a, local), _dot(b, local), _dot(c, local)))


@compiled_once
def _add_link(
    parent: Integers, prismatic: Integers, k: int, mass: float, inertia: Array, work: Array, M: Array, h: Array
) -> None:
    """Add what the motion of link k asks of every joint that carries it."""
    centre, spin, spin_rate = _at(work, k + 1, CENTRE), _at(work, k + 1, SPIN), _at(work, k + 1, SPIN_RATE)
    arm = _add(centre, _scaled(_at(work, k + 1, ORIGIN), -1.0))
    force = _scaled(_add(_at(work, k + 1, ACCELERATION), _carried(spin, spin_rate, arm)), mass)
    gyration = _cross(spin, _inertia_times(work, k + 1, inertia, spin))
    moment = _add(_inertia_times(work, k + 1, inertia, spin_rate), gyration)
    i = k
    while i >= 0:
        axis = _at(work, i + 1, AXIS)
        linear, angular = axis, (0.0, 0.0, 0.0)
        if not prismatic[i]:
            linear = _cross(axis, _add(centre, _scaled(_at(work, i + 1, ORIGIN), -1.0)))
            angular = axis
        _put(work, i + 1, LINEAR, linear)
        _put(work, i + 1, ANGULAR, angular)
        h[i] += _dot(linear, force) + _dot(angular, moment)
        impulse, twist = _scaled(linear, mass), _inertia_times(work, k + 1, inertia, angular)
        j = k
        while j >= i:
            M[i, j] += _dot(_at(work, j + 1, LINEAR), impulse) + _dot(_at(work, j + 1, ANGULAR), twist)
            M[j, i] = M[i, j]
            j = parent[j]
        i = parent[i]


@compiled_once
def mass_matrix_and_bias(
    parent: Integers,
    prismatic: Integers,
    rotation: Array,
    translation: Array,
    axis: Array,
    mass: Array,
    com: Array,
    inertia: Array,
    q: Array,
    v: Array,
    gravity: Array,
    work: Array,
    M: Array,
    h: Array,
) -> None:
    """Return M (N, N) and bias h (N,) (Coriolis, centrifugal, gravity) of all dofs, written: M a + h = tau.

    At positions q and velocities v (N,), gravity (3,) in the base frame; parent to inertia as in `RigidBodyTree`.
    `work` (N + 1, WORK_COLUMNS) is scratch; afterwards it holds the links' poses and spins.
    """
    for column in range(WORK_COLUMNS):
        work[0, column] = 0.0
    for i in range(3):
        work[0, ROTATION + 4 * i] = 1.0
        work[0, ACCELERATION + i] = -gravity[i]
    for k in range(len(parent)):
        before, row = parent[k] + 1, k + 1
        _turn(work, before, row, rotation[k], _at(axis, k, 0), 0.0 if prismatic[k] else q[k])
        _move(work, before, row, _at(translation, k, 0), prismatic[k], q[k], v[k])
        _put(work, row, CENTRE, _add(_at(work, row, ORIGIN), _rotated(work, row, _at(com, k, 0))))
        h[k] = 0.0
        for j in range(len(parent)):
            M[k, j] = 0.0
    for k in range(len(parent)):
        _add_link(parent, prismatic, k, mass[k], inertia[k], work, M, h)


@compiled_once
def add_spin_inertia(parent: Integers, prismatic: Integers, spin: Array, work: Array, M: Array, h: Array) -> None:
    """Add inertia about each link's own joint axis, `spin` (N,) [kg m^2], after `mass_matrix_and_bias` filled `work`.

    Bullet needs such inertia on light links to stay stable; it is not a reflected rotor inertia: where axes are
    parallel it also resists the parent's motion.
    """
    for k in range(len(parent)):
        if spin[k] == 0.0 or prismatic[k]:
            continue
        own, rate = _at(work, k + 1, AXIS), _at(work, k + 1, SPIN)
        speed = _dot(own, rate)
        torque = _add(_scaled(own, _dot(own, _at(work, k + 1, SPIN_RATE))), _scaled(_cross(rate, own), speed))
        i = k
        while i >= 0:
            if not prismatic[i]:
                share = _dot(_at(work, i + 1, AXIS), own)
                h[i] += spin[k] * _dot(_at(work, i + 1, AXIS), torque)
                j = k
                while j >= 0:
                    if not prismatic[j]:
                        M[i, j] += spin[k] * share * _dot(_at(work, j + 1, AXIS), own)
                    j = parent[j]
            i = parent[i]


@compiled_once
def pull_of_gravity(parent: Integers, prismatic: Integers, mass: Array, gravity: Vector, work: Array, h: Array) -> None:
    """Add the torques (N,) on the joints by which `gravity` pulls; `work` is of `mass_matrix_and_bias`."""
    for k in range(len(parent)):
        force, centre = _scaled(gravity, mass[k]), _at(work, k + 1, CENTRE)
        i = k
        while i >= 0:
            axis = _at(work, i + 1, AXIS)
            if prismatic[i]:
                h[i] += _dot(axis, force)
            else:
                h[i] += _dot(_cross(axis, _add(centre, _scaled(_at(work, i + 1, ORIGIN), -1.0))), force)
            i = parent[i]


@compiled_once
def add_weight(
    parent: Integers, prismatic: Integers, mass: Array, gravity: Array, other: Array, work: Array, h: Array
) -> None:
    """Turn the bias h under `gravity` (3,) into that under `other` (3,); `work` is of `mass_matrix_and_bias`."""
    change = gravity[0] - other[0], gravity[1] - other[1], gravity[2] - other[2]
    if change[0] != 0.0 or change[1] != 0.0 or change[2] != 0.0:
        pull_of_gravity(parent, prismatic, mass, change, work, h)
