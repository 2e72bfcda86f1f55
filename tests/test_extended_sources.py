"""Sources of finite size: on folds, in cusps, over rings and away from them; and against sums over rays."""

import itertools
import json
import math

import numpy as np
import problems
import pytest
from command_line import run
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

import kerrcaustics as kc
from kerrcaustics.curves.critical_curves import points_between
from kerrcaustics.images.sheets import sheets_of
from kerrcaustics.scripts import STUDIES
from kerrcaustics.spacetime.frame import line_of_sight_from_sky, sky_from_line_of_sight
from kerrcaustics.spacetime.sphere import from_angles, moved, polar_angle, polar_basis

TWIN = STUDIES.module("extended_sources.twin")
CAMERA = kc.Camera(0.999, 6.03)
# Distances of the centre from a fold, in radii of the disc, positive outside.
ETAS = (-3.0, -0.65222953, 0.0, 0.5, 0.99)


def fold_profile(eta):
    """The magnification of a uniform disc beside a fold, where pairs are as bright as 1 over the root of a distance."""
    low = max(eta, -1.0)
    if eta < -1:
        return quad(lambda x: math.sqrt(1 - x * x) / math.sqrt(x - eta), -1, 1)[0] * 2 / math.pi
    return quad(lambda y: 2 * math.sqrt(max(1 - (low + y * y) ** 2, 0)), 0, math.sqrt(1 - low))[0] * 2 / math.pi


def fold(camera, order, phase, max_index=2):
    """A point of a caustic between two that are stored, and the normal toward more images."""
    sheets = sheets_of(camera, max_index)
    curve = sheets.curves.curves[order - 1]
    point = points_between(sheets.curves.search(), {order: curve.over_three_turns()}, {order: np.array([phase])})[order]
    normal = np.cross(point.direction, point.major)
    counts = [sheets.expected_counts(moved(point.direction, side * 1e-4 * normal)).expected.sum() for side in (1, -1)]
    return point.direction[0], normal[0] * (1 if counts[0] > counts[1] else -1)


def angles(direction):
    return float(polar_angle(direction)), math.atan2(direction[1], direction[0])


def at(camera, direction, size, max_index=2, **settings):
    return kc.magnification(camera, angles(direction), size, max_index=max_index, **settings)


