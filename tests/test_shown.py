"""Views of results: one line in a terminal, a page in a notebook, a plot on axes."""

import math
import re
from dataclasses import replace
from xml.etree import ElementTree

import matplotlib.pyplot as plt
import numpy as np
import pytest
from made_results import KINDS, example
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from offenders import for_each

import kerrcaustics as kc
from kerrcaustics.curves.caustic import CausticSet
from kerrcaustics.draw import plots
from kerrcaustics.draw.light_curves import crowded_times, light_curve_figure
from kerrcaustics.draw.projection import about_shadow, view_axes
from kerrcaustics.results.declared import quantities, stored

NO_PLOT = {"CelestialSphere", "EquatorialPlane", "FilmResult", "Sphere", "SweepResult"}
CAMERA = kc.Camera(0.5, 4.0, 1.0)
SKIES = [
    kc.skies.StarField(),
    kc.skies.hipparcos(),
    kc.skies.Checkerboard(),
    kc.skies.TurnedSky(kc.skies.StarField(), 0.1),
    kc.skies.Panorama(np.ones((8, 16, 3))),
    kc.disks.Swatches(),
    kc.disks.Disk(3.0, 9.0, kc.disks.BlackBody(4500)),
]


@pytest.fixture
def ax():
    return Figure().add_subplot()


@for_each(kind=KINDS, count=[0, 1, 3, 40])
def test_the_line_is_short(kind, count):
    line = repr(example(kind, count))
    assert len(line) < 1000 and "\n" not in line and "array(" not in line
    assert kind.__name__ in line


@pytest.mark.parametrize("sky", SKIES, ids=lambda sky: type(sky).__name__)
def test_the_line_of_what_is_rendered_is_short(sky):
    assert len(repr(sky)) < 400 and "array(" not in repr(sky)


def known(value):
    """A made-up result without its NaN."""
    if isinstance(value, np.ndarray):
        return np.nan_to_num(value) if value.dtype.kind == "f" else value
    if isinstance(value, tuple):
        return tuple(map(known, value))
    if type(value) not in KINDS or isinstance(value, kc.Camera | kc.pictures.View):
        return value
    return replace(value, **{name: known(getattr(value, name)) for name in stored(type(value))})


@pytest.mark.slow
@pytest.mark.parametrize("count", [0, 5])
@for_each(kind=KINDS)
def test_the_page_holds_every_quantity_and_its_error(kind, count):
    made = known(example(kind, count))
    text = made._repr_html_()
    words = " ".join(ElementTree.fromstring(text).itertext())
    for name in quantities(kind):
        value = getattr(made, name)
        nothing = value is None or (isinstance(value, tuple | dict) and len(value) == 0)
        assert nothing or re.search(rf"\b{name}\b", words), name
    assert ("error" in words) >= ("error" in quantities(kind))
    assert count == 0 or ("data:image/png;base64," in text) == (kind.__name__ not in NO_PLOT)


def test_the_page_of_images_says_each_with_its_error():
    images = replace(example(kc.StarImages, 3), error=np.array([1.26e-13, 2e-13, 3e-13]))
    table = ElementTree.fromstring(images._repr_html_()).findall("table")[-1]
    cells = [["".join(cell.itertext()) for cell in row] for row in table]
    assert {"image", "sky", "error (rad)"} <= set(cells[0]) and len(cells) == 4
    assert cells[1][cells[0].index("error (rad)")] == "1.3e-13"


def test_words_in_a_page_are_no_markup():
    caustic = replace(known(example(kc.Caustic, 3)), kind="<b>&", remarks=("a < b",))
    assert "<b>&" in "".join(ElementTree.fromstring(caustic._repr_html_()).itertext())


@for_each(kind=KINDS)
def test_a_plot_returns_its_axes(kind):
    ax = Figure().add_subplot()
    made = known(example(kind, 5))
    if kind.__name__ in NO_PLOT:
        with pytest.raises(ValueError, match=f"to be drawn, but is {kind.__name__}"):
            made.plot(ax)
    else:
        assert made.plot(ax) is ax
        ax.figure.canvas.draw()
        knows = hasattr(made, "camera") or kind.__name__ in ("FollowedStar", "IsoradialSet")
        assert not knows or ("spin 0.5" in ax.get_title() and "radius 4" in ax.get_title())


def test_axes_are_made_where_none_are_given():
    drawn = CAMERA.plot()
    assert isinstance(drawn, Axes) and drawn.get_xlabel() == "right of the shadow's middle (deg)"
    assert kc.Observer(spin=0.5, inclination=1.0).plot().get_xlabel() == "α (M)"
    plt.close("all")


@pytest.mark.parametrize("camera", [CAMERA, kc.Camera(0.999, 2.2, velocity="static"), kc.Camera(0.9, 6.0)], ids=str)
def test_the_zero_of_the_camera_sky_is_the_middle_of_the_shadow(camera):
    """For every plot: about the zero the vector area of what the outline bounds has no sideward part."""
    edge = kc.shadow_edge(camera, 720)
    axes = view_axes(camera, edge)
    for draw in (camera.plot, lambda ax: plots.camera_sky(ax, kc.caustics(camera, 1), edge)):
        right, above = np.radians(draw(Figure().add_subplot()).patches[0].get_xy()[:720]).T
        away = np.hypot(right, above)
        line = np.stack([np.cos(away), *(np.sin(away) * part / away for part in (right, above))], axis=-1)
        area = np.cross(line, np.roll(line, -1, axis=0)).sum(axis=0)
        assert np.hypot(*area[1:]) < 1e-6 * abs(area[0])
        np.testing.assert_allclose(line @ axes, edge, atol=1e-6)


