"""Arrays whose numbers mean something else are refused: those with units or masks, dates, complex numbers, texts.

Directions that are called unit vectors may have any length; an observer's sky has two coordinates.
"""

import inspect
import math

import numpy as np
import pytest
import xarray as xr
from offenders import for_each
from public import PUBLIC
from public_calls import CALLS, is_numeric

import kerrcaustics as kc

u = pytest.importorskip("astropy.units")
CAMERA, OBSERVER = kc.Camera(0.9, 10.0, 1.2), kc.Observer(spin=0.9, inclination=1.2)
VIEW, SCREEN = kc.pictures.View(8, 8, 1.0), kc.Screen(8, 8, 20.0)
RIMS, ONES = (6.0, 10.0), np.ones(3)
PLACE = {"spin": 0.9, "radius": 10.0, "inclination": 1.2}
NEXT = {"star": (1.4, 0.3), "near": np.array([[-0.6, 0.5, 0.4]])}
# Functions beside those of `CALLS`: methods, and those that JAX may trace.
OTHERS = [
    (VIEW.directions, {"x": 1.0, "y": ONES}),
    (VIEW.pixel_sizes, {"x": ONES, "y": 1.0}),
    (VIEW.pixels, {"sky": np.array([-1.0, 0.1, 0.1])}),
    (SCREEN.places, {"x": 1.0, "y": ONES}),
    (SCREEN.pixels, {"sky": np.array([3.0, 0.1])}),
    (kc.tangent_basis, {"n": np.array([[0.0, 0.0, 1.0]])}),
    (kc.functional.direction, {**PLACE, "sky": np.array([-0.6, 0.5, 0.4])}),
    (kc.functional.images, {**PLACE, **NEXT, "index": 1}),
    (kc.functional.event_time, {**PLACE, "path": np.ones((2, 2)), "near": NEXT["near"][0]}),
    (kc.functional.magnification, {**PLACE, **NEXT, "size": 0.01, "index": [1], "folds": np.ones((1, 3))}),
]
# Functions of a user's that return such arrays.
LAWS = [
    ("opacity", lambda law: kc.disks.Disk(*RIMS, kc.disks.BlackBody(4500.0), law).opacity_at(ONES, ONES)),
    ("density", lambda law: kc.disks.Volume(law, 4000.0, *RIMS, 0.5).matter(ONES, ONES, ONES, 0.1)),
    ("colour", lambda law: kc.disks.Volume(1.0, 4000.0, *RIMS, 0.5, colour=law).tint(ONES, ONES, ONES, 0.1)),
]


def impaired(numbers):
    """Arrays of such numbers that mean something else."""
    plain = np.asarray(numbers, float)
    masked = np.ma.masked_array(plain, np.ones(plain.shape, bool))
    return [plain * u.deg, masked, *(plain.astype(kind) for kind in ("M8[s]", "m8[ns]", complex, str))]


@for_each("function", "arguments", rows=CALLS + OTHERS)
def test_arrays_that_lose_their_meaning_are_refused_by_name(function, arguments):
    for name in [name for name, value in arguments.items() if is_numeric(value)]:
        for value in impaired(arguments[name]):
            with pytest.raises(ValueError, match=rf"^Arguments? .*`{name}`.* must ") as caught:
                function(**{**arguments, name: value})
            assert "\n" not in str(caught.value)


def test_messages_say_what_is_lost():
    words = [
        "has the unit deg: convert it, angles to radians",
        "some are masked: leave those out",
        "holds dates: times",
    ]
    words += [
        "holds time spans: times are",
        "holds complex ones: pass their real parts",
        "two numbers \\(theta', phi'\\)",
    ]
    for value, end in zip(impaired([1.4, 0.3]), words, strict=True):
        with pytest.raises(ValueError, match=f"^Argument `star` must .*{end}"):
            kc.star_images(CAMERA, value)


