"""Counts of many stars and over the sphere, images of great circles, and the commands `images` and `counts`."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from command_line import run
from contoured_circles import contours
from matplotlib.figure import Figure
from scipy.spatial import cKDTree

import kerrcaustics as kc
from kerrcaustics.beams.trace import trace_beams
from kerrcaustics.draw import style
from kerrcaustics.draw.circles import CircleOrbit, circle_figure, counts_in_words, lines_of_counts
from kerrcaustics.draw.count_map import count_map_axes
from kerrcaustics.draw.projection import azimuthal_equidistant, unrolled_places, view_axes
from kerrcaustics.draw.sky_axes import wrapped
from kerrcaustics.scenes.catalogue import galactic_axes
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.sphere import from_angles, polar_angle
from kerrcaustics.tracks.lines import places_on_line

CAMERA = kc.Camera(0.9, 6.0)
NORMAL = (math.radians(60), math.radians(-30))


@pytest.fixture(scope="module")
def circle():
    return kc.circle_images(CAMERA, NORMAL, max_index=2)


@pytest.mark.slow
def test_points_lie_on_the_circle_and_on_their_sheet(circle):
    assert circle.certified and circle.remarks == ()
    axis = from_angles(*NORMAL)
    for curve in circle.curves:
        beams = trace_beams(CAMERA, curve.sky, engine="integrated", tolerance=1e-13)
        # The ends of an open curve lie on critical curves, where the index is either.
        inner = slice(None) if curve.closed else slice(1, -1)
        assert (beams.index[inner] == curve.index).all()
        assert (np.abs(beams.direction @ axis) <= 10 * beams.error + beams.delta_plus * curve.error)[inner].all()
        assert (np.diff(curve.longitude) > 0).all()
        place = Circle.great(*NORMAL).place(curve.longitude)
        assert np.allclose(place, beams.direction, rtol=0, atol=1e-8)


@pytest.mark.slow
def test_ends_of_curves_are_critical(circle):
    ends = [curve.sky[[0, -1]] for curve in circle.curves if not curve.closed]
    beams = trace_beams(CAMERA, np.concatenate(ends), tolerance=1e-12)
    assert len(ends) >= 2
    assert (np.abs(beams.delta_minus) < 1e-8 * beams.delta_plus).all()


def test_stars_on_the_circle_lie_on_its_curves(circle):
    stars = Circle.great(*NORMAL).place(np.radians([10.0, 100.0, 200.0]))
    for star in stars:
        found = kc.star_images(CAMERA, (float(polar_angle(star)), math.atan2(star[1], star[0])), 2)
        for index, sky in zip(found.index, found.sky, strict=True):
            points = np.concatenate([curve.sky for curve in circle.curves if curve.index == index])
            steps = max(np.linalg.norm(np.diff(c.sky, axis=0), axis=1).max() for c in circle.curves if c.index == index)
            assert np.linalg.norm(points - sky, axis=1).min() < steps


def farthest(points, curves):
    """Largest distance of points (n, 3) from the nearest of some curves, radians."""
    corners = []
    for curve in curves:
        count = np.ceil(np.linalg.norm(np.diff(curve, axis=0), axis=1) / 5e-4).astype(int)
        part = np.concatenate([np.arange(n) / n for n in count])[:, None]
        corners.append(np.repeat(curve[:-1], count, axis=0) * (1 - part) + np.repeat(curve[1:], count, axis=0) * part)
    return cKDTree(np.concatenate(corners)).query(points)[0].max()


FINE = (1500, 1200, 2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("viewer", "end"),
    [
        (kc.Camera(0.9, 10.0, 1.2, "fiducial"), 30.0),
        (kc.Camera(0.9, 10.0, 1.2, (0.1, 0.3, 0.5)), 30.0),
        (kc.Observer(spin=0.9, inclination=1.2, radius=500.0), math.inf),
        (kc.Observer(spin=0.9, inclination=1.2), math.inf),
    ],
)
def test_circles_of_every_viewer_on_spheres_beyond(viewer, end):
    """The rays of all points end on the circle, and both counts of a line's crossings agree."""
    images = kc.circle_images(viewer, NORMAL, 2, end=end)
    assert images.certified and len(images.curves) >= 2
    for curve in images.curves:
        rays = kc.trace_rays(viewer, curve.sky, end=end)
        assert np.abs(Circle.great(*NORMAL).height(rays.direction)).max() < 1e-7
    crossings = kc.crossings_of_line(images, 0.5)
    assert crossings.certified and crossings.sky.shape[1] == images.curves[0].sky.shape[1]