def test_profile_beside_a_fold_is_the_one_that_is_known():
    known = (0.583623, 1.393119, 1.112836, 0.636922, 0.014116)
    assert np.allclose([fold_profile(eta) for eta in ETAS], known, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("camera", [CAMERA, kc.Camera(0.95, 5.0, 1.3, "fiducial")], ids=["equator", "inclined"])
def test_fold_law_holds_for_small_discs_and_departs_as_their_size(camera):
    point, inward = fold(camera, 2, 1.234)
    departures = []
    for size in (1e-3, 1e-4, 1e-5):
        seen = [at(camera, moved(point[None], -eta * size * inward[None])[0], size) for eta in ETAS]
        assert all(one.certified for one in seen)
        totals = np.array([one.total for one in seen])
        profile = np.array([fold_profile(eta) for eta in ETAS])
        # The images that are not in the pair, and the strength of the fold, from two of the places.
        strength = (totals[1] - totals[4]) / (profile[1] - profile[4])
        rest = totals[4] - strength * profile[4]
        departures.append(np.abs((totals - rest) / strength - profile)[[0, 2, 3]].max())
    assert departures[0] < 0.02
    assert 3 < departures[0] / departures[1] < 30
    assert departures[2] < departures[1] / 3


@pytest.mark.slow
def test_light_is_continuous_where_the_limb_touches_the_caustic():
    point, inward = fold(CAMERA, 2, 1.234)
    size = 1e-3
    for touching in (-1.0, 1.0):
        seen = [
            at(CAMERA, moved(point[None], -(touching + step) * size * inward[None])[0], size)
            for step in (-1e-9, 0.0, 1e-9)
        ]
        totals = [one.total for one in seen]
        assert all(one.certified for one in seen)
        assert np.ptp(totals) < 2 * max(one.error for one in seen) + 1e-6


@pytest.mark.slow
def test_disc_on_a_caustic_is_bright_and_certified():
    point, inward = fold(CAMERA, 2, 1.234)
    size = 1e-4
    seen, beside = (at(CAMERA, moved(point[None], step * size * inward[None])[0], size) for step in (0.0, -20.0))
    # The pair is as bright as the fold law says; beside the caustic there is none.
    strength = (seen.total - beside.total) / fold_profile(0.0)
    brighter = at(CAMERA, moved(point[None], 3 * size * inward[None])[0], size)
    assert seen.certified and beside.certified and brighter.certified
    assert abs(brighter.total - beside.total - strength * fold_profile(-3.0)) < 5e-3 * brighter.total
    assert {0, 1, 2} == set(seen.per_index) and seen.per_index[2] > 100 * beside.per_index[2]
    assert any(np.ptp(image.index) > 0 for image in seen.images)


@pytest.mark.slow
def test_point_lens_far_away():
    """Einstein's ring has the radius 2 / sqrt(r); at u of it a point is (u^2 + 2) / (u sqrt(u^2 + 4)) as bright."""
    radius = 1e8
    ring = 2 / math.sqrt(radius)
    camera = kc.Camera(0.0, radius, velocity="static")
    small, large = (
        kc.magnification(camera, (math.pi / 2, math.pi + 0.1 * ring), size * ring, max_index=1) for size in (1e-3, 0.01)
    )
    point = (0.01 + 2) / (0.1 * math.sqrt(0.01 + 4))
    assert abs(small.total - point) < 1e-3 and abs(large.total - 10.050) < 1e-3
    # Witt & Mao: the light is drawn away from the lens by u / (u^2 + 2) of its radius.
    shift = abs(math.atan2(large.centroid[1], -large.centroid[0])) / ring
    assert abs(shift - 0.1 - 0.0493) < 2e-3
    on_ring = kc.magnification(camera, (math.pi / 2, math.pi), 0.05 * ring, max_index=1)
    assert on_ring.certified and abs(on_ring.total - math.sqrt(1 + 4 / 0.05**2)) < 1e-4 * on_ring.total
    assert [image.round_hole for image in on_ring.images] == [True, True]


def test_small_disc_is_as_bright_as_a_point():
    star = (1.2, 0.7)
    images = kc.star_images(CAMERA, star)
    seen = kc.magnification(CAMERA, star, 1e-5)
    assert seen.certified
    for k, share in seen.per_index.items():
        assert abs(share - images.magnification[images.index == k].sum()) < 1e-6 * share + seen.per_index_error[k]


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.1, 0.3, 1.0])
def test_shares_add_up_and_a_disc_and_the_rest_fill_the_sky(size):
    centre = from_angles(1.5, 3.0)
    disc, rest = at(CAMERA, centre, size), at(CAMERA, -centre, math.pi - size)
    assert disc.certified and rest.certified
    assert abs(sum(disc.per_index.values()) - disc.total) < sum(disc.per_index_error.values()) + disc.error
    solid = [4 * math.pi * math.sin(part / 2) ** 2 for part in (size, math.pi - size)]
    whole = at(CAMERA, centre, 1.1), at(CAMERA, -centre, math.pi - 1.1)
    filled = [one.total * area for one, area in zip((disc, rest), solid, strict=True)]
    other = [4 * math.pi * math.sin(part / 2) ** 2 for part in (1.1, math.pi - 1.1)]
    expected = sum(one.total * area for one, area in zip(whole, other, strict=True))
    assert abs(sum(filled) - expected) < 1e-8


@pytest.mark.slow
def test_square_of_the_frequency_ratio_is_the_same_for_all_velocities():
    totals = [
        kc.magnification(kc.Camera(0.9, 10.0, 1.2, velocity), (1.9, 3.0), 0.3, power=2.0)
        for velocity in ((0.0, 0.0, 0.0), (0.0, 0.6, 0.0), (0.3, -0.2, 0.5))
    ]
    assert np.ptp([one.total for one in totals]) < 1e-8 * totals[0].total
    assert np.ptp([one.per_index[1] for one in totals]) < 1e-8 * totals[0].per_index[1]


