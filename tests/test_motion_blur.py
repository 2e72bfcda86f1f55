"""Motion blur, against the mean of many pictures at moments of their own."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scenes.colour import luminance
from kerrcaustics.scenes.disk.crossings import Lattice, crossings
from kerrcaustics.scenes.disk.lighting import Looks, disk_light
from kerrcaustics.scenes.disk.turned import turned_disk
from kerrcaustics.scenes.motion import ShutterWeight

# Weights of moments t from -1/2 to 1/2, and their variances.
WEIGHTS = {
    "box": np.ones_like,
    "triangle": lambda t: 2 - 4 * np.abs(t),
    "cosine": lambda t: 1 + np.cos(2 * np.pi * t),
}
VARIANCES = {"box": 1 / 12, "triangle": 1 / 24, "cosine": 1 / 12 - 1 / (2 * math.pi**2)}
# Curves of one's own: the triangle again; one that opens fast, stands and closes slowly; a double exposure.
TRIANGLE, SLOW, DOUBLE = (0.0, 2.0, 0.0), (0.0, 3.0, 3.0, 2.0, 1.0, 0.0), (1.0, 1.0, 0.0, 0.0, 0.0, 1.0)
VELOCITY = (-0.3, 0.0, 0.2)
CAMERA = kc.Camera(0.999, 6.03, velocity=VELOCITY)
SMALL = 48, 30
MEDIUM = 128, 80
LARGE = 192, 120
DISK = kc.disks.Disk(9.26, 18.7, kc.disks.Swatches())


def view_of(size):
    return kc.pictures.View.toward_hole(CAMERA, *size, 1.4)


def orbiting(moment, middle):
    return CAMERA, middle, 0.08 * moment, 0.0


def falling(moment, middle):
    return kc.Camera(0.999, 6.03 - 0.25 * moment, velocity=VELOCITY), middle, 0.05 * moment, 2.0 * moment


def turning(moment, middle):
    forward = middle.forward * math.cos(0.1 * moment) + middle.right * math.sin(0.1 * moment)
    view = kc.pictures.View(middle.width, middle.height, middle.field_of_view, forward=forward, up=middle.up)
    return CAMERA, view, 0.0, 0.0


def waiting(moment, middle):
    return CAMERA, middle, 0.0, 4.0 * moment


def motion_of(way, middle, weight="box"):
    return kc.pictures.ShutterMotion(*zip(way(-0.5, middle), way(0.5, middle), strict=True), weight)


def blurred(way, middle, sky, disk=None, weight="box"):
    return kc.render(CAMERA, middle, sky, disk=disk, motion=motion_of(way, middle, weight)).light


def curve_of(weight):
    """The weight of moments, whose integral is 1 but for that of small steps."""
    if weight in WEIGHTS:
        return WEIGHTS[weight]
    times = np.linspace(-0.5, 0.5, len(weight))
    return lambda t: np.interp(t, times, weight) / np.trapezoid(weight, times)


def mean_of_moments(way, middle, sky, disk=None, count=64, weight="box"):
    total, moments = [], (np.arange(count) + 0.5) / count - 0.5
    for moment in moments:
        camera, view, azimuth, time = way(float(moment), middle)
        turned = None if sky is None else kc.skies.TurnedSky(sky, -azimuth)
        on_disk = None if disk is None else turned_disk(disk, -azimuth)
        total.append(kc.render(camera, view, turned, disk=on_disk, time=time).light)
    return np.average(total, axis=0, weights=curve_of(weight)(moments))


def differences(one, other):
    """Mean difference of luminance, and that of all light, as parts of all light."""
    one, other = luminance(one), luminance(other)
    return np.abs(one - other).mean() / other.mean(), one.mean() / other.mean() - 1


@pytest.mark.slow
@pytest.mark.parametrize("way", [orbiting, falling, turning])
@pytest.mark.parametrize(("sky", "disk", "most"), [(kc.skies.Checkerboard(), None, 0.015), (None, DISK, 0.03)])
def test_pictures_are_means_of_their_moments(way, sky, disk, most):
    middle = view_of(MEDIUM)
    mean = mean_of_moments(way, middle, sky, disk, 64 if disk is None else 32)
    difference, light = differences(blurred(way, middle, sky, disk), mean)
    assert difference < most and abs(light) < 0.01
    assert difference < 0.15 * differences(kc.render(CAMERA, middle, sky, disk=disk).light, mean)[0]


@pytest.mark.slow
def test_a_sky_that_turns_is_the_mean_of_its_moments():
    middle, sky = view_of(SMALL), kc.skies.Checkerboard()
    difference, light = differences(blurred(orbiting, middle, sky), mean_of_moments(orbiting, middle, sky, count=16))
    # Several moments, not swept, differ by 0.0022.
    assert difference < 0.0018 and abs(light) < 0.01


def far_star(direction):
    catalogue = kc.skies.StarCatalogue(direction[None], np.zeros(1), np.full(1, 0.65))
    return kc.skies.StarField(catalogue, orientation=np.eye(3), band=0)


# A star beside the hole, in the picture of LARGE pixels, and all pixels in which its first image is.
AROUND = np.s_[:50, :64]


def star_of(middle):
    return far_star(kc.trace_beams(CAMERA, middle.directions(30.3, 14.6)[0]).direction)


@pytest.mark.slow
@pytest.mark.parametrize(("way", "brightest"), [(falling, 0.74), pytest.param(turning, 0.16, marks=pytest.mark.slow)])
def test_a_star_keeps_its_light(way, brightest):
    middle = view_of(LARGE)
    sky = star_of(middle)
    found, still = luminance(blurred(way, middle, sky)), luminance(kc.render(CAMERA, middle, sky).light)
    assert found[AROUND].sum() == pytest.approx(still[AROUND].sum(), rel=0.01)
    # Pieces of the exposure without traces have 0.76 and 0.21.
    assert found[AROUND].max() < brightest * still[AROUND].max()


@pytest.mark.slow
@pytest.mark.parametrize("way", [orbiting, falling])
def test_a_star_is_drawn_along_its_trace(way):
    middle = view_of(LARGE)
    sky = star_of(middle)
    found, mean = blurred(way, middle, sky), mean_of_moments(way, middle, sky, count=32)
    difference, light = differences(found[AROUND], mean[AROUND])
    assert difference < 0.06 and abs(light) < 0.01


@pytest.mark.slow
def test_a_pattern_that_circles_is_blurred_for_a_camera_that_stays():
    middle = view_of(SMALL)
    found = kc.render(CAMERA, middle, disk=DISK, motion=motion_of(waiting, middle))
    mean = mean_of_moments(waiting, middle, None, DISK, 16)
    difference, light = differences(found.light, mean)
    assert difference < 0.02 and abs(light) < 0.01
    assert found.beams == kc.render(CAMERA, middle, disk=DISK).beams


@pytest.mark.slow
def test_moments_with_rays_of_their_own_see_thin_images_as_well_together():
    camera, disk = kc.Camera(0.9, 12.0, math.radians(80)), kc.disks.Disk(3, 14, kc.disks.BlackBody(5000.0), 0.5)
    view, looks = kc.pictures.View.toward_hole(camera, 48, 30, 1.0), Looks(0.9, False, False, False, 0.0)

    def seen(*numbers):
        """Beams to the thin images at a moment, and their light: that of one pixel full of it is 1."""
        plane = crossings(Lattice.at_moment(camera, view, False, *numbers), disk.inner, disk.outer, disk.opaque)
        whole, thin = (
            disk_light(disk, cells, (30, 48), looks)[0][..., 0] for cells in (plane.cells[:1], plane.cells[3:4])
        )
        return plane.beams[3], thin / whole.max()

    # A picture of a single moment, and one with the rays of eight of them.
    beams, still = seen(0, 1)
    truth = np.mean([seen(number, 1)[1] for number in range(1, 9)], axis=0)
    each = [seen(number, 4) for number in range(4)]
    together = np.mean([light for _, light in each], axis=0)
    assert all(other < 0.75 * beams for other, _ in each)
    assert together.sum() == pytest.approx(truth.sum(), rel=0.05) and truth.sum() > 0.3
    alone, mean = (np.sqrt(np.mean((light - truth)[truth > 0] ** 2)) for light in (still, together))
    # Both have an error by chance; together they may be as good as one picture.
    assert mean < 1.25 * alone, (mean, alone)
    assert np.abs(together - truth).max() < 0.01


@pytest.mark.slow
def test_without_motion_nothing_changes():
    middle, sky = view_of(SMALL), kc.skies.StarField()
    plain = kc.render(CAMERA, middle, sky)
    still = kc.render(CAMERA, middle, sky, motion=kc.pictures.ShutterMotion((CAMERA, CAMERA), (middle, middle)))
    assert np.array_equal(plain.light, still.light) and plain.beams == still.beams


@pytest.mark.slow
def test_a_draft_is_the_moment_in_the_middle():
    middle, sky = view_of(SMALL), kc.skies.Checkerboard()

    def rendered(motion):
        """At both qualities."""
        return [
            kc.render(CAMERA, middle, sky, disk=DISK, delay=True, time=5.0, quality=name, motion=motion)
            for name in ("draft", "normal")
        ]

    (still_draft, still), (draft, moving) = rendered(None), rendered(motion_of(falling, middle))
    assert np.array_equal(draft.light, still_draft.light)
    assert draft.crossings == still_draft.crossings and draft.beams == still_draft.beams
    # The other quality has several moments, each with beams of its own, and other light.
    assert moving.crossings[0] >= 2 * still.crossings[0]
    assert differences(moving.light, still.light)[0] > 0.02


def test_motion_that_is_none_is_refused_in_drafts_too():
    middle = view_of(SMALL)
    other = kc.pictures.View(24, 15, 1.4)
    motion = kc.pictures.ShutterMotion((CAMERA, CAMERA), (other, other))
    with pytest.raises(ValueError, match="Argument `motion` must keep width"):
        kc.render(CAMERA, middle, motion=motion, quality="draft")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"cameras": CAMERA}, "`cameras` must be two objects of the class Camera"),
        ({"views": (1, 2)}, "`views` must be two objects of the class View"),
        ({"azimuths": (0.0, math.nan)}, "`azimuths` must be two finite numbers"),
        ({"times": (0.0,)}, "`times` must be two finite numbers"),
        ({"weight": "round"}, "`weight` must be one of box, triangle, cosine"),
        ({"weight": [1.0]}, "`weight` must be one of box, triangle, cosine, or 2 to 1,000 finite numbers"),
        ({"weight": [0, 0]}, r"`weight` must .* not all 0, but is \[0, 0\]"),
        ({"weight": [1, -1]}, "`weight` must .* none of them negative"),
        ({"weight": [[1, 1]]}, "`weight` must .* finite numbers"),
        ({"weight": [1, math.inf]}, "`weight` must .* finite numbers"),
    ],
)
def test_what_is_no_motion_is_refused(values, words):
    middle = view_of(SMALL)
    with pytest.raises(ValueError, match=f"Argument {words}"):
        kc.pictures.ShutterMotion(**{"cameras": (CAMERA, CAMERA), "views": (middle, middle), **values})


def test_a_motion_that_does_not_fit_the_picture_is_refused():
    middle = view_of(SMALL)
    for motion, words in (
        (3, "must be a ShutterMotion"),
        (
            kc.pictures.ShutterMotion((CAMERA, CAMERA), (middle, view_of(LARGE))),
            "must keep width, height and projection",
        ),
        (kc.pictures.ShutterMotion((kc.Camera(0.5, 6.0), CAMERA), (middle, middle)), "must keep the spin"),
    ):
        with pytest.raises(ValueError, match=f"Argument `motion` {words}"):
            kc.render(CAMERA, middle, kc.skies.Checkerboard(), motion=motion)
    with pytest.raises(ValueError, match="Argument `sky` must have no `sweep` of its own"):
        kc.render(CAMERA, middle, kc.skies.StarField(sweep=0.1), motion=motion_of(turning, middle))


@pytest.mark.parametrize("count", [1, 2, 5, 32])
@pytest.mark.parametrize("shape", WEIGHTS)
def test_parts_of_a_weight_make_up_the_whole(shape, count):
    """Their light is the weight's integral, here by the middles of small steps; mean and variance are kept."""
    parts = ShutterWeight(shape).divided(count)
    t = (np.arange(count * 4096) + 0.5) / (count * 4096) - 0.5
    rows = WEIGHTS[shape](t).reshape(count, -1)
    assert np.allclose(parts.light, rows.mean(axis=1), atol=1e-7)
    assert np.allclose(parts.moment, np.average(t.reshape(count, -1), axis=1, weights=rows), atol=1e-7)
    assert parts.light.mean() == pytest.approx(1, rel=1e-14)
    assert (parts.light * parts.moment).sum() == pytest.approx(0, abs=1e-14)
    variance = (parts.light * (parts.moment**2 + parts.spread**2 / 12)).mean()
    assert variance == pytest.approx(VARIANCES[shape], rel=1e-12)


