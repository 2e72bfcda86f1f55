"""Photon rings: exact areas without spin, those of other programs, limits in the plane, masks, shapes, bad input."""

import math
from itertools import pairwise

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.rings.band_edge import edge_nodes, places_at
from kerrcaustics.rings.shape import circlipse
from kerrcaustics.spacetime import kerr

# Spin 0, face on, from infinity: impact parameters of both edges, and areas, n = 0 to 3; by quadrature in 30 digits.
FACE_ON = [
    (2.8476963313950621, None, None),
    (5.0151354941983346, 6.1675667647680063, 40.4866337241623),
    (5.1878081748760748, 5.2279386085338372, 1.31314939758528),
    (5.1957902930053547, 5.1975054870627264, 0.0560036616273547),
]
# Areas of n = 1, 2, 3 from the horizon to infinity, M^2, which 64 to 256 nodes of a prototype agreed on.
AREAS = {
    (0.94, 17.0): (52.237880442191, 2.879908030365, 0.219392541540),
    (0.5, 50.0): (71.560151081354, 1.818309478815, 0.083854004101),
    (0.99, 60.0): (111.3105212966, 3.991627993573, 0.370802905557),
    (0.9, 0.0): (48.670142777574, 2.564051726313, 0.179694930147),
}
# Solid angles of n = 0 and 1, sr, of the same prototype.
CAMERAS = [
    (kc.Camera(0.9, 6.0, 1.0, "fiducial"), (7.702200670888, 0.540378599624)),
    (kc.Camera(0.9, 2.0, 0.6, "fiducial"), (6.27380414684, 0.619744340149)),
    (kc.Camera(0.94, 10.0, 1.2, "static"), (7.258057765672, 0.381392095544)),
]


def observer(spin, degrees, radius=math.inf):
    return kc.Observer(spin=spin, inclination=math.radians(degrees), radius=radius)


def areas(rings):
    return np.array([band.solid_angle for band in rings])


def test_edges_and_areas_without_spin_and_face_on_are_exact():
    rings = kc.photon_rings(observer(0.0, 0.0))
    for band, (inner, outer, area) in zip(rings, FACE_ON, strict=True):
        np.testing.assert_allclose(np.hypot(*band.inner.sky.T), inner, rtol=1e-13)
        if outer is None:
            assert band.outer is None and band.solid_angle == math.inf
            continue
        np.testing.assert_allclose(np.hypot(*band.outer.sky.T), outer, rtol=1e-13)
        # In M^2: the areas within both edges are 80 M^2.
        assert band.solid_angle == pytest.approx(area, rel=1e-13, abs=3e-14)
    assert rings.certified and rings.remarks == ()


def test_areas_do_not_change_as_the_spin_vanishes():
    for spin in (0.0, 1e-12, 1e-8):
        found = areas(kc.photon_rings(kc.Observer(spin=spin, inclination=0.6), max_order=2))
        np.testing.assert_allclose(found[1:], [50.756777931734, 1.4471855373536], rtol=1e-12 if spin == 0 else 1e-11)


@pytest.mark.parametrize("case", AREAS)
def test_areas_are_those_of_the_prototype(case):
    rings = kc.photon_rings(observer(*case))
    np.testing.assert_allclose(areas(rings)[1:], AREAS[case], rtol=2e-11)
    assert all(band.solid_angle_error < 1e-10 * max(1, band.solid_angle) for band in rings[1:]) and rings.certified


def test_areas_are_those_of_other_programs():
    """Spin 0.5, 50 degrees, R = 1000, from the horizon to r = 50: areas of AART's hulls (their own table, 0.4 %)."""
    rings = kc.photon_rings(observer(0.5, 50.0, 1000.0), max_order=2, outer=50.0)
    np.testing.assert_allclose(areas(rings), [5452.714, 54.9492, 1.66673], rtol=1e-6)
    assert rings[1].solid_angle == pytest.approx(54.845, rel=4e-3)
    assert rings[2].solid_angle == pytest.approx(1.66720, rel=3e-3)
    # Their number for n = 0 is a box of 50 M, less the image of the horizon.
    bound = edge_nodes(rings[0].inner, 256)
    hole = abs(np.sum(bound.place[:, 0] * bound.step[:, 1] - bound.place[:, 1] * bound.step[:, 0])) / 2
    assert 2500 - hole == pytest.approx(2475.3, rel=1e-4) == pytest.approx(2465.40, rel=1e-2)
    assert rings.certified