@pytest.mark.parametrize(("name", "called"), LAWS, ids=[name for name, _ in LAWS])
def test_functions_of_users_return_plain_numbers(name, called):
    for value in impaired(0.5 * ONES):
        with pytest.raises(ValueError, match=f"^Argument `{name}` must hold .*numbers, but "):
            called(lambda *places, value=value: value)


def test_lists_are_looked_into():
    for value in ([np.ma.masked_array([1.4, 0.3], [True, False])], [np.array([1.4, 0.3]) * u.deg], [[1.4, "0.3"]]):
        with pytest.raises(ValueError, match=r"^Argument `stars` must "):
            kc.image_counts(CAMERA, value, 0)


def test_arrays_that_lose_nothing_are_taken():
    assert kc.Camera(0.9, 10.0, np.ma.masked_array(1.2, False)) == CAMERA
    for unit in ("rad", "GM/c^2", "1"):
        # As results have them as Datasets.
        place = xr.DataArray([6.0, 0.3], attrs={"units": unit})
        assert np.array_equal(kc.Screen(8, 8, 20.0, centre=place).centre, place)
    with pytest.raises(ValueError, match=r"^Argument `centre` must hold plain numbers, but has the unit deg"):
        kc.Screen(8, 8, 20.0, centre=xr.DataArray([6.0, 0.3], attrs={"units": "deg"}))


def test_an_observers_sky_has_two_coordinates():
    """Not the three of the sphere that stands for it inside."""
    takes_sky = {name for name, one in PUBLIC.items() if callable(one) and "sky" in inspect.signature(one).parameters}
    # The sky of the others is a `Sky`, or what a result holds.
    takes_sky -= {"render", "render_volume", "trace_view", "celestial_picture", "TurnedSky", "Caustic", "StarImages"}
    assert takes_sky == {"trace_rays", "trace_beams", "ray_paths"}
    words = r"^Argument `sky` must have shape \(\.\.\., 2\) for an Observer, places \(alpha, beta\) .* but has \(1, 3\)"
    for name in takes_sky:
        with pytest.raises(ValueError, match=words):
            PUBLIC[name](OBSERVER, [[-0.9, 0.3, 0.3]])
        with pytest.raises(ValueError, match=r"^Argument `sky` must have shape \(\.\.\., 3\), but has \(1, 2\)"):
            PUBLIC[name](CAMERA, [[4.0, 0.3]])


def test_unit_vectors_may_have_any_length():
    direction = np.random.default_rng(4).normal(size=(200, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    parsecs = direction * np.geomspace(1e-160, 1e160, 200)[:, None]
    stars = kc.skies.StarCatalogue(parsecs, np.ones(200), np.ones(200))
    np.testing.assert_allclose(stars.direction, direction, atol=4e-16)
    lights = kc.skies.StarField(stars, np.eye(3)).points.direction
    np.testing.assert_allclose(np.linalg.norm(lights, axis=1), 1, atol=1e-15)
    # Those of unit length stay as they are, to the last digit.
    assert kc.skies.StarCatalogue(direction, np.ones(200), np.ones(200)).direction.tobytes() == direction.tobytes()
    np.testing.assert_allclose(kc.tangent_basis(parsecs), kc.tangent_basis(direction), atol=1e-15)
    views = [kc.pictures.View(8, 8, 1.0, forward=(scale, scale, 0), up=(0, 0, scale)) for scale in (1.0, 1e9)]
    assert views[0].forward == pytest.approx(views[1].forward) and views[0].up == pytest.approx(views[1].up)


def test_vectors_without_a_direction_are_refused():
    for bad in ([0.0, 0.0, 0.0], [math.inf, 0.0, 0.0]):
        vectors = [[0.0, 0.0, 1.0], bad]
        with pytest.raises(ValueError, match=r"^Argument `direction` must hold finite"):
            kc.skies.StarCatalogue(vectors, [1.0, 2.0], [0.0, 0.0])
        with pytest.raises(ValueError, match=r"^Argument `n` must hold finite .* not zero, but vector 1 of 2"):
            kc.tangent_basis(vectors)
