"""Numbers of a place on the camera sky belongs to that place, and its error to the sky that it is given on.

Every analysis is traced anew at the places that it returns. Aberration stretches the sky of the camera at rest, and
with it the errors: here by differences of directions that are displaced there.
"""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.lens_map.search_sky import as_seen, search_sky
from kerrcaustics.spacetime.sphere import angle_between, from_angles, moved, tangent_basis

PLACE = (0.9, 10.0, 1.2)
REST = kc.Camera(*PLACE, "fiducial")
STAR, PLANE = (1.4, 1.6), kc.EquatorialPlane(2)
# Of a direction that is moved from sky to sky.
ROUNDING = 1e-15


def displaced(camera: kc.Camera, sky: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """By how much a displacement on the sky at rest is longer on that of the camera."""
    rest, frame = camera.at_rest().frame(), camera.frame()
    here = as_seen(sky, rest, frame)
    there = (as_seen(moved(sky, step * e), rest, frame) for e in tangent_basis(sky))
    return np.max([angle_between(here, one) / step for one in there], axis=0)


def velocities(count: int) -> list[tuple[float, ...]]:
    rng = np.random.default_rng(3)
    ways = rng.normal(size=(count, 3))
    speeds = np.where(rng.uniform(size=count) < 0.3, 0.99, rng.uniform(0, 0.99, count))
    return [tuple(v) for v in (ways / np.linalg.norm(ways, axis=1, keepdims=True) * speeds[:, None]).tolist()]


def test_errors_are_displacements_on_the_moving_sky():
    rng = np.random.default_rng(5)
    for velocity in velocities(20):
        camera = kc.Camera(*PLACE, velocity)
        sky = rng.normal(size=(50, 3))
        sky /= np.linalg.norm(sky, axis=1, keepdims=True)
        for size in (1e-6, 1e-15):
            found = search_sky(camera).errors(sky, np.full(50, size))
            true = displaced(camera, sky) * size
            assert (found >= 0.999 * true).all() and (found <= 1.001 * true + ROUNDING * (1 + true / size)).all()


def test_star_images_of_moving_cameras_report_errors_on_their_own_sky():
    still = kc.star_images(REST, STAR, 1)
    for velocity in ((0.0, 0.0, -0.95), *velocities(4)):
        camera = kc.Camera(*PLACE, velocity)
        found = kc.star_images(camera, STAR, 1)
        true = displaced(camera, still.sky) * still.error
        assert (found.error >= 0.999 * true).all() and (found.error <= 1.001 * true + 14 * ROUNDING).all()


@pytest.mark.slow
def test_values_of_refined_images_belong_to_their_final_place():
    """Next to the axis an image may move far while it is refined."""
    camera = kc.Camera(0.5, 10.0, 1e-4, (0.1, 0.2, 0.3))
    images = kc.star_images(camera, (math.pi - 1e-5, 2.9))
    beams = kc.trace_beams(camera, images.sky)
    for name in ("magnification", "redshift"):
        np.testing.assert_allclose(getattr(images, name), getattr(beams, name), rtol=1e-13)
    np.testing.assert_array_equal(images.crossings, beams.crossings)


def at_the_camera():
    orbit = kc.Camera(*PLACE, (0.0, 0.0, 0.3))
    there, end = (PLACE[2], 2 * math.pi), PLACE[1]
    yield "star", lambda: kc.star_images(orbit, there, end=end)
    yield "star", lambda: kc.star_images(orbit, (there[0] * (1 + 2e-16), 1e-15), end=end * (1 + 4e-16))
    yield "stars", lambda: kc.image_counts(orbit, [(1.0, 1.0), there], end=end)
    yield "stars", lambda: kc.image_counts(orbit, [there], end=end, find=False)
    yield "level", lambda: kc.star_tracks(orbit, there[0], end=end)
    far = kc.Camera(0.9, 1e6, 1.2, "fiducial")
    yield "star", lambda: kc.star_images(far, there, end=1e6)


@pytest.mark.parametrize(("name", "call"), list(at_the_camera()))
def test_a_star_at_the_camera_itself_is_refused(name, call):
    with pytest.raises(ValueError, match=rf"^Argument `{name}` must keep the star away from the camera, .*\.$"):
        call()


def on_skies(camera: kc.Camera):
    """Places of every analysis that reports errors of them on the camera sky: name, sky, errors."""
    for name, images in (
        ("star", kc.star_images(camera, STAR, 1)),
        ("far star", kc.star_images(camera, STAR, 1, end=30.0)),
        ("near star", kc.star_images(camera, STAR, 1, end=6.0)),
        ("star in the plane", kc.star_images(camera, (6.0, 1.6), 1, end=PLANE)),
        ("followed star", kc.follow_star([camera], STAR, 1).images[0]),
        ("track at a moment", kc.star_tracks(camera, STAR[0], 1).images_at(azimuth=STAR[1])),
    ):
        yield name, images.sky, images.error
    for name, tracks in (
        ("tracks", kc.star_tracks(camera, STAR[0], 1)),
        ("near tracks", kc.star_tracks(camera, STAR[0], 1, end=6.0)),
        ("tracks in the plane", kc.star_tracks(camera, 6.0, 1, end=PLANE)),
    ):
        yield name, *(np.concatenate([getattr(t, field) for t in tracks.tracks]) for field in ("sky", "error"))
    crossings = kc.crossings_of_line(kc.circle_images(camera, (0.8, 0.3), 1), 1.0)
    yield "line", crossings.sky, crossings.error
    curves = kc.isoradials(camera, [8.0], 2, points=64)
    yield "isoradials", *(np.concatenate([getattr(c, field) for c in curves]) for field in ("sky", "error"))


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.95, -0.99])
def test_errors_of_every_analysis_are_those_of_the_moving_sky(speed):
    camera = kc.Camera(*PLACE, (0.0, 0.0, speed))
    for (name, still, error), (_, sky, found) in zip(on_skies(REST), on_skies(camera), strict=True):
        there = as_seen(still, REST.frame(), camera.frame())
        # Tracks have other points where the sky is stretched; isoradials have all points elsewhere, as they are even on
        # the viewer's own sky: neighbours are compared.
        away = np.linalg.norm(sky[:, None] - there, axis=-1)
        same = away.min(axis=1) < (0.02 if name == "isoradials" else 1e-8)
        assert same.mean() > 0.2, name
        nearest = away.argmin(axis=1)[same]
        true = (displaced(camera, still) * error)[nearest]
        # Points that are sought on either sky do not miss their goal by the same.
        least = 0.5 if "track" in name or name == "isoradials" else 0.99
        assert (found[same] >= least * true).all(), name
        # At events beams on the moving sky are less certain where that is shrunk.
        assert (found[same] <= 20 * true + 14 * ROUNDING).all(), name


