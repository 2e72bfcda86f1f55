"""All images of a star: against another program, against themselves, and their number against areas."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from marks import few
from scipy.interpolate import CubicSpline

import kerrcaustics as kc
from kerrcaustics.beams.trace import trace_beams
from kerrcaustics.images.search import search
from kerrcaustics.images.sheets import sheets_of
from kerrcaustics.lens_map import sky_lines
from kerrcaustics.spacetime.frame import redshift
from kerrcaustics.spacetime.sphere import polar_angle

REFERENCE = json.loads((Path(__file__).parent / "data" / "images.json").read_text(encoding="utf-8"))
TRUTH = json.loads((Path(__file__).parents[1] / "studies" / "truth" / "truth.json").read_text(encoding="utf-8"))
NEAR, FAR = kc.Camera(0.999, 2.6), kc.Camera(0.999, 6.03)


def angles(direction: np.ndarray) -> np.ndarray:
    """(theta', phi') (n, 2) of directions (n, 3)."""
    return np.stack([polar_angle(direction), np.arctan2(direction[..., 1], direction[..., 0])], axis=-1)


def random_stars(count: int, seed: int) -> np.ndarray:
    star = np.random.default_rng(seed).normal(size=(count, 3))
    return star / np.linalg.norm(star, axis=1, keepdims=True)


@pytest.mark.parametrize("entry", REFERENCE, ids=[entry["tag"] for entry in REFERENCE])
def test_reference_stars(entry):
    camera = kc.Camera(entry["a"], entry["r_c"], math.radians(entry["theta_c_deg"]), (0.0, 0.0, entry["beta"]))
    found = kc.star_images(camera, tuple(angles(np.array(entry["star"]))), max_index=2)
    expected = entry["images"]
    assert found.certified and found.remarks == () and len(found) == len(expected)
    sky = np.array([image["N"] for image in expected])
    gaps = np.linalg.norm(found.sky - sky[:, None], axis=-1)
    match = gaps.argmin(axis=1)
    assert sorted(match) == list(range(len(found)))
    assert gaps.min(axis=1).max() < 1e-9
    # The reference's own residual is part of the difference.
    assert (gaps.min(axis=1) <= 10 * found.error[match] + 1e-15).all()
    for name, key in (("index", "index"), ("parity", "parity")):
        assert np.array_equal(getattr(found, name)[match], [image[key] for image in expected])
    # A star in the equatorial plane has rays whose last crossing round-off decides.
    crossings, certain = found.crossings[match], found.crossings_certain[match]
    assert certain.all() == (abs(entry["star"][2]) > 1e-12)
    assert np.array_equal(crossings[certain], np.array([image["equator_crossings"] for image in expected])[certain])
    for name, key in (("azimuth", "phi_unwrapped"), ("redshift", "redshift")):
        assert np.allclose(getattr(found, name)[match], [image[key] for image in expected], rtol=0, atol=1e-9)
    determinant = np.abs([image["det"] for image in expected])
    assert np.allclose(1 / found.magnification[match], determinant, rtol=1e-8, atol=1e-11)


def chosen_images(camera: kc.Camera, count: int, seed: int, closest: float) -> np.ndarray:
    """Directions (count, 3) on the sky at rest: anywhere on the sheets, every tenth close to a critical curve.

    The distance from a critical curve, `closest` at least, is in depth: a part of the distance from the shadow edge.
    """
    rng = np.random.default_rng(seed)
    sheets = sheets_of(camera, 2)
    edge_phase, index = rng.uniform(0, 2 * math.pi, count), rng.integers(0, 3, count)
    gap = 10 ** rng.uniform(math.log10(closest), -2, count)
    part = np.where(rng.uniform(size=count) < 0.9, rng.uniform(0.01, 0.99, count), 1 - gap)
    depth = np.choose(index, [sheet.depth(edge_phase, part) for sheet in sheets.sheets])
    near = part > 0.99
    for edge in sheets.curves:
        here = near & (index == edge.order - 1)
        exact = sheets.curves.search().polished(edge_phase[here], np.full(here.sum(), edge.order), depth[here]).depth
        depth[here] = exact - gap[here]
    return sheets.sky(sky_lines.line_of_sight(sheets.camera, edge_phase, depth))


def recovered(camera: kc.Camera, sky: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions (n, 3) that a search for their stars finds again; those that are flagged; magnification (n,)."""
    sheets = sheets_of(camera, 2)
    beams = trace_beams(sheets.camera, sky, tolerance=1e-12)
    found = search(sheets, beams.direction)
    # The star itself is known to the error of the chosen beam.
    size = np.maximum(1e-12, 10 * beams.error / np.abs(beams.delta_minus))
    gap = np.full(len(sky), np.inf)
    images = found.images
    distance = np.linalg.norm(images.sky - sky[images.star], axis=1)
    np.minimum.at(gap, images.star, distance - 10 * images.error)
    return gap <= size, ~found.certified, beams.magnification


