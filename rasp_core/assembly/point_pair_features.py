"""Poses that bring a part's surface onto a boundary, from pairs of points that are alike on both.

Two points with their normals have four features that no motion changes (Drost et al. 2010): their distance, the angles
of both normals with the line between them, and the angle of one normal about it with the other. A pair of the part and
a pair of the boundary with equal features give one pose.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

SPAN = 0.15, 0.7  # of the part's diameter: distances of the points of a pair
DISTANCES, ANGLES = 12, 12  # bins, of the distances within that span and of angles from 0 to pi
REFERENCES = 500  # points of the boundary from which pairs go
OTHERS = 2000  # points to which they go
PAIRS = 4000  # of the part
ALIKE = 6  # pairs of the boundary for each of them


def poses(
    part: tuple[np.ndarray, np.ndarray],
    boundary: tuple[np.ndarray, np.ndarray],
    references: np.ndarray,
    diameter: float,
    random: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Rotations `(B, 3, 3)` and shifts `(B, 3)` of a part, each by one pair of points.

    part, boundary : points `(P, 3)`, `(M, 3)` and unit normals, which are to be alike. references `(R,)`: indices into
    the boundary, of the points that the poses bring a point of the part to. diameter : the part's, same unit. Empty
    where nothing is alike.
    """
    low, high = SPAN[0] * diameter, SPAN[1] * diameter
    points, normals = boundary
    first = random.permutation(references)[:REFERENCES]
    second = random.permutation(len(points))[:OTHERS]
    near = cKDTree(points[first]).sparse_distance_matrix(cKDTree(points[second]), high, output_type="ndarray")
    near = near[near["v"] > low]
    i, j = first[near["i"]], second[near["j"]]
    bins = (high - low) / DISTANCES
    kept = _features(points[i], normals[i], points[j], normals[j], bins)
    order = np.argsort(kept, kind="stable")
    kept, i, j = kept[order], i[order], j[order]

    own, own_normals = part
    a, b = random.integers(len(own), size=(2, 8 * PAIRS))
    apart = np.linalg.norm(own[a] - own[b], axis=1)
    fit = np.flatnonzero((apart > low) & (apart < high))[:PAIRS]
    a, b = a[fit], b[fit]
    sought = _features(own[a], own_normals[a], own[b], own_normals[b], bins)
    begin, end = np.searchsorted(kept, sought, "left"), np.searchsorted(kept, sought, "right")
    pair = np.concatenate([np.flatnonzero(end - begin > k) for k in range(ALIKE)])
    match = begin[pair] + (random.random(len(pair)) * (end - begin)[pair]).astype(int)
    a, b, i, j = a[pair], b[pair], i[match], j[match]
    here, there = _frames(own[a], own_normals[a], own[b]), _frames(points[i], normals[i], points[j])
    rotation = there.swapaxes(1, 2) @ here
    shift = (points[i] + points[j]) / 2 - np.einsum("bij,bj->bi", rotation, (own[a] + own[b]) / 2)
    return rotation, shift


def _features(p, n, q, m, bins: float) -> np.ndarray:
    """One number for the bins in which the features of each pair lie: points p, q with normals n, m."""
    line = q - p
    distance = np.linalg.norm(line, axis=1)
    line = line / distance[:, None]
    first, second = (n * line).sum(1), (m * line).sum(1)
    about = np.arctan2((np.cross(n, m) * line).sum(1), (n * m).sum(1) - first * second)
    bend = [np.arccos(np.clip(cosine, -1, 1)) / np.pi * ANGLES for cosine in (first, second)]
    cells = [distance / bins, *bend, (about / np.pi + 1) * ANGLES]
    code = np.zeros(len(p), np.int64)
    for cell in cells:
        code = code * (2 * ANGLES + 1) + cell.astype(np.int64)
    return code


def _frames(p, n, q) -> np.ndarray:
    """`(B, 3, 3)` orthonormal rows: the normal, the way to the other point across it, and their product."""
    across = q - p
    across = across - (across * n).sum(1, keepdims=True) * n
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    return np.stack([n, across, np.cross(n, across)], axis=1)