def spots(camera: kc.Camera):
    """Places of every analysis: its name, sky, error, end, the source's n' or (r, phi), values that it claims there."""
    values = ("magnification", "redshift")
    for end in (math.inf, 30.0):
        for images in (
            kc.star_images(camera, STAR, 2, end=end),
            *kc.star_tracks(camera, 1.4, 2, end=end).images_at(azimuth=[1.6, 3]),
        ):
            claims = {name: getattr(images, name) for name in (*values, "index", "crossings")}
            claims |= {} if images.time is None else {"time": images.time}
            yield "images", images.sky, images.error, end, from_angles(*images.star), claims
        for track in kc.star_tracks(camera, 1.4, 1, end=end).tracks:
            plain = track.parity != 0
            claims = {name: getattr(track, name)[plain] for name in (*values, "index")}
            star = from_angles(np.full(plain.sum(), 1.4), track.azimuth[plain])
            yield "track", track.sky[plain], track.error[plain], end, star, claims
    for images in kc.follow_star([camera, camera], STAR, 1).images:
        claims = {name: getattr(images, name) for name in values}
        yield "followed", images.sky, images.error, math.inf, from_angles(*images.star), claims
    images = kc.star_images(camera, (6.0, 1.6), 1, end=PLANE)
    claims = {name: getattr(images, name) for name in (*values, "index", "time")}
    yield "plane", images.sky, images.error, PLANE, (6.0, 1.6), claims
    for track in kc.star_tracks(camera, 6.0, 1, end=PLANE).tracks:
        plain = track.parity != 0
        claims = {name: getattr(track, name)[plain] for name in (*values, "index", "time")}
        yield "plane track", track.sky[plain], track.error[plain], PLANE, (6.0, track.azimuth[plain]), claims
    for curve in kc.isoradials(camera, [8.0], 2, points=64):
        end = kc.EquatorialPlane(curve.crossing)
        claims = {"redshift": curve.redshift, "time": curve.time}
        yield "isoradial", curve.sky, curve.error, end, (8.0, curve.azimuth), claims
    circle = kc.circle_images(camera, (0.8, 0.3), 1)
    crossed = kc.crossings_of_line(circle, 1.0)
    yield "line", crossed.sky, crossed.error, math.inf, None, {"index": crossed.index}