@pytest.mark.parametrize(("camera", "known"), CAMERAS)
def test_solid_angles_of_cameras_are_those_of_the_prototype(camera, known):
    rings = kc.photon_rings(camera, max_order=1)
    np.testing.assert_allclose(areas(rings), known, rtol=1e-10)


@pytest.mark.parametrize(
    "camera", [camera for camera, _ in CAMERAS] + [kc.Camera(0.9, 6.0), kc.Camera(0.7, 3.0, 2.0, (0.5, -0.3, 0.2))]
)
def test_solid_angles_of_cameras_are_those_of_directions_that_are_counted(camera):
    random = np.random.default_rng(3)
    sky = random.normal(size=(40_000, 3))
    for inner, outer in ((None, math.inf), ("isco", 12.0)):
        rings = kc.photon_rings(camera, max_order=1, inner=inner, outer=outer)
        seen = rings.mask(sky).mean(axis=1)
        expected = areas(rings) / (4 * math.pi)
        assert (np.abs(seen - expected) < 4 * np.sqrt(expected / len(sky))).all()


@pytest.mark.parametrize(
    "viewer", [observer(0.94, 60.0, 100.0), kc.Camera(0.9, 6.0, 1.0), kc.Camera(0.99, 1.7, 1.2, "fiducial")]
)
def test_masks_are_what_rays_say(viewer):
    random = np.random.default_rng(4)
    sky = random.uniform(-9, 9, (3000, 2)) if isinstance(viewer, kc.Observer) else random.normal(size=(3000, 3))
    rings = kc.photon_rings(viewer, max_order=2, inner=2.5, outer=20.0)
    for band, mask in zip(rings, rings.mask(sky), strict=True):
        rays = kc.trace_rays(viewer, sky, end=kc.EquatorialPlane(band.order + 1))
        np.testing.assert_array_equal(mask, (rays.radius > 2.5) & (rays.radius < 20.0))


def test_masks_of_pictures_have_their_shape():
    screen, view = kc.Screen(12, 8, size=16.0), kc.pictures.View(12, 8, 1.2)
    rings = kc.photon_rings(observer(0.9, 40.0), outer=30.0)
    mask = rings.mask(screen)
    assert mask.shape == (4, 8, 12) and mask[0].any()
    np.testing.assert_array_equal(mask[:, 2, 5], rings.mask(screen.places(5, 2)))
    assert kc.photon_rings(kc.Camera(0.9, 8.0), max_order=1).mask(view).shape == (2, 8, 12)


def test_bands_are_nested_and_edges_shrink_to_the_shadow_edge():
    rings = kc.photon_rings(observer(0.94, 17.0), max_order=5)
    shrink = []
    for first, second in pairwise(rings[1:]):
        assert (np.abs(first.inner.distance) > np.abs(second.inner.distance)).all()
        shrink.append(np.log(first.outer.distance / second.outer.distance) - rings.edge.lyapunov)
    for before, after in pairwise(shrink):
        # The deviation from the exponent itself falls by about e^gamma.
        np.testing.assert_allclose(np.log(before / after), rings.edge.lyapunov, rtol=0.3)


@pytest.mark.parametrize("spin", [0.0, 0.5, 0.94])
def test_exponents_along_the_edge_are_finite_on_the_axis(spin):
    edge = kc.photon_rings(observer(spin, 0.0), max_order=1).edge
    assert np.isfinite([edge.lyapunov, edge.rotation, edge.delay]).all()
    assert np.ptp(edge.lyapunov) < 1e-13 and np.ptp(edge.delay) < 1e-12
    if spin == 0.94:
        np.testing.assert_allclose(edge.lyapunov, 2.56687303029405, rtol=1e-12)
        np.testing.assert_allclose(edge.delay, 15.1994951514700, rtol=1e-12)


def test_exponents_along_an_edge_have_their_known_range():
    edge = kc.photon_rings(observer(0.94, 17.0), max_order=1).edge
    low, high = edge.lyapunov.min(), edge.lyapunov.max()
    assert (low, high) == (pytest.approx(2.36376, abs=1e-3), pytest.approx(2.76486, abs=1e-3))
    assert edge.delay.min() > 15.1995 - 1e-3 and edge.delay.max() < 15.6466 + 1e-3


