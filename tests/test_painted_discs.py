"""Discs painted on spheres within the viewer's radius and in the equatorial plane: sums over rays, points, shares."""

import math

import numpy as np
import problems
import pytest

import kerrcaustics as kc
from kerrcaustics.beams.ends import Sphere
from kerrcaustics.extended_sources.charts import contours
from kerrcaustics.extended_sources.charts.charts import ChartRays, Disc, DiscChart
from kerrcaustics.results.progress import listening
from kerrcaustics.scripts import STUDIES

TWIN = STUDIES.module("extended_sources.twin")
NEAR = kc.Camera(0.9, 20.0, 1.2, "fiducial")


class PlainChart(DiscChart):
    """A chart on which light comes from the place of the plane with the polar coordinates 1 + height and phase."""

    def rays(self, phase, height):
        place = (1 + height)[:, None] * np.stack([np.cos(phase), np.sin(phase)], axis=-1)
        one, sky = np.ones(len(phase)), np.pad(place, ((0, 0), (0, 1)))
        index = np.zeros(len(phase), int)
        return ChartRays(sky, place, self.disc.height(place), 0 * one, index, one, 0 * one)


@pytest.mark.stand_ins
@pytest.mark.parametrize("most", [contours.MOST_RAYS, 2500])
def test_curves_on_a_chart_report_progress_and_are_given_up_in_the_end(monkeypatch, most):
    monkeypatch.setattr(contours, "MOST_RAYS", most)
    disc = Disc(kc.EquatorialPlane(1), np.array([1.5, 0.0]), 0.2)
    heard = []
    with listening(lambda text, part: heard.append((text, part))):
        curves = contours.contours(PlainChart(NEAR, disc, disc.surface, 1, None, 0.0, 1.0, open_ended=True))
    assert heard[0][0].startswith("limb and critical curves") and 0 < heard[0][1] < heard[-1][1] <= 1
    if most > 2500:
        # Closed curves have as many steps as nodes.
        assert curves.remarks == () and len(curves.steps.order) == len(curves.nodes.number) > 10
    else:
        assert curves.remarks == (contours.GIVEN_UP,)


@pytest.mark.slow
@problems.each(problems.DISCS, lambda problem: problem.end != math.inf)
def test_discs_agree_with_sums_over_rays(problem):
    viewer, end = problem.viewer, problem.end
    seen = problems.magnified(problem)
    assert seen.certified
    in_plane = isinstance(end, kc.EquatorialPlane)
    surface, size = (end, problem.size) if in_plane else (Sphere(end), problem.size / end)
    centre = surface.vectors(np.array([problem.place]))[0]
    expected, error = TWIN.summed(viewer, centre, size, problem.max_index, surface=surface)
    assert abs(seen.total - expected) < 3 * error + 5e-4 * expected and error < 0.1 * expected


@pytest.mark.slow
@problems.each(problems.SMALL)
def test_small_disc_is_as_bright_as_a_point(problem):
    images = kc.star_images(problem.viewer, problem.place, end=problem.end)
    seen = problems.magnified(problem)
    assert images.certified and seen.certified
    for k, share in seen.per_index.items():
        # What is left goes by the square of the size.
        assert abs(share - images.magnification[images.index == k].sum()) <= 1e-7 * share + seen.per_index_error[k]


@pytest.mark.slow
@pytest.mark.parametrize("place", [(1.4, 2.9), (1.4, 1.3), (1.2, 0.1)])
def test_disc_and_the_rest_fill_the_sphere(place):
    """All images of a sphere have one area, however it is cut into two discs."""
    theta, phi = place
    areas = []
    for angle in (0.15, 1.1):
        disc = kc.magnification(NEAR, place, angle * 8.0, max_index=1, end=8.0)
        rest = kc.magnification(NEAR, (math.pi - theta, phi + math.pi), (math.pi - angle) * 8.0, max_index=1, end=8.0)
        assert disc.certified and rest.certified
        parts = (disc.total, angle), (rest.total, math.pi - angle)
        areas.append(sum(total * 4 * math.pi * math.sin(part / 2) ** 2 for total, part in parts))
        for seen in (disc, rest):
            shares, off = sum(seen.per_index.values()), sum(seen.per_index_error.values())
            assert abs(shares - seen.total) <= off + seen.error
    assert abs(areas[0] - areas[1]) < 1e-7 * areas[0]


