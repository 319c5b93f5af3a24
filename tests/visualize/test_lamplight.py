"""Lamps cast the shadows that views see, and light only what they reach."""

import numpy as np
import pytest
import trimesh

from data_fetch import kitchen_like
from rasp_core.geometry.cameras import Camera
from rasp_core.geometry.silhouette_edges import Views
from rasp_core.silhouettes import render_at_rest
from rasp_core.visualize import installations, lamplight, studio
from rasp_core.visualize.lamplight import Bulb, Lamp, Surface

ABOVE = Camera(0, 90, 2.0)
GREY = (0.8, 0.8, 0.8)


def floor(low=-1.0, reach=3.0):
    corners = np.array([(-reach, -reach, low), (reach, -reach, low), (reach, reach, low), (-reach, reach, low)])
    return Surface(corners, np.array([[0, 1, 2], [0, 2, 3]]), GREY, body=False)


def block(edge=0.8, **more):
    cube = trimesh.creation.box([edge] * 3)
    return Surface(cube.vertices, cube.faces, (0.2, 0.9, 0.2), **more)


def seen(surfaces, lamps, wide=120):
    """From a little beside straight above, so that the shadow is not hidden: brightness `(H, W)` of greys."""
    corners = np.array([(x, y, -1.0) for x in (-1.6, 1.6) for y in (-1.6, 1.6)])
    return lamplight.picture(surfaces, lamps, 0.0, 50.0, wide, frame=corners).astype(int)


def test_a_lamp_lights_its_square_and_bodies_darken_it():
    lamp = Lamp(ABOVE, colour=(1, 1, 1), blur_deg=0.0, soft=0.01)
    scenes = ([floor()], []), ([floor()], [lamp]), ([floor(), block()], [lamp])
    dark, lit, shaded = (seen(*scene)[..., 0] for scene in scenes)
    assert np.ptp(dark) <= 1
    bright = lit > dark.max() + 50
    assert bright.mean() == pytest.approx(2.0**2 / 3.2**2, abs=0.06)
    grey = np.ptp(seen([floor(), block()], [lamp]), axis=2) <= 2
    shadow = bright & grey & (shaded < 60)
    assert shadow.mean() > 0.02, "the block's shadow lies on the floor"
    glowing = seen([floor(), block(glow=True)], [lamp])[..., 0]
    assert not (bright & grey & (glowing < 60)).any(), "what glows casts none"


def test_light_from_the_side_leaves_the_floor_dark():
    assert np.ptp(seen([floor()], [Lamp(Camera(0, 0, 2.0))])) <= 3


def test_a_shadow_is_the_silhouette_that_its_view_sees():
    """On a wall that is looked at from above, past the body, beside the renderer's silhouette."""
    (body,) = kitchen_like(6)[5:]
    view = Camera(0, 0, 2.2 * body.radius, tuple(body.centre))
    wall = installations.wall(view, 3.0)
    surfaces = [*studio.whole([body], np.eye(4)[None], np.array([GREY])), wall]
    lamp = Lamp(view, blur_deg=0.0, soft=1e-6)
    shown = lamplight.picture(surfaces, [lamp], 0.0, 60.0, 96, 1.0, wall.vertices)[..., 0]
    expected = render_at_rest(body, Views([view]), 96).numpy()[0]
    rows = np.minimum((np.arange(len(shown)) + 0.5) / len(shown) * 96, 95).astype(int)
    assert 0.1 < expected.mean() < 0.9
    assert ((shown < 100) == (expected[rows] > 0.5)).mean() > 0.96


def test_round_things_are_smooth_and_edges_sharp():
    ball, cube = trimesh.creation.icosphere(subdivisions=3), trimesh.creation.box()
    smooth = lamplight._corner_normals(ball.vertices, ball.faces)
    assert np.allclose(smooth, ball.vertices[ball.faces], atol=0.02)
    sharp = lamplight._corner_normals(cube.vertices, cube.faces)
    assert np.allclose(sharp, cube.face_normals[:, None])


def test_a_bulb_throws_a_larger_shadow_the_nearer_it_is():
    """A block's shadow on the floor, by similar triangles."""
    areas = []
    for height in (1.5, 4.0):
        bulb = Bulb((0, 0, height), (0, 0, -1), 80.0, colour=(3, 3, 3), blur_deg=0.0)
        lit, shaded = (seen([floor(), *more], [bulb])[..., 0] for more in ([], [block(0.6, glow=False)]))
        grey = np.ptp(seen([floor(), block(0.6)], [bulb]), axis=2) <= 2
        areas.append(((lit > 60) & grey & (shaded < 45)).sum())
    assert areas[0] > 1.3 * areas[1]


def test_a_bulb_lights_its_cone_and_what_is_behind_it_casts_nothing():
    bulb = Bulb((0, 0, 1), (0, 0, -1), 30.0, colour=(1, 1, 1), blur_deg=0.0)
    points = np.array([(2 * np.tan(np.radians(a)), 0, -1.0) for a in (0, 26, 31)])
    assert bulb.light(points) == pytest.approx([1, 1, 0])
    assert bulb.away(points)[0] == 2
    assert bulb.across @ np.array([0, 0, 1]) == pytest.approx([0, 0])
    roof = Surface(floor(low=1.5).vertices, floor().faces, GREY, body=False)
    below = np.array([(x, y, -1.0) for x in (-0.4, 0.4) for y in (-0.4, 0.4)])
    open_, roofed = (lamplight.picture([floor(), *more], [bulb], 0, 10, 40, frame=below) for more in ([], [roof]))
    assert abs(open_.astype(int) - roofed).max() <= 2
