"""The shadow renderer's hot loops on the CPU, compiled by numba at first use; `silhouettes` has the oracle in torch.

One worker draws one view of one start, see `dispatch.in_parallel`. Arrays only, no torch.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy", nogil=True)
def _lines(first, last, n):
    """The pixel lines whose centres lie between two coordinates: from, to (exclusive)."""
    low, high = min(first, last), max(first, last)
    return max(0, min(n, math.ceil(low - 0.5))), max(0, min(n, math.ceil(high - 0.5)))


@njit(cache=True, error_model="numpy", nogil=True)
def _project(vertices, vertex_body, rotation, translation, camera, n, pixels, depths):
    """Pixel coordinates `(V, 2)` and relative depths `(V,)` of all vertices in one view."""
    axes, eye, centre, width = camera
    scale = n / width
    distance = 0.0
    for a in range(3):
        distance += (centre[a] - eye[a]) ** 2
    distance = math.sqrt(distance)
    bodies = len(rotation)
    turned, moved = np.empty((bodies, 3, 3)), np.empty((bodies, 3))
    for b in range(bodies):
        for a in range(3):
            moved[b, a] = 0
            for c in range(3):
                moved[b, a] += axes[a, c] * (translation[b, c] - centre[c])
                turned[b, a, c] = 0
                for e in range(3):
                    turned[b, a, c] += axes[a, e] * rotation[b, e, c]
    for v in range(len(vertices)):
        b = vertex_body[v]
        x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
        depth = 1.0
        if eye[3] > 0:
            depth += (turned[b, 2, 0] * x + turned[b, 2, 1] * y + turned[b, 2, 2] * z + moved[b, 2]) / distance
        pixels[v, 0] = (
            scale * (turned[b, 0, 0] * x + turned[b, 0, 1] * y + turned[b, 0, 2] * z + moved[b, 0]) / depth + n / 2
        )
        pixels[v, 1] = (
            n / 2 - scale * (turned[b, 1, 0] * x + turned[b, 1, 1] * y + turned[b, 1, 2] * z + moved[b, 1]) / depth
        )
        depths[v] = depth


@njit(cache=True, error_model="numpy", nogil=True)
def _front(normals, offsets, face_body, rotation, translation, eye):
    """Which faces look at the eye, `(F,)` bool."""
    bodies = len(rotation)
    local = np.empty((bodies, 3))
    for b in range(bodies):
        for c in range(3):
            local[b, c] = 0
            for a in range(3):
                local[b, c] += (eye[a] - eye[3] * translation[b, a]) * rotation[b, a, c]
    seen = np.empty(len(normals), np.bool_)
    for f in range(len(normals)):
        e = local[face_body[f]]
        seen[f] = normals[f, 0] * e[0] + normals[f, 1] * e[1] + normals[f, 2] * e[2] > eye[3] * offsets[f]
    return seen


@njit(cache=True, error_model="numpy", nogil=True)
def _wind(edges, seen, pixels, n, winding):
    """Add each contour edge's cuts with the pixel rows to `winding` `(n, n + 1)`; returns the contour edges."""
    contour = np.empty(len(edges), np.int32)
    found = 0
    for e in range(len(edges)):
        if seen[edges[e, 2]] == seen[edges[e, 3]]:
            continue
        contour[found] = e
        found += 1
        u0, v0 = pixels[edges[e, 0], 0], pixels[edges[e, 0], 1]
        u1, v1 = pixels[edges[e, 1], 0], pixels[edges[e, 1], 1]
        turn = 1 if seen[edges[e, 2]] == (v1 > v0) else -1
        low, high = _lines(v0, v1, n)
        slope = (u1 - u0) / (v1 - v0)
        for row in range(low, high):
            x = u0 + (row + 0.5 - v0) * slope
            winding[row, max(0, min(n, math.ceil(x - 0.5)))] += turn
    return contour[:found]


@njit(cache=True, error_model="numpy", nogil=True)
def _outermost(edges, seen, pixels, contour, inside, reaches, winners):
    """For each pair of neighbours that a contour parts, the edge that reaches farthest out and how far, in pixels.

    reaches, winners : `(2, n, n)`, at the pair's first pixel; axis 0 pairs along a row, axis 1 along a column.
    """
    n = len(inside)
    for e in contour:
        u0, v0 = pixels[edges[e, 0], 0], pixels[edges[e, 0], 1]
        u1, v1 = pixels[edges[e, 1], 0], pixels[edges[e, 1], 1]
        front = seen[edges[e, 2]]
        if abs(v1 - v0) >= abs(u1 - u0):
            low, high = _lines(v0, v1, n)
            entering = front == (v1 > v0)
            slope = (u1 - u0) / (v1 - v0)
            for row in range(low, high):
                place = u0 + (row + 0.5 - v0) * slope - 0.5
                first = math.floor(place)
                if first < 0 or first >= n - 1 or inside[row, first] == inside[row, first + 1]:
                    continue
                if inside[row, first + 1] == entering:
                    reach = first + 1 - place if entering else place - first
                    if reach > reaches[0, row, first]:
                        reaches[0, row, first], winners[0, row, first] = reach, e
        else:
            low, high = _lines(u0, u1, n)
            entering = front != (u1 > u0)
            slope = (v1 - v0) / (u1 - u0)
            for column in range(low, high):
                place = v0 + (column + 0.5 - u0) * slope - 0.5
                first = math.floor(place)
                if first < 0 or first >= n - 1 or inside[first, column] == inside[first + 1, column]:
                    continue
                if inside[first + 1, column] == entering:
                    reach = first + 1 - place if entering else place - first
                    if reach > reaches[1, first, column]:
                        reaches[1, first, column], winners[1, first, column] = reach, e