@pytest.mark.parametrize("shape", WEIGHTS)
def test_a_part_of_a_weight_is_divided_as_the_whole_is(shape):
    whole, quarter = ShutterWeight(shape).divided(20), ShutterWeight(shape).part(-0.25, 0.0).divided(5)
    one, light = whole.light[5:10], whole.light[5:10].mean()
    assert np.allclose(quarter.light, one / light, rtol=1e-12)
    assert np.allclose(quarter.moment, 4 * (whole.moment[5:10] + 0.125), atol=1e-12)
    assert np.allclose(quarter.spread, 4 * whole.spread[5:10], rtol=1e-9)


@pytest.mark.parametrize("count", [1, 7, 32])
@pytest.mark.parametrize("curve", [SLOW, DOUBLE])
def test_parts_of_a_curve_of_ones_own_are_those_of_small_steps(curve, count):
    """Where the shutter is shut for a whole part, that has no light."""
    parts = ShutterWeight(curve).divided(count)
    t = (np.arange(count * 9000) + 0.5) / (count * 9000) - 0.5
    rows = np.interp(t, np.linspace(-0.5, 0.5, len(curve)), curve).reshape(count, -1)
    assert np.allclose(parts.light, rows.mean(axis=1) / rows.mean(), atol=2e-7)
    lit = rows.mean(axis=1) > 1e-6
    assert np.allclose(parts.moment[lit], np.average(t.reshape(count, -1)[lit], axis=1, weights=rows[lit]), atol=1e-7)
    squares = np.average(t.reshape(count, -1)[lit] ** 2, axis=1, weights=rows[lit])
    assert np.allclose(parts.moment[lit] ** 2 + parts.spread[lit] ** 2 / 12, squares, atol=1e-7)
    assert np.isfinite(parts).all()


