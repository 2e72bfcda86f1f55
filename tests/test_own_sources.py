"""Skies and emissions of a user: what they need, what they may leave out, and what is said where they are wrong."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scenes.disk.flat import render_flat

CAMERA = kc.Camera(0.9, 10.0, 1.2)
VIEW = kc.pictures.View.toward_hole(CAMERA, 24, 14, 1.4)


class Grey(kc.skies.Sky):
    """A sky of one light."""

    def __init__(self, light=0.5):
        self.value = light

    def light(self, footprint, beaming, colour_shift):
        factor = footprint.redshift[:, None] ** 4 if beaming else 1.0
        return self.value * factor * np.ones((len(footprint), 3))


class Returning(kc.skies.Sky):
    """A sky that returns what a function of the number of pixels says."""

    def __init__(self, function):
        self.function = function

    def light(self, footprint, beaming, colour_shift):
        return self.function(len(footprint))


class Falling(kc.disks.Emission):
    """An emission that falls with the radius, alike at all azimuths."""

    symmetric = True

    def light(self, samples, beaming, colour_shift):
        factor = samples.redshift**4 if beaming else 1.0
        return np.repeat((factor * samples.radius**-3.0)[:, None], 3, axis=1)


class Emitting(kc.disks.Emission):
    """An emission that returns what a function of the number of parts says."""

    def __init__(self, function):
        self.function = function

    def light(self, samples, beaming, colour_shift):
        return self.function(len(samples.radius))


WRONG = {
    "a number": (lambda n: 1.0, "the shape ()"),
    "one channel": (lambda n: np.ones((n, 1)), ", 1)"),
    "a light too few": (lambda n: np.ones((n - 1, 3)), ", 3)"),
    "negative": (lambda n: np.full((n, 3), -1.0), "that are not"),
    "infinite": (lambda n: np.full((n, 3), math.inf), "that are not"),
    "no number": (lambda n: np.full((n, 3), math.nan), "that are not"),
    "lists of different lengths": (lambda n: [[1.0, 1.0]] + [[1.0]] * (n - 1), "no real numbers"),
    "complex": (lambda n: np.full((n, 3), 1j), "no real numbers"),
}


def test_a_sky_needs_one_method():
    sky = Grey()
    assert (sky.points, sky.sweep, sky.smooth) == (None, 0.0, False)
    seen = kc.render(CAMERA, VIEW, sky)
    np.testing.assert_allclose(seen.light[..., 0], 0.5 * seen.visible_fraction, rtol=1e-6)
    assert kc.skies.celestial_picture(sky, 8).min() == kc.skies.celestial_picture(sky, 8).max() == 0.5
    np.testing.assert_array_equal(render_flat(CAMERA, VIEW, sky), 0.5)
    with pytest.raises(TypeError, match="light"):
        kc.skies.Sky()


def test_a_sky_with_points_shows_them():
    star = np.array([[-1.0, 0.0, 0.0]])
    sky = Grey(0.0)
    sky.points = kc.skies.PointLights(star, np.ones((1, 3)), np.array([6500.0]))
    catalogue = kc.skies.StarCatalogue(star, np.zeros(1), np.zeros(1))
    stars = kc.skies.StarField(catalogue, orientation=np.eye(3), band=0)
    own, other = (kc.render(CAMERA, VIEW, one).light.sum(axis=(0, 1)) for one in (sky, stars))
    np.testing.assert_allclose(own * stars.points.flux[0], other, rtol=1e-6)
    turned = kc.skies.TurnedSky(sky, 0.5)
    np.testing.assert_allclose(turned.points.direction, [[-math.cos(0.5), -math.sin(0.5), 0.0]], atol=1e-15)
    with pytest.raises(ValueError, match="`nebulae` must be a sky without points"):
        kc.skies.StarField(catalogue, nebulae=sky)


def test_a_sky_may_turn_while_it_is_exposed():
    sky = Grey()
    sky.sweep, sky.smooth = 0.1, True
    turned = kc.skies.TurnedSky(sky, 0.3)
    assert (turned.sweep, turned.smooth) == (0.1, True)
    motion = kc.pictures.ShutterMotion((CAMERA, kc.Camera(0.9, 10.1, 1.2)), (VIEW, VIEW))
    with pytest.raises(ValueError, match="Argument `sky` must have no `sweep` of its own"):
        kc.render(CAMERA, VIEW, sky, motion=motion)


@pytest.mark.parametrize("case", WRONG)
def test_light_that_is_none_is_reported_with_the_class_that_returned_it(case):
    function, words = WRONG[case]
    disk = kc.disks.Disk(6.0, 12.0, Emitting(function))
    calls = {
        "Returning": [
            lambda: kc.render(CAMERA, VIEW, Returning(function)),
            lambda: kc.skies.celestial_picture(Returning(function), 8),
            lambda: render_flat(CAMERA, VIEW, Returning(function)),
        ],
        "Emitting": [lambda: kc.render(CAMERA, VIEW, disk=disk), lambda: render_flat(CAMERA, VIEW, disk=disk)],
    }
    for name, several in calls.items():
        for call in several:
            with pytest.raises(ValueError, match=r"^Argument `(sky|emission)` must") as caught:
                call()
            message = str(caught.value)
            assert "\n" not in message and words in message and name in message, message


def test_light_may_be_a_list_or_whole_numbers():
    for function in (lambda n: [[1, 1, 1]] * n, lambda n: np.ones((n, 3), int), lambda n: np.ones((n, 3), np.float32)):
        assert kc.render(CAMERA, VIEW, Returning(function)).light.max() == 1
        disk = kc.disks.Disk(6.0, 12.0, Emitting(function))
        assert kc.render(CAMERA, VIEW, disk=disk).light.max() == 1


def test_an_emission_needs_one_method():
    emission = Falling()
    assert (emission.keeps_shape, emission.symmetric, emission.own_opacity(6.0, 12.0)) == (False, True, None)
    size = np.array([[0.01, 0.1], [0.01, 0.3], [1.0, 6.0]])
    assert emission.parts(np.zeros((3, 2)), np.ones((3, 2)), size).tolist() == [2, 4, 16]
    disk = kc.disks.Disk(6.0, 12.0, emission)
    assert disk.opaque
    seen = kc.render(CAMERA, VIEW, disk=disk)
    assert seen.light.max() <= 6.0**-3 and seen.light.max() > 12.0**-3
    with pytest.raises(TypeError, match="light"):
        kc.disks.Emission()


def test_where_nothing_can_circle_light_that_is_shifted_is_dark():
    disk = kc.disks.Disk(1.6, 3.0, Falling(), motion="retrograde")
    dark, plain = (kc.render(CAMERA, VIEW, disk=disk, beaming=beaming).light for beaming in (True, False))
    assert dark.max() == 0 < plain.max()


def test_an_emission_may_bring_its_own_opacity():
    class Veiled(Falling):
        def own_opacity(self, inner, outer):
            return lambda radius, azimuth: np.full(len(radius), 0.25)

    disk = kc.disks.Disk(6.0, 12.0, Veiled())
    assert not disk.opaque and not disk.slant
    assert kc.render(CAMERA, VIEW, disk=disk).transmission.min() < 0.76


@pytest.mark.slow
def test_what_is_alike_all_round_needs_one_moment():
    """A camera that stays sees a disk that only circles: no more moments than of a black body."""
    motion = kc.pictures.ShutterMotion((CAMERA, CAMERA), (VIEW, VIEW), times=(-4.0, 4.0))

    class Pattern(Falling):
        symmetric = False

    one, several = (
        kc.render(CAMERA, VIEW, disk=kc.disks.Disk(6.0, 12.0, kind()), motion=motion) for kind in (Falling, Pattern)
    )
    np.testing.assert_allclose(one.light, several.light, rtol=1e-5, atol=1e-9)
