"""Bodies pushed apart by a Levenberg-Marquardt method on their surface contact, compiled by numba at first use.

Conjugate gradients solve each step's system, that of `gauss_newton`. Arrays only, no tensors.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from .gauss_newton import system

STIFFEST, FIRST, SOFTEST = 10.0, 0.1, 0.01  # damping, as a fraction of the mean stiffness
RATE = 3.0  # what damping falls by after a step that helped, and grows by after one that did not
LEVER = 0.4  # of a body's radius: what its turns are weighed by against its shifts
LONGEST = 0.25  # of a body's radius: how far it moves in a step
SOLVED = 1e-3  # of the residual, as the preconditioner weighs it, is left by conjugate gradients
SOLVE_STEPS = 40
LOOK_BACK = 4  # steps in which the energy must have fallen by
GAIN = 0.02  # of itself, or it is as good as at its least


@njit(cache=True, error_model="numpy", nogil=True)
def _times(blocks, vector, product):
    """`product` `(N, 6)` = each body's block times its row of `vector`."""
    for body in range(len(vector)):
        for i in range(6):
            total = 0.0
            for j in range(6):
                total += blocks[body, i, j] * vector[body, j]
            product[body, i] = total


@njit(cache=True, error_model="numpy", nogil=True)
def _solve(diagonal, coupling, pairs, count, pull):
    """`(N, 6)` x of `A x = -pull`, by conjugate gradients with each body's own block as preconditioner."""
    bodies = len(diagonal)
    inverse = np.empty_like(diagonal)
    for body in range(bodies):
        inverse[body] = np.linalg.inv(diagonal[body])
    x, left = np.zeros((bodies, 6)), -pull
    easier, product = np.empty((bodies, 6)), np.empty((bodies, 6))
    _times(inverse, left, easier)
    along, norm = easier.copy(), (left * easier).sum()
    enough = SOLVED * norm
    for _ in range(SOLVE_STEPS):
        if norm <= enough:
            break
        _times(diagonal, along, product)
        for pair in range(count):
            one, two = pairs[pair, 0], pairs[pair, 1]
            for i in range(6):
                total = 0.0
                for j in range(6):
                    total += coupling[pair, i, j] * along[two, j]
                    product[two, j] += coupling[pair, i, j] * along[one, i]
                product[one, i] += total
        length = norm / (along * product).sum()
        x += length * along
        left -= length * product
        _times(inverse, left, easier)
        before, norm = norm, (left * easier).sum()
        along = easier + norm / before * along
    return x


@njit(cache=True, error_model="numpy", nogil=True)
def _turn(rotation, w):
    """`rotation` turned by the rotation vector w, in place."""
    angle = math.sqrt(w[0] ** 2 + w[1] ** 2 + w[2] ** 2)
    if angle == 0.0:
        return
    x, y, z, c, s = w[0] / angle, w[1] / angle, w[2] / angle, math.cos(angle), math.sin(angle)
    turn = np.empty((3, 3))
    turn[0, 0], turn[0, 1], turn[0, 2] = c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s
    turn[1, 0], turn[1, 1], turn[1, 2] = y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s
    turn[2, 0], turn[2, 1], turn[2, 2] = z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)
    rotation[:] = turn @ rotation


@njit(cache=True, error_model="numpy", nogil=True)
def _relax(scene, rotation, translation, margin, ceiling, energy_of_body):
    """Poses of one start, in place; its least energy, and `energy_of_body` `(N,)`, each body's part of it."""
    radius = scene[4]
    bodies = len(radius)
    diagonal, pull, part = np.empty((bodies, 6, 6)), np.empty((bodies, 6)), np.empty(bodies)
    room = bodies * (bodies - 1) // 2 + 1
    pairs, coupling = np.empty((room, 2), np.int64), np.empty((room, 6, 6))
    best_rotation, best_translation, best = rotation.copy(), translation.copy(), np.inf
    damping, before = FIRST, np.full(LOOK_BACK, np.inf)
    for step in range(len(ceiling)):
        energy, count = system(*scene, rotation, translation, margin, (diagonal, coupling, pairs, pull, part))
        if energy < best:
            best, best_rotation[:], best_translation[:], energy_of_body[:] = energy, rotation, translation, part
            damping = max(damping / RATE, SOFTEST)
        else:
            damping = min(damping * RATE, STIFFEST)
        stalled = before[step % LOOK_BACK] * (1 - GAIN) < energy
        before[step % LOOK_BACK] = energy
        if energy == 0.0 or stalled or energy > ceiling[step]:
            break
        stiffness = 0.0
        for body in range(bodies):
            stiffness += (diagonal[body, 0, 0] + diagonal[body, 1, 1] + diagonal[body, 2, 2]) / (3 * bodies)
        if stiffness == 0.0:
            break
        for body in range(bodies):
            lever = (LEVER * radius[body]) ** 2
            for i in range(6):
                for j in range(i):
                    diagonal[body, j, i] = diagonal[body, i, j]
                diagonal[body, i, i] += damping * stiffness * (1.0 if i < 3 else lever)
        found = _solve(diagonal, coupling, pairs, count, pull)
        for body in range(bodies):
            shift, turn = found[body, :3], found[body, 3:]
            far = math.sqrt((shift**2).sum()) + radius[body] * math.sqrt((turn**2).sum())
            scale = min(1.0, LONGEST * radius[body] / far) if far > 0 else 0.0
            translation[body] += scale * shift
            _turn(rotation[body], scale * turn)
    rotation[:], translation[:] = best_rotation, best_translation
    return best


@njit(cache=True, error_model="numpy", nogil=True)
def relax(worker, workers, scene, rotation, translation, margin, ceiling, energy, energy_of_body):
    """Each start's poses, `(S, N, 3, 3)` and `(S, N, 3)` float64, in place; `energy` `(S,)`, the least of
    each; `energy_of_body` `(S, N)`, each body's part of it. scene : what `system` takes before the poses."""
    for start in range(worker, len(rotation), workers):
        energy[start] = _relax(scene, rotation[start], translation[start], margin, ceiling, energy_of_body[start])
