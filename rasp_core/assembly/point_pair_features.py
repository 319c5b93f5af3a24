"""Poses that bring a part's surface onto a boundary, from pairs of points with equal features on both.

Two points with their normals have four features that no motion changes (Drost et al. 2010): their distance, the angles
of both normals with the line between them, and the angle of one normal about it with the other. A pair of the part and
a pair of the boundary with equal features give one pose.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree


@dataclass(frozen=True)
class PairSettings:
    """Of pairs of points. shortest, longest : their distance, in the part's diameter. Bins are over these distances,
    and over angles from 0 to pi. references, others : points of the boundary from which and to which pairs go. pairs :
    of the part; matches : pairs of the boundary for each of them, at most."""

    shortest_diameters: float = 0.15
    longest_diameters: float = 0.7
    distance_bins: int = 12
    angle_bins: int = 12
    references: int = 500
    others: int = 2000
    pairs: int = 4000
    matches: int = 6


SETTINGS = PairSettings()


def poses(
    part: tuple[np.ndarray, np.ndarray],
    boundary: tuple[np.ndarray, np.ndarray],
    references: np.ndarray,
    diameter: float,
    random: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Rotations `(B, 3, 3)` and translations `(B, 3)` of a part, each from one pair of points.

    part, boundary : points `(P, 3)`, `(M, 3)` and unit normals, which a pose is to bring together. references `(R,)`:
    indices into the boundary, of the points that the poses bring a point of the part to. diameter : the part's, same
    unit. Empty if no pair has equal features.
    """
    low, high = SETTINGS.shortest_diameters * diameter, SETTINGS.longest_diameters * diameter
    points, normals = boundary
    first = random.permutation(references)[: SETTINGS.references]
    second = random.permutation(len(points))[: SETTINGS.others]
    near = cKDTree(points[first]).sparse_distance_matrix(cKDTree(points[second]), high, output_type="ndarray")
    near = near[near["v"] > low]
    i, j = first[near["i"]], second[near["j"]]
    bins = (high - low) / SETTINGS.distance_bins
    kept = _features(points[i], normals[i], points[j], normals[j], bins)
    order = np.argsort(kept, kind="stable")
    kept, i, j = kept[order], i[order], j[order]

    own, own_normals = part
    a, b = random.integers(len(own), size=(2, 8 * SETTINGS.pairs))
    apart = np.linalg.norm(own[a] - own[b], axis=1)
    fit = np.flatnonzero((apart > low) & (apart < high))[: SETTINGS.pairs]
    a, b = a[fit], b[fit]
    sought = _features(own[a], own_normals[a], own[b], own_normals[b], bins)
    begin, end = np.searchsorted(kept, sought, "left"), np.searchsorted(kept, sought, "right")
    pair = np.concatenate([np.flatnonzero(end - begin > k) for k in range(SETTINGS.matches)])
    match = begin[pair] + (random.random(len(pair)) * (end - begin)[pair]).astype(int)
    a, b, i, j = a[pair], b[pair], i[match], j[match]
    here, there = _frames(own[a], own_normals[a], own[b]), _frames(points[i], normals[i], points[j])
    rotation = there.swapaxes(1, 2) @ here
    translation = (points[i] + points[j]) / 2 - np.einsum("bij,bj->bi", rotation, (own[a] + own[b]) / 2)
    return rotation, translation


def _features(p, n, q, m, bins: float) -> np.ndarray:
    """One number for the bins in which the features of each pair lie: points p, q with normals n, m."""
    line, angle_bins = q - p, SETTINGS.angle_bins
    distance = np.linalg.norm(line, axis=1)
    line = line / distance[:, None]
    first, second = (n * line).sum(1), (m * line).sum(1)
    about = np.arctan2((np.cross(n, m) * line).sum(1), (n * m).sum(1) - first * second)
    bend = [np.arccos(np.clip(cosine, -1, 1)) / np.pi * angle_bins for cosine in (first, second)]
    cells = [distance / bins, *bend, (about / np.pi + 1) * angle_bins]
    code = np.zeros(len(p), np.int64)
    for cell in cells:
        code = code * (2 * angle_bins + 1) + cell.astype(np.int64)
    return code


def _frames(p, n, q) -> np.ndarray:
    """`(B, 3, 3)` orthonormal rows: the normal, the way to the other point across it, and their product."""
    across = q - p
    across = across - (across * n).sum(1, keepdims=True) * n
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    return np.stack([n, across, np.cross(n, across)], axis=1)
