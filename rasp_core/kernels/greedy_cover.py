"""What a body's silhouettes would gain at a place, and whether it is free there; compiled by numba at first use.

A scene is (views, profiles, worth, veil).
views : (axes `(K, 3, 3)`, centre `(K, 3)`, width `(K,)`, distance `(K,)` of the eye, 0 where it is at infinity).
profiles : (runs, rotation, reach, radius), see `art.run_length.Profiles`. worth `(K, H, H + 1)`: each row's running sum
of what covering its pixels is worth. veil : (hidden `(K, H, H)`, depth `(K, H, H)`, shared `(L, K, K)`), or arrays of
length 0: what hiding each pixel's sight is worth; how far along the middle ray it lies; and what it costs, for each
square metre's pixels, that two views see all of a profile.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from .grid import sample


@njit(cache=True, error_model="numpy", nogil=True)
def _project(views, k, x, y, z, size):
    """Pixel coordinates of a world point in view k, and pixels per metre there."""
    axes, centre, width, distance = views
    x, y, z = x - centre[k, 0], y - centre[k, 1], z - centre[k, 2]
    zoom = size / width[k]
    if distance[k] > 0:
        depth = axes[k, 2, 0] * x + axes[k, 2, 1] * y + axes[k, 2, 2] * z
        zoom *= distance[k] / (distance[k] + depth)
    u = axes[k, 0, 0] * x + axes[k, 0, 1] * y + axes[k, 0, 2] * z
    v = axes[k, 1, 0] * x + axes[k, 1, 1] * y + axes[k, 1, 2] * z
    return size / 2 + zoom * u, size / 2 - zoom * v, zoom


@njit(cache=True, error_model="numpy", nogil=True)
def gain(scene, which, place):
    """What profile `which` at `place` `(3,)` gains, all views together."""
    views, profiles, worth, (hidden, depth, shared) = scene
    runs, _, _, radius = profiles
    axes, centre = views[0], views[1]
    rows, size, count = runs.shape[2], worth.shape[1], len(worth)
    total, seen, zooms = 0.0, np.zeros(count), np.zeros(count)
    for k in range(count):
        u, v, zoom = _project(views, k, place[0], place[1], place[2], size)
        cell = 2 * radius[which] * zoom / rows  # pixels
        top, left = v - rows / 2 * cell, u - rows / 2 * cell
        far, area, front = 0.0, 0, 0
        for a in range(3):
            far += axes[k, 2, a] * (place[a] - centre[k, a])
        for row in range(max(0, int(top)), min(size, int(top + rows * cell) + 1)):
            at = math.floor((row + 0.5 - top) / cell)
            if at < 0 or at >= rows:
                continue
            for run in range(runs.shape[3]):
                first, last = runs[which, k, at, run]
                if first == last:
                    break
                begin = min(max(math.floor(left + first * cell + 0.5), 0), size)
                end = min(max(math.floor(left + last * cell + 0.5), 0), size)
                total += worth[k, row, end] - worth[k, row, begin]
                if len(depth) == 0:
                    continue
                area += end - begin
                for column in range(begin, end):
                    if far < depth[k, row, column]:
                        front += 1
                        total += hidden[k, row, column]
        seen[k], zooms[k] = front / max(area, 1), zoom
    if len(depth) > 0:
        for k in range(count):
            for other in range(k):
                total -= shared[which, k, other] * zooms[k] * zooms[other] * seen[k] * seen[other]
    return total


@njit(cache=True, error_model="numpy", nogil=True)
def within(bounds, profiles, which, place):
    """True where the body's box lies in `bounds` `(2, 3)`."""
    reach = profiles[2]
    for a in range(3):
        if place[a] - reach[which, a] < bounds[0, a] or place[a] + reach[which, a] > bounds[1, a]:
            return False
    return True


@njit(cache=True, error_model="numpy", nogil=True)
def gains(scene, bounds, which, places, found):
    """`gain` of profiles `which` `(M,)` at `places` `(M, 3)`, into `found` `(M,)`; -inf outside of the bounds."""
    for m in range(len(which)):
        found[m] = gain(scene, which[m], places[m]) if within(bounds, scene[1], which[m], places[m]) else -np.inf


@njit(cache=True, error_model="numpy", nogil=True)
def free(solids, placed, body, turn, at, margin):
    """True where a body, `turn` `(3, 3)` at `at` `(3,)`, keeps `margin` metres from all that is placed.

    solids : grids as `sdf.GridStack.arrays` has them; samples, (points, first), those of body b being
    `points[first[b]:first[b + 1]]`; and radius, of each body of the pool. placed : bodies `(N,)`, their rotation
    `(N, 3, 3)` and place `(N, 3)`. Each one's samples are looked up in the other's grid.
    """
    grids, samples, radius = solids
    placed, rotation, place = placed
    for n in range(len(placed)):
        other = placed[n]
        dx, dy, dz = at[0] - place[n, 0], at[1] - place[n, 1], at[2] - place[n, 2]
        if dx * dx + dy * dy + dz * dz > (radius[body] + radius[other] + margin) ** 2:
            continue
        if _touches(grids, samples, body, turn, at, other, rotation[n], place[n], margin):
            return False
        if _touches(grids, samples, other, rotation[n], place[n], body, turn, at, margin):
            return False
    return True


@njit(cache=True, error_model="numpy", nogil=True)
def _touches(grids, samples, own, turn, at, other, other_turn, other_at, margin):
    points, first = samples
    for s in range(first[own], first[own + 1]):
        x, y, z = points[s, 0], points[s, 1], points[s, 2]
        wx = turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z + at[0] - other_at[0]
        wy = turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z + at[1] - other_at[1]
        wz = turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z + at[2] - other_at[2]
        lx = other_turn[0, 0] * wx + other_turn[1, 0] * wy + other_turn[2, 0] * wz
        ly = other_turn[0, 1] * wx + other_turn[1, 1] * wy + other_turn[2, 1] * wz
        lz = other_turn[0, 2] * wx + other_turn[1, 2] * wy + other_turn[2, 2] * wz
        if sample(grids, other, lx, ly, lz)[0] < margin:
            return True
    return False


@njit(cache=True, error_model="numpy", nogil=True)
def climb(scene, bounds, solids, placed, margin, turns, which, place, step, least):
    """Move along axes, and turn, while that gains and stays free; steps from `step` halved down to `least` metres.

    `place` `(3,)` is changed. solids and placed : see `free`. Returns the profile and its gain.
    """
    rotation = scene[1][1]
    best = gain(scene, which, place)
    trial = place.copy()
    while step >= least:
        better = True
        while better:
            better = False
            for axis in range(3):
                for sign in (-1.0, 1.0):
                    trial[:] = place
                    trial[axis] += sign * step
                    if not within(bounds, scene[1], which, trial):
                        continue
                    value = gain(scene, which, trial)
                    if value > best + 1e-9 and free(solids, placed, which // turns, rotation[which], trial, margin):
                        best, better = value, True
                        place[:] = trial
        first = which // turns * turns
        for turn in range(first, first + turns):
            if within(bounds, scene[1], turn, place):
                value = gain(scene, turn, place)
                if value > best + 1e-9 and free(solids, placed, which // turns, rotation[turn], place, margin):
                    best, which = value, turn
        step /= 2
    return which, best