@pytest.mark.slow
def test_limb_darkening_is_a_sum_over_rings():
    star, size = (1.77, -1.07), 0.02
    dark = kc.magnification(CAMERA, star, size, profile=("linear", 0.6))
    shape = kc.magnification(CAMERA, star, size, profile=lambda s: 1 - 0.6 * (1 - np.sqrt(np.maximum(1 - s * s, 0))))
    assert dark.certified and abs(dark.total - shape.total) < 1e-6
    edges = np.linspace(0, 1, 21)
    areas = np.array([0.0, *(kc.magnification(CAMERA, star, size * s).total * s * s for s in edges[1:])])
    middle = (edges[1:] + edges[:-1]) / 2
    bright = 1 - 0.6 * (1 - np.sqrt(1 - middle**2))
    rings = (bright * np.diff(areas)).sum() / (bright * np.diff(edges**2)).sum()
    assert abs(dark.total - rings) < 4e-3 * rings


@pytest.mark.slow
def test_profile_with_a_step_is_a_smaller_disc():
    star, size = (1.77, -1.07), 0.02
    half = kc.magnification(CAMERA, star, size / 2, max_index=1)
    stepped = kc.magnification(CAMERA, star, size, max_index=1, profile=lambda s: 1.0 * (s < 0.5))
    assert half.certified and stepped.certified
    assert abs(stepped.total - half.total) < stepped.error + half.error
    assert 0 < stepped.error < 2e-6 * half.total
    for k, share in half.per_index.items():
        assert abs(stepped.per_index[k] - share) < stepped.per_index_error[k] + half.per_index_error[k]


@pytest.mark.slow
def test_steep_and_narrow_profiles_on_a_cusp():
    camera, size = kc.Camera(0.9, 10.0, 1.2, "fiducial"), 0.04
    cusp = kc.caustics(camera, orders=2)[1].cusps[0].celestial
    star, half = (cusp[0], cusp[1] % (2 * math.pi)), kc.magnification(camera, cusp, size / 2)
    # A step at half the radius is the disc of half the size; the smooth step, the mean of discs about as large.
    for profile, margin in ((lambda s: 1.0 * (s < 0.5), 0.0), (lambda s: 1 / (1 + np.exp((s - 0.5) / 0.02)), 1e-3)):
        steep = kc.magnification(camera, star, size, profile=profile)
        assert steep.certified and 0 < steep.error < 1e-5
        assert abs(steep.total - half.total) < steep.error + half.error + margin
    narrow = kc.magnification(camera, star, size, profile=("gaussian", 0.2))
    assert narrow.certified and 0 < narrow.error < 1e-5
    # From 57 radii, another time.
    assert abs(narrow.total - 0.94260369) < 1e-8 + narrow.error


@pytest.mark.slow
@problems.each(problems.DISCS, lambda problem: problem.end == math.inf)
def test_discs_agree_with_sums_over_rays(problem):
    seen = problems.magnified(problem)
    assert seen.certified
    expected, error = TWIN.summed(problem.viewer, from_angles(*problem.place), problem.size, problem.max_index)
    assert abs(seen.total - expected) < 3 * error + 5e-4 * expected and error < 1e-2 * expected


def test_curves_are_drawn_saved_and_reported(tmp_path):
    seen = kc.magnification(CAMERA, (1.77, -1.07), 0.02)
    ax = seen.plot()
    assert ax.patches and ax.get_legend() is not None
    file = kc.save(tmp_path / "seen.npz", seen) or tmp_path / "seen.npz"
    assert kc.load(file) == seen
    record = kc.record(seen, points=True)
    assert record["size_deg"] == pytest.approx(math.degrees(0.02)) and len(record["images"]) == len(seen.images)
    assert "certified" not in repr(seen)