@pytest.mark.parametrize(
    ("camera", "normal", "grid"),
    [
        pytest.param(kc.Camera(0.95, 4.0, 1.0), (1.0, 2.0), (350, 250, 8e-3), marks=pytest.mark.slow),
        pytest.param(CAMERA, NORMAL, FINE, marks=pytest.mark.slow),
        pytest.param(kc.Camera(0.95, 4.0, 1.0), (1.0, 2.0), FINE, marks=pytest.mark.slow),
        pytest.param(kc.Camera(0.999, 2.6), (0.7, 0.3), FINE, marks=pytest.mark.slow),
        pytest.param(kc.Camera(0.0, 6.0), (0.3, 1.0), FINE, marks=pytest.mark.slow),
    ],
    ids=str,
)
def test_curves_are_the_contours_of_a_grid(camera, normal, grid):
    *size, apart = grid
    found = kc.circle_images(camera, normal, max_index=1)
    assert found.certified
    for index in (0, 1):
        curves = [curve for curve in found.curves if curve.index == index]
        curves = [np.concatenate([curve.sky, curve.sky[: int(curve.closed)]]) for curve in curves]
        lines = contours(camera, normal, index, *size)
        # Every contour runs along a curve, and every curve along a contour, but for the grid's and the curves' steps.
        assert farthest(np.concatenate(lines), curves) < apart
        assert farthest(np.concatenate(curves), lines) < apart


@pytest.mark.parametrize("on_axes", [0, 1])
def test_figure_shows_the_curves_and_what_a_line_crosses(circle, on_axes):
    """Each point of a curve and each crossing is drawn where the camera sees it, in the colour of its index."""
    crossings = kc.crossings_of_line(circle, 0.4)
    figure = circle_figure(circle, kc.caustics(CAMERA, 3), {0.4: crossings})
    view, edge = view_axes(CAMERA, kc.shadow_edge(CAMERA, 2000)), kc.shadow_edge(CAMERA, 2000)
    place = (lambda sky: azimuthal_equidistant(sky, view), lambda sky: unrolled_places(sky, view, edge))[on_axes]
    for index in range(3):
        lines = [line for line in figure.axes[on_axes].lines if line.get_color() == style.index_colour(index)]
        drawn, dots = (line.get_xydata() for line in lines)
        for curve in circle.curves:
            if curve.index == index:
                assert max(np.nanmin(np.abs(drawn - point).sum(axis=1)) for point in place(curve.sky)) < 1e-9
        np.testing.assert_allclose(dots, place(crossings.sky[crossings.index == index]), rtol=0, atol=1e-9)
    assert figure.get_suptitle().endswith(counts_in_words("the line at 22.9183 deg", crossings))
    assert "NOT certified" not in figure.get_suptitle()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["above", "below"])
def test_most_circles_are_seen_once_straight_above_the_shadow_and_below_it(name):
    """Percent of random circles, by the signs of their heights along the line; docs/open_questions.md has them."""
    camera = kc.Camera(0.999, 2.6)
    caustics = kc.caustics(camera, orders=3)
    line = places_on_line(kc.circle_images(camera, (0.5, 0.0), 2), lines_of_counts(caustics)[name], 100_001)
    # Closer together toward the shadow.
    beams = trace_beams(camera, line[np.unique(np.geomspace(1, len(line), 800).astype(int)) - 1])
    normals = np.random.default_rng(4).normal(size=(20_000, 3))
    for index, shares in ((1, [23, 64, 13]), (2, [11, 75, 14])):
        above = normals @ beams.direction[beams.index == index].T > 0
        crossings = (above[:, 1:] != above[:, :-1]).sum(axis=1)
        assert [100 * np.mean(crossings == count) for count in range(3)] == pytest.approx(shares, abs=1.0)


