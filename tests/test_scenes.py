"""Views, footprints, the checkerboard, light and colour, and the pictures that come of them."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scenes.colour import decoded, encoded, luminance, shifted_light, star_temperature
from kerrcaustics.scenes.disk.samples import DiskSamples
from kerrcaustics.scenes.footprint import bend, singular_values
from kerrcaustics.spacetime.sphere import from_angles, polar_basis

NEAR = kc.Camera(spin=0.999, radius=2.6)
FAR = kc.Camera(spin=0.0, radius=1e7, velocity="fiducial")
VIEWS = {
    "pinhole": kc.pictures.View(64, 40, 1.7, "pinhole", (-1, 0.3, 0.2), (0.1, 0, 1)),
    "fisheye": kc.pictures.View(64, 40, 3.0, "fisheye", (-1, 0.3, 0.2), (0.1, 0, 1)),
    "equirectangular": kc.pictures.View(64, 32, 2 * math.pi, "equirectangular", (-1, 0.3, 0.2), (0.1, 0, 1)),
}


class Plain(kc.skies.Sky):
    """A sky with one function of the direction, unfiltered."""

    def __init__(self, function):
        self.function = function

    def light(self, footprint, beaming, colour_shift):
        factor = footprint.redshift**4 if beaming else 1.0
        return np.repeat((self.function(footprint.direction) * factor)[:, None], 3, axis=1)


def identity_footprint(direction, size):
    """Round footprints of a size (radians)."""
    n = len(direction)
    return kc.skies.Footprint(direction, size * np.tile(np.eye(2), (n, 1, 1)), np.zeros(n), np.ones(n))


@pytest.mark.parametrize("name", VIEWS)
def test_places_and_directions_are_inverse(name):
    rng = np.random.default_rng(1)
    view = VIEWS[name]
    places = rng.uniform(0, 1, (500, 2)) * [view.width - 1, view.height - 1]
    sky, _ = view.directions(*places.T)
    assert np.abs(np.linalg.norm(sky, axis=1) - 1).max() < 1e-15
    assert np.abs(view.pixels(sky) - places).max() < 1e-10


@pytest.mark.parametrize("name", VIEWS)
def test_steps_are_the_derivatives(name):
    view = VIEWS[name]
    x, y = np.meshgrid(np.arange(view.width), np.arange(view.height))
    _, steps = view.directions(x, y)
    h = 1e-5
    along_x = (view.directions(x + h, y)[0] - view.directions(x - h, y)[0]) / (2 * h)
    along_y = (view.directions(x, y + h)[0] - view.directions(x, y - h)[0]) / (2 * h)
    assert np.abs(steps - np.stack([along_x, along_y], axis=-1)).max() < 1e-9


def test_pixels_of_a_whole_sky_fill_it():
    view = kc.pictures.View(400, 200, 2 * math.pi, "equirectangular")
    x, y = np.meshgrid(np.arange(400), np.arange(200))
    assert view.solid_angle(view.directions(x, y)[1]).sum() == pytest.approx(4 * math.pi, rel=3e-5)


def test_view_toward_the_hole_has_the_shadow_in_its_middle():
    view = kc.pictures.View.toward_hole(NEAR, 200, 200, 2.4, "fisheye")
    places = view.pixels(kc.shadow_edge(NEAR, 400))
    assert abs(places[:, 1].max() + places[:, 1].min() - 199) < 0.01
    assert abs(places[:, 0].max() + places[:, 0].min() - 199) < 6
    assert view.up == pytest.approx([0, 0, 1], abs=1e-12)


@pytest.mark.parametrize(
    ("argument", "values"),
    [
        ("width", {"width": 0}),
        ("height", {"height": 2.5}),
        ("projection", {"projection": "mercator"}),
        ("field_of_view", {"field_of_view": 3.1}),
        ("field_of_view", {"field_of_view": 6.2, "projection": "fisheye"}),
        ("field_of_view", {"field_of_view": 6.3, "projection": "equirectangular"}),
        ("forward", {"forward": (0, 0, 0)}),
        ("up", {"up": (2, 0, 0)}),
    ],
)
def test_view_refuses(argument, values):
    with pytest.raises(ValueError, match=f"Argument `{argument}` must"):
        kc.pictures.View(**{"width": 64, "height": 48, "field_of_view": 1.0, **values})


def test_footprint_axes_are_singular_values():
    rng = np.random.default_rng(2)
    matrix = rng.normal(size=(200, 2, 2))
    major, minor, angle = singular_values(matrix)
    u, s, _ = np.linalg.svd(matrix)
    assert np.abs(np.stack([major, minor], axis=-1) - s).max() < 1e-13
    along = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    assert np.abs(np.abs((along * u[:, :, 0]).sum(axis=-1)) - 1).max() < 1e-12


def test_bend_of_a_fold():
    # n' near (1, 0, 0) with theta' = pi/2 + c x^2 / 2: places x with a deviation of half a pixel spread over a strip.
    c, normal = 1e-4, np.random.default_rng(2).normal(size=400_000)
    spread = (c * (normal / 2) ** 2 / 2).std()
    curving = np.zeros((1, 3, 3))
    curving[0, 0] = [0, 0, -c]
    # A minor axis has half of itself for a deviation.
    assert bend(curving, np.array([[0.0, 0, 1]]))[0] == pytest.approx(2 * spread, rel=0.01)
    assert bend(curving, np.array([[0.0, 1, 0]]))[0] == 0


@pytest.mark.parametrize("along", ["latitude", "longitude"])
def test_swatches_are_averaged_over_their_box(along):
    board = kc.skies.Checkerboard(rows=7, columns=10, gap=0.3, along=along)
    centre, size = np.array([1.1, 2.9]), 0.4
    half = size * math.sqrt(3) / 2
    theta = centre[0] + half * (np.arange(400) + 0.5 - 200) / 200
    phi = centre[1] + half / math.sin(centre[0]) * (np.arange(400) + 0.5 - 200) / 200
    places = from_angles(*np.meshgrid(theta, phi)).reshape(-1, 3)
    fine = board.light(identity_footprint(places, 1e-9), False, False)
    coarse = board.light(identity_footprint(from_angles(*centre)[None], size), False, False)
    assert coarse[0] == pytest.approx(fine.mean(axis=0), abs=2e-3)


@pytest.mark.parametrize("along", ["latitude", "longitude"])
def test_swatches_have_no_seam_and_no_pinch(along):
    board = kc.skies.Checkerboard(along=along)
    theta = np.linspace(0.05, 3.1, 300)
    sides = [
        board.light(identity_footprint(from_angles(theta, phi), 0.03), False, False) for phi in (3.14159, -3.14159)
    ]
    assert np.abs(sides[0] - sides[1]).max() < 1e-3
    round_pole = board.light(identity_footprint(from_angles(1e-4, np.arange(60) * 0.1), 0.1), False, False)
    assert np.ptp(round_pole, axis=0).max() < 1e-12


def test_hues_run_with_longitude_and_brightness_alternates():
    board = kc.skies.Checkerboard(
        rows=6, columns=8, gap=0.2, colours=("#ff0000", "#00ff00", "#0000ff"), along="longitude"
    )
    theta, phi = (np.arange(6) + 0.5) * math.pi / 6, (np.arange(8) + 0.5) * math.pi / 4
    places = from_angles(*np.meshgrid(theta, phi, indexing="ij")).reshape(-1, 3)
    light = board.light(identity_footprint(places, 1e-6), False, False).reshape(6, 8, 3)
    assert light[::2] == pytest.approx(np.broadcast_to(light[0], (3, 8, 3)), abs=1e-9)
    # Every second swatch has half the light of the one below it.
    ratio = light[0].sum(axis=-1) / light[1].sum(axis=-1)
    assert ratio == pytest.approx(np.tile([2.0, 0.5], 4), rel=1e-6)
    assert light[0, 0].argmax() == 0 and light[0, 3].argmax() == 1 and light[1, 6].argmax() == 2
    gaps = board.light(identity_footprint(from_angles(theta, np.zeros(6)), 1e-6), False, False)
    assert gaps == pytest.approx(np.broadcast_to(gaps[0], gaps.shape), abs=1e-9) and gaps.min() > 0.85


def test_a_long_footprint_sees_the_mean_of_the_columns():
    board = kc.skies.Checkerboard(rows=5, columns=60, gap=0.2)
    matrix = np.array([[[1e-3, 0.0], [0.0, 0.8]]])
    direction = from_angles(np.array([math.pi / 2]), np.array([1.0]))
    seen = board.light(kc.skies.Footprint(direction, matrix, np.zeros(1), np.ones(1)), False, False)
    places = from_angles(math.pi / 2, np.linspace(0, 2 * math.pi, 6000))
    around = board.light(identity_footprint(places, 1e-6), False, False)
    assert np.ptp(around, axis=0).max() > 0.2
    assert seen[0] == pytest.approx(around.mean(axis=0), abs=0.02)


@pytest.mark.parametrize("ratio", [1.0, 1.2, 1.6, 2.5, 5.0, 12.0, 40.0])
@pytest.mark.parametrize("kind", ["latitude", "longitude", "picture"])
def test_a_long_footprint_sees_the_mean_of_round_ones(kind, ratio):
    """Along its major axis, by a Gaussian; those of more than 16 to 1 are widened."""
    rng = np.random.default_rng(3)
    picture = kc.skies.Panorama(rng.uniform(size=(256, 512, 3)))
    sky = picture if kind == "picture" else kc.skies.Checkerboard(along=kind)
    direction, major, minor = rng.normal(size=(500, 3)), 0.2, max(0.2 / ratio, 0.2 / 16)
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    turn, other = (
        np.moveaxis([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]], -1, 0) for a in rng.uniform(0, 6, (2, 500))
    )
    matrix = turn @ np.diag([major, 0.2 / ratio]) @ other
    seen = sky.light(kc.skies.Footprint(direction, matrix, np.zeros(500), np.ones(500)), False, False)
    spread = math.sqrt(major**2 - minor**2) / 2
    count = next(n for n in (1, 3, 5, 9, 17, 33) if 4 * spread / minor - 0.5 <= n - 1)
    place = np.linspace(-2, 2, count) if count > 1 else np.zeros(1)
    ahead = (np.stack(polar_basis(direction), axis=-1) @ turn[:, :, :1])[..., 0]
    probes = [np.cos(at) * direction + np.sin(at) * ahead for at in spread * place]
    size = minor if count > 1 else math.sqrt(minor * major)
    light = np.stack([sky.light(identity_footprint(probe, size), False, False) for probe in probes])
    weights = np.exp(-(place**2) / 2)
    assert seen == pytest.approx(np.tensordot(weights / weights.sum(), light, 1), rel=1e-9)


@pytest.mark.parametrize(
    "values", [{"rows": 1}, {"columns": 7}, {"gap": 1.0}, {"colours": ("red",)}, {"colours": ()}, {"along": "x"}]
)
def test_checkerboard_refuses(values):
    with pytest.raises(ValueError, match="must"):
        kc.skies.Checkerboard(**values)


@pytest.mark.slow
def test_far_from_a_hole_the_sky_is_itself():
    view = kc.pictures.View(48, 32, 1.2, forward=(1, 0.2, 0.1))
    scene = kc.render(FAR, view, Plain(lambda n: 2 + n[:, 0] + 3 * n[:, 1] * n[:, 2]))
    x, y = np.meshgrid(np.arange(48), np.arange(32))
    # The camera basis is (e_r, e_phi, -e_theta), which are x, y, z of the celestial sphere here.
    n, _ = view.directions(x, y)
    assert scene.light[..., 0] == pytest.approx(2 + n[..., 0] + 3 * n[..., 1] * n[..., 2], abs=3e-6)
    assert scene.visible_fraction.min() == 1


@pytest.mark.slow
def test_pixels_on_the_shadow_edge_are_covered_in_part():
    view = kc.pictures.View.toward_hole(NEAR, 96, 96, math.radians(150), "fisheye")
    scene = kc.render(NEAR, view, Plain(lambda n: np.ones(len(n))))
    assert scene.light[..., 1] == pytest.approx(scene.visible_fraction, abs=1e-6)
    places = view.pixels(kc.shadow_edge(NEAR, 4000))
    x, y = places.T
    area = abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) / 2
    assert (1 - scene.visible_fraction).sum() == pytest.approx(area, rel=2e-3)
    partly = (scene.visible_fraction > 0) & (scene.visible_fraction < 1)
    assert 100 < partly.sum() < 300
    assert scene.supersampled >= partly.sum()


def test_beaming_is_the_fourth_power_of_the_redshift():
    view = kc.pictures.View(12, 8, 1.0, forward=(1, -0.5, 0))
    plain = kc.render(NEAR, view, Plain(lambda n: np.ones(len(n))))
    beamed = kc.render(NEAR, view, Plain(lambda n: np.ones(len(n))), beaming=True)
    x, y = np.meshgrid(np.arange(12), np.arange(8))
    ratio = kc.trace_rays(NEAR, view.directions(x, y)[0], redshift=True).redshift
    assert beamed.light[..., 0] == pytest.approx(ratio**4 * plain.light[..., 0], rel=1e-6)


def test_daylight_is_white_and_cooler_is_redder():
    assert kc.pictures.black_body(6504.0) == pytest.approx([1, 1, 1], abs=1e-12)
    assert kc.pictures.black_body(4500.0, white=4500.0) == pytest.approx([1, 1, 1], abs=1e-12)
    warm, cold = kc.pictures.black_body(3000.0), kc.pictures.black_body(12000.0)
    assert warm[0] > warm[1] > warm[2] and cold[0] < cold[1] < cold[2]
    assert star_temperature(0.65) == pytest.approx(5778, abs=5)


@pytest.mark.parametrize(
    ("temperature", "x", "y", "fit"),
    [(3000.0, 0.4369, 0.4041, 0.013), (4500.0, 0.3608, 0.3635, 0.005), (10000.0, 0.2807, 0.2884, 0.004)],
)
def test_colour_of_a_black_body_against_the_planckian_locus(temperature, x, y, fit):
    """Linear sRGB (IEC 61966-2-1) of chromaticities (x, y) from the tabulated CIE 1931 functions; fit: measured."""
    to_srgb = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
    # The white is that of 6504 K.
    body, white = (to_srgb @ (x, y, 1 - x - y) for x, y in ((x, y), (0.3135, 0.3236)))
    found, expected = kc.pictures.black_body(temperature), body / white
    assert found / found[1] == pytest.approx(expected / expected[1], rel=1.4 * fit)


def test_shift_of_a_black_body_is_another_black_body():
    ratio = np.array([0.6, 1.0, 1.7])
    both = shifted_light(ratio, True, True, 5000.0)
    assert both * kc.pictures.black_body(5000.0) == pytest.approx(kc.pictures.black_body(5000.0 * ratio))
    colour = shifted_light(ratio, False, True, 5000.0) * kc.pictures.black_body(5000.0)
    assert luminance(colour) == pytest.approx(np.full(3, luminance(kc.pictures.black_body(5000.0))))
    assert shifted_light(ratio, True, False)[:, 1] == pytest.approx(ratio**4)
    assert (shifted_light(ratio, False, False) == 1).all()


def of_film(temperature):
    """A finer sum over more of Planck's law."""
    wavelength = np.linspace(250e-9, 1000e-9, 20_001)
    layers = np.exp(-(((wavelength - np.array([[640e-9], [545e-9], [445e-9]])) / 25e-9) ** 2) / 2)
    return layers @ (wavelength**-5 / np.expm1(0.01438776877 / (wavelength * temperature)))