@njit(cache=True, error_model="numpy", nogil=True)
def render(worker, workers, surface, rotation, translation, cameras, drawn):
    """Draw this worker's views of S starts, rotation `(S, N, 3, 3)` and translation `(S, N, 3)`.

    surface : `(vertices, vertex_body, normals, offsets, face_body, edges)`, cameras : `(axes, eye, centre, width)`, see
    `silhouettes`. drawn, filled here: silhouettes before clamping `(S * K, n, n)`, their masks, and what the way back
    needs: reaches and winners `(S * K, 2, n, n)`, both -1 before, pixels `(S * K, V, 2)`, depths `(S * K, V)`.
    """
    vertices, vertex_body, normals, offsets, face_body, edges = surface
    axes, eyes, centres, widths = cameras
    image, inside, reaches, winners, pixels, depths = drawn
    n, views = image.shape[1], len(widths)
    for i in range(worker, len(rotation) * views, workers):
        turn, place, k = rotation[i // views], translation[i // views], i % views
        camera = (axes[k], eyes[k], centres[k], widths[k])
        _project(vertices, vertex_body, turn, place, camera, n, pixels[i], depths[i])
        seen = _front(normals, offsets, face_body, turn, place, eyes[k])
        winding = np.zeros((n, n + 1), np.int32)
        contour = _wind(edges, seen, pixels[i], n, winding)
        for row in range(n):
            layers = 0
            for column in range(n):
                layers += winding[row, column]
                inside[i, row, column] = layers > 0
                image[i, row, column] = 1.0 if layers > 0 else 0.0
        _outermost(edges, seen, pixels[i], contour, inside[i], reaches[i], winners[i])
        for axis in range(2):
            for row in range(n - axis):
                for column in range(n - 1 + axis):
                    if winners[i, axis, row, column] < 0:
                        continue
                    reach = reaches[i, axis, row, column]
                    entering = not inside[i, row, column]
                    if (reach < 0.5) == entering:
                        image[i, row + axis, column + 1 - axis] += reach - 0.5
                    else:
                        image[i, row, column] += reach - 0.5


@njit(cache=True, error_model="numpy", nogil=True)
def pull(worker, workers, upstream, surface, rotation, translation, cameras, drawn, wrench):
    """The gradient's way back: for each start and view, sums of world forces at body-frame points, see
    `wrenches.gather`.

    upstream `(S * K, n, n)`: the loss's gradient in the image. drawn : what `render` left. Adds to wrench
    `(S * K, N, 4, 3)`.
    """
    vertices, vertex_body, _, _, _, edges = surface
    axes, eyes, centres, widths = cameras
    _, inside, reaches, winners, pixels, depths = drawn
    n, views = upstream.shape[1], len(widths)
    for i in range(worker, len(rotation) * views, workers):
        turn, place, k = rotation[i // views], translation[i // views], i % views
        right, up, forward = axes[k, 0], axes[k, 1], axes[k, 2]
        scale = n / widths[k]
        distance = 0.0
        for a in range(3):
            distance += (centres[k, a] - eyes[k, a]) ** 2
        distance = math.sqrt(distance)
        point, world, force = np.empty(3), np.empty(3), np.empty(3)
        for axis in range(2):
            for row in range(n - axis):
                for column in range(n - 1 + axis):
                    e = winners[i, axis, row, column]
                    if e < 0:
                        continue
                    reach = reaches[i, axis, row, column]
                    entering = not inside[i, row, column]
                    if (reach < 0.5) == entering:
                        g = upstream[i, row + axis, column + 1 - axis]
                    else:
                        g = upstream[i, row, column]
                    if entering:
                        g = -g
                    if g == 0:
                        continue
                    a, b = edges[e, 0], edges[e, 1]
                    across, along = axis, 1 - axis
                    line = (row if axis == 0 else column) + 0.5
                    span = pixels[i, b, along] - pixels[i, a, along]
                    fraction = (line - pixels[i, a, along]) / span
                    slope = (pixels[i, b, across] - pixels[i, a, across]) / span
                    # the 2D parameter runs faster where the edge is near
                    fraction = fraction / depths[i, b] / ((1 - fraction) / depths[i, a] + fraction / depths[i, b])
                    body = vertex_body[a]
                    for c in range(3):
                        point[c] = vertices[a, c] + fraction * (vertices[b, c] - vertices[a, c])
                    depth, shift_u, shift_v = 1.0, 0.0, 0.0
                    if eyes[k, 3] > 0:
                        ahead = 0.0
                        for c in range(3):
                            world[c] = place[body, c] - centres[k, c]
                            for d in range(3):
                                world[c] += turn[body, c, d] * point[d]
                            ahead += world[c] * forward[c]
                            shift_u += scale * right[c] * world[c]
                            shift_v -= scale * up[c] * world[c]
                        depth += ahead / distance
                    for c in range(3):
                        du, dv = scale * right[c] / depth, -scale * up[c] / depth
                        if eyes[k, 3] > 0:
                            bend = forward[c] / distance / depth / depth
                            du, dv = du - shift_u * bend, dv - shift_v * bend
                        force[c] = g * (du - slope * dv if axis == 0 else dv - slope * du)
                        wrench[i, body, 0, c] += force[c]
                    for c in range(3):
                        for d in range(3):
                            wrench[i, body, 1 + c, d] += point[c] * force[d]
