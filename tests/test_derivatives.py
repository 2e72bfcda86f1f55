"""Rays as functions for JAX, and derivatives of images and caustics: against long arithmetic, and other cameras."""

import math
import warnings
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from mpmath import mp, mpf
from parity import SURFACES, VIEWERS, end_for, place_on, viewer_named

import kerrcaustics as kc
from kerrcaustics.spacetime.sphere import from_angles
from studies.truth.rays import Path, Place, follow, unit

ROUND = np.float32([0.9, 10.0, 1.0]), np.float32([-0.6, 0.5, 0.4])
RAYS = [
    (0.9, 10.0, 1.0, -0.6, 0.5, 0.4),
    (0.999, 6.03, 1.5, -0.3, 0.8, -0.4),
    (0.3, 40.0, 0.4, -0.99, 0.1, -0.12),
    (0.7, 3.0, 1.2, 0.9, 0.1, 0.2),
]
# Of the differences in long arithmetic: their own error is the square of it.
STEP = mpf("1e-12")


@pytest.fixture(autouse=True)
def long_arithmetic():
    with mp.workdps(60):
        yield


def long_end(given):
    """n' and the time, in mpmath."""
    path = Path(Place(*given[:3], "fiducial"), unit(list(given[3:])), 50, timed=True)
    follow([path], lambda *_: None)
    there = path.end()
    return [*there.direction, there.delay]


def long_slopes(given):
    """Central differences (4, 6)."""
    columns = []
    for k in range(6):
        shifted = [[mpf(x) + sign * STEP * (i == k) for i, x in enumerate(given)] for sign in (1, -1)]
        columns.append([float((p - m) / (2 * STEP)) for p, m in zip(*map(long_end, shifted), strict=True)])
    return np.array(columns).T


def everything(*given):
    """n' and the time."""
    return jnp.append(kc.functional.direction(*given), kc.functional.travel_time(*given))


@pytest.mark.slow
@pytest.mark.parametrize("velocity", ["fiducial", "static", (0.1, 0.2, -0.3)], ids=str)
def test_direction_and_time_are_those_of_rays(velocity):
    place, sky = (0.9, 10.0, 1.0), np.array([[-0.6, 0.5, 0.4], [0.1, -0.8, 0.3], [-1.0, 0.01, 0.0]])
    sky /= np.linalg.norm(sky, axis=1, keepdims=True)
    rays = kc.trace_rays(kc.Camera(*place, velocity), sky, time=True)
    found = np.asarray(kc.functional.direction(*place, 3 * sky, velocity))
    time = np.asarray(kc.functional.travel_time(*place, sky, velocity))
    seen = rays.escaped
    assert np.isnan(found[~seen]).all() and np.isnan(time[~seen]).all()
    assert np.abs(found - rays.direction)[seen].max() < 1e-13
    assert np.abs(time - rays.time)[seen].max() < 1e-12
    assert seen[:2].all() and (velocity != "fiducial" or not seen[2])


@pytest.mark.slow
def test_float64_under_any_settings():
    place, sky = ROUND
    true = np.asarray(kc.functional.direction(*map(float, place), sky.astype(float)))
    compiled = jax.jit(kc.functional.direction)(*place, sky)
    many = jax.vmap(partial(kc.functional.direction, *place))(np.stack([sky, sky]))
    assert compiled.dtype == many.dtype == np.float64
    assert np.abs(np.asarray(compiled) - true).max() < 1e-15
    assert np.abs(np.asarray(many) - true).max() < 1e-15
    with jax.debug_nans(True), jax.numpy_rank_promotion("raise"), jax.numpy_dtype_promotion("strict"):
        assert np.array_equal(kc.functional.direction(*map(float, place), sky.astype(float)), true)


@pytest.mark.parametrize("sky", [0.5, [1.0, 0.0]], ids=str)
def test_sky_without_three_components_is_refused(sky):
    with pytest.raises(ValueError, match="Argument `sky` must have the shape"):
        kc.functional.direction(0.9, 10.0, 1.0, sky)


@pytest.mark.parametrize(
    ("place", "name"),
    [
        ((1.2, 10.0, 1.0), "spin"),
        ((0.9, 1.4, 1.0), "radius"),
        ((0.9, math.nan, 1.0), "radius"),
        ((0, 9, 4), "inclination"),
    ],
)
def test_places_are_refused_as_those_of_cameras(place, name):
    with pytest.raises(ValueError, match=f"Argument `{name}` must"):
        kc.functional.direction(*place, [-0.6, 0.5, 0.4])