def test_the_plane_is_the_limit_from_the_north():
    flat = areas(kc.photon_rings(observer(0.9, 90.0), max_order=2, outer=20.0))
    near = kc.photon_rings(observer(0.9, 89.99), max_order=2, outer=20.0)
    np.testing.assert_allclose(areas(near), flat, rtol=5e-3)
    assert "within 1.7e-04 rad of the plane" in near.remarks[0]
    # Steps to the limit grow no more than they should.
    far = areas(kc.photon_rings(observer(0.9, 89.9), max_order=2, outer=20.0))
    assert (np.abs(areas(near) - flat) < 0.3 * np.abs(far - flat)).all()


@pytest.mark.slow
def test_the_plane_of_a_camera_is_the_limit_too():
    for outer in (4.0, 20.0, math.inf):
        flat = areas(kc.photon_rings(kc.Camera(0.9, 6.0, math.pi / 2, "fiducial"), max_order=2, outer=outer))
        near = areas(kc.photon_rings(kc.Camera(0.9, 6.0, math.radians(89.99), "fiducial"), max_order=2, outer=outer))
        np.testing.assert_allclose(near, flat, rtol=5e-3)


def test_beside_the_plane_1024_lines_give_seven_digits():
    rings = kc.photon_rings(observer(0.9, 89.9), max_order=2, outer=20.0)
    assert len(rings.edge.sky) <= 1024
    np.testing.assert_allclose(areas(rings), [151.4137547, 149.5296561, 3.9530978], rtol=1e-7)
    for band in rings:
        assert band.solid_angle_error < 1e-6 * 150


@pytest.mark.parametrize(
    "viewer", [observer(0.94, 17.0), observer(0.9, 90.0), kc.Camera(0.9, 6.0, 1.0, "static"), kc.Camera(0.9, 6.0)]
)
def test_points_between_nodes_cross_the_plane_at_the_circle(viewer):
    phase = np.array([[0.01, 0.7, 2.0], [3.5, 5.0, 6.2]])
    rings = kc.photon_rings(viewer, max_order=2, inner=3.0, outer=12.0)
    for band in rings:
        for edge in (band.inner, band.outer):
            places = edge.at(phase)
            assert places.shape == (2, 3, edge.sky.shape[1])
            for place, below in zip(places, (False, True), strict=True):
                crossing = band.order + 1 - (below and viewer.on_equator)
                if crossing:
                    rays = kc.trace_rays(viewer, place, end=kc.EquatorialPlane(crossing))
                    np.testing.assert_allclose(rays.radius, edge.radius, rtol=1e-6)


@pytest.mark.parametrize("degrees", [17.0, 60.0, 90.0])
def test_diameters_are_those_of_dense_points(degrees):
    rings, angle = kc.photon_rings(observer(0.94, degrees), max_order=2, outer=20.0), np.linspace(0, math.pi, 7)
    found = rings.diameter(angle)
    assert found.edge.shape == (7,) and found.inner.shape == found.outer.shape == (3, 7)
    onto = np.stack([np.cos(angle), np.sin(angle)])
    for band, widths in zip(rings, found.outer, strict=True):
        chi = np.concatenate([np.linspace(0, math.pi, 4000), np.linspace(math.pi + 1e-9, 2 * math.pi, 4000)])
        dense = np.ptp(places_at(band.outer, chi) @ onto, axis=0)
        np.testing.assert_allclose(widths, dense, rtol=1e-6)
        assert (widths >= dense - 1e-9).all()
        np.testing.assert_allclose(
            band.width(angle) + band.width(angle + math.pi), widths - found.inner[band.order], atol=1e-9
        )


# Residuals of the circlipse over the diameter, and diameters perpendicular and parallel to the spin.
CIRCLIPSES = [
    (0.94, 17.0, 3.6e-7, 9.833778, 9.732093),
    (0.5, 50.0, 2.4e-7, 10.331546, 10.235526),
    (0.9, 30.0, 4.6e-6, 9.994481, 9.763265),
]