def test_film_has_a_white_and_sees_the_hotter_bluer():
    assert kc.pictures.black_body(6504.0, response="film") == pytest.approx([1, 1, 1], abs=1e-12)
    assert kc.pictures.black_body(3200.0, white=3200.0, response="film") == pytest.approx([1, 1, 1], abs=1e-12)
    light = kc.pictures.black_body(np.geomspace(1500, 30000, 40), response="film")
    assert (light > 0).all() and (np.diff(light[:, 2] / light[:, 0]) > 0).all() and (np.diff(light, axis=0) > 0).all()
    for temperature in (3000.0, 10000.0):
        expected = of_film(temperature) / of_film(6504.0)
        # The sum's edges, and the table of temperatures: 2.3e-4 measured.
        assert kc.pictures.black_body(temperature, response="film") == pytest.approx(expected, rel=4e-4)
    # Blue is what the eye's functions and the film's distinguish.
    assert kc.pictures.black_body(3000.0, response="film")[2] > 1.15 * kc.pictures.black_body(3000.0)[2]


@pytest.mark.slow
@pytest.mark.parametrize("response", ["cie", "film"])
def test_what_shines_goes_by_its_response(response):
    """Disks, spots and stars: seen with a frequency ratio, black bodies are black bodies."""
    ratio, one = np.array([0.6, 1.0, 1.7]), np.ones(3)
    samples = DiskSamples(
        10 * one, 0 * one, 0.5 * one, np.full((3, 2, 2), 1e-12), ratio, 5.0, 0.5, 0 * one, np.zeros_like
    )
    shining = kc.disks.BlackBody(5000.0, response), kc.disks.PowerLaw(5000.0, response=response)
    for emission in (*shining, kc.disks.Spots([10.0], [0.0], 5000.0, response=response)):
        seen = emission.light(samples, True, True)
        assert seen == pytest.approx(kc.pictures.black_body(5000.0 * ratio, response=response), rel=1e-6)
    assert kc.disks.PageThorne(5000.0, response).light(samples, True, True)[0].argmax() == 0
    both = shifted_light(ratio, True, True, 5000.0, response) * kc.pictures.black_body(5000.0, response=response)
    assert both == pytest.approx(kc.pictures.black_body(5000.0 * ratio, response=response))
    star = kc.skies.StarCatalogue(np.array([[1.0, 0, 0]]), np.zeros(1), np.full(1, 1.5))
    colour = kc.pictures.black_body(star_temperature(1.5), response=response)
    field = kc.skies.StarField(star, np.eye(3), band=0, response=response)
    view = kc.pictures.View(16, 16, 0.1, forward=(1, 0, 0))
    seen = kc.render(FAR, view, field).light.sum(axis=(0, 1))
    assert seen / seen[1] == pytest.approx(colour / colour[1], rel=1e-5)