@pytest.mark.slow
def test_values_of_every_analysis_belong_to_its_places():
    camera = kc.Camera(*PLACE, (0.0, 0.0, -0.8))
    for name, sky, error, end, source, claims in spots(camera):
        beams = kc.trace_beams(camera, sky, "auto", 1e-12, end=end, time=True)
        allowed = 3 * (error * beams.delta_plus + beams.error) + 1e-14
        if isinstance(end, kc.EquatorialPlane):
            radius, phi = source
            assert (np.abs(beams.radius - radius) <= radius * allowed).all(), name
            assert (np.abs(np.sin((beams.azimuth - phi) / 2)) <= allowed).all(), name
        elif source is not None:
            assert (np.linalg.norm(beams.direction - source, axis=1) <= allowed).all(), name
        for what, claimed in claims.items():
            traced = getattr(beams, what)
            # A hair's breadth for values that are traced in another batch.
            relative = 1e-11 + (10 * beams.time_error / np.abs(traced) if what == "time" else 0)
            assert (np.abs(claimed - traced) <= relative * np.abs(traced)).all(), (name, what)


@pytest.mark.slow
def test_curves_and_events_lie_where_their_places_lead():
    """Critical curves, cusps, pair events on the sky of a moving camera, and events of light curves."""
    camera = kc.Camera(*PLACE, (0.0, 0.0, -0.8))
    curves = kc.caustics(camera, 2)
    for curve in curves:
        for sky, place, error in [(curve.sky, curve.celestial, curve.error)] + [
            (cusp.sky[None], cusp.celestial[None], cusp.error) for cusp in curve.cusps
        ]:
            beams = kc.trace_beams(camera, sky, "auto", 1e-12)
            away = np.linalg.norm(beams.direction - from_angles(*place.T), axis=1)
            assert (away <= 3 * (error + beams.error)).all()
            assert (np.abs(beams.delta_minus) <= 1e-6 * beams.delta_plus).all()
    for event in kc.pair_events(camera, curves[1].celestial[:, 0].mean(), 2):
        beams = kc.trace_beams(camera, event.sky[None], "auto", 1e-12)
        away = np.linalg.norm(beams.direction[0] - from_angles(*event.star))
        assert away <= 3 * (event.error + beams.error[0])
    still = kc.Camera(*PLACE[:2], PLACE[2], (0.0, 0.0, 0.9))
    for event in kc.light_curve(still, 6.0, 8, crossings=2).events:
        beams = kc.trace_beams(still, event.sky[None], end=kc.EquatorialPlane(event.crossing))
        allowed = 10 * (event.sky_error * beams.delta_plus + beams.error)
        assert abs(beams.radius[0] - 6.0) <= allowed[0]