@pytest.mark.parametrize("velocity", ["fast", (1.0, 0.0, 0.1), (0.1, 0.2)], ids=str)
def test_velocities_are_refused_as_those_of_cameras(velocity):
    with pytest.raises(ValueError, match="Argument `velocity` must"):
        kc.functional.direction(0.9, 10.0, 1.0, [-0.6, 0.5, 0.4], velocity)


@pytest.mark.slow
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_derivatives_of_rays_against_long_arithmetic(mode):
    with jax.enable_x64(True):
        slopes = jax.jit(jax.vmap(mode(lambda x: everything(x[0], x[1], x[2], x[3:]))))(np.array(RAYS))
    for given, found in zip(RAYS, np.asarray(slopes), strict=True):
        true = long_slopes(given)
        assert np.abs(found - true).max() < 1e-12 * np.abs(true).max()


@pytest.mark.slow
def test_second_derivatives_and_their_order():
    def one(x):
        return kc.functional.direction(x[0], x[1], x[2], x[3:])[2]

    with jax.enable_x64(True):
        x, step = jnp.array(RAYS[0]), 1e-4
        slope, curved = jax.jit(jax.grad(one)), jax.jit(jax.hessian(one))(x)
        for direction in np.eye(6):
            change = (slope(x + step * direction) - slope(x - step * direction)) / (2 * step)
            assert np.abs(curved @ direction - change).max() < 1e-6 * np.abs(curved).max()


def unit_vector(theta, phi):
    return np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])


def long_image(given, images, slopes):
    """An image's place, ln magnification and time in long arithmetic, by Newton's method with a fixed slope.

    given: spin, radius, inclination, theta, phi as mpf; images: N; slopes, dn'/dN there.
    """
    theta, phi = given[3:]
    star = [mp.sin(theta) * mp.cos(phi), mp.sin(theta) * mp.sin(phi), mp.cos(theta)]
    inverse = mp.matrix(np.linalg.pinv(slopes, rcond=1e-8).tolist())
    sky = unit([mpf(x) for x in images])
    for _ in range(4):
        left = [s - n for s, n in zip(star, long_end([*given[:3], *sky])[:3], strict=True)]
        sky = unit([n + d for n, d in zip(sky, inverse * mp.matrix(left), strict=True)])
    step = mpf("1e-15")
    columns = []
    for k in range(3):
        ends = [long_end([*given[:3], *(x + s * step * (i == k) for i, x in enumerate(sky))]) for s in (1, -1)]
        columns.append([(p - m) / (2 * step) for p, m in zip(*(e[:3] for e in ends), strict=True)])
    x, y, z = columns
    n = long_end([*given[:3], *sky])

    def crossed(p, q):
        return [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]

    cofactors = zip(sky, (crossed(y, z), crossed(z, x), crossed(x, y)), strict=True)
    determinant = sum(s * sum(p * q for p, q in zip(n[:3], c, strict=True)) for s, c in cofactors)
    return [*sky, 1 / abs(determinant), n[3]]


@pytest.mark.slow
@pytest.mark.parametrize(("place", "star"), [((0.9, 10.0, 1.0), (1.4, 2.9)), ((0.6, 6.0, 1.3), (1.5, 0.4))], ids=str)
def test_derivatives_of_images_against_long_arithmetic(place, star):
    camera = kc.Camera(*place, "fiducial")
    images = kc.star_images(camera, star, 1)
    found = kc.image_derivatives(camera, images)
    beams = kc.trace_beams(camera, images.sky)
    step = mpf("1e-9")
    for i, sky in enumerate(images.sky):
        basis = np.stack(kc.tangent_basis(sky), axis=-1)
        n = beams.direction[i]
        sine = np.hypot(n[0], n[1])
        there = np.array([[n[2] * n[0] / sine, n[2] * n[1] / sine, -sine], [-n[1] / sine, n[0] / sine, 0]]).T
        slopes = there @ beams.jacobian[i] @ basis.T
        for k in range(5):
            ends = []
            for sign in (1, -1):
                given = [mpf(x) + sign * step * (j == k) for j, x in enumerate((*place, *star))]
                ends.append(long_image(given, sky, slopes))
            true = np.array([float((p - m) / (2 * step)) for p, m in zip(*ends, strict=True)])
            mine = np.array([*found.sky[i, :, k], found.magnification[i, k], found.time[i, k]])
            scale = np.array([*[np.abs(true[:3]).max()] * 3, abs(true[3]), abs(true[4])])
            assert (np.abs(mine - true) < 1e-9 * scale).all()
    assert found.error.max() < 1e-9