@pytest.mark.slow
def test_frames_of_an_orbit_count_the_images_of_the_circle_that_turns():
    """A quarter of an orbit later the circle has turned back by as much; what is not certified is said."""
    camera, normal = kc.Camera(0.999, 2.6), (math.radians(25), math.radians(-150))
    sky = kc.skies.StarField()
    np.testing.assert_allclose(sky.orientation @ galactic_axes()[2], from_angles(*normal), atol=1e-12)
    orbit = CircleOrbit(camera, normal, 2, 4)
    captions = []
    for number in (0, 1):
        orbit.frame(number)
        captions.append(next(text.get_text() for text in orbit.figure.texts if "dashed" in text.get_text()))
        turned = kc.circle_images(camera, (normal[0], normal[1] - number * math.pi / 2), max_index=2)
        left = kc.crossings_of_line(turned, 0.0)
        assert counts_in_words("left edge", left) in captions[-1]
        assert turned.certified and left.certified and ", certified:" in captions[-1]
    assert "left edge: 1 of index 0, 4 of index 1, 11 of index 2" in captions[0]
    assert "above: 1 of index 1, 1 of index 2\nbelow: 0 of index 1, 1 of index 2" in captions[0]
    assert captions[0] != captions[1]
    doubtful = replace(turned, certified=False, remarks=("two curves are one",))
    assert "NOT certified (two curves are one)" in orbit.caption(0.0, doubtful, {"left edge": left})


@pytest.mark.slow
def test_events_of_a_circle_change_its_counts(circle):
    assert len(circle.events) > 0
    great = Circle.great(*NORMAL)
    for event in circle.events:
        place = great.place(event.longitude + np.array([-1e-6, 1e-6]))
        angles = np.stack([polar_angle(place), np.arctan2(place[:, 1], place[:, 0])], axis=-1)
        before, after = kc.image_counts(CAMERA, angles, 2, find=False).expected
        pair = np.isin(np.arange(3), event.indices).astype(int)
        assert np.array_equal(after - before, pair if event.kind == "creation" else -pair)
        beams = trace_beams(CAMERA, event.sky[None], engine="integrated", tolerance=1e-13)
        assert abs(beams.delta_minus[0]) < 1e-9 * beams.delta_plus[0]
        assert abs(great.height(beams.direction)[0]) < 1e-10
    ends = [curve for curve in circle.curves if not curve.closed]
    met = np.array([event.sky for event in circle.events])
    inner = [end for curve in ends if curve.index < 2 for end in curve.sky[[0, -1]]]
    assert all(np.linalg.norm(met - end, axis=1).min() < 1e-9 for end in inner)


@pytest.mark.slow
def test_schwarzschild_shows_the_whole_circle_once_an_index():
    found = kc.circle_images(kc.Camera(0.0, 6.0), (0.3, 1.0), max_index=2)
    assert found.certified and found.per_index == {0: 1, 1: 1, 2: 1}
    assert all(curve.closed and curve.sweep == pytest.approx(2 * math.pi) for curve in found.curves)


@pytest.mark.slow
def test_circle_of_the_equator_runs_along_the_flat_edge():
    found = kc.circle_images(CAMERA, (0.0, 0.0), max_index=1)
    assert found.certified
    line = kc.crossings_of_line(found, 0.0)
    assert not line.certified and "lies on" in line.remarks[0]
    assert kc.crossings_of_line(found, 1.0).certified


@pytest.mark.slow
@pytest.mark.parametrize("turn", [0.0, 0.5 * math.pi, math.pi, 4.0])
def test_crossings_are_counted_twice(circle, turn):
    line = kc.crossings_of_line(circle, turn)
    assert line.certified and line.per_index == line.expected
    beams = trace_beams(CAMERA, line.sky, engine="integrated", tolerance=1e-13)
    assert np.array_equal(beams.index, line.index)
    height = beams.direction @ from_angles(*NORMAL)
    assert (np.abs(height) <= 10 * beams.delta_plus * line.error + beams.error).all()


def test_crossings_of_a_line_between_two_directions(circle):
    curve = max(circle.curves, key=lambda curve: np.ptp(curve.longitude))
    middle = len(curve.sky) // 2
    point, step = curve.sky[middle], curve.sky[middle + 1] - curve.sky[middle - 1]
    across = np.cross(point, step / np.linalg.norm(step))
    ends = np.array([point - 1e-3 * across, point + 1e-3 * across])
    line = kc.crossings_of_line(circle, ends)
    assert line.certified
    assert np.linalg.norm(line.sky - point, axis=1).min() < 1e-5


@pytest.mark.slow
def test_flat_edge_of_the_fast_hole():
    """JTFT fig 8: the paper sees 3 images of its galactic plane between the first two critical curves, 8 beyond."""
    camera = kc.Camera(0.999, 2.6)
    found = kc.circle_images(camera, "galactic plane", max_index=2)
    line = kc.crossings_of_line(found, 0.0)
    assert found.certified and line.certified
    assert line.per_index == {0: 1, 1: 4, 2: 11}


