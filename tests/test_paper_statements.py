"""Statements of JTFT about its figures, checked; docs/figures_of_the_paper.md has where the other tests of it are."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.draw.projection import azimuthal_equidistant, unrolled_places, view_axes
from kerrcaustics.draw.tracks import stretches
from kerrcaustics.scripts import FIGURES, HOME
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.shadow import edge_photons
from kerrcaustics.spacetime.sphere import polar_basis

NEAR, FAR = kc.Camera(0.999, 2.6), kc.Camera(0.999, 6.03)
# The star of figures 5 and 6, 18 degrees above the plane (following JTFT, whose polar angle of 0.608 pi grows upward),
# and that of the counts at the flat edge.
STAR = 0.392 * math.pi
COUNTED = math.pi / 2, math.radians(141)


def winding(picture):
    """Turns of a closed curve (n, 2) about the origin, counter-clockwise."""
    angle = np.unwrap(np.arctan2(picture[:, 1], picture[:, 0]))
    return round((angle[-1] - angle[0]) / (2 * math.pi))


@pytest.mark.slow
def test_without_spin_a_star_has_one_image_on_each_side_of_the_ring():
    """An image of index 0 outside the Einstein ring, one of index 1 inside, on opposite sides of the shadow."""
    camera = kc.Camera(0.0, 6.03, velocity="fiducial")
    # The ring is the circle of rays that turn through 180 degrees: its impact parameter is 6.4936.
    ring = math.asin(6.493_636 * math.sqrt(1 - 2 / camera.radius) / camera.radius)
    for star in ((0.3, 1.0), (1.2, 3.0), (2.0, 4.5), (1.6, 0.2)):
        images = kc.star_images(camera, star, max_index=1)
        away = np.arccos(-images.sky[:, 0])
        assert images.index.tolist() == [0, 1] and away[0] > ring > away[1]
        first, second = (image[1:] / np.linalg.norm(image[1:]) for image in images.sky)
        np.testing.assert_allclose(first, -second, atol=1e-7)


def test_counts_of_one_star_at_the_flat_edge_are_those_of_the_paper():
    """2, 3 and 8 images between the critical curves; two pairs are not in the equatorial plane, one is on the right."""
    images = kc.star_images(NEAR, COUNTED, max_index=2)
    assert images.certified and images.per_index == {0: 2, 1: 3, 2: 8}
    in_plane = np.abs(images.sky[:, 2]) < 1e-9
    assert [int(in_plane[images.index == k].sum()) for k in range(3)] == [2, 1, 6]
    np.testing.assert_allclose(images.sky[~in_plane, 2].sum(), 0, atol=1e-9)
    right = azimuthal_equidistant(images.sky, view_axes(NEAR, kc.shadow_edge(NEAR, 2000)))[:, 0] > 0
    assert images.index[right].tolist() == [0]


@pytest.mark.slow
def test_those_counts_are_one_and_the_windings_of_two_caustics():
    """1 + w_k + w_(k+1), with the windings 1, 1 and 6 of the first three caustics about the star."""
    theta, phi = COUNTED
    windings = [0]
    for caustic in kc.caustics(NEAR, orders=3):
        line = np.concatenate([caustic.celestial, caustic.celestial[:1]])[:, ::-1]
        # It spreads over several turns of the azimuth: the star is met in each.
        first, last = np.floor(np.array([line[:, 0].min(), line[:, 0].max()]) / (2 * math.pi))
        stars = phi + 2 * math.pi * np.arange(first, last + 1)
        windings.append(sum(winding(line - [place, theta]) for place in stars))
    assert np.abs(windings).tolist() == [0, 1, 1, 6]
    counts = kc.star_images(NEAR, COUNTED, max_index=2).per_index
    assert counts == {k: 1 + abs(windings[k]) + abs(windings[k + 1]) for k in range(3)}


@pytest.mark.slow
def test_without_spin_the_primary_caustic_is_a_line_behind_the_hole():
    """On spheres from close to the horizon to infinity it is a point, opposite to the camera."""
    camera = kc.Camera(0.0, 6.03, velocity="fiducial")
    for end in (2.2, 6.0, 12.0, math.inf):
        caustic = kc.caustics(camera, orders=1, end=end)[0]
        assert max(caustic.theta_extent, caustic.phi_extent) < 1e-12
        np.testing.assert_allclose(caustic.celestial, [[math.pi / 2, math.pi]] * len(caustic.celestial), atol=1e-12)
        # A ring about the direction to the hole.
        assert np.ptp(caustic.sky[:, 0]) < 1e-12


# Spin, radius and velocity of the cameras, following JTFT; of the disks the camera is ours to choose a motion for.
SET_UPS = {
    "schwarzschild_tracks": (0.0, 30, "circular"),
    "kerr_tracks_with_poles": (0.999, 6.03, "circular"),
    "star_through_caustic": (0.999, 6.03, "circular"),
    "pair_creation": (0.999, 6.03, "circular"),
    "all_tracks": (0.999, 6.03, "circular"),
    "star_field": (0.999, 2.6, "circular"),
    "galactic_plane": (0.999, 2.6, "circular"),
    "checkerboard": (0.999, 2.6, "circular"),
    "trapped_orbit": (0.999, 2.6, "circular"),
    "images_sink": (0.999, 2.6, "circular"),
    "disk_swatches": (0.999, 74.1, "static"),
    "disk_images": (0.999, 74.1, "static"),
    "disk_shifts": (0.6, 74.1, "static"),
    "disk_flare": (0.6, 74.1, "static"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SET_UPS)
def test_figures_have_the_set_ups_of_the_paper(name):
    """The cameras; stars 18 and 1.8 degrees above the plane; rims, and the temperature of the gas."""
    script = FIGURES.load(name)
    spin, radius, velocity = SET_UPS[name]
    inclination = math.radians(86.56) if velocity == "static" else math.pi / 2
    camera = script.CAMERA
    assert (camera.spin, camera.radius, camera.velocity) == (spin, radius, velocity)
    assert camera.inclination == pytest.approx(inclination, rel=1e-12)
    stars = {"star_through_caustic": [0.392], "pair_creation": [0.392], "all_tracks": [0.4, 0.49]}.get(name, [])
    found = list(script.STARS.values()) if name == "all_tracks" else [script.STAR] if stars else []
    assert found == pytest.approx([math.pi * star for star in stars], rel=1e-12)
    disks = {"disk_swatches": "DISK", "disk_images": "GAS", "disk_flare": "GAS"}
    if name in disks:
        disk = getattr(script, disks[name])
        assert (disk.inner, disk.outer) == (9.26, 18.70) and getattr(disk, "peak", 4500) == 4500


def test_an_imax_frame_has_23_million_pixels():
    view = kc.pictures.View(5616, 4096, math.radians(90), "pinhole")
    assert view.width * view.height == pytest.approx(23e6, rel=2e-3)
    # Each is seen where it lies: from corner to corner, and back.
    corners = np.array([[0, 0], [5615, 0], [0, 4095], [5615, 4095]], float)
    sky, _ = view.directions(*corners.T)
    np.testing.assert_allclose(view.pixels(sky), corners, rtol=0, atol=1e-8)


@pytest.mark.slow
def test_motion_blur_of_a_camera_that_circles_needs_no_more_beams():
    """JTFT say twice the time. Beams of the map: as many as without blur; in figure A1, with a fall, 27 times."""
    sky, figure = kc.skies.Checkerboard(), FIGURES.load("motion_blur")
    camera, view = figure.seen(0.0)
    still = kc.render(camera, view, sky).beams
    circling = kc.pictures.ShutterMotion((camera, camera), (view, view), (-0.04, 0.04))
    assert kc.render(camera, view, sky, motion=circling).beams == still
    falling = kc.pictures.ShutterMotion(*zip(figure.seen(-0.5), figure.seen(0.5), strict=True))
    assert kc.render(camera, view, sky, motion=falling).beams / still == pytest.approx(27.1, abs=1.0)


def test_dot_of_figure_12_is_the_motion_of_the_other_cameras():
    """Backward as the circular camera sees it, away from the shadow's right part; the page says so."""
    dot = FIGURES.load("aberration").MOTION
    orbit = NEAR.fido_velocity()[2]
    for velocity, speed in (("fiducial", 0.546), ("static", 0.813)):
        own = kc.Camera(NEAR.spin, NEAR.radius, velocity=velocity).fido_velocity()[2]
        # A camera's sky has its second axis along the orbital motion.
        past = np.array([0.0, (own - orbit) / (1 - own * orbit), 0.0])
        np.testing.assert_allclose(past, speed * dot, atol=5e-4)
    # All of that camera's shadow lies ahead of it.
    assert (kc.shadow_edge(NEAR, 360) @ dot).max() < 0