CELLS = [
    (viewer, surface)
    for viewer in VIEWERS
    for surface in SURFACES
    if (viewer, surface) not in (("near", "sky"), ("infinity", "beyond"))
]
# Of each number, relative to its size: parts of one step that changes all of them.
PARTS = np.array([0.7, 0.9, -0.8, 0.6, -1.0])
WIDE = 1e-3
# Of values over the wide step, relative to them.
NOISE = 1e-9


def numbers_of(viewer, star):
    """The numbers of a viewer's place and of a source's, without an infinite radius."""
    place = {name: getattr(viewer, name) for name in ("spin", "radius", "inclination")}
    return np.array([value for value in (*place.values(), *star) if math.isfinite(value)])


def displaced(viewer, numbers):
    """The viewer, and the source, whose numbers these are."""
    place = {"spin": numbers[0], "inclination": numbers[-3], "radius": numbers[1] if len(numbers) == 5 else math.inf}
    motion = {"velocity": viewer.velocity} if isinstance(viewer, kc.Camera) else {}
    return type(viewer)(**place, **motion), tuple(numbers[-2:].tolist())


def slope_along(function, numbers, change):
    """A directional derivative by differences at two steps, and an error of it."""
    wide, close = (
        (function(numbers + step * change) - function(numbers - step * change)) / (2 * step)
        for step in (WIDE, WIDE / 2)
    )
    return (4 * close - wide) / 3, np.abs(close - wide) * WIDE**2


@pytest.mark.slow
@pytest.mark.parametrize(("name", "surface"), CELLS, ids=lambda part: part)
def test_derivatives_of_images_against_other_viewers_and_sources(name, surface):
    """Along one direction in the space of all numbers, by differences; and the error that is reported."""
    viewer, end, star = viewer_named(name), end_for(surface, name), place_on(surface)

    def seen(numbers):
        other, place = displaced(viewer, numbers)
        images = kc.star_images(other, place, 1, end=end)
        return np.column_stack([images.sky, np.log(images.magnification), images.time])

    images = kc.star_images(viewer, star, 1, end=end)
    found = kc.image_derivatives(viewer, images)
    # A camera far away sees the hole so small that rounding of N is a part of it.
    assert len(images) and found.error.max() < (1e-7 if name == "far" else 1e-9)
    numbers = numbers_of(viewer, star)
    assert len(found.parameters) == len(numbers) == 5 - (name == "infinity")
    assert ("radius" in found.parameters) == (name != "infinity")
    assert found.parameters[-2] == ("source_radius" if surface == "plane" else "theta")
    change = numbers * PARTS[-len(numbers) :]
    true, doubt = slope_along(seen, numbers, change)
    logarithm = found.magnification / images.magnification[:, None]
    mine = np.concatenate([found.sky, logarithm[:, None], found.time[:, None]], axis=1)
    # What is lost in the differences, and what the result itself says of its error: of the largest part of each.
    largest = np.abs(mine * change).max(axis=2)
    axes = found.sky.shape[1]
    largest[:, :axes] = largest[:, :axes].max(axis=1, keepdims=True)
    error = largest * np.repeat(found.error, [axes, 1, 1], axis=1)
    scale = np.abs(seen(numbers))
    # A rounding of the magnification is as large in its logarithm, however small that is.
    scale[:, axes] = np.maximum(scale[:, axes], 1)
    noise = NOISE * (scale + largest)
    assert (np.abs(mine @ change - true) < 3 * error + doubt + noise).all()