@pytest.mark.parametrize(
    "make",
    [
        lambda response: kc.pictures.black_body(5000.0, response=response),
        lambda response: kc.disks.BlackBody(5000.0, response),
        lambda response: kc.disks.PageThorne(5000.0, response),
        lambda response: kc.disks.PowerLaw(5000.0, response=response),
        lambda response: kc.disks.Spots([10.0], [0.0], response=response),
        lambda response: kc.disks.Wisps(5000.0, 9.0, 18.0, response=response),
        lambda response: kc.disks.Volume(1.0, 5000.0, 9.0, 18.0, response=response),
        lambda response: kc.skies.StarField(response=response),
    ],
)
def test_other_responses_are_refused(make):
    with pytest.raises(ValueError, match="Argument `response` must be one of cie, film, but is 'eye'"):
        make("eye")


def test_tone_curves():
    values = np.linspace(0, 1, 256)
    assert encoded(decoded(values)) == pytest.approx(values, abs=1e-4)
    picture = kc.pictures.tone_mapped(np.array([[0, 0, 0], [1, 1, 1], [9, 0.5, 0.1]]), 1.0, curve="asinh", softening=10)
    assert picture.dtype == np.uint8
    assert picture[0].tolist() == [0, 0, 0] and picture[1].tolist() == [255, 255, 255]
    assert picture[2, 0] == 255 and picture[2, 0] >= picture[2, 1] >= picture[2, 2]
    grey = kc.pictures.tone_mapped(np.full((1, 3), 0.01), 1.0, curve="asinh", softening=10)
    assert decoded(grey / 255)[0, 0] == pytest.approx(math.asinh(0.1) / math.asinh(10), abs=2e-3)
    for bad in ({"exposure": 0.0}, {"curve": "log"}, {"softening": -1.0}):
        with pytest.raises(ValueError, match="Argument"):
            kc.pictures.tone_mapped(np.zeros((1, 3)), **bad)