@pytest.mark.slow
@pytest.mark.parametrize("end", [8.0, kc.EquatorialPlane(2)])
def test_disc_on_a_caustic_grows_steadily(end):
    """Between discs there are rings, whose light is positive, and a disc is brightest where the caustic is."""
    (*_, curve) = kc.caustics(NEAR, orders=2, end=end)
    far = np.flatnonzero(np.abs(curve.place[:, 0] - 6.0) < 1.0) if end != 8.0 else np.arange(len(curve.place))
    place = tuple(curve.place[far[len(far) // 3]].tolist())
    sizes = (0.02, 0.05, 0.1)
    seen = [kc.magnification(NEAR, place, size, end=end) for size in sizes]
    assert all(one.certified for one in seen)
    areas = [one.total * size**2 for one, size in zip(seen, sizes, strict=True)]
    assert areas[0] < areas[1] < areas[2]
    # Pairs on a fold are as bright as 1 over the root of the size.
    assert seen[0].total > seen[1].total > seen[2].total
    # An image goes over the critical curve.
    assert any(np.ptp(image.index) > 0 for image in seen[1].images)


@pytest.mark.slow
@pytest.mark.parametrize(("place", "end"), [((1.6, 3.1), 8.0), ((7.0, 3.0), kc.EquatorialPlane(1))])
def test_limb_darkening_is_a_sum_over_rings(place, end):
    size = 1.0
    dark = kc.magnification(NEAR, place, size, max_index=1, end=end, profile=("linear", 0.6))
    edges = np.linspace(0, 1, 9)
    discs = [kc.magnification(NEAR, place, size * s, max_index=1, end=end).total for s in edges[1:]]
    areas = np.array([0.0, *discs * edges[1:] ** 2])
    middle = (edges[1:] + edges[:-1]) / 2
    bright = 1 - 0.6 * (1 - np.sqrt(1 - middle**2))
    rings = (bright * np.diff(areas)).sum() / (bright * np.diff(edges**2)).sum()
    assert dark.certified and abs(dark.total - rings) < 3e-3 * rings


@pytest.mark.slow
def test_disc_without_images_to_an_index_has_no_light():
    plane = kc.EquatorialPlane(3)
    seen = kc.magnification(NEAR, (8.0, 0.4), 0.5, max_index=0, end=plane)
    assert seen.certified and seen.total == 0 and seen.images == () and np.isnan(seen.centroid).all()
    assert not kc.star_images(NEAR, (8.0, 0.4), 0, end=plane).per_index[0]


@pytest.mark.slow
def test_image_over_the_rim_is_seen_by_both_arrivals():
    """On the rim an image is folded: its curves on either arrival have a piece of the rim in common."""
    seen = kc.magnification(NEAR, (1.4, 1.3), 2.4, max_index=0, end=8.0)
    assert seen.certified and len(seen.images) == 2
    one, other = (image.sky for image in seen.images)
    apart = np.linalg.norm(one[:, None] - other, axis=2).min(axis=1)
    assert (apart < 1e-5).sum() > 5 and apart.max() > 1e-3


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"size": 30.0}, "Argument `size` must be a radius from 8e-08 to 24.8 units of the mass, but is 30.0."),
        ({"power": 4.0}, "Argument `power` must be 0 for a source at a finite radius"),
        (
            {"source": (6.0, 1.0), "size": 6.0, "end": kc.EquatorialPlane(1)},
            "units of the mass, so that the disc lies outside the horizon, but is 6.0.",
        ),
        ({"source": (1.0, 1.0), "end": kc.EquatorialPlane(1)}, "Argument `source` must have an r larger than"),
        ({"end": 2.0}, "Argument `end` must be in"),
    ],
)
def test_bad_arguments_are_one_line(changes, words):
    arguments = {"source": (1.4, 2.9), "size": 0.1, "end": 8.0} | changes
    with pytest.raises(ValueError) as error:
        kc.magnification(NEAR, **arguments)
    assert words in str(error.value) and "\n" not in str(error.value)


@pytest.mark.slow
def test_limb_next_to_a_caustic_that_is_a_point():
    """On a sphere just within the camera's radius: as an integral along one line of rays says, with aberration."""
    velocity = (-0.199754602369708, -0.22086689389351255, 0.27007559349698773)
    camera = kc.Camera(0.0, 14.182805319873646, 1.7173559034274244, velocity)
    place = (1.3701740794779673, 3.113972276229373)
    seen = kc.magnification(camera, place, 0.7593985831930437, max_index=0, end=12.536403492656264)
    assert seen.certified and abs(seen.total - 0.7281957314521) < seen.error < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    ("camera", "crossing", "place", "size", "most"),
    [
        (kc.Camera(0.7716, 548.46, 1.36759, "fiducial"), 1, (4.84, 4.552), 5.73e-6, 1e-6),
        (kc.Camera(0.57988, 883.595, 1.55362, "fiducial"), 1, (18.7765, 1.2554), 1e-4, 1e-4),
    ],
    ids=["small", "nearly edge on"],
)
def test_small_discs_in_the_plane_are_as_bright_as_points(camera, crossing, place, size, most):
    end = kc.EquatorialPlane(crossing)
    seen = kc.magnification(camera, place, size, max_index=0, end=end)
    points = kc.star_images(camera, place, max_index=0, end=end)
    assert seen.certified and points.certified
    assert abs(seen.total - points.magnification.sum()) < seen.error + most * seen.total


@pytest.mark.slow
def test_limb_that_crosses_the_equator_where_lines_are_known_to_the_root_of_round_off():
    camera = kc.Camera(0.8420832806894953, 8.530735277017923, 1.7671859367066052, "fiducial")
    place = (2.1999282119035644, 3.0559703381222767)
    seen = kc.magnification(camera, place, 5.58, max_index=1, end=5.074118929734789)
    assert seen.certified and seen.error < 1e-8 * seen.total
