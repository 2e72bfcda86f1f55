"""Refusals of public functions: a ValueError of one line that names the argument and what it must be."""

import inspect
import math

import jaxtyping
import numpy as np
import pytest
from offenders import for_each
from public import PUBLIC

import kerrcaustics as kc
from kerrcaustics.spacetime.checks import differing_digits, quoted
from kerrcaustics.sweeps.scene import Scene

CAMERA = kc.Camera(0.9, 10.0)
VIEW = kc.pictures.View(8, 8, 1.0)
LIGHT = np.zeros((4, 8, 3))
MAP = kc.skies.Panorama(LIGHT)
BAD = [
    (lambda: kc.render(CAMERA, None, None), "`view` must be a View or a Screen, but is NoneType."),
    (
        lambda: kc.render(CAMERA, VIEW, "stars"),
        "`sky` must be a `kerrcaustics.skies.Sky`, but is 'stars'.",
    ),
    (
        lambda: kc.render(CAMERA, VIEW, kc.skies.Checkerboard),
        "`sky` must be a `kerrcaustics.skies.Sky`, but is <class",
    ),
    (lambda: kc.caustic_tubes(CAMERA, radii=3), "`radii` must fall from math.inf to a radius outside the horizon, but"),
    (
        lambda: kc.follow_star([CAMERA], (80, 20)),
        "but is [80.0, 20.0] (80 degrees are 1.39626 radians).",
    ),
    (lambda: kc.render(None, VIEW), "`camera` must be a Camera or an Observer, but is NoneType."),
    (lambda: kc.pictures.trace_view(CAMERA, LIGHT), "`view` must be a View or a Screen, but is ndarray."),
    (
        lambda: kc.pictures.trace_view(CAMERA, VIEW, quality=LIGHT),
        "`quality` must be one of draft, normal, high, but is array",
    ),
    (lambda: kc.pictures.render_volume(CAMERA, VIEW, None), "`volume` must be a Volume, but is NoneType."),
    (
        lambda: kc.skies.celestial_picture(None, 8),
        "`sky` must be a `kerrcaustics.skies.Sky`, but is None.",
    ),
    (
        lambda: kc.skies.TurnedSky(None, 0.1),
        "`sky` must be a `kerrcaustics.skies.Sky`, but is None.",
    ),
    (lambda: kc.pictures.black_body(-5), "`temperature` must be from 0 kelvin on, but is -5."),
    (lambda: kc.pictures.black_body("x"), "`temperature` must hold numbers, but is 'x'."),
    (lambda: kc.pictures.black_body([300.0, math.nan]), "`temperature` must be from 0 kelvin on, but is [300.0, nan]."),
    (lambda: kc.pictures.black_body(300.0, response=None), "`response` must be one of cie, film, but is None."),
    (lambda: kc.pictures.tone_mapped("x"), "`light` must hold numbers, but is 'x'."),
    (lambda: kc.pictures.tone_mapped(np.zeros((2, 5))), "`light` must have the shape (..., 3), but has (2, 5)."),
    (
        lambda: kc.pictures.tone_mapped(LIGHT, exposure=math.inf),
        "`exposure` must be a positive, finite number, but is inf.",
    ),
    (lambda: kc.skies.Panorama("x"), "`light` must hold numbers, but is 'x'."),
    (lambda: kc.skies.Panorama(LIGHT, "x"), "`orientation` must hold numbers, but is 'x'."),
    (lambda: kc.skies.Panorama(LIGHT, aspect=math.inf), "`aspect` must be a finite number from 1 on, but is inf."),
    (lambda: kc.disks.Texture({}), "`light` must hold numbers, but is {}."),
    (lambda: kc.skies.Checkerboard(colours=None), "`colours` must be a list of one colour or more, but is None."),
    (lambda: kc.skies.Checkerboard(gap_colour="red"), "`gap_colour` must look like \"#rrggbb\", but is 'red'."),
    (
        lambda: kc.disks.Disk(6.0, math.inf, kc.disks.BlackBody(4500)),
        "`outer` must be a positive, finite radius, but is inf.",
    ),
    (lambda: kc.EquatorialPlane(1, []), "`emitter` must be one of circular, retrograde, static, fiducial, plunging"),
    (lambda: kc.isoradials(CAMERA, [6.0], motion="up"), "`motion` must be one of circular, retrograde, static, fid"),
    (lambda: kc.skies.StarCatalogue([1.0], [1.0], [1.0]), "`direction` must have the shape (n, 3), but has (1,)."),
    (lambda: kc.skies.StarCatalogue([[1.0, 0, 0]], [1.0, 2.0], [1.0]), "`magnitude` must hold one for each of 1 stars"),
    (lambda: kc.skies.merged_catalogues(None, None), "`first` must be a StarCatalogue, but is NoneType."),
    (lambda: kc.crossings_of_line(None, 0.1), "`images` must be a CircleImages, but is NoneType."),
    (lambda: kc.save("no/such/x.npz", CAMERA), "`path` must lie in a folder that exists, but 'no/such' is none."),
    (lambda: kc.save("no/x.npz", CAMERA), "`path` must lie in a folder that exists, but 'no' is none."),
    (lambda: kc.save("", CAMERA), "`path` must be the name of a file, but is ''."),
    (lambda: kc.save(None, CAMERA), "`path` must be the name of a file, but is None."),
    (lambda: kc.load(None), "`path` must be the name of a file, but is None."),
    (lambda: kc.read_scene(None), "`path` must be the name of a file, but is None."),
    (lambda: kc.read_scene(3.5), "`path` must be the name of a file, but is 3.5."),
    (
        lambda: kc.skies.save_sky("no/x.fits", np.zeros((4, 8, 3))),
        "`path` must lie in a folder that exists, but 'no' is none.",
    ),
    (lambda: kc.record(CAMERA, camera="x"), "`camera` must be a Camera or an Observer, but is str."),
    (lambda: kc.render(CAMERA, VIEW, time="x"), "`time` must be a finite number, but is 'x'."),
    (lambda: kc.light_curve(CAMERA, 6.0, 0), "`times` must be a whole number from 1 to 1000000, but is 0."),
    (lambda: kc.light_curve(CAMERA, 6.0, "x"), "`times` must be a whole number, or finite times, but is 'x'."),
    (lambda: kc.light_curve(CAMERA, math.inf), "`orbit` must be a finite number, but is inf."),
    (lambda: kc.light_curve(CAMERA, "isco"), "`orbit` must be a finite number, but is 'isco'."),
    (lambda: kc.caustics(0.9, 10.0), "`camera` must be a Camera or an Observer, but is float."),
    (lambda: kc.save(".", CAMERA), "`path` must name a file, but '.' is a folder."),
    (
        lambda: kc.Camera(-0.5, 10.0),
        "`spin` must lie in [0, 1), but is -0.5: the mirror image, spin 0.5 with azimuths and velocities along phi of",
    ),
    (
        lambda: kc.isco(-0.5),
        'is such a hole; orbits and disks against the spin have motion "retrograde".',
    ),
    (lambda: kc.isco([0.1, 1.0]), "`spin` must lie in [0, 1), but is 1.0."),
    (
        lambda: kc.Camera(0.9, 4e10),
        "`radius` must be at most 1e+09, but is 4e+10: farther away, take an Observer at radius inf",
    ),
    (
        lambda: kc.Camera(0.9, math.inf),
        "`radius` must be a finite number, but is inf: farther away, take an Observer at radius inf",
    ),
    (lambda: MAP.to_healpix(3), "`nside` must be a power of two, but is 3: take 4."),
    (
        lambda: kc.skies.Panorama.from_healpix(np.ones(108)),
        "`values` must be a map whose nside is a power of two, but that is 3: healpy.ud_grade brings a map to 4.",
    ),
    (lambda: kc.skies.Panorama.read("sky.tif"), "but is 'sky.tif': other pictures can be converted, TIFF files to"),
    (lambda: kc.magnification(CAMERA, (1.4, 0.3), 0.1, profile=[[]]), '`profile` must be "uniform", ("linear", u)'),
]