def test_second_disk_of_figure_15_is_on_the_page_of_disks():
    _, (inner, outer, _) = FIGURES.load("disk_shifts").DISKS.values()
    text = (HOME / "docs" / "disks.md").read_text(encoding="utf-8")
    assert "figures/disk_shifts" in text and f"rims at $r = {inner}$ and ${outer}$" in text


@pytest.mark.parametrize(("velocity", "part"), [("static", 1.24), ("fiducial", 0.87), ("circular", 0.45)])
def test_solid_angles_of_the_shadow(velocity, part):
    """In units of half the sky, by the fan of triangles from a direction within the shadow."""
    edge = kc.shadow_edge(kc.Camera(0.999, 2.6, velocity=velocity), 4000)
    middle, after = np.array([-1.0, 0.0, 0.0]), np.roll(edge, -1, axis=0)
    volume = np.cross(middle, edge)
    tangent = (volume * after).sum(axis=1), 1 + edge @ middle + after @ middle + (edge * after).sum(axis=1)
    assert abs(2 * np.arctan2(*tangent).sum()) / (2 * math.pi) == pytest.approx(part, abs=0.005)


def test_velocities_of_the_cameras_of_figure_12():
    """As the circular camera measures them, the fiducial one moves at -0.546 c, the static one at -0.813 c."""
    circular, static = (kc.Camera(0.999, 2.6, velocity=name).fido_velocity()[2] for name in ("circular", "static"))
    assert -circular == pytest.approx(-0.546, abs=5e-4)
    assert (static - circular) / (1 - static * circular) == pytest.approx(-0.813, abs=5e-4)


