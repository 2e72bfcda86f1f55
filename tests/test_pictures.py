"""Pictures compared with those in tests/baseline: made of made-up curves, so that only the drawing can change them.

Text is left out: another version of the font renderer changes a picture more than another colour of a line does. What
the text says is the matter of the other tests of the drawings.

After a wanted change: python -m pytest tests/test_pictures.py --mpl-generate-path=tests/baseline, and look at them.
"""

import math

import matplotlib
import numpy as np
import pytest
from made_curves import CAMERA, EDGE, astroids, made_set, point, ring
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.text import Text
from packaging.version import Version

from kerrcaustics.beams.ends import CelestialSphere
from kerrcaustics.draw import plots, style
from kerrcaustics.draw.count_map import count_map_figure
from kerrcaustics.draw.multiples import multiples_figure
from kerrcaustics.draw.tracks import tracks_legend, tracks_on_sky, tracks_unrolled
from kerrcaustics.images.counts import CountMap
from kerrcaustics.tracks.events import PairEvent, PairEvents
from kerrcaustics.tracks.tracks import StarTracks, Track

# Even empty text has a height, and matplotlib 3.11 measures it anew.
pytestmark = pytest.mark.skipif(Version(matplotlib.__version__) < Version("3.11"), reason="made with matplotlib 3.11")
SKY = CelestialSphere()
# Another colour of one order makes 4 or so of it, lines broader by a fifth 2.
picture = pytest.mark.mpl_image_compare(savefig_kwargs={"dpi": 60}, tolerance=0.8)


def without_text(figure):
    # Their size follows from the font, even where they are empty.
    for legend in [*figure.legends]:
        legend.remove()
    for ax in figure.axes:
        ax.tick_params(labelleft=False, labelright=False, labelbottom=False)
    for text in figure.findobj(Text):
        text.set_text("")
    return figure


def made_track(index, radius, events=()):
    """A made-up closed track: a circle of this radius (degrees), with events at some of its points."""
    sky = ring(radius, 60)
    indices = np.array(index) if np.ndim(index) else np.full(60, index)
    places = tuple(int(np.argmin(np.linalg.norm(sky - event.sky, axis=1))) for event in events)
    parity = 1 - 2 * (indices % 2)
    parity[list(places)] = 0
    ones = np.ones(60)
    azimuth = 2 * math.pi * np.arange(60) / 60
    columns = ones, 0 * ones, ones, 0 * ones, ones, 0 * ones, 0 * ones
    return Track(CAMERA, SKY, sky, azimuth, indices, parity, *columns, True, 1, events, places)


def made_event(kind, point_of_ring, radius):
    sky = ring(radius, 60)[point_of_ring]
    return PairEvent(kind, 2, 0.0, 0.0, sky, SKY, (1.0, 0.0), (1, 2), *[0.0] * 5, False, False, ())


def made_tracks():
    events = made_event("creation", 5, 43), made_event("annihilation", 25, 43)
    inner = np.where((np.arange(60) >= 5) & (np.arange(60) < 25), 2, 1)
    tracks = made_track(0, 60), made_track(inner, 43, events)
    return StarTracks(CAMERA, SKY, 1.0, 2, 0.05, 125.0, tracks, PairEvents(events, CAMERA, SKY, True, ()), (), True, ())


@picture
def test_overview():
    return without_text(plots.overview(astroids(3), EDGE))


@picture
def test_overview_of_points():
    return without_text(plots.overview(made_set([point(1, 45), point(3, 41)], missing=(2,)), EDGE))


@picture
def test_tracks():
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 4.0), layout="constrained")
        sky, unrolled = figure.subplots(1, 2)
        tracks_on_sky(sky, made_tracks(), astroids(2), EDGE)
        tracks_unrolled(unrolled, made_tracks(), astroids(2), EDGE)
        figure.legend(handles=tracks_legend([made_tracks()], True), loc="outside lower center", ncols=6)
    return without_text(figure)


@picture
def test_count_map():
    theta, phi = (np.arange(n) * math.pi / 45 for n in (45, 90))
    stripes = np.stack(np.broadcast_arrays(np.ones((45, 1), int), np.arange(90) // 30 + (np.arange(45) // 15)[:, None]))
    nowhere = np.zeros((45, 90), bool)
    counts = CountMap(CAMERA, SKY, theta, phi, np.moveaxis(stripes, 0, -1), nowhere, nowhere)
    return without_text(count_map_figure(counts, astroids(3)))


@picture
def test_multiples():
    rows = {"spin 0.1": astroids(3), "spin 0": made_set([point(1, 45), point(2, 42), point(3, 41)])}
    return without_text(multiples_figure(rows, "made up"))


def test_every_axis_of_the_azimuth_says_that_it_is_seen_from_outside():
    figures = plots.overview(astroids(3), EDGE), multiples_figure({"spin 0.1": astroids(3)}, "made up")
    for figure in figures:
        names = [ax.get_xlabel() for ax in figure.axes if "φ′" in ax.get_xlabel()]
        assert len(names) == 3 and all(name.endswith("seen from outside") for name in names)