@pytest.mark.slow
@pytest.mark.parametrize("end", [math.inf, 50.0, 7.0], ids=str)
def test_without_spin_a_source_that_turns_about_the_viewer_turns_its_images(end):
    """And a viewer who turns about an axis across sees what sources see that turn the other way."""
    viewer, star = kc.Observer(spin=0.0, inclination=1.2, radius=1e3), (1.9, 2.3)
    images = kc.star_images(viewer, star, 1, end=end)
    found = kc.image_derivatives(viewer, images)
    n = unit_vector(*star)
    e_theta, e_phi = unit_vector(star[0] + math.pi / 2, star[1]), unit_vector(math.pi / 2, star[1] + math.pi / 2)

    def turned_about(axis):
        """Changes of theta and phi."""
        change = np.cross(axis, n)
        return np.array([e_theta @ change, e_phi @ change / math.sin(star[0])])

    about = turned_about(unit_vector(1.2, 0.0))
    alpha, beta = images.sky.T
    # Seen from outside the axis, alpha runs along e_phi and beta against e_theta.
    assert np.abs(found.sky[:, :, 3:] @ about - np.stack([-beta, alpha], axis=-1)).max() < 1e-9 * np.abs(alpha).max()
    for values in (found.magnification / images.magnification[:, None], found.time):
        assert np.abs(values[:, 3:] @ about).max() < 1e-9 * np.abs(values).max()
    across = turned_about(np.array([0.0, 1.0, 0.0]))
    for values in (found.sky, found.time):
        size = np.abs(values).max()
        assert np.abs(values[..., 2] + values[..., 3:] @ across).max() < 1e-9 * size


@pytest.mark.slow
def test_from_the_axis_a_source_that_turns_in_azimuth_turns_its_images(tmp_path):
    for viewer, end, star in (
        (kc.Observer(spin=0.9, inclination=0.0), math.inf, (2.0, 1.0)),
        (kc.Observer(spin=0.9, inclination=0.0), 6.0, (2.0, 1.0)),
        (kc.Observer(spin=0.9, inclination=0.0), kc.EquatorialPlane(1), (9.0, 1.0)),
    ):
        images = kc.star_images(viewer, star, 1, end=end)
        found = kc.image_derivatives(viewer, images)
        assert len(images)
        kc.save(tmp_path / "change.npz", found)
        assert np.array_equal(kc.load(tmp_path / "change.npz").error, found.error)
        assert kc.to_xarray(found).coords["axis"].values.tolist() == ["alpha", "beta"]
        alpha, beta = images.sky.T
        size = np.abs(images.sky).max()
        assert np.abs(found.sky[..., -1] - np.stack([-beta, alpha], axis=-1)).max() < 1e-10 * size
        assert np.abs(found.time[:, -1]).max() < 1e-9 * np.abs(found.time).max()


@pytest.mark.slow
@pytest.mark.parametrize("surface", ["sky", "within", "plane"])
def test_far_viewers_come_to_the_limit_as_one_over_the_radius(surface):
    """Observers at two radii, and a camera, whose sky is radians: their derivatives by what they have in common."""
    end, star = end_for(surface, "near"), place_on(surface)

    def change(viewer):
        images = kc.star_images(viewer, star, 1, end=end)
        which = images.index == 1
        found = kc.image_derivatives(viewer, images)
        kept = [i for i, name in enumerate(found.parameters) if name != "radius"]
        return found.sky[which][..., kept], found.time[which][:, kept]

    limit, *others = (change(kc.Observer(spin=0.9, inclination=1.2, radius=r)) for r in (math.inf, 1e4, 1e5))
    for one, near, far in zip(limit, *others, strict=True):
        ratio = np.abs(near - one).max() / np.abs(far - one).max()
        assert 9 < ratio < 11
    # Both differ from it by some 40 M over the radius.
    camera = change(kc.Camera(0.9, 1e6, 1.2, "fiducial"))
    # N is (alpha, beta) over the radius, after its first component.
    for one, far in zip(limit, (1e6 * camera[0][:, 1:], camera[1]), strict=True):
        assert np.abs(far - one).max() < 1e-4 * np.abs(one).max()


def test_images_of_another_kind_of_viewer_are_refused():
    camera, observer = kc.Camera(0.9, 10.0), kc.Observer(spin=0.9, inclination=1.0)
    images = kc.star_images(camera, (1.4, 2.9), max_index=0)
    with pytest.raises(ValueError, match="Argument `images` must be those that `camera` sees, but holds direction N"):
        kc.image_derivatives(observer, images)