def test_map_agrees_with_counts_of_stars():
    found = kc.count_map(CAMERA, max_index=2, rows=30)
    assert found.counts.shape == (30, 60, 3)
    assert found.solid_angle.sum() * 60 == pytest.approx(4 * math.pi)
    row, column = np.random.default_rng(0).integers(0, (30, 60), (20, 2)).T
    stars = np.stack([found.level[row], found.phi[column]], axis=-1)
    counted = kc.image_counts(CAMERA, stars, max_index=2)
    assert counted.certified.all()
    assert np.array_equal(counted.counts, found.counts[row, column])
    quick = kc.image_counts(CAMERA, stars, max_index=2, find=False)
    assert np.array_equal(quick.counts, counted.counts) and not quick.certified.any()


def test_map_shows_each_count_and_wraps_caustics():
    ax = count_map_axes(Figure().add_subplot(), kc.count_map(CAMERA, 1, 24), kc.caustics(CAMERA, 2))
    assert len(ax.images) == 1 and len(ax.get_legend_handles_labels()[0]) == 2
    line = wrapped(np.array([[90.0, 170.0], [80.0, 190.0], [80.0, -170.0 + 720]]))
    phi, theta = line[np.isfinite(line[:, 0])].T
    assert (np.abs(phi) <= 180).all()
    assert theta[1] == pytest.approx(85.0) and np.isnan(line[:, 0]).sum() == 2


@pytest.mark.parametrize("beyond", [170.0, 190.0])
def test_a_caustic_with_a_point_on_the_border_of_the_picture_does_not_cross_it(beyond):
    line = wrapped(np.array([[90.0, 180.0], [89.0, beyond], [90.0, 180.0], [91.0, 185.0]]))
    steps = np.abs(np.diff(line[:, 0]))
    assert np.nanmax(steps) < 11 and np.isfinite(line).any()


BAD_CIRCLES = [((4.0, 0.0), "`normal` must have theta'"), ("milky way", "galactic plane"), ((1.0,), "`normal` must be")]


@pytest.mark.parametrize(("normal", "complaint"), BAD_CIRCLES, ids=str)
def test_bad_normals(normal, complaint):
    with pytest.raises(ValueError, match=complaint):
        kc.circle_images(CAMERA, normal)


@pytest.mark.parametrize("line", [math.nan, "left", [[1, 0, 0]], [[0, 0, 1], [0, 0, 1]], [[0, 0, 0], [0, 0, 1]]])
def test_bad_lines(circle, line):
    with pytest.raises(ValueError, match="Argument `line` must"):
        kc.crossings_of_line(circle, line)


def test_a_line_through_the_shadow_is_refused(circle):
    edge = kc.shadow_edge(CAMERA)
    with pytest.raises(ValueError, match="shadow"):
        kc.crossings_of_line(circle, [edge[0], edge[180]])


PLACE = ("--spin", 0.9, "--radius", 6)


def test_images_command(capsys, tmp_path):
    target = tmp_path / "out.json"
    status, out, err = run(capsys, "images", *PLACE, "--star", 80, -20, "--max-index", 1, "--json", target)
    assert (status, err) == (0, "") and "certified" in out and "magnification" in out
    entry = json.loads(target.read_text())
    found = kc.star_images(CAMERA, (math.radians(80), math.radians(-20)), 1)
    assert entry["schema"] == "kerrcaustics/images/1" and entry["star_deg"] == [80, -20]
    assert entry["certified"] and entry["per_index"] == {str(k): n for k, n in found.per_index.items()}
    names = {"sky", "phi_deg", "index", "parity", "magnification", "crossings", "crossings_certain", "redshift"}
    names |= {"error_rad", "time", "second_arrival"} | {
        f"{name}_error" for name in ("magnification", "redshift", "time")
    }
    assert len(entry["images"]) == len(found) and set(entry["images"][0]) == names
    assert entry["images"][1]["sky"] == found.sky[1].tolist()


def test_an_image_that_is_not_certified_is_exit_status_1(capsys):
    theta, phi = np.degrees(kc.caustics(CAMERA, 2)[1].celestial[20])
    status, out, err = run(
        capsys, "images", *PLACE, "--star", float(theta), float(phi), "--max-index", 1, "--json", "-"
    )
    assert status == 1 and json.loads(out)["on_caustic"] == [2]
    assert "NOT certified" in err and "caustic of order 2" in err