@pytest.mark.parametrize("row", CIRCLIPSES)
def test_shadow_edges_are_circlipses(row):
    spin, degrees, residual, parallel, across = row
    rings, angle = kc.photon_rings(observer(spin, degrees), max_order=1), np.linspace(0, math.pi, 90, endpoint=False)
    np.testing.assert_allclose(rings.diameter([math.pi / 2, 0.0]).edge, [parallel, across], atol=2e-6)
    fit = circlipse(rings.diameter(angle).edge, angle)
    assert fit.residual == pytest.approx(residual, rel=0.5)


def test_a_circlipse_that_is_one_is_found():
    angle = np.linspace(0, math.pi, 40)
    half = 3.0 + np.hypot(1.2 * np.sin(angle - 0.4), 2.0 * np.cos(angle - 0.4))
    fit = circlipse(2 * half, angle)
    assert fit.residual < 1e-12
    np.testing.assert_allclose(
        3.0
        + np.hypot(fit.ellipse_1 * np.sin(angle - fit.angle), fit.ellipse_2 * np.cos(angle - fit.angle))
        - 3.0
        + fit.circle,
        half,
        atol=1e-10,
    )


def test_centroids_are_those_of_directions_that_are_counted():
    random = np.random.default_rng(6)
    rings = kc.photon_rings(observer(0.9, 60.0), max_order=1, outer=10.0)
    places = random.uniform(-13, 13, (200_000, 2))
    for band, mask in zip(rings, rings.mask(places), strict=True):
        spread = places[mask].std(axis=0) / math.sqrt(mask.sum())
        assert (np.abs(places[mask].mean(axis=0) - band.centroid) < 4 * spread).all()
    camera = kc.photon_rings(kc.Camera(0.9, 6.0, 1.0), max_order=1)
    sky = random.normal(size=(100_000, 3))
    sky /= np.linalg.norm(sky, axis=1, keepdims=True)
    for band, mask in zip(camera, camera.mask(sky), strict=True):
        mean = sky[mask].mean(axis=0)
        assert np.arccos(mean @ band.centroid / np.linalg.norm(mean)) < 0.05


def test_an_ergosphere_is_remarked_upon():
    rings = kc.photon_rings(kc.Camera(0.99, 1.7, 1.2, "fiducial"), max_order=1)
    assert "ergosphere" in rings.remarks[0]
    assert not kc.photon_rings(kc.Camera(0.99, 3.0, 1.2), max_order=1).remarks


@pytest.mark.parametrize("viewer", [observer(0.9, 40.0), kc.Camera(0.9, 6.0)])
def test_rings_are_saved_and_shown(viewer, tmp_path):
    rings = kc.photon_rings(viewer, max_order=1, outer=20.0)
    kc.save(tmp_path / "rings.npz", rings)
    loaded = kc.load(tmp_path / "rings.npz")
    assert loaded == rings and loaded.bands[1] == rings[1]
    np.testing.assert_array_equal(loaded[1].outer.at([0.3, 4.0]), rings[1].outer.at([0.3, 4.0]))
    entry = kc.record(rings, points=True)
    assert entry["schema"] == "kerrcaustics/photon-rings/1" and entry["bands"][1]["solid_angle"] == rings[1].solid_angle
    assert len(entry["bands"][0]["rims"][0]["sky"]) == len(rings[0].inner.sky)
    assert "certified" in repr(rings[0]) and kc.to_xarray(rings).band_solid_angle.shape == (2,)


def test_spins_close_to_one_keep_their_digits():
    for spin, error in ((0.999, 1e-10), (0.999999, 1e-3)):
        rings = kc.photon_rings(observer(spin, 60.0), max_order=2)
        assert rings.certified
        assert all(band.solid_angle_error < error * band.solid_angle for band in rings[1:])


@pytest.mark.slow
def test_orders_up_to_nine_have_edges():
    rings = kc.photon_rings(observer(0.0, 30.0), max_order=9)
    size = np.array([np.abs(band.inner.distance).min() for band in rings])
    np.testing.assert_allclose(np.log(size[3:-1] / size[4:]), math.pi, rtol=1e-3)
    # The last ones have few digits, and say so.
    relative = np.array([band.solid_angle_error / band.solid_angle for band in rings[1:]])
    assert (np.diff(relative) > 0).all() and relative[-1] < 0.1