@pytest.mark.slow
def test_derivatives_of_caustics_against_other_cameras():
    place, step = np.array([0.9, 10.0, 1.0]), 1e-3

    def features(change):
        found = kc.caustics(kc.Camera(*(place + change)), 2)
        extents = [[c.theta_min, c.theta_max, c.phi_min, c.phi_max] for c in found]
        return [np.append(e, [cusp.celestial for cusp in c.cusps]) for e, c in zip(extents, found, strict=True)]

    def difference(change):
        pairs = zip(features(change), features(-change), strict=True)
        return [(p - m) / (2 * step) for p, m in pairs]

    slopes = kc.caustic_derivatives(kc.Camera(*place), 2)
    for k, axis in enumerate(np.eye(3)):
        wide, close = difference(step * axis), [2 * d for d in difference(step / 2 * axis)]
        for one, w, c in zip(slopes, wide, close, strict=True):
            extents = [one.theta_min, one.theta_max, one.phi_min, one.phi_max]
            mine = np.append([e[k] for e in extents], one.cusps[:, :, k])
            assert np.abs(mine - (4 * c - w) / 3).max() < 3e-9 * max(np.abs(mine).max(), 0.1)
            assert one.error < 1e-10
            assert math.isclose(one.phi_extent[k], one.phi_max[k] - one.phi_min[k])


CAUSTICS = [
    ("near", "beyond"),
    ("near", "within"),
    ("near", "plane"),
    ("far", "within"),
    ("finite", "sky"),
    ("finite", "beyond"),
    ("infinity", "sky"),
    ("infinity", "within"),
    ("infinity", "plane"),
]


def features_of(caustic):
    """Its extremes and cusps in a row."""
    if isinstance(caustic.surface, kc.EquatorialPlane):
        return np.array([caustic.r_min, caustic.r_max, caustic.phi_min, caustic.phi_max])
    extremes = [caustic.theta_min, caustic.theta_max, caustic.phi_min, caustic.phi_max]
    return np.append(extremes, [cusp.celestial for cusp in caustic.cusps])


def doubt_of(caustic):
    """Errors of the same: an end in the plane lies off its circle, and the azimuth there by the slope of the curve."""
    if not isinstance(caustic.surface, kc.EquatorialPlane):
        return np.full(4 + 2 * len(caustic.cusps), caustic.error)
    r, phi = caustic.place.T
    steep = np.abs(np.diff(phi) / np.diff(r))
    ends = [r[i] * steep[min(i, len(steep) - 1)] for i in (phi.argmin(), phi.argmax())]
    return caustic.error * np.array([r.min(), r.max(), *ends])


def slopes_of(one):
    """Their derivatives in that order, (features, numbers)."""
    plane = isinstance(one.surface, kc.EquatorialPlane)
    fixed, extremes = (one.theta_min, one.theta_max), (one.r_min, one.r_max)
    if not plane:
        fixed, extremes = extremes, fixed
    assert not np.any(fixed)
    return np.concatenate([[*extremes, one.phi_min, one.phi_max], one.cusps.reshape(-1, len(one.parameters))])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "surface"), CAUSTICS, ids=lambda part: part)
def test_derivatives_of_caustics_against_other_viewers(name, surface):
    """Along one direction in the space of the viewer's numbers: cusps and extremes, and the errors of both."""
    viewer, end = viewer_named(name), end_for(surface, name)
    slopes, known = kc.caustic_derivatives(viewer, 2, end=end), kc.caustics(viewer, 2, end=end)
    assert [one.order for one in slopes] == [caustic.order for caustic in known] and slopes
    numbers = numbers_of(viewer, (math.inf, math.inf))
    # Sections in the plane end on a circle of one height over the horizon, which is another one for another spin.
    change = numbers * PARTS[: len(numbers)] * (np.arange(len(numbers)) > (0 if surface == "plane" else -1))

    def features(numbers):
        other, _ = displaced(viewer, np.append(numbers, [0.0, 0.0]))
        return np.concatenate([features_of(caustic) for caustic in kc.caustics(other, 2, end=end)])

    true, doubt = slope_along(features, numbers, change)
    mine = np.concatenate([slopes_of(one) for one in slopes])
    errors = np.repeat([one.error for one in slopes], [len(slopes_of(one)) for one in slopes])
    noise = np.concatenate([doubt_of(caustic) for caustic in known]) / WIDE
    assert errors.max() < (1e-6 if surface == "plane" else 1e-9)
    lost = np.isnan(mine).any(axis=1)
    assert lost.sum() == sum("has no derivative" in remark for one in slopes for remark in one.remarks)
    largest = np.abs(mine).max(axis=1) * np.abs(change).max()
    missed = np.abs(mine @ change - true)
    assert (missed < errors * largest + doubt + 3 * noise + NOISE * (1 + np.abs(true)))[~lost].all()
    assert (~lost).sum() >= 2 * len(slopes)


