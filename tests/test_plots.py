"""Plots: the data in degrees on the axes given, one colour an order, matching letters, the picture not mirrored."""

import math
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from kerrcaustics.curves.caustic import Caustic, CausticSet, Cusp
from kerrcaustics.draw import plots, style
from kerrcaustics.spacetime.camera import Camera, sky_from_fido
from kerrcaustics.spacetime.shadow import shadow_edge

CAMERA = Camera(0.1, 8.0, velocity="fiducial")
EDGE = shadow_edge(CAMERA, 2000)
DRAWN = (plots.camera_sky, plots.camera_sky_unrolled)


def ring(radius, n=96):
    """Directions at an angle (degrees) from the hole: e_x points away from it, and looking at it e_y is right."""
    turn, radius = 2 * math.pi * np.arange(n) / n, math.radians(radius)
    across = [math.sin(radius) * np.cos(turn), math.sin(radius) * np.sin(turn)]
    return np.stack([np.full(n, -math.cos(radius)), *across], axis=-1)


def astroid(order, half_width, radius, n=96):
    """A made-up caustic of an order: an astroid, and a circle of this radius (degrees) for its critical curve."""
    turn = 2 * math.pi * np.arange(n) / n
    height = min(0.9 * half_width, 1.3)
    shape = np.stack([math.pi / 2 - height * np.sin(turn) ** 3, half_width * np.cos(turn) ** 3], axis=-1)
    shape += (0.0, order * math.pi)
    sky = ring(radius, n)
    cusps = tuple(Cusp(sky[i], shape[i], 1e-12) for i in range(0, n, n // 4))
    low, high = shape.min(axis=0), shape.max(axis=0)
    extremes = (low[0], high[0], low[1], high[1])
    return Caustic(order, sky, shape, cusps, *extremes, "astroid", True, 1e-12, 1e-12, ())


def point(order, radius):
    """A made-up caustic that is a point."""
    made = astroid(order, 1e-15, radius)
    return replace(made, cusps=(), kind="point")


def made_set(curves, camera=CAMERA, missing=()):
    made = {"camera": camera, "engine": "", "tolerance": 0.0, "seconds": 0.0, "beams": 0, "versions": {}}
    return CausticSet(tuple(curves), **made, missing=missing)


def astroids(count):
    """Orders 1 to count; the half width, in radians, grows from small to several circuits."""
    return made_set([astroid(k, 0.01 * 8.0 ** (k - 1), 40 + 20 / 4.0**k) for k in range(1, count + 1)])


def new_axes():
    return Figure(figsize=(4, 4)).add_subplot()


def lines(ax):
    return {line.get_label(): line for line in ax.get_lines() if not line.get_label().startswith("_")}


def letters(ax):
    """(letter, colour) of each text, with the point that it stands for."""
    return {(text.get_text(), to_hex(text.get_color()).upper()): np.array(text.xy) for text in ax.texts}


@pytest.mark.parametrize("draw", DRAWN)
def test_camera_sky_has_one_coloured_line_an_order_and_units(draw):
    curves, ax = astroids(3), new_axes()
    assert draw(ax, curves, EDGE) is ax
    drawn = lines(ax)
    assert list(drawn) == ["primary", "secondary", "tertiary"]
    for caustic, line in zip(curves, drawn.values(), strict=True):
        assert line.get_color() == style.order_colour(caustic.order)
    assert "deg" in ax.get_xlabel() and "deg" in ax.get_ylabel()


def test_camera_sky_holds_true_angles_from_the_centre():
    """A circle about the centre of a circular shadow has its own radius in degrees on the picture."""
    ax = plots.camera_sky(new_axes(), astroids(1), ring(30))
    radius = np.hypot(*lines(ax)["primary"].get_data())
    # Nine of ten points are a spline's.
    np.testing.assert_allclose(radius[::10], 45.0, rtol=1e-12)
    np.testing.assert_allclose(radius, 45.0, rtol=1e-5)


@pytest.mark.parametrize("gap", [1e-2, 1e-8])
def test_distance_to_the_edge_is_accurate_when_small(gap):
    """A circle round a circular shadow is at one distance, to the round-off of its radians."""
    curves = made_set([astroid(1, 0.01, 30 + gap)])
    ax = plots.camera_sky_unrolled(new_axes(), curves, ring(30, 500))
    angle, distance = lines(ax)["primary"].get_data()
    np.testing.assert_allclose(distance, gap, rtol=1e-9, atol=1e-13)
    assert angle.min() < 0 and angle.max() > 360


def test_unrolled_shadow_of_a_spinning_hole_has_zero_distance():
    """Points of the edge between those given lie on it, to the error that is claimed."""
    camera = Camera(0.999, 6.03)
    other = shadow_edge(camera, 777)
    on_edge = replace(astroid(1, 0.01, 45), sky=other, cusps=())
    ax = plots.camera_sky_unrolled(new_axes(), made_set([on_edge], camera), shadow_edge(camera, 2000))
    distance = lines(ax)["primary"].get_ydata()
    assert np.nanmax(np.radians(distance), initial=0.0) < 3e-13


@pytest.mark.parametrize("draw", DRAWN)
def test_letters_match_those_of_the_caustic(draw):
    """Same letters, in the order's colour, on the critical curve and on the caustic."""
    curves = astroids(3)
    on_sky = set(letters(draw(new_axes(), curves, EDGE)))
    on_sphere = set()
    for caustic in curves:
        marked = letters(plots.celestial_sphere(new_axes(), caustic))
        for i, letter in enumerate("ABCD"):
            at = marked[letter, style.order_colour(caustic.order).upper()]
            np.testing.assert_allclose(np.radians(at[::-1]), caustic.cusps[i].celestial)
        on_sphere |= set(marked)
    assert on_sky == on_sphere
    assert len(on_sky) == 12


def test_celestial_sphere_in_degrees():
    caustic = astroid(3, 10.0, 41)
    ax = new_axes()
    assert plots.celestial_sphere(ax, caustic) is ax
    drawn = np.stack(lines(ax)["tertiary"].get_data(), axis=-1)
    np.testing.assert_allclose(drawn[:-1], np.degrees(caustic.celestial[:, ::-1]))
    assert np.array_equal(drawn[-1], drawn[0])
    bottom, top = ax.get_ylim()
    assert bottom >= 180 and top <= 0
    assert "deg" in ax.get_xlabel() and "deg" in ax.get_ylabel()
    guides = [line.get_xdata()[0] for line in ax.get_lines() if line.get_color() == style.GUIDE_COLOUR]
    assert guides == [360 * k for k in range(0, 4)]


@pytest.mark.parametrize("half_width", [1.0, 1e-2, 1e-6])
def test_primary_zoom_names_its_centre(half_width):
    caustic = astroid(1, half_width, 45)
    ax = new_axes()
    assert plots.primary_zoom(ax, caustic) is ax
    phi, theta = lines(ax)["primary"].get_data()
    np.testing.assert_allclose(np.ptp(phi), 2 * math.degrees(half_width), rtol=1e-6)
    np.testing.assert_allclose(theta[:-1] + 90, np.degrees(caustic.celestial[:, 0]), atol=1e-9)
    assert ax.get_ylim()[0] > ax.get_ylim()[1]
    assert ax.get_xlabel().startswith("φ′ − 180 (") and "deg" in ax.get_xlabel()
    assert ax.get_ylabel().startswith("θ′ − 90 (") and "deg" in ax.get_ylabel()


def test_curve_that_is_not_closed_is_left_open():
    caustic = replace(astroid(1, 0.5, 45), closed=False)
    assert len(lines(plots.celestial_sphere(new_axes(), caustic))["primary"].get_xdata()) == 96
    plots.camera_sky_unrolled(new_axes(), made_set([caustic]), EDGE)


@pytest.mark.parametrize("draw", [plots.celestial_sphere, plots.primary_zoom])
def test_point_is_a_cross(draw):
    line = lines(draw(new_axes(), point(2, 41)))["secondary"]
    assert line.get_marker() == "x"
    assert len(line.get_xdata()) == 1


@pytest.mark.parametrize("velocity", ["fiducial", "static", "circular", (-0.3, 0.0, 0.0), (0.1, 0.2, 0.3)])
def test_picture_is_not_mirrored(velocity):
    """Light that moves along +phi comes from the left, light that moves toward larger theta from above.

    Right = forward x up, whatever the camera's velocity; the prograde edge, b > 0, is on the left.
    """
    camera = Camera(0.9, 8.0, velocity=velocity)
    edge = shadow_edge(camera, 400)
    inward = math.sqrt(1 - 0.75**2)
    photons = np.array([(inward, 0, 0.75), (inward, 0.75, 0), (inward, 0, -0.75), (inward, -0.75, 0)])
    sky = sky_from_fido(camera.frame(), photons)
    curve = replace(astroid(1, 0.1, 45), sky=sky, cusps=())
    left, above, right, below = np.transpose(
        lines(plots.camera_sky(new_axes(), made_set([curve], camera), edge))["primary"].get_data()
    )[:4]
    assert left[0] < -20 and right[0] > 20
    assert above[1] > 20 and below[1] < -20
    turn = lines(plots.camera_sky_unrolled(new_axes(), made_set([curve], camera), edge))["primary"].get_xdata()
    assert np.any(np.abs(turn - 180) < 25)


def test_prograde_edge_is_the_flat_left_one():
    """The shadow of a fast spin reaches less far from its centre on the left than on the right, top and bottom."""
    camera = Camera(0.999, 50.0, velocity="fiducial")
    ax = plots.camera_sky(new_axes(), made_set([astroid(1, 0.1, 20)], camera), shadow_edge(camera, 720))
    outline = ax.patches[0].get_xy()
    prograde = outline[0]
    assert prograde[0] == pytest.approx(outline[:, 0].min(), abs=0.02)
    height = np.ptp(outline[:, 1])
    assert np.ptp(outline[:, 0]) < 0.97 * height
    near_left = outline[outline[:, 0] < outline[:, 0].min() + 0.05 * height]
    near_right = outline[outline[:, 0] > outline[:, 0].max() - 0.05 * height]
    assert np.ptp(near_left[:, 1]) > 1.1 * np.ptp(near_right[:, 1])


@pytest.mark.parametrize("count", [1, 5])
def test_overview_saves(tmp_path, count):
    figure = plots.overview(astroids(count), EDGE)
    assert len(figure.axes) == 2 + count
    for suffix in ("png", "pdf", "svg") if count == 1 else ("png",):
        path = tmp_path / f"overview.{suffix}"
        figure.savefig(path, dpi=50)
        assert path.stat().st_size > 1000


def test_overview_of_points_and_missing_orders():
    figure = plots.overview(made_set([point(1, 45), point(3, 41)], missing=(2,)), EDGE)
    assert "not found: secondary" in figure.get_suptitle()
    assert [ax.get_title() for ax in figure.axes[2:]] == ["primary caustic, a point", "tertiary caustic, a point"]
    plots.overview(made_set([], missing=(1,)), EDGE)


def test_colours_and_dashes_tell_ten_orders_apart():
    looks = {str(style.order_line(order)) for order in range(1, 11)}
    assert len(looks) == 10
    assert style.order_name(1) == "primary" and style.order_name(4) == "4th order"
