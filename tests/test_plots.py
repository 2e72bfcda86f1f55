"""Plots: the data in degrees on the axes given, one colour an order, matching letters, the picture not mirrored."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_curves import EDGE, astroid, astroids, made_set, point, ring
from marks import few
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from skimage.color import deltaE_ciede2000, rgb2lab

from kerrcaustics.beams.ends import SKY
from kerrcaustics.draw import palettes, plots, style
from kerrcaustics.draw.projection import unrolled
from kerrcaustics.draw.result_plots import PLOTS
from kerrcaustics.draw.scenes import show_picture
from kerrcaustics.draw.sky_axes import celestial_sphere_axes, draw_places
from kerrcaustics.draw.titles import viewer_in_words
from kerrcaustics.draw.tracks import draw_motion
from kerrcaustics.scenes.view import View
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.observer import Observer
from kerrcaustics.spacetime.shadow import shadow_edge

DRAWN = (plots.camera_sky, plots.camera_sky_unrolled)


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


def test_the_page_lists_every_plot_with_its_settings(monkeypatch):
    docs = Path(__file__).parents[1] / "docs"
    monkeypatch.syspath_prepend(docs)
    from plot_list import plot_list

    rows = re.findall(r"^\| (`.*?) \| (.{10,}) \| (.*) \|$", plot_list(), re.MULTILINE)
    assert sorted(name for names, _, _ in rows for name in re.findall(r"`(\w+)`", names)) == sorted(PLOTS)
    # Each setting is said in words, too.
    for names, text, settings in rows:
        assert all(f"`{name}" in text for name in re.findall(r"`(\w+)=`", settings)), names
    assert "<!-- plots -->" in (docs / "plots.md").read_text(encoding="utf-8")


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
    assert ax.get_xlabel().endswith("seen from outside")
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


@pytest.mark.parametrize("count", few((1, 5), ()))
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


def test_arrows_point_along_a_line_within_the_limits():
    ax = new_axes()
    ax.set(xlim=(0, 10), ylim=(-1, 1))
    draw_motion(ax, np.stack([np.linspace(20, -10, 61), np.zeros(61)], axis=-1), "black", spacing=0.5)
    arrows = [(text.xy, text.xyann) for text in ax.texts]
    assert len(arrows) == 2
    for head, tail in arrows:
        assert head[0] < tail[0] and 0 < head[0] < 10 and head[1] == tail[1] == 0
    draw_motion(ax, np.array([[3.0, 0], [3.2, 0]]), "black")
    assert len(ax.texts) == 2


def test_ticks_and_numbers_of_small_spans():
    assert style.tick_step(0.29, 7) == 0.05 and style.tick_step(200, 7) == 30
    assert style.number(-0.5) == "−0.5" and style.number(1234.5, ".0f") == "1234"


@pytest.mark.parametrize("log", ["", "xy"])
def test_computed_points_are_dots_on_a_smooth_curve(log):
    ax, x, y = new_axes(), np.array([1.0, 2, 3, 5, 8, 9]), np.array([2.0, 5, math.nan, 9, 8.9, 3])
    style.draw_computed(ax, x, y, log, color="red")
    curve, dots = (line.get_xydata() for line in ax.get_lines())
    assert len(curve) > 100 and dots[~np.isnan(dots[:, 1])] == pytest.approx(np.stack([x, y], axis=1)[[0, 1, 3, 4, 5]])
    for place, height in dots[~np.isnan(dots[:, 1])]:
        assert np.interp(place, *curve.T) == pytest.approx(height, rel=1e-2)
    style.draw_computed(ax, x[:1], y[:1], log)
    assert ax.get_lines()[2].get_xydata().tolist() == [[pytest.approx(1.0), pytest.approx(2.0)]]


def test_a_curve_beside_the_centre_is_unrolled_at_every_turn():
    line = unrolled(np.array([350.0, 355, 5, 10, 5, 355]), np.array([1.0, 2, 2, 1, 0.5, 0.5]), closed=True)
    seen = line[np.isfinite(line[:, 0])]
    for low, high in ((-10, 10), (350, 370)):
        here = seen[(seen[:, 0] >= low) & (seen[:, 0] <= high)]
        assert len(here) == 7 and np.ptp(here[:, 0]) == 20


def test_letters_are_left_out_where_there_is_no_room():
    small = replace(astroid(2, 0.01, 2), order=2)
    ax = plots.camera_sky(new_axes(), made_set([astroid(1, 0.01, 45), small]), ring(1))
    assert {colour for _, colour in letters(ax)} == {style.order_colour(1).upper()}


def test_a_part_of_a_picture_counts_degrees_from_the_middle_of_the_whole():
    whole = View(100, 100, math.radians(60), "fisheye")
    turned = math.radians(20)
    part = View(50, 50, math.radians(10), forward=(-math.cos(turned), math.sin(turned), 0))
    ax = show_picture(new_axes(), part, np.zeros((50, 50, 3), np.uint8), whole)
    places, names = ax.xaxis.get_major_locator()(), ax.xaxis.get_major_formatter()
    middle = [names(place, 0) for place in places if abs(place - 24.5) < 0.6]
    assert middle == ["20"]


def test_colours_and_dashes_say_ten_orders_apart():
    assert len({str(style.order_line(order)) for order in range(1, 11)}) == 10
    assert len({str(style.index_line(index)) for index in range(7)}) == 7
    assert style.order_name(1) == "primary" and style.order_name(4) == "4th order"


# Machado, Oliveira & Fernandes 2009, severity 1, linear RGB: readers who see no red, and no green.
PROTAN = [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
DEUTAN = [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]


def seen_lab(colours, eye):
    """CIE Lab of colours as an eye sees them."""
    rgb = np.array([to_rgb(colour) for colour in colours])
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    seen = np.clip(linear @ np.transpose(eye), 0, 1)
    return rgb2lab(np.where(seen <= 0.0031308, 12.92 * seen, 1.055 * seen ** (1 / 2.4) - 0.055))


@pytest.mark.parametrize(
    ("orders", "indices", "least"),
    [(palettes.ORDER, palettes.INDEX, 15), (palettes.ORDER_ON_BLACK, palettes.INDEX_ON_BLACK, 11)],
)
@pytest.mark.parametrize("eye", [np.eye(3), PROTAN, DEUTAN], ids=["all", "no red", "no green"])
def test_colours_of_orders_and_indices_are_distinct_for_every_eye(orders, indices, least, eye):
    lab = seen_lab([*orders[:4], *indices[:4]], eye)
    apart = deltaE_ciede2000(lab[:, None], lab[None])
    assert apart[~np.eye(8, dtype=bool)].min() > least


@pytest.mark.parametrize(("theme", "ground"), [("light", 1.0), ("dark", 0.0)])
def test_colours_stand_out_from_their_ground(theme, ground):
    names = palettes.THEMES[theme]
    for colour in (*names["order"], *names["index"], names["star"]):
        rgb = np.array(to_rgb(colour))
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        light, dark = sorted((ground, linear @ [0.2126, 0.7152, 0.0722]), reverse=True)
        assert (light + 0.05) / (dark + 0.05) > 2


def test_caustics_on_the_sphere_are_not_torn():
    """Caustics behind the hole, at 180 degrees, are whole; one that winds runs over both borders."""
    curves = made_set([astroid(1, 0.6, 45), astroid(2, 0.9, 42), replace(astroid(3, 9.0, 41), order=3)])
    ax = curves.plot(new_axes())
    low, high = ax.get_xlim()
    for name in ("primary", "secondary"):
        phi = lines(ax)[name].get_xdata()
        assert np.abs(np.diff(phi)).max() < 10 and low < phi.min() and phi.max() < high
    wound = [line.get_xdata() for line in ax.get_lines() if line.get_color() == style.order_colour(3)]
    assert min(phi.min() for phi in wound) < low and max(phi.max() for phi in wound) > high
    assert ax.xaxis.get_major_formatter()(-170.0) == "−170" and ax.xaxis.get_major_formatter()(240.0) == "−120"


def test_places_stand_within_the_turn_that_is_shown():
    curves = made_set([astroid(1, 0.6, 45)])
    ax = curves.plot(new_axes())
    draw_places(ax, SKY, np.array([[1.0, math.radians(-170)]]))
    assert ax.get_lines()[-1].get_xdata() == pytest.approx([190.0])


@pytest.mark.parametrize(("half_width", "shape"), [(5e-11, False), (0.5, True)])
def test_unresolved_caustics_are_named(half_width, shape):
    """Next to its error in size, a caustic is a cross; where cusps alone are lost, its curve is drawn."""
    unresolved = replace(astroid(2, half_width, 45), kind="unresolved", cusps=())
    ax = made_set([unresolved]).plot(new_axes())
    line = lines(ax)["secondary, unresolved"]
    assert (len(line.get_xdata()) > 1) == shape
    if not shape:
        assert len(lines(plots.celestial_sphere(new_axes(), unresolved))["secondary, unresolved"].get_xdata()) == 1
        assert plots.overview(made_set([unresolved]), EDGE).axes[2].get_title() == "secondary caustic, unresolved"


def test_viewers_in_words():
    assert viewer_in_words(Camera(0.9, 8.0)) == "spin 0.9, radius 8, inclination 90 deg, circular orbit"
    moving = viewer_in_words(Camera(0.9, 8.0, velocity=(-0.3, 0, 0.1)))
    assert moving.endswith("\nvelocity (r, θ, φ) = (−0.3, 0, 0.1)")
    distant = Observer(spin=0.5, inclination=math.pi / 2)
    assert viewer_in_words(distant) == "spin 0.5, observer at infinity, inclination 90 deg"
    far = Observer(spin=0.5, radius=1000, inclination=1.0)
    assert viewer_in_words(far) == "spin 0.5, observer at radius 1000, inclination 57.2958 deg"


@pytest.mark.parametrize(
    ("middle", "names"), [(0.0, "−180 −120 −60 0 60 120 180"), (60.0, "−120 −60 0 60 120 180 −120")]
)
def test_azimuth_axes_name_both_ends_as_they_are(middle, names):
    """From -180 on the left to 180 on the right; axes about another middle count on from 180."""
    ax = celestial_sphere_axes(new_axes(), middle=middle)
    ticks = [tick for tick in ax.get_xticks() if middle - 180 <= tick <= middle + 180]
    assert [ax.xaxis.get_major_formatter()(tick) for tick in ticks] == names.split()