@pytest.mark.slow
def test_largest_radius_of_a_section_changes_as_that_of_other_cameras():
    """The section winds out of the horizon, turns back at a largest radius, and winds in again."""
    end, place = kc.EquatorialPlane(2), np.array([0.998, 1000.0, math.radians(45)])
    (section,) = kc.caustic_derivatives(kc.Camera(*place), 2, end=end)
    (known,) = kc.caustics(kc.Camera(*place), 2, end=end)
    # The table of docs/disk_studies.md.
    assert known.r_max == pytest.approx(2.109071, abs=2e-6) and "r_max" not in " ".join(section.remarks)
    change = np.array([5e-4, 300.0, 0.5])

    def largest(place):
        (caustic,) = kc.caustics(kc.Camera(*place), 2, end=end)
        return np.array(caustic.r_max)

    true, doubt = slope_along(largest, place, change)
    assert abs(section.r_max @ change - true) < 10 * doubt + 1e-6 * abs(true)
    assert np.isnan(section.r_min).all() and "r_min is the end of the curve toward horizon" in " ".join(section.remarks)


@pytest.mark.slow
def test_caustics_of_far_cameras_change_as_those_of_the_observer():
    """The first three numbers are those of one place: the same to round-off."""
    camera, observer = kc.Camera(0.9, 1e6, 1.2), kc.Observer(spin=0.9, radius=1e6, inclination=1.2)
    for one, other in zip(kc.caustic_derivatives(camera, 2), kc.caustic_derivatives(observer, 2), strict=True):
        assert np.array_equal(one.cusps, other.cusps) and np.array_equal(one.phi_max, other.phi_max, equal_nan=True)


def test_derivatives_take_images_alone():
    with pytest.raises(ValueError, match="Argument `images` must be StarImages, but is tuple"):
        kc.image_derivatives(kc.Camera(0.9, 10.0), (1.4, 2.9))


@pytest.mark.slow
def test_images_are_those_of_the_star_next_to_them_with_their_derivatives():
    place, star, step = (0.9, 10.0, 1.0), np.array([1.41, 2.9]), 1e-5
    camera = kc.Camera(*place, "fiducial")
    near, true = (kc.star_images(camera, star=at, max_index=1) for at in ((1.4, 2.9), tuple(star)))
    images = kc.functional.images(*place, star, near.sky, near.index)
    assert np.abs(np.asarray(images.sky) - true.sky).max() < 1e-12
    assert np.asarray(images.magnification) == pytest.approx(true.magnification, rel=1e-11)
    with jax.enable_x64(True):

        def light(x, sky):
            return kc.functional.images(x[0], x[1], x[2], x[3:], sky, near.index).magnification

        x, derivatives = jnp.array([*place, *star]), jax.jit(jax.jacrev(light))
        slopes = np.asarray(derivatives(x, near.sky))
        for k, unit in enumerate(np.eye(5)):
            difference = np.asarray(light(x + step * unit, near.sky)) - np.asarray(light(x - step * unit, near.sky))
            assert slopes[:, k] == pytest.approx(difference / (2 * step), rel=1e-6, abs=1e-9)
        # From afar the direct image hardly changes: derivatives of 6e-10, with the errors that they have elsewhere.
        far = kc.Camera(0.9, 1e6, 1.0, "fiducial")
        images = kc.star_images(far, tuple(star), max_index=1)
        assert np.array_equal(images.index, near.index)
        away = np.asarray(derivatives(jnp.array([0.9, 1e6, 1.0, *star]), images.sky))[0]
        expected = kc.image_derivatives(far, images).magnification[0]
        assert np.abs(away - expected).max() < 1e-13 < 1e-3 * np.abs(expected).max()