def test_a_curve_of_ones_own_that_is_the_triangle_makes_its_parts():
    one, other = (
        ShutterWeight(TRIANGLE).part(-0.3, 0.4).divided(5),
        ShutterWeight("triangle").part(-0.3, 0.4).divided(5),
    )
    assert np.allclose(one, other, rtol=1e-9, atol=1e-12)


def test_a_part_in_which_the_shutter_is_shut_has_no_light():
    parts = ShutterWeight(DOUBLE).part(0.0, 0.1).divided(3)
    assert not parts.light.any() and np.isfinite(parts).all()


# Far from the hole and away from it: as the camera goes round, stars on the equator run straight along the middle row.
AWAY = kc.Camera(0.9, 1e4, velocity="static")


def away(turn, weight, width=128):
    view = kc.pictures.View(width, 9, 0.25, forward=(1.0, 0.0, 0.0), up=(0.0, 0.0, 1.0))
    motion = kc.pictures.ShutterMotion((AWAY, AWAY), (view, view), azimuths=(-turn / 2, turn / 2), weight=weight)
    return view, motion


class Power(kc.skies.Sky):
    """A sky whose light is a power of its azimuth, from a quarter of the sky behind the camera on."""

    def __init__(self, exponent):
        self.exponent = exponent

    def light(self, footprint, beaming, colour_shift):
        x, y, _ = footprint.direction.T
        return np.repeat((2 + np.arctan2(y, x)[:, None]) ** self.exponent, 3, axis=1)