@pytest.mark.slow
def test_chosen_images_are_found_again():
    again, flagged, _ = recovered(NEAR, chosen_images(NEAR, 200, 0, 1e-6))
    assert again.all()
    assert flagged.mean() < 0.05


@pytest.mark.slow
def test_ten_thousand_chosen_images_are_found_again():
    again, flagged, magnification = recovered(NEAR, chosen_images(NEAR, 10_000, 1, 5e-8))
    assert magnification.max() > 1e6
    assert again.all()
    # Those that cannot be distinguished from a caustic.
    assert flagged.mean() < 0.05


def fold_crossings(camera: kc.Camera, count: int, seed: int) -> None:
    """Counts on both sides of caustics differ by one on each of the two sheets that meet there, and nowhere else."""
    rng = np.random.default_rng(seed)
    sheets = sheets_of(camera, 2)
    points, order = [], []
    for course in list(sheets.curves)[:2]:
        chosen = rng.integers(0, len(course.points), count // 2)
        points.append(course.points[chosen])
        order += [course.order] * len(chosen)
    place, number = np.concatenate([p.direction for p in points]), np.arange(len(order))
    across = np.cross(place, np.concatenate([p.major for p in points]))
    expected = np.zeros((len(order), 3), int)
    expected[number, np.array(order) - 1] = expected[number, np.array(order)] = 1
    for distance, find in ((1e-8, False), (1e-4, True), (1e-10, True)):
        sides = np.concatenate([place + sign * distance * across for sign in (-1, 1)])
        sides /= np.linalg.norm(sides, axis=1, keepdims=True)
        counts, sure = sheets.expected_counts(sides).expected, np.ones(len(sides), bool)
        if find:
            found = search(sheets, sides)
            counts, sure = found.counts, found.certified
            assert (sure | found.on_caustic.any(axis=1)).all()
            assert sure.mean() > 0.8
        here = sure[: len(place)] & sure[len(place) :]
        change = counts[len(place) :] - counts[: len(place)]
        # At a cusp both sides lie outside, and close to one where they are far from the caustic.
        crossed = change.any(axis=1)
        assert crossed.mean() > (0.7 if distance > 1e-5 else 0.95)
        here &= crossed
        inside = np.sign(change.sum(axis=1))
        # Next to where a caustic meets itself a long step crosses both of its branches.
        branches = np.abs(change).max(axis=1)
        assert np.array_equal(change[here], ((inside * branches)[:, None] * expected)[here])
        assert (branches[here] > 1).mean() < (0.01 if distance > 1e-5 else 1e-9)
        assert {-1, 1} == set(inside[here])


@pytest.mark.slow
def test_a_fold_changes_two_counts_by_one():
    fold_crossings(FAR, 20, 0)


@pytest.mark.slow
def test_a_thousand_folds_change_two_counts_by_one():
    fold_crossings(NEAR, 1000, 1)


@pytest.mark.slow
def test_a_hundred_thousand_stars_are_certified_or_flagged():
    found = kc.image_counts(NEAR, angles(random_stars(100_000, 2)), max_index=2)
    assert (found.certified | found.on_caustic).all()
    assert found.certified.mean() > 0.9999


def area_under_winding(sheets, index: int) -> float:
    """Integral of the count over the celestial sphere: the north pole's, and lines along both caustics."""
    total = 4 * math.pi * sheets.pole_counts[index]
    for edge, sign in ((index - 1, -1), (index, 1)):
        if edge >= 0:
            points = sheets.curves.curves[edge].points
            azimuth = np.arctan2(points.direction[:, 1], points.direction[:, 0])
            azimuth = np.unwrap(np.append(azimuth, azimuth[0]))
            total += sign * (-1) ** index * _line_integral(points.direction[:, 2], azimuth, points.edge_phase)
    return total


def _line_integral(z: np.ndarray, azimuth: np.ndarray, edge_phase: np.ndarray) -> float:
    """Integral of (1 + cos theta') d phi' along a closed curve: a crossing counts for all that lies south of it."""
    parameter = np.append(edge_phase, edge_phase[0] + 2 * math.pi)
    height = CubicSpline(parameter, np.append(z, z[0]), bc_type="periodic")
    circuit = azimuth[-1] - azimuth[0]
    rest = azimuth - circuit * (parameter - parameter[0]) / (2 * math.pi)
    rest[-1] = rest[0]
    speed = CubicSpline(parameter, rest, bc_type="periodic").derivative()
    node, weight = np.polynomial.legendre.leggauss(6)
    half = np.diff(parameter)[:, None] / 2
    at = (parameter[1:] + parameter[:-1])[:, None] / 2 + half * node
    return float((half * weight * (1 + height(at)) * (speed(at) + circuit / (2 * math.pi))).sum())


def area_on_sky(sheets, index: int, lines: int, points: int) -> float:
    """Integral of |det J| over a sheet: trapezia in turn, Gauss-Legendre in part."""
    sheet = sheets.sheets[index]
    even = 2 * math.pi * np.arange(lines) / lines
    # More lines on the prograde side of a fast hole.
    crowd = 0.9 * sheets.camera.spin**4
    edge_phase, spread = even - crowd * np.sin(even), 1 - crowd * np.cos(even)
    node, weight = np.polynomial.legendre.leggauss(points)
    edge_phase, part = np.meshgrid(edge_phase, (node + 1) / 2, indexing="ij")

    def sky(t, p):
        return sheets.sky(sky_lines.line_of_sight(sheets.camera, t, sheet.depth(t, p)))

    step = 1e-5
    along = (sky(edge_phase + step, part) - sky(edge_phase - step, part)) / (2 * step)
    across = (sky(edge_phase, part + step) - sky(edge_phase, part - step)) / (2 * step)
    element = np.linalg.norm(np.cross(along, across), axis=-1)
    beams = trace_beams(sheets.camera, sky(edge_phase, part), tolerance=1e-12)
    per_line = (np.abs(beams.determinant) * element) @ (weight / 2)
    return float((per_line * spread).sum() * 2 * math.pi / lines)


@pytest.mark.slow
@pytest.mark.parametrize(
    "camera", [pytest.param(FAR, marks=pytest.mark.slow), kc.Camera(0.9, 8.0, math.radians(50))], ids=str
)
def test_counts_fill_the_area_that_the_sheets_cover(camera):
    sheets = sheets_of(camera, 2)
    for index in range(3):
        covered = area_on_sky(sheets, index, 240, 60)
        assert covered == pytest.approx(area_under_winding(sheets, index), rel=1e-4)


CAMERAS = [
    kc.Camera(0.0, 6.0),
    kc.Camera(0.7, 3.0, 0.0),
    kc.Camera(0.95, 4.0, math.radians(60)),
    kc.Camera(0.999, 1.3),
    kc.Camera(0.9, 1000.0, math.radians(75)),
]


@pytest.mark.parametrize("camera", few(CAMERAS, CAMERAS[::2][:2]), ids=str)
def test_cameras_anywhere(camera):
    found = kc.image_counts(camera, angles(random_stars(100, 3)), max_index=2)
    assert found.certified.all()
    assert (found.counts[:, 0] >= 1).all()


@pytest.mark.slow
@pytest.mark.parametrize(("spin", "radius"), [(0.003, 6.0), (0.01, 13.0), (0.03, 25.0)])
def test_images_of_high_index_next_to_small_caustics(spin, radius):
    camera = kc.Camera(spin, radius)
    rng = np.random.default_rng(5)
    for caustic in kc.caustics(camera, 6)[4:]:
        low, high = caustic.celestial.min(axis=0), caustic.celestial.max(axis=0)
        stars = rng.uniform(low - (high - low) / 2, high + (high - low) / 2, (12, 2))
        found = kc.image_counts(camera, stars, 5)
        assert (found.certified | found.on_caustic).all()
        assert found.certified.mean() > 0.8
        # Inside and outside.
        assert len(np.unique(found.total)) > 1


@pytest.mark.slow
def test_a_grid_keeps_to_its_most_nodes_and_says_so(monkeypatch):
    stars = angles(random_stars(100, 4))
    fine = kc.image_counts(kc.Camera(0.9, 5.0, 1.2), stars, 2)
    assert fine.certified.all()
    nodes = sheets_of(kc.Camera(0.9, 5.0, 1.2), 2).sheets[2].direction.size // 3
    monkeypatch.setattr("kerrcaustics.images.sheet_grids.MOST_NODES", nodes // 4)
    # The same in a mirror.
    camera, stars[:, 0] = kc.Camera(0.9, 5.0, math.pi - 1.2), math.pi - stars[:, 0]
    wide = kc.image_counts(camera, stars, 2)
    sheet = sheets_of(camera, 2).sheets[2]
    assert sheet.is_coarse and sheet.direction.size // 3 < nodes
    # The caustics say the same, and what is certified is right.
    assert np.array_equal(wide.expected, fine.expected)
    assert np.array_equal(wide.certified, (wide.counts == fine.counts).all(axis=1))
    monkeypatch.setattr("kerrcaustics.images.sheet_grids.MOST_NODES", 10)
    with pytest.raises(ValueError, match=r"max_index.*would take .* rays"):
        kc.star_images(camera, (1.0, 1.0), 3)


@pytest.mark.slow
def test_a_star_on_a_caustic_is_said_to_be():
    caustic = kc.caustics(FAR, 2)[1]
    theta, phi = caustic.celestial[len(caustic.celestial) // 7]
    found = kc.star_images(FAR, (theta, phi), 2)
    assert found.on_caustic == (2,) and not found.certified
    assert "caustic of order 2" in found.remarks[0]


def test_velocity_moves_images_by_aberration_alone():
    star = (1.2, 0.4)
    moving, static = (kc.star_images(kc.Camera(0.999, 6.03, velocity=v), star, 2) for v in ("circular", "static"))
    assert moving.per_index == static.per_index and np.array_equal(moving.index, static.index)
    assert np.allclose(moving.azimuth, static.azimuth, rtol=0, atol=1e-10)


BAD = [
    ({"star": (4.0, 0.0)}, "`star` must have theta'"),
    ({"star": (1.0, math.nan)}, "finite phi'"),
    ({"star": 3.0}, "`star` must be two numbers"),
    ({"max_index": -1}, "`max_index` must be a whole number from 0 to 6, but is -1"),
    ({"max_index": 2.5}, "`max_index` must be a whole number"),
]


@pytest.mark.parametrize(("change", "complaint"), BAD, ids=str)
def test_bad_input(change, complaint):
    with pytest.raises(ValueError, match=complaint):
        kc.star_images(**({"camera": FAR, "star": (1.0, 0.0), "max_index": 1} | change))


def light_off(rays):
    """True by reported errors of magnification and frequency ratio, of images that are rays of truth.json."""
    off = []
    for ray in rays:
        camera = kc.Camera(**TRUTH["cameras"][ray["camera"]])
        x, y, z = map(float, ray["direction"])
        images = kc.star_images(camera, (math.atan2(math.hypot(x, y), z), math.atan2(y, x)), ray["index"])
        sky = np.array(ray["sky"], float)
        k = int(np.argmin(np.linalg.norm(images.sky - sky, axis=1) + (images.index != ray["index"])))
        true = 1 / abs(float(ray["determinant"])), float(redshift(camera.frame(), sky))
        off.append(
            [
                abs(images.magnification[k] - true[0]) / images.magnification_error[k],
                abs(images.redshift[k] - true[1]) / images.redshift_error[k],
            ]
        )
        assert images.magnification_error[k] < 1e-10 * true[0] * math.exp(math.pi * ray["index"])
    return np.array(off)


@pytest.mark.slow
def test_errors_of_magnification_and_redshift_hold_to_25_digits():
    rays = [ray for ray in TRUTH["rays"] if ray["index"] <= 1 and ray["camera"] in (0, 2)]
    off = light_off(rays[::8])
    assert len(off) > 8 and off.max() < 1


@pytest.mark.slow
def test_errors_of_magnification_and_redshift_hold_for_high_indices():
    off = light_off([ray for ray in TRUTH["rays"] if 2 <= ray["index"] <= 6][::2])
    # The star is rounded to doubles, too.
    assert len(off) > 30 and off[:, 0].max() < 1 and off[:, 1].max() < 2


def test_errors_of_a_star_beside_a_caustic_grow():
    camera = kc.Camera(0.999, 6.03)
    (*_, curve) = kc.caustics(camera, 2)
    theta, phi = curve.place[len(curve.place) // 7]
    inside = [kc.star_images(camera, (theta, phi + step), 2) for step in (1e-2, 1e-4, 1e-6)]
    worst = [(images.magnification_error / images.magnification).max() for images in inside]
    assert worst[0] < worst[1] < worst[2] < 1