@pytest.mark.slow
def test_a_traced_view_serves_many_skies_that_turn():
    view = kc.pictures.View.toward_hole(NEAR, 48, 32, 2.2)
    traced = kc.pictures.trace_view(NEAR, view)
    angle = 2 * math.pi / kc.skies.Checkerboard().columns
    # Swatches are in turn light and dark: two of them on, the sky is the same.
    for sky in (kc.skies.Checkerboard(), kc.skies.TurnedSky(kc.skies.Checkerboard(), 2 * angle)):
        assert np.allclose(traced.show(sky).light, kc.render(NEAR, view, kc.skies.Checkerboard()).light, atol=1e-6)
    turned = traced.show(kc.skies.TurnedSky(Plain(lambda n: 1 + n[:, 0]), 0.3)).light
    expected = traced.show(Plain(lambda n: 1 + math.cos(0.3) * n[:, 0] + math.sin(0.3) * n[:, 1])).light
    assert np.allclose(turned, expected, atol=1e-6)
    both = {"beaming": True, "colour_shift": True}
    assert np.allclose(
        traced.show(kc.skies.Checkerboard(), **both).light, kc.render(NEAR, view, kc.skies.Checkerboard(), **both).light
    )
    with pytest.raises(ValueError, match="Argument `sky` needs a view that was traced with it"):
        kc.pictures.trace_view(NEAR, view, sky=False).show(kc.skies.Checkerboard())
    with pytest.raises(ValueError, match="Argument `quality` must be one of draft, normal, high"):
        kc.pictures.trace_view(NEAR, view, quality="best")