def test_far_cameras_see_what_observers_see():
    far, near = (
        kc.photon_rings(kc.Camera(0.9, 1e6, 1.0, "fiducial")),
        kc.photon_rings(observer(0.9, 57.29577951308232, 1e6)),
    )
    np.testing.assert_allclose(areas(far)[1:] * 1e12, areas(near)[1:], rtol=1e-6)
    assert far[0].outer is None and math.isnan(far[0].solid_angle)


BAD = [
    (lambda: kc.photon_rings(None), "`viewer` must be a Camera or an Observer"),
    (lambda: kc.photon_rings(observer(0.9, 40), max_order=10), "`max_order` must be a whole number from 0 to 9"),
    (lambda: kc.photon_rings(observer(0.9, 40), inner="rim"), '`inner` must be a radius, "isco" or None'),
    (
        lambda: kc.photon_rings(observer(0.9, 40), inner=1.0),
        "`inner` must be finite and larger than the horizon radius",
    ),
    (lambda: kc.photon_rings(observer(0.9, 40), inner=math.nan), "`inner` must be finite and larger"),
    (
        lambda: kc.photon_rings(observer(0.9, 40), inner=6.0, outer=6.0),
        "`outer` must be larger than the inner radius 6",
    ),
    (lambda: kc.photon_rings(observer(0.9, 40), outer=math.nan), "`outer` must be larger than the inner radius"),
    (lambda: kc.photon_rings(kc.Camera(0.9, 6.0), max_order=0).diameter(0.0), "must be an Observer for a diameter"),
    (lambda: kc.photon_rings(kc.Camera(0.9, 6.0), max_order=1)[1].width(0.0), "must be an Observer for a width"),
    (lambda: kc.photon_rings(observer(0.9, 40), max_order=0)[0].width(0.0), "take photon_rings with a finite `outer`"),
    (lambda: kc.photon_rings(observer(0.9, 40), max_order=0).mask([1.0, 2.0, 3.0]), "in an array of shape (..., 2)"),
    (
        lambda: kc.photon_rings(kc.Camera(0.9, 6.0), max_order=0).mask(kc.Screen(4, 4, size=9.0)),
        "must be a raster for Camera",
    ),
    (lambda: circlipse([1.0, 2.0], [0.0, 1.0]), "`diameter` must hold at least 4 numbers"),
]


@pytest.mark.parametrize(("call", "line"), BAD)
def test_bad_input_is_one_line(call, line):
    with pytest.raises(ValueError) as raised:
        call()
    assert line in str(raised.value) and "\n" not in str(raised.value)


def test_a_direction_beside_the_shadow_edge_of_the_horizon_has_its_image_there():
    """The inner edge of order 0 is the image of the horizon: rays beside it fall in, or cross the plane first."""
    viewer = observer(0.9, 40.0)
    edge = kc.photon_rings(viewer, max_order=0)[0].inner
    for scale, crosses in ((0.999, False), (1.001, True)):
        rays = kc.trace_rays(viewer, edge.sky * scale, end=kc.EquatorialPlane(1))
        assert (np.isfinite(rays.radius) == crosses).all()
    assert edge.radius == kerr.horizon(0.9)


def test_diameters_and_widths_without_spin_are_known_within_their_errors():
    # Impact parameters of the edges seen face on, from 30-digit quadrature.
    inner = {1: 5.0151354941983346, 2: 5.1878081748760748, 3: 5.1957902930053547}
    outer = {1: 6.1675667647680063, 2: 5.2279386085338372, 3: 5.1975054870627264}
    rings = kc.photon_rings(kc.Observer(spin=0.0, inclination=0.0))
    found = rings.diameter([0.3, 2.0])
    assert np.abs(found.edge - 2 * math.sqrt(27)).max() < 1e-13
    for n in inner:
        band = rings[n]
        assert np.abs(found.inner[n] - 2 * inner[n]).max() <= 2 * band.inner.error.max()
        assert np.abs(found.outer[n] - 2 * outer[n]).max() <= 2 * band.outer.error.max()
        error = band.inner.error.max() + band.outer.error.max()
        assert np.abs(band.width([0.3, 2.0]) - (outer[n] - inner[n])).max() <= error