@pytest.mark.slow
def test_what_changes_evenly_is_the_same_with_all_weights_and_squares_have_their_variances():
    def shown(exponent, turn, weight):
        view, motion = away(turn, weight)
        return kc.render(AWAY, view, Power(exponent), motion=motion).light[..., 0]

    still = {n: shown(n, 0.0, "box") for n in (1, 2)}
    for weight, variance in VARIANCES.items():
        assert np.allclose(shown(1, 0.2, weight), still[1], atol=2e-6)
        # Of so many sweeps within the exposure all but the variance within each.
        assert np.allclose(shown(2, 0.2, weight) - still[2], 0.04 * variance, rtol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("turn", [0.07, 0.16])
@pytest.mark.parametrize("weight", [*WEIGHTS, SLOW])
def test_the_streak_of_a_star_has_the_profile_of_the_weight(weight, turn):
    """Short enough to be drawn as one trace, and so long that it is drawn from two halves."""
    view, motion = away(turn, weight)
    sky = far_star(kc.trace_beams(AWAY, view.directions(63.5, 4.0)[0]).direction)
    column = luminance(kc.render(AWAY, view, sky, motion=motion).light).sum(axis=0)
    length = turn / 0.25 * 128
    t = (np.arange(100_000) + 0.5) / 100_000 - 0.5
    shut = np.interp((np.arange(128) - 63) / length, t, np.cumsum(curve_of(weight)(t)) / len(t))
    # To a quarter of a pixel of the streak: an image is a spline three pixels wide.
    assert np.allclose(np.cumsum(column) / column.sum(), shut, atol=0.25 / length)


@pytest.mark.slow
@pytest.mark.parametrize("weight", ["cosine", SLOW], ids=["cosine", "slow"])
@pytest.mark.parametrize("way", [falling, waiting])
def test_a_weighted_picture_is_the_weighted_mean_of_its_moments(way, weight):
    """Sky, disk and shadow edge of a camera that falls in pieces of the exposure; a disk before one that stays."""
    middle, sky = view_of(SMALL), kc.skies.Checkerboard()
    disk = kc.disks.Disk(9.26, 18.7, kc.disks.Swatches(), opacity=0.7)
    found = {name: blurred(way, middle, sky, disk, name) for name in ("box", weight)}
    mean = mean_of_moments(way, middle, sky, disk, 16, weight)
    difference, light = differences(found[weight], mean)
    assert difference < 0.02 and abs(light) < 0.01
    # Of the fall 0.57: what patches and moments are off with any weight.
    assert difference < 0.7 * differences(found["box"], mean)[0]