@pytest.mark.slow
def test_images_beyond_a_caustic_are_lost():
    camera = kc.Camera(0.9, 10.0, 1.0, "fiducial")
    event = kc.pair_events(camera, 1.2, 2)[0]
    theta, phi = event.star
    sides = {late: kc.star_images(camera, (theta, phi + late), 2) for late in (0.01, -0.01)}
    inward = max(sides, key=lambda late: len(sides[late].index))
    inside = sides[inward]
    pair = np.argsort(np.linalg.norm(inside.sky - event.sky, axis=1))[:2]
    toward, beyond = (np.array([theta, phi + late * inward]) for late in (0.5, -0.5))
    here, gone = (
        kc.functional.images(0.9, 10.0, 1.0, star, inside.sky[pair], inside.index[pair]) for star in (toward, beyond)
    )
    assert np.isfinite(np.asarray(here.sky)).all() and np.isnan(np.asarray(gone.sky)).all()


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"near": [-0.6, 0.5, 0.4]}, "Argument `near` must have the shape"),
        ({"star": 1.0}, "Argument `star` must have the shape"),
        ({"index": [-1]}, "Argument `index` must hold whole numbers"),
        ({"spin": 1.5}, "Argument `spin` must lie in"),
    ],
)
def test_bad_arguments_of_images_get_one_line(changed, words):
    given = {
        "spin": 0.9,
        "radius": 10.0,
        "inclination": 1.0,
        "star": (1.4, 2.9),
        "near": [[-0.6, 0.5, 0.4]],
        "index": [0],
    }
    with pytest.raises(ValueError, match=words):
        kc.functional.images(**{**given, **changed})


# A place on the secondary caustic of this camera, far from its cusps.
BESIDE = kc.Camera(0.95, 5.0, 1.3, "fiducial")


def star_beside(depth, number=40):
    """A star so far, radians, from a point of the secondary caustic, on its bright side where positive."""
    caustic = kc.caustics(BESIDE, orders=2)[1]
    here, after = (from_angles(*caustic.celestial[i]) for i in (number, number + 1))
    along = (after - here) / np.linalg.norm(after - here)
    place = here + depth * np.cross(here, along)
    return float(np.arccos(place[2] / np.linalg.norm(place))), float(np.arctan2(place[1], place[0]))


@pytest.mark.slow
@pytest.mark.parametrize("size", [1e-3, 1e-2])
def test_the_light_of_a_disc_that_crosses_a_caustic(size):
    start = kc.functional.starting_points(BESIDE, star_beside(-3 * size), 6 * size)
    assert len(start.folds) == 1
    for depth in (-3.0, -1.001, -0.999, -0.65, 0.0, 0.5, 1.5):
        star = star_beside(depth * size)
        assert kc.functional.starting_points(BESIDE, star, 6 * size).indices.tolist() == start.indices.tolist()
        true = kc.magnification(BESIDE, star, size)
        found = float(kc.functional.magnification(0.95, 5.0, 1.3, star, size, *start))
        assert found == pytest.approx(true.total, rel=1e-8)


@pytest.mark.slow
def test_the_gradient_of_the_light_of_a_disc_that_crosses_a_caustic():
    size = 3e-3
    start = kc.functional.starting_points(BESIDE, star_beside(-3 * size), 6 * size)
    with jax.enable_x64(True):

        def light(x):
            return kc.functional.magnification(x[0], x[1], x[2], x[3:5], x[5], *start)

        slopes = jax.jit(jax.grad(light))
        for depth in (-0.5, 0.3, 1.5):
            x, step = jnp.array([0.95, 5.0, 1.3, *star_beside(depth * size), size]), 1e-4 * size
            moved = [(light(x + step * unit) - light(x - step * unit)) / (2 * step) for unit in np.eye(6)]
            assert np.asarray(slopes(x)) == pytest.approx(np.array(moved), rel=1e-5)


@pytest.mark.slow
def test_a_disc_at_a_cusp_has_no_number_as_a_function():
    cusp = kc.caustics(BESIDE, orders=2)[1].cusps[0]
    star = cusp.celestial
    start = kc.functional.starting_points(BESIDE, star, 1e-3)
    assert math.isnan(float(kc.functional.magnification(0.95, 5.0, 1.3, star, 1e-3, *start)))