@pytest.mark.slow
def test_command_says_what_the_function_returns(capsys, tmp_path):
    line = "magnification --spin 0.9 --radius 10 --star 80 166 --size 1 --max-index 1 --profile linear:0.5"
    status, out, _ = run(capsys, *line.split(), "--json", "-", "--figure", str(tmp_path / "shapes.png"))
    printed = json.loads(out)
    camera = kc.Camera(0.9, 10.0)
    star = math.radians(80), math.radians(166)
    seen = kc.magnification(camera, star, math.radians(1), max_index=1, profile=("linear", 0.5))
    assert status == 0 and printed["total"] == pytest.approx(seen.total, rel=1e-12)
    assert (tmp_path / "shapes.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"size": -0.1}, "Argument `size` must be a radius from 1e-08 to 3.1 radians, but is -0.1."),
        ({"size": math.nan}, "Argument `size` must be a radius"),
        ({"size": 4.0}, "Argument `size` must be a radius"),
        ({"source": (4.0, 0.0)}, "Argument `source` must have theta' in [0, pi]"),
        ({"profile": "linea"}, "did you mean linear?"),
        ({"profile": ("linear",)}, "Argument `profile` must have 1 finite coefficients after"),
        ({"profile": lambda s: -s}, "Argument `profile` must give finite intensities"),
        ({"power": math.inf}, "Argument `power` must be a finite number"),
        ({"power": 2.0, "end": 20.0}, "Argument `power` must be 0 for a source at a finite radius"),
        ({"source": (6.0, 1.0), "end": kc.EquatorialPlane(1)}, "Argument `viewer` must not lie in the"),
        ({"max_index": 7}, "Argument `max_index` must be a whole number from 0 to 6"),
    ],
)
def test_bad_arguments_are_one_line(changes, words):
    arguments = {"source": (1.4, 2.9), "size": 0.01} | changes
    with pytest.raises(ValueError) as error:
        kc.magnification(CAMERA, **arguments)
    assert words in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("offset", [0.0, 0.4])
def test_images_of_infinite_size_on_a_screen_are_refused(offset):
    """A ray straight away from a hole without spin ends at the polar angle of the Observer."""
    viewer = kc.Observer(spin=0.0, inclination=0.67, radius=100.0)
    for size in (offset + 1e-6, offset + 0.5):
        with pytest.raises(ValueError, match=r"^Argument `source` must lie farther than `size` from") as raised:
            kc.magnification(viewer, (0.67 + offset, 0.0), size)
        assert "\n" not in str(raised.value) and "take a Camera" in str(raised.value)


@pytest.mark.slow
def test_cusps_are_as_bright_as_their_laws():
    """1 over the distance along the axis of a cusp, to the power of -2/3 across it."""
    camera = kc.Camera(0.95, 5.0, 1.3, "fiducial")
    away = np.array([1e-4, 10**-3.5, 1e-3])
    for cusp in kc.caustics(camera, 2)[1].cusps[1:]:
        beam = kc.trace_beams(camera, cusp.sky[None])
        at, south, east = from_angles(*cusp.celestial), *polar_basis(beam.direction)
        angle = beam.position_angle[0]
        axis = math.cos(angle) * south + math.sin(angle) * east
        for step, sizes, power in ((axis, away**1.5 / 100, 1.0), (np.cross(at, axis), away / 100, 2 / 3)):
            for side in (1, -1):
                light = [
                    kc.magnification(camera, angles(moved(at[None], side * d * step)[0]), max(size, 2e-8)).total
                    for d, size in zip(away, sizes, strict=True)
                ]
                # The other images are as bright everywhere.
                ratio = (light[0] - light[1]) / (light[1] - light[2])
                assert ratio == pytest.approx(10 ** (power / 2), rel=2e-3 if power == 1 else 2e-2)


@pytest.mark.slow
def test_limb_through_a_tiny_caustic_has_no_gaps():
    """Arcs that met at two places of the limb were wrong by a sixth of the light, and certified."""
    camera = kc.Camera(0.07589241932451746, 60.52340657968123, 2.5503503968995185, "fiducial")
    seen = kc.magnification(camera, (0.5912225475363114, 3.140301909832497), 3.1790081224364656e-05, max_index=0)
    assert seen.certified and seen.total == pytest.approx(4989.46, abs=0.05)