@pytest.mark.slow
def test_plots_of_one_camera_have_one_shadow():
    camera = kc.Camera(0.9, 10.0, math.radians(60), "static")
    caustics = kc.caustics(camera, 1)
    light = kc.light_curve(camera, 6.0, 8, crossings=1)
    drawn = [
        camera.plot(),
        caustics.plot(sky="camera"),
        plots.camera_sky(Figure().add_subplot(), caustics, kc.shadow_edge(camera, 2000)),
        light_curve_figure(light).axes[1],
        kc.star_images(camera, (1.4, 3.0), 0).plot(),
    ]
    extents = [np.concatenate([ax.patches[0].get_xy().min(axis=0), ax.patches[0].get_xy().max(axis=0)]) for ax in drawn]
    plt.close("all")
    np.testing.assert_allclose(extents, [extents[0]] * len(extents), atol=1e-3)


def test_images_bring_shadow_and_critical_curves_and_add_to_what_is_there():
    camera = kc.Camera(0.9, 10.0)
    images = kc.star_images(camera, (1.4, 3.0), 1)
    ax = images.plot()
    labels = ax.get_legend_handles_labels()[1]
    assert labels[:3] == ["shadow", "primary critical curve", "secondary critical curve"]
    assert [label for label in labels if label.startswith("index")] == [f"index {k}" for k in np.unique(images.index)]
    drawn = len(ax.lines)
    assert len(images.plot(ax).lines) == drawn + len(images) and len(ax.patches) == 1
    plt.close("all")


@pytest.mark.slow
def test_light_curves_with_crowded_times_have_no_corners_at_events():
    """From time to time the light of the second crossing changes by a factor of 1.34 at most (measured), not of 7."""
    camera = kc.Camera(0.998, 50.0, math.radians(75), "static")
    steps, coarse = [], kc.light_curve(camera, 6.0, 200, crossings=2)
    for times in (coarse.time, crowded_times(coarse)):
        share = kc.light_curve(camera, 6.0, times, crossings=2).shares[1]
        steps.append(np.abs(np.diff(np.log(share))).max())
    assert coarse.events and steps[0] > math.log(5) and steps[1] < math.log(1.5)


def test_an_image_far_out_is_an_arrow_at_the_rim_and_the_legend_is_beside_the_picture():
    """A star in front of a far camera: its primary image is 140 degrees from the hole, the curves within 20."""
    images = kc.star_images(kc.Camera(0.9, 50.0), (1.4, 0.7), 1)
    ax = images.plot()
    ax.figure.canvas.draw()
    (far,) = np.hypot(*about_shadow(images.camera, images.sky[images.index == 0]).T)
    assert far > 100 and max(np.abs([*ax.get_xlim(), *ax.get_ylim()])) < 25
    (words,) = ax.texts
    assert words.get_text() == f"at {far:.3g} deg"
    x, y = words.xy
    assert ax.get_xlim()[0] < x < ax.get_xlim()[1] and ax.get_ylim()[0] < y < ax.get_ylim()[1]
    right, up = about_shadow(images.camera, images.sky[images.index == 0])[0]
    assert math.atan2(y, x) == pytest.approx(math.atan2(up, right), abs=1e-9)
    assert ax.get_legend().get_window_extent().x0 > ax.get_window_extent().x1
    plt.close("all")


@pytest.mark.slow
def test_events_and_tracks_bring_their_curves():
    camera = kc.Camera(0.999, 6.03)
    events = kc.pair_events(camera, math.radians(77))
    assert {event.order for event in events} == {2}
    labels = events.plot().get_legend_handles_labels()[1]
    assert labels == ["primary", "secondary", "creation, order 2", "annihilation, order 2"]
    ax = kc.star_tracks(camera, math.radians(77), 1).plot()
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["index 0", "index 1", "critical curve", "creation", "annihilation"] and ax.patches
    plt.close("all")


def test_every_curve_knows_its_camera():
    caustics = kc.caustics(kc.Camera(0.9, 10.0, velocity="static"), 2)
    assert all(caustic.camera == caustics.camera for caustic in caustics)
    assert "radius 10" in caustics[1].plot().get_title()
    plt.close("all")


def test_stars_and_panoramas_are_drawn(ax):
    assert kc.skies.StarField().plot(ax, brightest=10) is ax and len(ax.collections[0].get_offsets()) == 10
    assert ElementTree.fromstring(kc.skies.StarField()._repr_html_()).find("img") is not None


def test_a_sky_that_there_is_not_is_refused(ax):
    with pytest.raises(ValueError, match="Argument `sky` must be celestial or camera, but is 'sea'"):
        example(CausticSet, 1).plot(ax, sky="sea")