@pytest.mark.parametrize("along", ["latitude", "longitude"])
def test_a_checkerboard_is_nowhere_darker_than_black(along):
    assert (
        kc.skies.celestial_picture(
            kc.skies.Checkerboard(colours=("#000000", "#ffffff", "#ff0000"), along=along), 64
        ).min()
        >= 0
    )


def test_a_star_on_the_seam_of_a_whole_sky_keeps_its_light():
    sums = []
    for phi in (0.0, 1.0, -1e-3):
        star = kc.skies.StarCatalogue(from_angles(np.array([1.4]), phi), np.zeros(1), np.zeros(1))
        sums.append(kc.skies.celestial_picture(kc.skies.StarField(star, np.eye(3), band=0), 90).sum())
    assert sums == pytest.approx([sums[1]] * 3, rel=1e-12)


@pytest.mark.parametrize("sky", [kc.skies.Checkerboard(), kc.skies.StarField()], ids=["board", "stars"])
def test_a_picture_of_the_shadow_alone_is_black(sky):
    """No cell of its map sees the sky: at rest, and while the camera moves."""
    cameras = [kc.Camera(0.9, radius, 1.3, "fiducial") for radius in (3.0, 3.01, 3.02)]
    views = [kc.pictures.View.toward_hole(camera, 24, 14, 1.0) for camera in cameras]
    motion = kc.pictures.ShutterMotion((cameras[0], cameras[2]), (views[0], views[2]))
    for how in ({}, {"quality": "draft"}, {"motion": motion}, {"beaming": True, "colour_shift": True}):
        rendering = kc.render(cameras[1], views[1], sky, **how)
        assert not rendering.light.any() and not rendering.visible_fraction.any()