def light_about_axis(camera, centre, size, max_index):
    """The magnification of a disc where all caustics are points, by an integral for each index along one line of rays.

    centre: angle of its centre from the viewer's own direction.
    """
    depth = np.linspace(0, 25, 32001)
    line = -kc.shadow_edge(camera, 1)
    psi = math.acos(float(line_of_sight_from_sky(camera.frame(), -line)[0, 0]) * -1)
    psi = psi + (math.pi - psi) * np.exp(-depth)
    sight = np.stack([-np.cos(psi), 0.6 * np.sin(psi), 0.8 * np.sin(psi)], axis=-1)
    rays = kc.trace_beams(camera, sky_from_line_of_sight(camera.frame(), sight))
    angle = polar_angle(rays.direction @ np.stack([*polar_basis(axis_of(camera)), axis_of(camera)]).T)
    swept = math.pi * rays.index + np.where(rays.index % 2 == 0, angle, math.pi - angle)
    rate = CubicSpline(swept, -np.cos(psi)).derivative()

    def width(s):
        """Part of a turn that the disc fills at the angle s from the axis, by the haversine law."""
        across = (math.sin(size / 2) ** 2 - math.sin((s - centre) / 2) ** 2) / (math.sin(s) * math.sin(centre))
        return 4 * math.asin(math.sqrt(min(max(across, 0.0), 1.0)))

    total = 0.0
    for k in range(max_index + 1):
        low, high = max(centre - size, 0.0), min(centre + size, math.pi)
        beside = sorted({abs(centre - size), min(centre + size, 2 * math.pi - centre - size)})
        nodes = sorted({0.0, *(min(max(x, low), high) for x in beside), low, centre, high, math.pi})
        for a, b in itertools.pairwise(nodes):
            at_end = lambda s, k=k: k * math.pi + (s if k % 2 == 0 else math.pi - s)  # noqa: E731
            total += abs(
                quad(lambda s, at=at_end: width(s) * float(rate(at(s))), a, b, limit=400, epsabs=0, epsrel=1e-10)[0]
            )
    return total / (4 * math.pi * math.sin(size / 2) ** 2)


def axis_of(camera):
    return from_angles(camera.inclination, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("camera", "order", "eta", "size", "most"),
    [
        (kc.Camera(0.0, 10.0, 1.2, "fiducial"), 1, 0.3, 1e-3, 1e-7),
        (kc.Camera(0.0, 10.0, 1.2, "fiducial"), 1, 1.0, 1e-3, 2e-4),
        (kc.Camera(0.0, 10.0, 1.2, "fiducial"), 1, 1.0 + 1e-9, 1e-3, 2e-4),
        (kc.Camera(0.0, 5.0, 0.7, "fiducial"), 2, 0.999, 1e-5, 1e-5),
        (kc.Camera(0.9, 10.0, 0.0, "fiducial"), 1, 1.001, 0.05, 1e-6),
        (kc.Camera(0.9, 10.0, 0.0, "fiducial"), 2, 0.5, 0.2, 1e-6),
    ],
)
def test_disc_at_a_caustic_that_is_a_point(camera, order, eta, size, most):
    """Limbs about such a caustic, through it, and next to it: as an integral along one line of rays says."""
    away = eta * size if order % 2 == 0 else math.pi - eta * size
    axis = axis_of(camera)
    centre = moved(axis[None], away * polar_basis(axis)[0][None])[0]
    seen = kc.magnification(camera, angles(centre), size, max_index=2)
    expected = light_about_axis(camera, away, size, 2)
    assert seen.certified and seen.error < most * seen.total
    # The integral misses some 1e-6 of the light beside the ends of each index.
    assert abs(seen.total - expected) < seen.error + 2e-6 * expected


@pytest.mark.parametrize("size", [7.65e-7, 1e-4])
def test_small_disc_straight_behind_the_camera(size):
    """Its image lies round the direction opposite to the hole, where areas are measured the other way."""
    camera = kc.Camera(0.0, 21.8, 1.114, "fiducial")
    seen = kc.magnification(camera, (1.114, 0.0), size, max_index=0)
    (point,) = kc.star_images(camera, (1.114, 1e-3), 0).magnification
    assert seen.certified and abs(seen.total - point) < seen.error + 1e-6
    assert seen.images[0].area == pytest.approx(seen.total * 4 * math.pi * math.sin(size / 2) ** 2, rel=1e-9)


@pytest.mark.slow
def test_limb_on_a_sphere_next_to_the_photon_orbits_is_refused():
    """The retrograde photon orbit lies 0.0009 M below this sphere: its critical curves are not followed."""
    with pytest.raises(ValueError, match="Argument `end` must be a surface on which the critical curve of order 1 can"):
        kc.magnification(CAMERA, (1.4, 2.9), 0.05, end=4.0)
