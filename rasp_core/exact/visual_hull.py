"""Visual hulls: the largest solid whose silhouettes stay within given ones, by exact booleans of their extrusions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from manifold3d import CrossSection, FillRule, Manifold, OpType

from ..geometry.cameras import PERSPECTIVE_DISTANCE, Camera
from ..geometry.meshes import Body, make_body
from ..util.errors import InputError

LEVEL = 0.5  # of the coverage: where a silhouette's outline runs
TOLERANCE = 0.1  # of a pixel, by which outlines are straightened


def visual_hull(images: np.ndarray, cameras: Sequence[Camera]) -> Body:
    """The visual hull of silhouettes `(K, H, H)` in [0, 1], row 0 on top, seen by K cameras (Laurentini 1994).

    Its own silhouettes are the best that any solid can do. Raises InputError if there are not as many images as
    cameras, an image is not square or is empty, two views look along one line, or nothing lies in all silhouettes.
    """
    if len(images) != len(cameras) or not len(cameras):
        raise InputError(f"a silhouette for each view is needed, got {len(images)} for {len(cameras)} views")
    for k, camera in enumerate(cameras):
        for other in cameras[:k]:
            along = float(camera.axes[2] @ other.axes[2])
            if (along if camera.projection == "perspective" else abs(along)) > 1 - 1e-6:
                raise InputError(
                    f"two views look along one line (azimuth {camera.azimuth_deg:g}, elevation "
                    f"{camera.elevation_deg:g}); they show the same shadow, leave one out"
                )
    hull = Manifold.batch_boolean(
        [extrusion(image, camera) for image, camera in zip(images, cameras, strict=True)], OpType.Intersect
    )
    if hull.is_empty():
        raise InputError("no point lies in all silhouettes; are views and pictures in the same order?")
    mesh = hull.to_mesh64()
    return make_body("visual_hull", np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


def extrusion(image: np.ndarray, camera: Camera) -> Manifold:
    """All points that a view's silhouette `(H, H)` hides, a width before and behind its centre. Raises InputError if
    the image is not square, or nothing of it is dark."""
    from contourpy import contour_generator

    image = np.asarray(image, np.float64)
    if image.ndim != 2 or image.shape[0] != image.shape[1]:
        raise InputError(f"a silhouette must be a square image, got one of shape {image.shape}")
    if not (image > LEVEL).any():
        raise InputError(f"the silhouette {camera.direction} is empty")
    pixel = camera.width / len(image)
    lines = contour_generator(z=np.pad(image, 1)).lines(LEVEL)
    # pixel (row, column) of the padded image -> metres to the right and up from the view's centre
    middle = (len(image) - 1) / 2 + 1
    polygons = [np.column_stack([x - middle, middle - y]) * pixel for x, y in (line.T for line in lines)]
    section = CrossSection([polygon[:-1] for polygon in polygons], FillRule.EvenOdd).simplify(TOLERANCE * pixel)
    near = far = 1.0
    if camera.projection == "perspective":
        near, far = ((PERSPECTIVE_DISTANCE + step) / PERSPECTIVE_DISTANCE for step in (-1, 1))
    solid = section.scale((near, near)).extrude(2 * camera.width, scale_top=(far / near, far / near))
    right, up, forward = camera.axes
    # these axes are left-handed; manifold3d turns the faces round
    turn = np.column_stack([right, up, forward])
    shift = np.asarray(camera.centre) - camera.width * forward
    return solid.transform(np.column_stack([turn, shift]))
