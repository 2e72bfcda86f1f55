"""How results show themselves: one line in a terminal, a page in a notebook, a plot on axes."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import matplotlib.pyplot as plt
import numpy as np
import pytest
from made_results import KINDS, example
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.curves.caustic import CausticSet
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


@pytest.fixture(params=KINDS, ids=lambda kind: kind.__name__)
def kind(request):
    return request.param


@pytest.fixture
def ax():
    return Figure().add_subplot()


@pytest.mark.parametrize("count", [0, 1, 3, 40])
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


@pytest.mark.parametrize("count", [0, 5])
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


def test_the_page_of_images_tells_each_with_its_error():
    images = replace(example(kc.StarImages, 3), error=np.array([1.26e-13, 2e-13, 3e-13]))
    table = ElementTree.fromstring(images._repr_html_()).findall("table")[-1]
    cells = [["".join(cell.itertext()) for cell in row] for row in table]
    assert {"image", "sky", "error (rad)"} <= set(cells[0]) and len(cells) == 4
    assert cells[1][cells[0].index("error (rad)")] == "1.3e-13"


def test_words_in_a_page_are_no_markup():
    caustic = replace(known(example(kc.Caustic, 3)), kind="<b>&", remarks=("a < b",))
    assert "<b>&" in "".join(ElementTree.fromstring(caustic._repr_html_()).itertext())


def test_a_plot_returns_its_axes(kind, ax):
    made = known(example(kind, 5))
    if kind.__name__ in NO_PLOT:
        with pytest.raises(ValueError, match=f"to be drawn, but is {kind.__name__}"):
            made.plot(ax)
    else:
        assert made.plot(ax) is ax
        ax.figure.canvas.draw()


def test_axes_are_made_where_none_are_given():
    drawn = CAMERA.plot()
    assert isinstance(drawn, Axes) and drawn.get_xlabel() == "to the right (deg)"
    assert kc.Observer(spin=0.5, inclination=1.0).plot().get_xlabel() == "α (GM/c²)"
    plt.close("all")


def test_the_shadow_is_drawn_where_it_is(ax):
    outline = CAMERA.plot(ax).patches[0].get_xy()
    x, y, z = kc.shadow_edge(CAMERA, 400).T
    away = np.degrees(np.arccos(-x))
    np.testing.assert_allclose(np.hypot(*outline[:400].T), away, atol=1e-9)
    assert (np.sign(outline[:400, 0]) == np.sign(y)).all() and (
        np.sign(outline[1:400, 1]) == np.sign(z[1:])
    ).mean() > 0.99


def test_stars_and_panoramas_are_drawn(ax):
    assert kc.skies.StarField().plot(ax, brightest=10) is ax and len(ax.collections[0].get_offsets()) == 10
    assert ElementTree.fromstring(kc.skies.StarField()._repr_html_()).find("img") is not None


def test_a_sky_that_there_is_not_is_refused(ax):
    with pytest.raises(ValueError, match="Argument `sky` must be celestial or camera, but is 'sea'"):
        example(CausticSet, 1).plot(ax, sky="sea")