SKY, GLOW = np.array([[-0.6, 0.5, 0.4]]), kc.disks.Volume(0.1, 6504.0, inner=5.0, outer=8.0)
CHECKED = kc.skies.Checkerboard()
# Functions with arguments that are true or false, and arguments with which they work.
FLAGS = {
    "trace_rays": (kc.trace_rays, {"camera": CAMERA, "sky": SKY}),
    "trace_beams": (kc.trace_beams, {"camera": CAMERA, "sky": SKY}),
    "ray_paths": (kc.ray_paths, {"camera": CAMERA, "sky": SKY}),
    "isco": (kc.isco, {"spin": 0.9}),
    "image_counts": (kc.image_counts, {"camera": CAMERA, "stars": [(1.4, 0.3)]}),
    "render": (kc.render, {"camera": CAMERA, "view": VIEW}),
    "render_volume": (kc.pictures.render_volume, {"camera": CAMERA, "view": VIEW, "volume": GLOW}),
    "trace_view": (kc.pictures.trace_view, {"camera": CAMERA, "view": VIEW}),
    "celestial_picture": (kc.skies.celestial_picture, {"sky": CHECKED, "height": 8}),
    "save_sky": (kc.skies.save_sky, {"path": "sky.fits", "light": LIGHT}),
    "with_glare": (kc.pictures.with_glare, {"light": LIGHT, "spread": np.ones((3, 3))}),
    "record": (kc.record, {"result": CAMERA}),
    "sweep": (kc.sweep, {"scene": Scene(0.5, 6.0), "path": "none/s.zarr"}),
}
# Of classes, which hold arguments that are none as well.
FIELDS = [
    (kc.disks.Disk, "slant", {"inner": 6.0, "outer": 9.0, "emission": kc.disks.BlackBody(4500.0)}),
    (kc.disks.Texture.read, "mirror", {"path": "no.png"}),
    (kc.disks.Spots, "retrograde", {"radius": 8.0, "azimuth": 0.1, "temperature": 4000.0, "size": 0.1}),
    (kc.skies.Panorama, "mirror", {"light": LIGHT}),
    (kc.skies.Panorama.read, "mirror", {"path": "no.png"}),
]


