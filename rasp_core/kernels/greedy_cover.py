"""What a body's silhouettes would gain at a place, and whether it is free there; compiled by numba at first use."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from .grid import sample


class Views(NamedTuple):
    """K views: axes `(K, 3, 3)` as `Camera.axes`, centre `(K, 3)`, width `(K,)`, and the eye's distance `(K,)`, 0 if
    it is at infinity; metres."""

    axes: np.ndarray
    centre: np.ndarray
    width: np.ndarray
    distance: np.ndarray


class Silhouettes(NamedTuple):
    """Of L turned bodies, as `run_length.Profiles` has them."""

    runs: np.ndarray
    rotation: np.ndarray
    half_extents: np.ndarray
    radius: np.ndarray


class Occlusion(NamedTuple):
    """What it is worth to hide what the views see.

    hidden `(K, H, H)`: worth of hiding each pixel. depth `(K, H, H)`: of what it sees, metres along the middle ray.
    shared `(L, K, K)`: what it costs, for each square metre's pixels, that two views see all of a silhouette.
    """

    hidden: np.ndarray
    depth: np.ndarray
    shared: np.ndarray


NO_OCCLUSION = Occlusion(*[np.zeros((0, 0, 0))] * 3)


class Scene(NamedTuple):
    """What a body gains: worth `(K, H, H + 1)`, each row's running sum of what covering its pixels is worth."""

    views: Views
    silhouettes: Silhouettes
    worth: np.ndarray
    occlusion: Occlusion


class Solids(NamedTuple):
    """The pool's bodies: grids as `sdf.GridStack.arrays` has them; points `(S, 3)` on their surfaces, in their frames,
    those of body b being `points[first[b]:first[b + 1]]`; radius `(B,)` of their spheres."""

    grids: tuple
    points: np.ndarray
    first: np.ndarray
    radius: np.ndarray


class Obstacles(NamedTuple):
    """What a body must keep `margin` metres from: N placed ones, `body` `(N,)` in the pool at rotation `(N, 3, 3)` and
    translation `(N, 3)`. bounds `(2, 3)`: of the viewing volume, which it must not leave."""

    bounds: np.ndarray
    solids: Solids
    body: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray
    margin: float


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
def gain(scene, which, at):
    """What silhouette `which` at `at` `(3,)` metres gains, in pixels' worth, all views together."""
    views, silhouettes, worth, (hidden, depth, shared) = scene
    runs, _, _, radius = silhouettes
    axes, centre = views.axes, views.centre
    rows, size, count = runs.shape[2], worth.shape[1], len(worth)
    total, seen, zooms = 0.0, np.zeros(count), np.zeros(count)
    for k in range(count):
        u, v, zoom = _project(views, k, at[0], at[1], at[2], size)
        cell = 2 * radius[which] * zoom / rows  # pixels
        top, left = v - rows / 2 * cell, u - rows / 2 * cell
        far, area, front = 0.0, 0, 0
        for a in range(3):
            far += axes[k, 2, a] * (at[a] - centre[k, a])
        for row in range(max(0, int(top)), min(size, int(top + rows * cell) + 1)):
            line = math.floor((row + 0.5 - top) / cell)
            if line < 0 or line >= rows:
                continue
            for run in range(runs.shape[3]):
                first, last = runs[which, k, line, run]
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
def within(bounds, silhouettes, which, at):
    """True if the body's box lies in `bounds` `(2, 3)`."""
    half = silhouettes.half_extents
    for a in range(3):
        low, high = at[a] - half[which, a], at[a] + half[which, a]
        if low < bounds[0, a] or high > bounds[1, a]:
            return False
    return True


@njit(cache=True, error_model="numpy", nogil=True)
def gains(scene, bounds, which, at):
    """`(M,)`: `gain` of silhouettes `which` `(M,)` at `at` `(M, 3)`; -inf outside of the bounds."""
    found = np.empty(len(which))
    for m in range(len(which)):
        found[m] = gain(scene, which[m], at[m]) if within(bounds, scene.silhouettes, which[m], at[m]) else -np.inf
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def is_free(obstacles, body, turn, at):
    """True if a body of the pool, `turn` `(3, 3)` at `at` `(3,)`, keeps the margin from all that is placed: surface
    points of each are looked up in the other's grid."""
    _, solids, placed, rotation, translation, margin = obstacles
    radius = solids.radius
    for n in range(len(placed)):
        other = placed[n]
        dx, dy, dz = at[0] - translation[n, 0], at[1] - translation[n, 1], at[2] - translation[n, 2]
        if dx * dx + dy * dy + dz * dz > (radius[body] + radius[other] + margin) ** 2:
            continue
        if _touches(solids, body, turn, at, other, rotation[n], translation[n], margin):
            return False
        if _touches(solids, other, rotation[n], translation[n], body, turn, at, margin):
            return False
    return True


@njit(cache=True, error_model="numpy", nogil=True)
def _touches(solids, own, turn, at, other, other_turn, other_at, margin):
    grids, points, first, _ = solids
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
def climb(scene, obstacles, turns, which, at, first_step, last_step):
    """Move along axes, and turn, while that gains and stays free; steps are halved from the first to the last, metres.

    turns : silhouettes of each body. which, at `(3,)` : where to begin; `at` is changed. Returns the silhouette and its
    gain.
    """
    bounds, silhouettes, rotation = obstacles.bounds, scene.silhouettes, scene.silhouettes.rotation
    best = gain(scene, which, at)
    trial, step = at.copy(), first_step
    while step >= last_step:
        better = True
        while better:
            better = False
            for axis in range(3):
                for sign in (-1.0, 1.0):
                    trial[:] = at
                    trial[axis] += sign * step
                    if not within(bounds, silhouettes, which, trial):
                        continue
                    value = gain(scene, which, trial)
                    if value > best + 1e-9 and is_free(obstacles, which // turns, rotation[which], trial):
                        best, better = value, True
                        at[:] = trial
        first = which // turns * turns
        for turn in range(first, first + turns):
            if within(bounds, silhouettes, turn, at):
                value = gain(scene, turn, at)
                if value > best + 1e-9 and is_free(obstacles, which // turns, rotation[turn], at):
                    best, which = value, turn
        step /= 2
    return which, best