def test_speed_of_the_gas_for_which_the_factors_of_figure_15_are():
    """About 0.55 c: at r = 4.2, and nowhere between the rims of figure 13."""
    inner, ours = (kc.Camera(0.6, radius).fido_velocity()[2] for radius in (4.2, 9.26))
    assert inner == pytest.approx(0.545, abs=5e-4) and ours < 0.36


@pytest.mark.parametrize(
    ("velocity", "latitude", "depth"), [("fiducial", 27.0, 2.8), ("static", 22.0, 4.7), ("circular", None, None)]
)
def test_notch_in_the_flat_edge(velocity, latitude, depth):
    """Up to this latitude (degrees) the edge bends toward the shadow; for the circular camera nowhere on the left."""
    edge = kc.shadow_edge(kc.Camera(0.999, 2.6, velocity=velocity), 20_000)
    ahead, behind = np.roll(edge, -1, axis=0), np.roll(edge, 1, axis=0)
    # Positive where three points in a row turn the way in which the curve runs round the shadow.
    bend = (np.cross(behind, edge) * ahead).sum(axis=1)[: len(edge) // 8]
    if latitude is None:
        assert (bend > 0).all()
        return
    last = int(np.argmax(bend > 0))
    assert (bend[:last] < 0).all() and (bend[last : 2 * last] > 0).all()
    assert math.degrees(math.asin(edge[last, 2])) == pytest.approx(latitude, abs=0.1)
    # Of the great circle through both ends, a meridian: from it to the prograde end in the plane.
    meridian = [math.degrees(math.atan2(x, y)) for x, y in edge[[0, last], :2]]
    assert meridian[0] - meridian[1] == pytest.approx(depth, abs=0.1)


@pytest.mark.slow
def test_a_ray_outside_the_flat_edge_winds_and_leaves():
    """Figure 11: 23 turns, 18 of them close to the orbit of constant r; on these the ray turns back in latitude."""
    # On the flat side, by the edge phase.
    before, there, after = sky_from_fido(NEAR.frame(), edge_photons(NEAR, math.pi / 1000 * np.array([19, 20, 21])))
    outward = np.cross(after - before, there)
    ray = kc.ray_paths(NEAR, there + 1e-4 * outward / np.linalg.norm(outward), n=4000)
    # Against the light, which goes forward.
    assert (np.diff(ray.azimuth) < 0).all() and ray.status == kc.Status.ESCAPED
    turns = -ray.azimuth / (2 * math.pi)
    assert turns[-1] == pytest.approx(23.0, abs=0.01)
    close = np.flatnonzero(np.abs(ray.radius / 1.0584 - 1) < 0.05)
    assert (np.diff(close) == 1).all() and np.ptp(turns[close]) == pytest.approx(18.1, abs=0.05)
    assert np.count_nonzero(np.diff(np.sign(np.diff(ray.theta[close])))) == 3


@pytest.mark.slow
def test_images_are_stretched_along_the_primary_curve():
    """To within 0.6 degrees of its tangent; across it 2.1 times as thin on the left, 15.7 times on the right."""
    sky = kc.caustics(NEAR, orders=1)[0].sky
    tangent = np.roll(sky, -1, axis=0) - np.roll(sky, 1, axis=0)
    along = np.stack([(tangent * axis).sum(axis=1) for axis in kc.tangent_basis(sky)], axis=1)
    _, diameters, axes = np.linalg.svd(kc.trace_beams(NEAR, sky).jacobian)
    assert (diameters[:, 1] < 1e-9 * diameters[:, 0]).all()
    # A small star is drawn out in the direction that the map flattens.
    part = np.abs((along * axes[:, 1]).sum(axis=1)) / np.linalg.norm(along, axis=1)
    assert np.degrees(np.arccos(part.clip(max=1))).max() < 0.6
    across = azimuthal_equidistant(sky, view_axes(NEAR, kc.shadow_edge(NEAR, 2000)))[:, 0]
    thin = diameters[[across.argmin(), across.argmax()], 0]
    np.testing.assert_allclose(thin, [2.09, 15.71], rtol=2e-3)


def evenly(sky, count):
    """So many directions along a closed curve, at equal distances."""
    closed = np.concatenate([sky, sky[:1]])
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    places = np.linspace(0, way[-1], count, endpoint=False)
    even = np.stack([np.interp(places, way, part) for part in closed.T], axis=1)
    return even / np.linalg.norm(even, axis=1, keepdims=True)


@pytest.mark.parametrize(("camera", "speed"), [(FAR, 19.8), (NEAR, 20.1)], ids=["r=6.03", "r=2.6"])
def test_the_flow_of_images_is_sheared_at_the_primary_curve(camera, speed):
    """Half a degree outside the curve images run along it one way, as far inside the other way, and fast.

    In the median over its length so many times as fast as the stars turn about the camera; half as far from the curve,
    twice as fast.
    """
    sky = evenly(kc.caustics(camera, orders=1)[0].sky, 400)
    along = np.roll(sky, -1, axis=0) - np.roll(sky, 1, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    outward = np.cross(along, sky)
    outward *= -np.sign(outward @ sky.mean(axis=0))[:, None]
    flows = []
    for away in np.radians((0.5, -0.5, 0.25)):
        beside = sky * math.cos(away) + outward * math.sin(away)
        beams = kc.trace_beams(camera, beside)
        # The camera goes round toward larger phi', so the stars go the other way.
        turning = np.cross([0.0, 0.0, -1.0], beams.direction)
        motion = np.stack([(axis * turning).sum(axis=1) for axis in polar_basis(beams.direction)], axis=-1)
        images = np.linalg.solve(beams.jacobian, motion[..., None])[..., 0]
        velocity = sum(images[:, i, None] * axis for i, axis in enumerate(kc.tangent_basis(beside)))
        flows.append((velocity * along).sum(axis=1))
    # But for the two points in the plane, where the flow crosses the curve.
    off_plane = np.abs(sky[:, 2]) > 0.02
    assert (flows[0] * flows[1] < 0)[off_plane].all() and off_plane.mean() > 0.9
    assert np.median(np.abs(flows[0])) == pytest.approx(speed, rel=0.02)
    assert np.median((flows[2] / flows[0])[off_plane]) == pytest.approx(2, abs=0.05)


def test_the_shadow_of_a_fast_hole_is_a_d_and_that_of_the_films_hole_is_round():
    """Seen from its equatorial plane, far away: with spin 1 straight at x = -2 M for |y| < sqrt(3) M.

    With 0.999 two fifths of its height lie within 1 % of the left side. With 0.6 it is round to 1.3 %.
    """
    edges = {a: kc.shadow_edge(kc.Observer(spin=a, inclination=math.pi / 2), 4000) for a in (0.6, 0.999, 1 - 1e-12)}
    straight = np.abs(edges[1 - 1e-12][:, 1]) < math.sqrt(3) - 1e-3
    left = edges[1 - 1e-12][:, 0] < 0
    np.testing.assert_allclose(edges[1 - 1e-12][straight & left, 0], -2, atol=2e-5)
    assert (straight & left).sum() > 100
    parts, roundness = {}, {}
    for spin, (x, y) in ((spin, edge.T) for spin, edge in edges.items()):
        parts[spin] = np.ptp(y[x < x.min() + 0.01 * np.ptp(x)]) / np.ptp(y)
        away = np.hypot(x - (x.min() + x.max()) / 2, y)
        roundness[spin] = np.ptp(away) / (away.max() + away.min())
    assert parts[0.999] == pytest.approx(0.403, abs=0.002) and parts[0.6] == pytest.approx(0.2, abs=0.002)
    assert roundness[0.6] == pytest.approx(0.012, abs=0.001) and roundness[0.999] == pytest.approx(0.080, abs=0.001)


@pytest.mark.slow
@pytest.mark.parametrize(("theta", "outside", "inside"), [(10, 1, -1), (170, -1, 1)])
def test_senses_in_which_images_circle_the_poles(theta, outside, inside):
    """Northern ones: of index 0 counter-clockwise round the upper image, of index 1 clockwise, round the lower."""
    axes = view_axes(FAR, kc.shadow_edge(FAR, 2000))
    poles = azimuthal_equidistant(kc.star_images(FAR, (math.pi * (theta > 90), 0.0), max_index=1).sky, axes)
    assert (np.sign(poles[:, 1]) == (outside, inside)).all()
    tracks = kc.star_tracks(FAR, math.radians(theta), max_index=1).tracks
    for track, pole, sense in zip(tracks, poles, (outside, inside), strict=True):
        # The star's azimuth falls with time.
        forward = slice(None, None, -int(np.sign(track.turns)))
        picture = azimuthal_equidistant(np.concatenate([track.sky, track.sky[:1]])[forward], axes)
        assert winding(picture - pole) == sense


@pytest.mark.slow
def test_life_of_the_star_of_figures_5_and_6():
    """A creation and an annihilation an orbit; 1 or 3 images of order 1; the third takes the place of the first."""
    tracks = kc.star_tracks(FAR, STAR, max_index=2)
    assert tracks.certified and [event.kind for event in tracks.events] == ["creation", "annihilation"]
    born, died = tracks.events
    assert born.order == died.order == 2
    axes = view_axes(FAR, kc.shadow_edge(FAR, 2000))
    numbers, places = {}, {}
    for name, time in (("before", born.moment - 1), ("between", born.moment + 1), ("after", died.moment + 1)):
        images = tracks.images_at(time)
        shown = images.crossings == 1
        numbers[name] = sorted(images.index[shown].tolist())
        places[name] = azimuthal_equidistant(images.sky[shown], axes)[:, 0]
    assert numbers == {"before": [1], "between": [1, 1, 2], "after": [1]}
    # The pair that dies is on the left: the third image, on the right, is left over.
    assert places["before"][0] < 0 and azimuthal_equidistant(died.sky[None], axes)[0, 0] < 0 < places["after"][0]


# Index: trips; distance from the shadow edge at first and last, degrees; latitude at first, least and last.
SINKING = {1: (1.16, (38.4, 6.91), (25.3, 4.46, 13.1)), 2: (4.38, (5.30, 0.795), (22.4, 2.90, 6.80))}


@pytest.mark.slow
def test_images_at_the_flat_edge_sink_with_each_prograde_trip():
    """Toward the shadow, on either side of the plane; their latitude grows toward a critical curve, falls behind it."""
    edge = kc.shadow_edge(NEAR, 2000)
    axes = view_axes(NEAR, edge)
    tracks = kc.star_tracks(NEAR, math.radians(85), max_index=2)
    assert tracks.certified
    for index, (trips, ends, latitudes) in SINKING.items():
        track = tracks.tracks[index]
        which = next(which for k, which in stretches(track) if k == index)
        azimuth = np.unwrap(track.azimuth[which])
        # In the order of time: the azimuth falls, by a turn for each further prograde trip of the light.
        order = np.argsort(-azimuth)
        which, azimuth = which[order], azimuth[order]
        angle, away = unrolled_places(track.sky[which], axes, edge).T
        first = np.where(np.abs(angle - 180) < 90, away, 0).argmax()
        sky, away = track.sky[which[first:]], away[first:]
        latitude = np.degrees(np.arcsin(sky[:, 2]))
        assert (np.sign(latitude) == (-1) ** index).all()
        assert (np.diff(away) < 0).all()
        assert np.ptp(azimuth[first:]) / (2 * math.pi) == pytest.approx(trips, abs=0.01)
        lowest = np.abs(latitude).argmin()
        assert (np.diff(np.abs(latitude[: lowest + 1])) < 0).all() and (np.diff(np.abs(latitude[lowest:])) > 0).all()
        assert away[[0, -1]] == pytest.approx(ends, rel=0.01)
        assert np.abs(latitude[[0, lowest, -1]]) == pytest.approx(latitudes, rel=0.03)


@pytest.mark.slow
def test_at_one_moment_each_image_at_the_flat_edge_has_made_one_trip_more_than_the_one_above_it():
    """The same by a search for the images of one star: five of them, of index 1 and 2, ever nearer to the shadow."""
    images = kc.star_images(NEAR, (math.radians(85), math.pi), max_index=2)
    edge = kc.shadow_edge(NEAR, 2000)
    angle, away = unrolled_places(images.sky, view_axes(NEAR, edge), edge).T
    beside = np.flatnonzero((np.abs(angle - 180) < 30) & (images.index > 0))
    beside = beside[np.argsort(-away[beside])]
    assert images.certified and images.index[beside].tolist() == [1, 2, 2, 2, 2]
    np.testing.assert_allclose(np.diff(images.azimuth[beside]), -2 * math.pi, rtol=0, atol=1e-9)


def counter_clockwise(line):
    """A closed curve (n, 2) in its counter-clockwise sense, by the sign of its area."""
    right, up = line.T
    return line if np.sum(right * np.roll(up, -1) - up * np.roll(right, -1)) > 0 else line[::-1]


@pytest.mark.slow
def test_senses_in_which_the_images_of_that_star_move():
    """Along the track, which is just below the shadow: #2 counter-clockwise, #1 and #3 clockwise."""
    tracks = kc.star_tracks(FAR, STAR, max_index=2)
    born, died = tracks.events
    edge = kc.shadow_edge(FAR, 2000)
    axes = view_axes(FAR, edge)
    # That of the images of order 1: closed, and not round the shadow.
    line = counter_clockwise(azimuthal_equidistant(tracks.tracks[1].sky, axes))
    shadow = azimuthal_equidistant(edge, axes)
    assert winding(line) == 0 and line[:, 1].max() < 0
    # Degrees from the shadow edge, whose radius is about 30.
    away = np.linalg.norm(line[:, None] - shadow, axis=2).min(axis=1)
    assert away.min() < 1.0 and away.max() < 17.0
    along = {}
    for time in np.linspace(born.moment + 0.3, died.moment - 0.3, 8):
        images = tracks.images_at(float(time))
        shown = images.crossings == 1
        # Of index 1 are #1 at the prograde edge on the left, and #3 on the right.
        for index, place in zip(images.index[shown], azimuthal_equidistant(images.sky[shown], axes), strict=True):
            name = "2" if index == 2 else "1" if place[0] < 0 else "3"
            along.setdefault(name, []).append(np.linalg.norm(line - place, axis=1).argmin() / len(line))
    senses = {name: np.sign(np.diff(np.unwrap(parts, period=1.0))) for name, parts in along.items()}
    assert {name: set(sense) for name, sense in senses.items()} == {"1": {-1.0}, "2": {1.0}, "3": {-1.0}}