def test_counts_of_a_file_of_stars(capsys, tmp_path):
    (tmp_path / "stars.csv").write_text("theta,phi\n# one\n80,-20\n\n10, 400\n")
    status, out, err = run(capsys, "counts", *PLACE, "--stars", tmp_path / "stars.csv", "--json", "-", "--max-index", 1)
    entry = json.loads(out)
    assert status == 0 and "2 of 2 certified" in err
    assert entry["schema"] == "kerrcaustics/counts/1" and entry["kind"] == "stars"
    assert [star["star_deg"] for star in entry["stars"]] == [[80, -20], [10, 400]]
    assert all(star["certified"] and star["total"] == sum(star["per_index"].values()) for star in entry["stars"])


def test_counts_map_with_its_figure(capsys, tmp_path):
    target, picture = tmp_path / "out.json", tmp_path / "map.png"
    options = ("--map", "--rows", 12, "--max-index", 1, "--figure", picture, "--json", target)
    status, out, _ = run(capsys, "counts", *PLACE, *options)
    entry = json.loads(target.read_text())
    assert status == 0 and "fewest" in out and picture.read_bytes()[:4] == b"\x89PNG"
    assert np.array(entry["counts"]).shape == (12, 24, 2) and len(entry["phi_deg"]) == 24


@pytest.mark.slow
def test_counts_of_a_circle_with_its_figure(capsys, tmp_path):
    options, picture = ("--circle", 60, -30, "--line", 90, "--json", "-", "--points"), tmp_path / "circle.png"
    status, out, err = run(capsys, "counts", *PLACE, *options, "--figure", picture)
    entry = json.loads(out)
    assert picture.read_bytes()[:4] == b"\x89PNG" and str(picture) in err
    assert status == 0 and entry["certified"] and "the line at 90 deg crosses" in err
    assert entry["line"]["per_index"] == entry["line"]["expected"]
    assert len(entry["curves"][0]["sky"]) == len(entry["curves"][0]["longitude_deg"]) > 10


BAD = [
    (("images", *PLACE), "--star"),
    (("images", *PLACE, "--star", "181", "0"), "--star must have a theta' in [0, 180] degrees, but it is 181."),
    (("images", *PLACE, "--star", "nan", "0"), "--star must have a theta' in [0, 180] degrees"),
    (("images", *PLACE, "--star", "90", "inf"), "--star must have a finite phi'"),
    (("images", *PLACE, "--star", "90", "0", "--max-index", "-1"), "--max-index must be a whole number from 0 to 6"),
    (("images", *PLACE, "--star", "90", "0", "--max-index", "1.5"), "--max-index must be a whole number, but is 1.5."),
    (("images", *PLACE, "--star", "90", "0", "--inclination", "-3"), "--inclination must lie in [0, 180]"),
    (("counts", *PLACE), "--star, --stars, --map, --circle: one of them must be given, but none was given."),
    (("counts", *PLACE, "--map", "--star", "9", "9"), "--star and --map were given"),
    (("counts", *PLACE, "--stars", "nowhere.csv"), "--stars must name a file that can be read"),
    (("counts", *PLACE, "--map", "--rows", "0"), "--rows must be a whole number from 1 to 4096"),
    (("counts", *PLACE, "--map", "--line", "0"), "--line must be used with --circle."),
    (("counts", *PLACE, "--star", "9", "9", "--figure", "x.png"), "--figure must be used with --map or --circle."),
    (("counts", *PLACE, "--circle", "9", "9", "--points"), "--points must be used with --json."),
    (("counts", *PLACE, "--circle", "9", "9", "--line", "nan"), "--line must be a finite number of degrees"),
]


@pytest.mark.parametrize(("arguments", "complaint"), BAD, ids=lambda value: " ".join(map(str, value))[:70])
def test_bad_input_gets_one_line_and_exit_status_2(arguments, complaint, assert_refused):
    assert_refused(arguments, complaint)


@pytest.mark.parametrize("text", ["80,-20\n80\n", "80;20\n1,2\n", "x,y\n", "200,0\n"])
def test_bad_files_of_stars(text, capsys, tmp_path):
    (tmp_path / "stars.csv").write_text(text)
    status, _, err = run(capsys, "counts", *PLACE, "--stars", tmp_path / "stars.csv")
    assert status == 2 and err.count("\n") == 1 and "--stars" in err