@pytest.mark.slow
def test_the_time_of_an_event_and_its_gradient():
    event = kc.pair_events(kc.Camera(0.999, 6.03), 0.392 * math.pi)[0]
    with jax.enable_x64(True):

        def time(x):
            path = jnp.stack([x[3:5], x[5:]])
            return kc.functional.event_time(x[0], x[1], x[2], path, event.sky, "circular")

        x = jnp.array([0.999, 6.03, math.pi / 2, 0.392 * math.pi, event.longitude - 0.01, 0.0, 1.0])
        assert float(time(x)) == pytest.approx(0.01, abs=1e-11)
        slopes = np.asarray(jax.grad(time)(x))
        step = 1e-5
        moved = [float(time(x + step * unit) - time(x - step * unit)) / (2 * step) for unit in np.eye(7)]
        assert slopes == pytest.approx(np.array(moved), rel=1e-5, abs=1e-8)
        # A caustic that moves by so much in azimuth is met so much later.
        other = kc.pair_events(kc.Camera(0.999, 6.03 + 1e-3), 0.392 * math.pi)[0]
        later = (other.longitude - event.longitude) / 1e-3
        assert slopes[1] == pytest.approx(later, rel=1e-2)


@pytest.mark.parametrize(
    ("function", "arguments", "words"),
    [
        ("event_time", (0.9, 10.0, 1.0, [1.0, 2.0], [-0.6, 0.5, 0.4]), "Argument `path` must have the shape"),
        ("event_time", (0.9, 10.0, 1.0, [[1.0, 2.0]], [-0.6, 0.5]), "Argument `near` must have the shape"),
        ("magnification", (0.9, 10.0, 1.0, [1.0, 2.0], 0.1, [[0.6, 0.5]], [0], []), "Argument `near` must have"),
        (
            "magnification",
            (0.9, 10.0, 1.0, [1.0, 2.0], 0.1, [[0.6, 0.5, 0.1]], [0], [0.1, 0.2, 0.3]),
            "Argument `folds` must have the shape",
        ),
        ("magnification", (0.9, 10.0, 1.0, [1.0, 2.0], -0.1, [[0.6, 0.5, 0.1]], [0], [[1, 0, 0]]), "Argument `size`"),
        ("starting_points", (kc.Camera(0.9, 10.0), (1.4, 2.9), -1.0), "Argument `reach` must be an angle"),
        ("starting_points", (1.0, (1.4, 2.9), 0.1), "Argument `camera` must be"),
    ],
)
def test_bad_arguments_of_events_and_discs_get_one_line(function, arguments, words):
    with pytest.raises(ValueError, match=words):
        getattr(kc.functional, function)(*arguments)


@pytest.mark.slow
def test_the_function_of_a_result_has_its_values_and_slopes():
    """By spin, radius, inclination and star, of a camera in motion: values of the search, and finite differences."""
    images = kc.star_images(kc.Camera(0.9, 10.0), star=(1.4, 2.9), max_index=1)
    function = images.function()
    with jax.enable_x64(True):
        assert np.abs(np.asarray(function().sky) - images.sky).max() < 1e-12
        assert np.asarray(function().magnification) == pytest.approx(images.magnification, rel=1e-11)
        assert np.asarray(function().time) == pytest.approx(images.time, abs=1e-9)

        def light(x):
            return function(x[0], x[1], star=x[2:]).magnification

        x, step = np.array([0.9, 10.0, 1.4, 2.9]), 1e-5
        slopes = np.asarray(jax.jit(jax.jacrev(light))(x))
        for k, unit in enumerate(np.eye(4)):
            ends = [
                kc.star_images(kc.Camera(*at[:2]), star=tuple(at[2:]), max_index=1).magnification
                for at in (x + step * unit, x - step * unit)
            ]
            assert slopes[:, k] == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-5, abs=1e-8)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        slope = jax.grad(lambda spin: function(spin=spin).magnification.sum())(0.9)
    assert slope == pytest.approx(slopes[:, 0].sum(), rel=1e-5)


@pytest.mark.parametrize(
    ("viewer", "star", "end"),
    [(kc.Observer(spin=0.9, inclination=1.0), (1.4, 2.9), math.inf), (kc.Camera(0.9, 10.0), (1.4, 2.9), 50.0)],
)
def test_other_images_are_no_function(viewer, star, end):
    with pytest.raises(ValueError, match="on the celestial sphere, as a Camera sees it"):
        kc.star_images(viewer, star, max_index=1, end=end).function()