def flag_names(function):
    return [name for name, one in inspect.signature(function).parameters.items() if one.annotation is bool]


def test_arguments_that_are_true_or_false_are_not_taken_for_their_truth():
    """Of all public functions, and of classes: as users have them, without checks of types."""
    jaxtyping.config.update("jaxtyping_disable", True)
    functions = {name: one for name, one in PUBLIC.items() if inspect.isfunction(one) and flag_names(one)}
    assert set(functions) == set(FLAGS)
    calls = [(function, name, given) for function, given in FLAGS.values() for name in flag_names(function)]
    for function, name, given in calls + FIELDS:
        for value in ("no", 2, [True, 1.5]):
            with pytest.raises(ValueError, match=rf"^Argument `{name}` must (be|hold) True or False, but is "):
                function(**given, **{name: value})
    assert kc.isco(0.9, prograde=np.bool_(False)) == kc.isco(0.9, prograde=False)


@pytest.mark.parametrize(
    "call",
    [
        lambda: kc.magnification(None, (1.4, 0.3), 0.1),
        lambda: kc.magnification(CAMERA, (6.0, 0.3), 0.1, end=kc.EquatorialPlane(1)),
        lambda: kc.amplification(None, (1.4, 0.3), [1.0]),
        lambda: kc.diffraction_pattern(None, ((1.5, 1.6), (3.1, 3.2)), 5.0),
    ],
    ids=["magnification", "magnification in the plane", "amplification", "diffraction_pattern"],
)
def test_a_viewer_is_called_as_the_function_calls_it(call):
    with pytest.raises(ValueError, match=r"^Argument `viewer` must "):
        call()


def test_whole_numbers_that_no_memory_holds_are_refused():
    for number in (2**31, 2**63, 10**400):
        with pytest.raises(ValueError, match=r"^Argument `n` must be a whole number from 1 to 1000000, but is "):
            kc.shadow_edge(CAMERA, number)
        with pytest.raises(ValueError, match=r"^Argument `crossing` must be a whole number from 1 to 1000000, but is "):
            kc.EquatorialPlane(number)


PLACE, NEAR = (0.9, 10.0, 1.2), np.ones((4, 3))
MISFITS = [
    ("sky", lambda: kc.functional.direction([0.1, 0.2], 10.0, 1.2, np.ones((3, 3)))),
    ("radius", lambda: kc.functional.travel_time([0.1, 0.2], [10.0, 9.0, 8.0], 1.2, np.ones(3))),
    ("near", lambda: kc.functional.images(*PLACE, np.ones((2, 2)), np.ones((3, 4, 3)), np.zeros((3, 4), int))),
    ("index", lambda: kc.functional.images(*PLACE, (1.4, 0.3), NEAR, [0, 1, 2])),
    ("near", lambda: kc.functional.event_time(*PLACE, np.ones((2, 2, 2)), np.ones((3, 3)))),
    ("size", lambda: kc.functional.magnification(*PLACE, np.ones((2, 2)), [0.1] * 3, NEAR, [0, 0, 0, 0], NEAR)),
    ("velocity", lambda: kc.functional.direction(*PLACE, np.ones(3), velocity=np.array([0.1, 2.0, 0.1]))),
    ("velocity", lambda: kc.functional.direction(*PLACE, np.ones(3), velocity="round")),
]


@for_each("name", "call", rows=MISFITS)
def test_arguments_of_functional_that_do_not_fit_are_named(name, call):
    with pytest.raises(ValueError, match=rf"^Argument `{name}` must "):
        call()


@for_each("call", "words", rows=BAD)
def test_bad_arguments_are_named(call, words):
    with pytest.raises(ValueError, match=r"^Argument `\w+` must ") as caught:
        call()
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_values_in_messages():
    assert [quoted(value) for value in (-0.0, np.float64(-0.0), np.int64(3), "a\nb", None)] == [
        "0.0",
        "0.0",
        "3",
        "'a\\nb'",
        "None",
    ]
    assert "\n" not in quoted(np.zeros((9, 9))) and len(quoted(np.zeros((9, 9)))) < 90
    assert quoted(10**5000) == "a number of very many digits"


def test_a_number_differs_from_its_limit():
    horizon = 1 + math.sqrt(0.75)
    assert differing_digits(horizon, math.nextafter(horizon, 2)) == ("1.8660254037844386", "1.8660254037844388")
    assert differing_digits(1.5, horizon) == ("1.5", "1.86602540378")
    assert differing_digits(2.0, 2.0) == ("2", "2")
    with pytest.raises(ValueError, match=r"the horizon radius 1\.86602540378443\d+, but is 1\.86602540378443\d+\."):
        kc.Camera(0.5, math.nextafter(horizon, 0))
    with pytest.raises(ValueError, match=r"the horizon radius 2, but is 0\."):
        kc.Camera(0.0, -0.0)
