"""Spots on orbits of their own: the orbits against laws of motion and integrated falls, their light against beams."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.beams.emitters import EMITTERS
from kerrcaustics.orbits.geodesics import free_fall
from kerrcaustics.orbits.spherical_orbits import SphericalOrbits, spherical_constants
from kerrcaustics.scenes.colour import luminance
from kerrcaustics.scenes.disk.turned import turned_volume
from kerrcaustics.spacetime import kerr

TIMES = np.linspace(-300, 900, 7)


def orbits(spin, radius, inclination, node=0.4, phase=0.7):
    columns = np.broadcast_arrays(*(np.atleast_1d(np.asarray(x, float)) for x in (radius, inclination, node, phase)))
    return SphericalOrbits(spin, *columns)


def test_without_spin_orbits_are_tilted_circles():
    for time in TIMES:
        found = orbits(0.0, 8.0, [0.0, 0.5, math.pi / 2, 2.5]).places(np.full(4, time))
        for inclination, vector in zip((0.0, 0.5, math.pi / 2, 2.5), found.vector, strict=True):
            angle = 0.7 + time / 8**1.5
            c, s = math.cos(0.4), math.sin(0.4)
            x, y, z = math.cos(angle), math.sin(angle) * math.cos(inclination), math.sin(angle) * math.sin(inclination)
            assert np.abs(vector - (c * x - s * y, s * x + c * y, z)).max() < 1e-12


@pytest.mark.parametrize("spin", [0.3, 0.95])
def test_orbits_keep_their_constants(spin):
    """u.u = -1, E, L_z and Q from the velocity on the way are those of the closed form, and the radius stays."""
    radius, inclination = (part.ravel() for part in np.meshgrid([4.5, 8.0, 60.0], [0.0, 0.4, 1.3, math.pi / 2, 1.7]))
    some = orbits(spin, radius, inclination)
    energy, momentum, carter = some.constants
    pull = energy * (radius**2 + spin**2) - spin * momentum
    delta, total = radius * (radius - 2) + spin**2, (momentum - spin * energy) ** 2 + carter
    assert np.abs(pull**2 / delta / (radius**2 + total) - 1).max() < 1e-13
    slope = 4 * radius * energy * pull - 2 * (radius - 1) * (radius**2 + total) - 2 * radius * delta
    assert np.abs(slope / radius**3).max() < 1e-13 and some.error.max() < 1e-13
    for time in TIMES:
        at = some.places(np.full(len(radius), time))
        for i, (vector, rate) in enumerate(zip(at.vector, at.rate, strict=True)):
            metric, sine = kerr.metric(spin, radius[i], vector[2]), math.hypot(*vector[:2])
            turn = (vector[0] * rate[1] - vector[1] * rate[0]) / sine**2
            east = metric.cylindrical_scale * sine * (turn - metric.shift) * at.clock[i]
            gamma = metric.lapse * at.clock[i]
            south = metric.sigma * (rate[2] / sine) ** 2 * at.clock[i] ** 2
            lz = east * metric.cylindrical_scale * sine
            e = gamma * metric.lapse + metric.shift * lz
            q = metric.sigma * south + vector[2] ** 2 * (spin**2 * (1 - e * e) + lz**2 / sine**2)
            assert gamma**2 - east**2 - south == pytest.approx(1, abs=1e-12)
            scale = radius[i]
            assert (e, lz, q) == pytest.approx((energy[i], momentum[i], carter[i]), abs=1e-12 * scale)


def test_in_the_plane_they_are_the_orbits_of_disks():
    radius = np.array([6.0, 9.0, 40.0])
    for inclination, motion in ((0.0, "circular"), (math.pi, "retrograde")):
        some = orbits(0.5, radius if inclination == 0 else radius + 3, inclination, 0.0, 0.0)
        rate = (np.cos(inclination) * 2 * math.pi + some.precession) / some.period
        assert rate == pytest.approx(EMITTERS[motion](0.5, some.radius, 0.0).orbital, rel=1e-13)


@pytest.mark.parametrize("radius", [3.01, 6.0, 1e3, 1e7])
def test_constants_keep_their_digits_far_out(radius):
    """Without spin in closed form: of E^2 - 1 nothing is left to rounding, nor of the period."""
    inclination = np.array([0.0, 0.7, math.pi / 2, 2.8, math.pi])
    _, momentum, carter = spherical_constants(0.0, radius, inclination)
    assert momentum**2 + carter == pytest.approx(
        np.full(5, radius**2 / (radius - 3)), rel=4e-15 * max(1, 1 / (radius - 3))
    )
    some = orbits(0.0, radius, inclination)
    assert some.period == pytest.approx(np.full(5, 2 * math.pi * radius**1.5), rel=some.error.max() + 1e-15)
    assert some.error.max() < 1e-12
    turn = 1e6 * some.period
    assert some.errors(turn) == pytest.approx(some.error * 2e6 * math.pi, rel=1e-5)


def test_nodes_turn_as_they_must():
    """Near the plane in closed form, by the frequencies of Kato 1990; far out at any tilt as Lense and Thirring say."""
    a, r = 0.7, 9.0
    vertical = math.sqrt(1 - 4 * a / r**1.5 + 3 * a * a / r**2)
    assert orbits(a, r, 1e-7).precession[0] == pytest.approx(2 * math.pi * (1 / vertical - 1), rel=1e-10)
    for inclination in (0.3, 1.2, math.pi / 2, 2.6):
        turned = orbits(a, 1e6, inclination).precession[0]
        assert turned == pytest.approx(4 * math.pi * a / 1e6**1.5, rel=3e-3)


def test_orbits_are_those_of_integrated_falls():
    a, r, inclination = 0.9, 9.0, 2.2
    some = orbits(a, r, inclination, 0.0, 0.0)
    metric, rate = kerr.metric(a, r, 0.0), some.places(np.zeros(1)).rate[0]
    east = metric.cylindrical_scale * (rate[1] - metric.shift) / metric.lapse
    velocity = 0.0, -math.sqrt(metric.sigma) * rate[2] / metric.lapse, east
    fall = free_fall(kc.Camera(a, r, math.pi / 2, velocity), 0.0, 0.0, (0.0, 200.0))
    assert fall.constants.carter == pytest.approx(some.constants[2][0], rel=1e-13)
    place, vector = fall.place(200.0), some.places(np.full(1, 200.0)).vector[0]
    flat = math.sin(place.theta) * np.exp(1j * place.phi)
    assert np.abs(vector - (flat.real, flat.imag, math.cos(place.theta))).max() < 1e-10


def solid_angles(view):
    y, x = (part.ravel() for part in np.mgrid[: view.height, : view.width])
    steps = view.directions(x, y)[1]
    return np.linalg.norm(np.cross(steps[..., 0], steps[..., 1]), axis=-1).reshape(view.height, view.width)


def seen(camera, direction, time, field, pixels, **options):
    """Flux of a spot of 0.03 about a direction, the peak, the flux that the beam there says, and that intensity."""
    end = kc.EquatorialPlane(1, "circular")
    beam = kc.trace_beams(camera, [direction], end=end, redshift=True, time=True, constants=True)
    (radius,), (azimuth,), (ratio,), (travel,) = beam.radius, beam.azimuth, beam.redshift, beam.time
    orbital = float(EMITTERS["circular"](camera.spin, radius, 0.0).orbital)
    spot = kc.disks.OrbitingSpots([radius], azimuth - orbital * (time - travel), size=0.03)
    view = kc.pictures.View(pixels, pixels, field, forward=tuple(direction), up=(0.0, 0.0, 1.0))
    light = luminance(kc.render(camera, view, volume=spot, beaming=True, delay=True, time=time).light)
    # Across a beam d(area) = sqrt(q) dr dphi, whoever measures.
    solid = beam.magnification[0] * radius / math.sqrt(beam.carter[0])
    return (light * solid_angles(view)).sum(), light.max(), 2 * math.pi * 0.03**2 * ratio**4 * solid, ratio**4


@pytest.mark.slow
@pytest.mark.parametrize("spin", [0.0, 0.9])
def test_light_is_that_of_beams(spin):
    """Before the hole, behind it, and at its side: flux, and the brightness in the middle."""
    camera = kc.Camera(spin, 20.0, 1.2, "static")
    view = kc.pictures.View.toward_hole(camera, 11, 11, 0.9)
    y, x = (part.ravel() for part in np.mgrid[:11, :11])
    sky = view.directions(x, y)[0]
    radius = kc.trace_rays(camera, sky, end=kc.EquatorialPlane(1)).radius
    some = np.flatnonzero((radius > 5) & (radius < 9))
    for direction in sky[some[[0, len(some) // 2, -1]]]:
        flux, peak, expected, intensity = seen(camera, direction, 7.0, 0.024, 110)
        assert flux == pytest.approx(expected, rel=0.008) and peak == pytest.approx(intensity, rel=0.03)


@pytest.mark.slow
def test_without_spin_the_tilt_is_that_of_the_camera():
    """A tilted orbit is seen as one in the plane is, from a camera that is tilted the other way."""
    tilt, size = 0.3, 0.25
    view = kc.pictures.View(80, 80, 1.6)
    pictures = []
    for inclination, tilted in ((1.2, tilt), (1.2 - tilt, 0.0)):
        camera = kc.Camera(0.0, 14.0, inclination, "static")
        spots = kc.disks.OrbitingSpots([7.0, 8.0], [0.3, 2.5], tilted, math.pi / 2, size=size, streak=4.0)
        options = {"beaming": True, "colour_shift": True, "delay": True, "time": 11.0}
        pictures.append(kc.render(camera, view, volume=spots, **options).light)
    assert np.abs(pictures[0] - pictures[1]).max() < 0.01 * pictures[0].max() and pictures[0].max() > 0.1
    other = kc.render(camera, view, volume=turned_volume(spots, 0.5), **options).light
    assert np.abs(other - pictures[1]).max() > 0.1 * pictures[0].max()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"radius": []}, "`radius` must hold positive"),
        ({"radius": [8.0, 9.0], "node": [1.0, 2.0, 3.0]}, "`node` must hold one finite number, or 2"),
        ({"radius": [8.0], "inclination": 4.0}, "`inclination` must hold angles from 0 to pi"),
        ({"radius": [8.0], "temperature": -5.0}, "must hold kelvins"),
        ({"radius": [8.0], "size": 0.0}, "`size` must be a positive"),
    ],
)
def test_bad_spots_are_refused(arguments, words):
    with pytest.raises(ValueError, match=words):
        kc.disks.OrbitingSpots(**arguments)


def test_where_nothing_circles_there_are_no_spots():
    assert np.isnan(spherical_constants(0.5, [2.0], [math.pi])[0]).all()
    with pytest.raises(ValueError, match="must hold radii of circular orbits, but one is 2"):
        kc.disks.OrbitingSpots([8.0, 2.0]).check(0.0)
    observer, screen = kc.Observer(spin=0.5, inclination=1.0), kc.Screen(4, 4, 20)
    with pytest.raises(ValueError, match="`camera` must be a Camera for spots"):
        kc.render(observer, screen, volume=kc.disks.OrbitingSpots([8.0]))
