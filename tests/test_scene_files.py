"""Scene files: what they say, how cameras move in them, what is refused, and pictures of some."""

import importlib
import json
import math
import pickle
import re
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command_line import run
from marks import few
from matplotlib.figure import Figure
from matplotlib.path import Path as Outline
from offenders import for_each
from PIL import Image
from scipy.integrate import solve_ivp

import kerrcaustics as kc
from kerrcaustics.cli.render import LEFT_OUT
from kerrcaustics.draw.palettes import INDEX_ON_BLACK
from kerrcaustics.orbits.geodesics import circular_velocity, free_fall
from kerrcaustics.orbits.moving_place import fido_velocity
from kerrcaustics.results.stages import stage
from kerrcaustics.scene_files import contents, renderer, scene_file
from kerrcaustics.scene_files.expressions import Moment, formula
from kerrcaustics.scene_files.templates import first_lines, template_text
from kerrcaustics.scenes.disk.turned import turned_disk
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.sweeps.scene import Scene

DOCS = Path(__file__).parents[1] / "docs"
PLAIN = """
[hole]
spin = 0.6
[camera]
radius = 20
[view]
width = 64
height = 36
field_of_view_deg = 60
"""
DISK = """
[disk]
inner = 5
outer = 12
emission = {kind = "black-body", peak = 4500}
"""
ON_A_PATH = """
[hole]
spin = 0.6
[view]
width = 64
height = 36
[film]
frames = 10
start = 0
end = 50
[camera.path]
"""


@pytest.fixture
def scene(tmp_path):
    """A scene file from text, read with some changes."""

    def made(text, *changes):
        (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
        return kc.SceneFile.read(tmp_path / "scene.toml", changes)

    return made


def four_velocity(camera):
    """Components (t, r, theta, phi) of a camera's velocity, from that which the fiducial observer measures."""
    at = kerr.metric(camera.spin, camera.radius, camera.cos_theta)
    v = camera.fido_velocity()
    gamma = 1 / math.sqrt(1 - np.dot(v, v))
    root = math.sqrt(at.sigma)
    scale = at.cylindrical_scale * camera.sin_theta
    along_phi = at.shift / at.lapse + v[2] / scale
    return gamma * np.array([1 / at.lapse, v[0] * math.sqrt(at.delta) / root, v[1] / root, along_phi])


def metric(spin, r, theta):
    """g_mu_nu (4, 4) in Boyer-Lindquist coordinates, as textbooks write it."""
    sigma, delta = r**2 + (spin * np.cos(theta)) ** 2, r**2 - 2 * r + spin**2
    s = np.sin(theta) ** 2
    g = np.diag([-(1 - 2 * r / sigma), sigma / delta, sigma, s * (r**2 + spin**2 + 2 * spin**2 * r * s / sigma)])
    g[0, 3] = g[3, 0] = -2 * spin * r * s / sigma
    return g


def constants(camera):
    """u . u, E, L_z and Q of a camera."""
    g, u = metric(camera.spin, camera.radius, camera.inclination), four_velocity(camera)
    p = g @ u
    axial = (p[3] / camera.sin_theta) ** 2 + camera.spin**2 * (1 - p[0] ** 2)
    return np.array([u @ g @ u, -p[0], p[3], p[2] ** 2 + camera.cos_theta**2 * axial])


def test_a_scene_says_size_frames_and_moments(scene):
    plain = scene(PLAIN)
    assert (plain.size, plain.frames, plain.rate, plain.moment(0)) == ((64, 36), 1, 24, 0.0)
    film = scene(PLAIN + "[film]\nduration = 2.5\nrate = 20\nstart = 10\nend = 60\n")
    assert film.frames == 50 and film.moment(0) == 10 and film.moment(49) == 59
    for number in (-1, 50, 1.5):
        with pytest.raises(ValueError, match="Argument `number` must be a whole number from 0 to 49"):
            film.moment(number)


def test_the_record_says_what_frames_depend_on_and_no_more(scene, tmp_path):
    Image.new("RGB", (8, 4), "red").save(tmp_path / "sky.png")
    text = f'title = "one"\n{PLAIN}[sky]\nkind = "panorama"\nfile = "sky.png"\n'
    first = scene(text).record()
    assert json.loads(json.dumps(first)) == first
    assert scene(text.replace("one", "other")).record() == first
    assert scene(text, "camera.radius=21").record() != first
    Image.new("RGB", (8, 4), "blue").save(tmp_path / "sky.png")
    assert scene(text).record() != first


def test_a_scene_can_be_sent_to_other_processes(scene, tmp_path):
    Image.new("RGB", (8, 4), "red").save(tmp_path / "sky.png")
    here = scene(PLAIN + DISK + '[sky]\nkind = "panorama"\nfile = "sky.png"\n')
    there = pickle.loads(pickle.dumps(here))
    assert there.record() == here.record() and there.camera(0) == here.camera(0)


def lit_at(sky, direction, redshift=1.0):
    """Light (n, 3) of what is spread over a sky, in directions (n, 3), shifted and beamed where they are."""
    count, shifted = len(direction), redshift != 1
    matrix = 1e-3 * np.tile(np.eye(2), (count, 1, 1))
    around = kc.skies.Footprint(direction, matrix, np.zeros(count), np.full(count, redshift))
    return sky.light(around, shifted, shifted)


def test_a_picture_beside_the_stars(scene, tmp_path):
    values = np.zeros((32, 64, 3), np.uint8)
    values[15:17, 31:33, 0] = values[:3, :, 2] = values[8:10, 31:33] = 255
    Image.fromarray(values).save(tmp_path / "sky.png")
    stars = '[sky]\nkind = "stars"\nband = 0\nnebulae = {file = "sky.png"}\n'
    plain = scene(PLAIN + stars).matter.sky
    assert len(plain.points.direction) == 37622
    middle_and_pole = np.array([[-1.0, 0, 0], [0, 0, 1.0]])
    assert lit_at(plain, middle_and_pole) == pytest.approx(np.array([[100.0, 0, 0], [0, 0, 100.0]]), abs=5)
    bright = scene(PLAIN + stars, "sky.nebulae.brightness=70", "sky.nebulae.orientation_deg=[0, 90, 0]").matter.sky
    assert lit_at(bright, np.array([[-1.0, 0, 0], [0, 0, -1]])) == pytest.approx(
        np.array([[0, 0, 70.0], [70.0, 0, 0]]), abs=4
    )
    galaxy = scene(PLAIN + stars, "sky.nebulae.frame=galaxy", "sky.galaxy_tilt_deg=40").matter.sky
    assert lit_at(galaxy, -galaxy.galaxy[:, :1].T) == pytest.approx(np.array([[100.0, 0, 0]]), abs=5)
    for spectrum, factor in (("-1", [16.0] * 3), ("[0, 1, 2]", [8.0, 4, 2]), ("[[300, 1], [2000, 1]]", [32.0] * 3)):
        sky = scene(PLAIN + stars, f"sky.nebulae.spectrum={spectrum}").matter.sky.nebulae
        white = from_angles(math.radians(9 * 180 / 32), math.pi)[None]
        assert lit_at(sky, white, 2.0) / lit_at(sky, white) == pytest.approx(np.array([factor]), rel=1e-4)
    assert galaxy.galaxy[2, 2] == pytest.approx(math.cos(math.radians(40)))


@pytest.mark.parametrize("kind", ["stars", "checkerboard", "panorama"])
def test_a_sky_at_a_finite_radius(kind, scene, painted, tmp_path):
    Image.new("RGB", (8, 4)).save(tmp_path / "sky.png")
    file = 'file = "sky.png"' if kind == "panorama" else ""
    for more, radius in (("", math.inf), ("radius = 80", 80.0)):
        scene(f'{PLAIN}[sky]\nkind = "{kind}"\n{file}\n{more}\n').rendering(0)
        assert painted[-1]["sky_radius"] == radius
    moving = 'path = {kind = "expressions", radius = "20 + 0.5 * t", inclination_deg = 90}'
    film = PLAIN.replace("radius = 20", moving) + "[film]\nframes = 3\nend = 15\n"
    with pytest.raises(ValueError, match=r"sky.radius must be larger than the radius of the camera, 22.5, but is 22\."):
        scene(f'{film}[sky]\nkind = "{kind}"\n{file}\nradius = 22\n')


def test_one_word_reads_both_kinds_of_scenes(scene, tmp_path):
    scene(PLAIN)
    assert isinstance(kc.read_scene(tmp_path / "scene.toml"), kc.SceneFile)
    (tmp_path / "sweep.toml").write_text("spin = 0.5\nradius = 6")
    assert isinstance(kc.read_scene(tmp_path / "sweep.toml"), Scene)


@pytest.mark.parametrize("name", first_lines())
def test_templates_are_scenes(name, scene):
    read = scene(template_text(name))
    for number in (0, read.frames // 2, read.frames - 1):
        time = read.moment(number)
        assert read.camera(time).radius > 1 and read.view(time, 0.1).width == round(read.size[0] / 10)


def test_the_examples_of_the_page_are_a_scene_and_a_film(scene):
    page = (DOCS / "scene_files.md").read_text(encoding="utf-8")
    still, film = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)[:2]
    # The first page counts its lines.
    assert scene(still).size == (1600, 800) and len(still.splitlines()) == 14
    loop = scene(film)
    assert loop.frames == 32 and loop.span[1] == pytest.approx(2 * math.pi)


def test_all_keys_are_described(monkeypatch):
    monkeypatch.syspath_prepend(DOCS)
    from kerrcaustics.scene_files import key_tables as scene_keys

    keys = {(path, table): set(table.__struct_fields__) for path, table in scene_keys.tables()}
    assert len(keys) > 25 and sum(map(len, keys.values())) > 120
    undescribed = {path: own ^ set(scene_keys.described(table)) for (path, table), own in keys.items()}
    assert not any(undescribed.values()), undescribed
    assert all(len(text) > 3 for _, table in keys for text in scene_keys.described(table).values())
    shown = scene_keys.key_tables()
    assert all(f"| `{key}`" in shown for own in keys.values() for key in own)
    assert (
        '| `along` | the direction in which the colours change (`"latitude"`, `"longitude"`) | `"latitude"` |' in shown
    )
    assert "<!-- keys -->" in (DOCS / "scene_files.md").read_text(encoding="utf-8")


def test_changes_are_as_if_written(scene):
    assert scene(PLAIN, "camera.radius=5").record() == scene(PLAIN.replace("20", "5")).record()
    assert scene(PLAIN, "camera.velocity=static").camera(0).velocity == "static"
    for change, words in (("camera.radius", "KEY=VALUE"), ("camera.radius[0]=1", "must name an entry")):
        with pytest.raises(ValueError, match=words):
            scene(PLAIN, change)


EXPRESSIONS = [
    ("2 + 3 * t ** 2", 3.0, 29.0, 18.0),
    ("-sqrt(t) / 2", 4.0, -1.0, -0.125),
    ("exp(sin(t)) * cos(t)", 0.0, 1.0, 1.0),
    ("log(t) + max(t, 2) - min(t, 1, 7)", 5.0, math.log(5) + 4, 1.2),
    ("2 ** t", 3.0, 8.0, 8 * math.log(2)),
    ("(t - 3) ** 20 + abs(-t) + degrees(radians(t)) + 0 * pi", 2.0, 5.0, -18.0),
    ("atan(t) + tan(t)", 0.0, 0.0, 2.0),
]


@pytest.mark.parametrize(("text", "time", "value", "rate"), EXPRESSIONS)
def test_expressions_have_values_and_derivatives(text, time, value, rate):
    found = Moment(time, {}).value(formula("x", text))
    assert (found.value, found.rate) == pytest.approx((value, rate), abs=1e-14)


OUTSIDE = [
    "__import__('os').system('true')",
    "t.real",
    "(lambda: 1)()",
    "[1][0]",
    "'a' * 3",
    "True",
    "1 if t else 2",
    "t < 3",
    "sin",
    "sin(t, t)",
    "min(t)",
    "open('x')",
    "sin(x=t)",
    "(t := 3)",
    "",
    "1 +",
    "(" * 500,
    "t" * 3000,
    "1j",
    "t ^ 2",
]


@for_each(text=OUTSIDE)
def test_all_else_that_python_can_say_is_refused(text):
    with pytest.raises(ValueError, match=r"^x must be ") as caught:
        formula("x", text)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text", ["1 / t", "log(t - 1)", "(t - 1) ** 0.5", "10.0 ** 400", "9 ** 9 ** 9 ** 9", "exp(1e4)"]
)
def test_expressions_without_a_value_say_when(text):
    with pytest.raises(ValueError, match=r"^x must .* at t = 0, but"):
        Moment(0.0, {}).value(formula("x", text))


def test_definitions_may_use_each_other_and_the_place_but_not_go_round(scene):
    path = 'kind = "expressions"\nradius = "start - 0.1 * t"\n'
    read = scene(ON_A_PATH + path + '[definitions]\nstart = "10 * two"\ntwo = 2\nslow = "radius / 10"\n')
    assert read.camera(10.0).radius == 19
    with pytest.raises(ValueError, match=r"Scene .*definitions.start must not depend on itself, by way of two"):
        scene(ON_A_PATH + path + '[definitions]\nstart = "two"\ntwo = "start"\n')
    with pytest.raises(ValueError, match=r"camera.path.radius must use names that are defined, but start is not"):
        scene(ON_A_PATH + path)


CIRCLES = [(0.0, 10.0), (0.6, 6.0), (0.999, 2.6)]


@pytest.mark.parametrize(("spin", "radius"), CIRCLES)
def test_paths_of_a_circular_orbit_have_its_velocity(spin, radius, scene):
    rate = math.degrees(1 / (spin + radius**1.5))
    expected = kc.Camera(spin, radius, velocity="circular").fido_velocity()
    start = ON_A_PATH.replace("0.6", str(spin))
    times = [{"time": t, "radius": radius, "azimuth_deg": rate * t} for t in (0.0, 20.0, 50.0)]
    keys = ", ".join("{" + ", ".join(f"{k} = {v!r}" for k, v in key.items()) + "}" for key in times)
    for path in (
        f'kind = "expressions"\nradius = {radius}\nazimuth_deg = "{rate!r} * t"\n',
        f'kind = "geodesic"\nradius = {radius}\n',
        f'kind = "keyframes"\nkeyframes = [{keys}]\n',
    ):
        camera = scene(start + path).camera(33.0)
        assert camera.radius == pytest.approx(radius, rel=1e-11)
        assert camera.fido_velocity() == pytest.approx(expected, abs=1e-10)
        assert constants(camera)[0] == pytest.approx(-1, abs=1e-12)


# Inclined, plunging, fly-by, through the axis without spin and with it, retrograde.
FALLS = [
    (0.9, 8.0, 90.0, "circular", 40.0, 400.0),
    (0.9, 8.0, 60.0, "circular", 180.0, 400.0),
    (0.5, 12.0, 70.0, (-0.1, 0.02, 0.1), 0.0, 60.0),
    (0.998, 30.0, 80.0, (-0.3, 0.1, 0.25), 0.0, 300.0),
    (0.7, 10.0, 90.0, (0.0, 0.33, 0.0), 0.0, 300.0),
    (0.0, 9.0, 40.0, (0.0, 0.4, 0.05), 0.0, 300.0),
]


def fallen(spin, radius, degrees, velocity, heading, end):
    theta = math.radians(degrees)
    if velocity == "circular":
        velocity = circular_velocity(spin, radius, theta, math.radians(heading))
    return free_fall(kc.Camera(spin, radius, theta, velocity), 0.3, 0.0, (0.0, end))


@pytest.mark.parametrize("fall", few(FALLS, FALLS[::3]))
def test_geodesics_keep_energy_momentum_and_carters_constant(fall):
    found = fallen(*fall)
    assert found.error < 1e-9
    spin, reported = fall[0], []
    for time in np.linspace(*found.span, 40):
        place = found.place(time)
        step = 1e-4
        after, before = (found.place(time + sign * step)[:3] for sign in (1, -1))
        slope = [math.remainder(b - a, math.pi) / (2 * step) for a, b in zip(before, after, strict=True)]
        if found.span[0] < time < found.span[1]:
            assert place[3:] == pytest.approx(slope, abs=1e-6)
        reported.append(constants(kc.Camera(spin, place.radius, place.theta, fido_velocity(spin, place))))
    reported = np.array(reported)
    assert np.abs(reported[:, 0] + 1).max() < 1e-8
    assert np.abs(reported - reported[0]).max() < 1e-7
    if fall[3] == "circular":
        assert found.place(found.span[1]).radius == pytest.approx(fall[1], rel=1e-7)


@pytest.mark.slow
def test_a_way_through_the_axis_is_continuous():
    found = fallen(*FALLS[4])
    r, theta, phi = np.array([found.place(time)[:3] for time in np.linspace(*found.span, 1001)]).T
    places = r * np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    assert theta.min() < 0.02 and theta.max() > math.pi - 0.02
    # Its velocity changes by 3e-3 and less in 0.3 units of time; turned back at the axis, by 0.6.
    assert np.linalg.norm(np.diff(places, 2), axis=0).max() < 0.3 * 0.03


def test_headings_are_from_the_way_round_toward_the_axis():
    ahead, up, back = (circular_velocity(0.5, 10.0, math.pi / 2, math.radians(d)) for d in (0, 90, 180))
    assert ahead == pytest.approx(kc.Camera(0.5, 10.0, velocity="circular").fido_velocity(), abs=1e-12)
    assert up[1] < -0.3 and abs(up[2]) < 1e-12 and back[2] < -ahead[2]


def hamilton(spin):
    """Right-hand side of Hamilton's equations in coordinate time, the metric's derivatives by differences."""

    def energy(r, theta, p):
        return p @ np.linalg.inv(metric(spin, r, theta)) @ p / 2

    def slope(_, y):
        r, theta, _, *p = y
        p, step = np.array(p), 1e-5
        rates = np.linalg.inv(metric(spin, r, theta)) @ p
        forces = (
            -(energy(r + step, theta, p) - energy(r - step, theta, p)) / (2 * step),
            -(energy(r, theta + step, p) - energy(r, theta - step, p)) / (2 * step),
        )
        return np.array([*rates[1:], 0.0, *forces, 0.0]) / rates[0]

    return slope


@pytest.mark.parametrize("fall", few(FALLS[:4], FALLS[:1]))
def test_geodesics_are_those_of_hamiltons_equations(fall):
    found = fallen(*fall)
    spin, last = fall[0], min(found.span[1], 40.0)
    start = found.place(0.0)
    camera = kc.Camera(spin, start.radius, start.theta, fido_velocity(spin, start))
    p = metric(spin, camera.radius, camera.inclination) @ four_velocity(camera)
    twin = solve_ivp(hamilton(spin), (0, last), [*start[:3], *p], rtol=1e-9, atol=1e-9).y[:3, -1]
    # The differences of the twin are good to 1e-10 a step.
    assert found.place(last)[:3] == pytest.approx(twin.tolist(), abs=2e-6)


def kerr_schild(spin, place, rates, last):
    """Boyer-Lindquist time, radius and theta after a proper time, from Cartesian Kerr-Schild coordinates.

    place: x, y, z; rates: of t, x, y, z. The metric has no singular axis there: g = eta + f k k.
    """
    root = math.sqrt(1 - spin**2)

    def parts(x):
        square = x @ x - spin**2
        r = math.sqrt((square + math.hypot(square, 2 * spin * x[2])) / 2)
        wide = r * r + spin**2
        k = np.array([1, (r * x[0] + spin * x[1]) / wide, (r * x[1] - spin * x[0]) / wide, x[2] / r])
        return r, 2 * r**3 / (r**4 + (spin * x[2]) ** 2), k

    def inward(p, k):
        return k[1:] @ p[1:] - p[0]

    def energy(x, p):
        _, f, k = parts(x)
        return -f * inward(p, k) ** 2 / 2

    def slope(_, y):
        x, p, step = y[1:4], y[4:], 1e-3 * np.eye(3)
        _, f, k = parts(x)
        forces = np.array([(energy(x - 2 * d, p) - energy(x + 2 * d, p)) / 12e-3 for d in step])
        forces += np.array([(energy(x + d, p) - energy(x - d, p)) * 8 / 12e-3 for d in step])
        rates = np.append(-p[0], p[1:]) - f * inward(p, k) * np.append(-1, k[1:])
        return [*rates, 0.0, *(-forces)]

    def ahead(r):
        outer, inner = 1 + root, 1 - root
        return (outer * math.log(r - outer) - inner * math.log(r - inner)) / root

    r, f, k = parts(np.array(place))
    momentum = np.diag([-1.0, 1, 1, 1]) @ rates + f * k * (k @ rates)
    found = solve_ivp(slope, (0, last), [ahead(r), *place, *momentum], "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    now = parts(found[1:4])[0]
    return found[0] - ahead(now), now, math.acos(found[3] / now)


def test_on_the_axis_both_transverse_velocities_are_alike():
    spin, radius, velocity = 0.9, 8.0, (0.0, 0.24, 0.32)
    camera = kc.Camera(spin, radius, 0.0, velocity)
    gamma = 1 / math.sqrt(1 - 0.4**2)
    rates = gamma * np.array([1 / camera.frame().lapse, 0.24, 0.32, 0.0])
    time, r, theta = kerr_schild(spin, [0.0, 0.0, radius], rates, 60.0)
    found = free_fall(camera, 0.3, 0.0, (-time, time))
    assert found.span == (-time, time) and found.error < 1e-10
    assert found.place(time)[:2] == pytest.approx((r, theta), abs=1e-9)
    # The plane of the motion has the azimuth of the velocity.
    start = found.place(0.0)
    assert (start.theta, start.phi) == pytest.approx((0.0, 0.3 + math.atan2(0.32, 0.24)), abs=1e-15)
    assert fido_velocity(spin, start) == pytest.approx((0, 0.4, 0), abs=1e-15)
    assert found.constants.carter == pytest.approx(
        (gamma * 0.4) ** 2 * (64 + 0.81) + 0.81 * (1 - found.constants.energy**2)
    )


@pytest.mark.parametrize("south", [1e-12, 1e-7])
def test_beside_the_axis_falls_are_those_from_the_axis(south):
    one, other = (free_fall(kc.Camera(0.9, 8.0, t, (0.1, 0.2, -0.3)), 0.0, 0.0, (0, 90)) for t in (0.0, south))
    assert other.error < 1e-10
    assert other.place(80.0) == pytest.approx(one.place(80.0), abs=20 * south + 1e-10)


@pytest.mark.parametrize("proper", few((438.5, 439.8), (439.8,)))
def test_falls_from_rest_are_followed_to_the_hole(proper):
    spin, radius, theta = 0.99983, 54.0, 1.2
    found = free_fall(kc.Camera(spin, radius, theta, "static"), 0.3, 0.0, (0.0, 2000.0))
    wide, sigma = math.hypot(radius, spin), radius**2 + (spin * math.cos(theta)) ** 2
    rates = np.array([1 / math.sqrt(1 - 2 * radius / sigma), 0, 0, 0])
    twin = kerr_schild(spin, [wide * math.sin(theta), 0.0, radius * math.cos(theta)], rates, proper)
    assert found.place(twin[0])[:2] == pytest.approx(twin[1:], abs=3e-9)
    assert found.error < 1e-13 and found.place(found.span[1]).radius < 1.02


def test_a_radial_fall_without_spin_is_a_cycloid():
    start = 54.0
    found = free_fall(kc.Camera(0.0, start, 1.2, "fiducial"), 0.0, 0.0, (0.0, 1000.0))
    half = np.linspace(0.1, 1.3, 7)
    radius, root = start * np.cos(half) ** 2, math.sqrt(start / 2 - 1)
    # Misner, Thorne & Wheeler (31.10), with eta = 2 half.
    turn = 2 * half + start / 4 * (2 * half + np.sin(2 * half))
    time = 2 * np.log((root + np.tan(half)) / (root - np.tan(half))) + 2 * root * turn
    assert [found.place(t).radius for t in time] == pytest.approx(radius.tolist(), rel=1e-11)


@pytest.mark.parametrize(("place", "heading"), [("radius = 4", 0), ("radius = 4.6\ninclination_deg = 70", 130)])
def test_circular_paths_stay_on_their_circle(place, heading, scene):
    start = ON_A_PATH.replace("spin = 0.6", "spin = 0.0").replace("end = 50", "end = 402")
    film = scene(f'{start}kind = "geodesic"\n{place}\nvelocity = "circular"\nheading_deg = {heading}\n')
    first, last = (film.camera(time) for time in (0.0, 402.0))
    assert first.radius == last.radius and constants(last) == pytest.approx(constants(first), abs=1e-12)


@pytest.mark.slow
def test_unstable_paths_that_are_no_exact_circles_are_refused(scene):
    """As are none that are stable, or end early."""
    speed = kc.Camera(0.0, 4.0, velocity="circular").fido_velocity()[2]
    start = ON_A_PATH.replace("spin = 0.6", "spin = 0.0") + 'kind = "geodesic"\n'
    assert scene(f"{start}radius = 4\nvelocity = [0, 0, {speed!r}]\n").camera(50.0).radius == pytest.approx(
        4.0, abs=1e-9
    )
    with pytest.raises(ValueError, match=r"camera.path must be so stable that rounding .* or give a circular velocity"):
        scene(f"{start.replace('end = 50', 'end = 300')}radius = 4\nvelocity = [0, 0, {speed!r}]\n")


def test_a_film_of_a_fall_starts_when_the_fall_does(scene):
    text = ON_A_PATH + 'kind = "geodesic"\nradius = 8\ntime = 20\n'
    assert scene(text.replace("start = 0\n", "")).span == (20.0, 50.0)


def test_a_fall_ends_at_the_hole_and_says_so(scene):
    text = ON_A_PATH + 'kind = "geodesic"\nradius = 8\nvelocity = [-0.5, 0, 0]\n'
    with pytest.raises(ValueError, match=r"camera.path must reach t = .*, but is given from 0 to "):
        scene(text.replace("end = 50", "end = 500"))


def test_a_path_from_a_file_is_that_of_its_keyframes(scene, tmp_path):
    rows = "time,azimuth_deg,radius,inclination_deg\n0, 0, 20, 80\n25, 10, 15, 90\n\n50, 30, 12, 95\n"
    (tmp_path / "way.csv").write_text(rows)
    keys = "{time = 0, radius = 20, inclination_deg = 80}, {time = 25, radius = 15, azimuth_deg = 10}, "
    keys += "{time = 50, radius = 12, inclination_deg = 95, azimuth_deg = 30}"
    one = scene(ON_A_PATH + 'kind = "csv"\nfile = "way.csv"\n')
    other = scene(ON_A_PATH + f'kind = "keyframes"\nkeyframes = [{keys}]\n')
    assert one.camera(31.0) == other.camera(31.0) and one.camera(25.0).inclination == math.pi / 2
    (tmp_path / "way.csv").write_text("time,radius\n0,20\n")
    with pytest.raises(ValueError, match=r"camera.path.file must name a file whose first line is time,radius,"):
        scene(ON_A_PATH + 'kind = "csv"\nfile = "way.csv"\n')


def test_a_camera_without_a_path_goes_round_as_it_moves(scene):
    assert scene(PLAIN).azimuth(100.0) == pytest.approx(100 / (0.6 + 20**1.5), rel=1e-12)
    assert scene(PLAIN, "camera.velocity=static", "camera.azimuth_deg=30").azimuth(100.0) == math.radians(30)


def test_the_view_turns_as_it_is_asked(scene):
    still = ("camera.velocity=fiducial", "view.look=[-1, 0, 0]")
    plain = scene(PLAIN, *still).view(0)
    assert plain.forward == pytest.approx([-1, 0, 0], abs=1e-15) and plain.up == pytest.approx([0, 0, 1], abs=1e-15)
    right = scene(PLAIN, *still, "view.yaw_deg=90").view(0)
    assert right.forward == pytest.approx(plain.right, abs=1e-15)
    above = scene(PLAIN, *still, "view.pitch_deg=90").view(0)
    assert above.forward == pytest.approx(plain.up, abs=1e-15)
    rolled = scene(PLAIN, *still, "view.tilt_deg=90").view(0)
    assert rolled.up == pytest.approx(plain.right, abs=1e-15)
    assert scene(PLAIN, "view.look=forward").view(0).forward.tolist() == [0, 1, 0]
    for degrees in (0, 180):
        assert scene(PLAIN, f"camera.inclination_deg={degrees}").view(0).forward == pytest.approx([-1, 0, 0], abs=1e-6)
    moving = scene(PLAIN + "[film]\nframes = 2\nend = 9\n", 'view.field_of_view_deg="60 + t"')
    assert math.degrees(moving.view(3.0).field_of_view) == pytest.approx(63)


def test_a_turned_disk_is_seen_as_from_another_azimuth():
    disk = kc.disks.Disk(5, 12, kc.disks.Swatches(), opacity=lambda r, phi: 0.5 + 0.4 * np.sin(phi))
    turned = turned_disk(disk, 0.3)
    radius, phi = np.full(50, 8.0), np.linspace(0, 6, 50)
    assert turned.opacity(radius, phi) == pytest.approx(disk.opacity(radius, phi - 0.3))
    low = np.stack([np.full(50, 0.3), phi], axis=-1)
    size = np.full((50, 2), 0.01)
    back = low - [0, 0.3]
    assert (turned.emission.parts(low, low + size, size) == disk.emission.parts(back, back + size, size)).all()
    assert turned_disk(disk, 2 * math.pi) is disk


BAD = [
    ("hole.spin=1", "hole.spin must lie in [0, 1), but is 1."),
    ("hole.spin=-0.5", "hole.spin must lie in [0, 1), but is -0.5: the mirror image, spin 0.5 with azimuths"),
    ("hole.charge=1", "hole: unknown key `charge`"),
    ("camera.radius=1.2", "camera.radius must be larger than the horizon radius 1.8, but is 1.2."),
    ("camera.radius=far", "camera.radius must be a number, but is 'far'."),
    ("camera.radius=nan", "camera.radius must be a finite number, but is nan."),
    ("camera.inclination_deg=181", "camera.inclination_deg must lie in [0, 180] degrees, but is 181."),
    (
        "camera.velocity=warp",
        "camera.velocity must be circular, fiducial, static, path or three numbers, but is 'warp'",
    ),
    ("camera.velocity=path", "camera.velocity must be circular, fiducial, static or three numbers where camera.path"),
    ("camera.velocity=[1, 0, 0]", "camera.velocity must have a speed below 1 (light), but has 1."),
    ("camera.path={kind='road'}", "camera.path.kind must be keyframes, expressions, geodesic or csv, but is 'road'."),
    ("camera.path={kind='csv', file='x.csv'}", "camera must have either radius or path, but is both."),
    ("view.width=0", "view.width must be a whole number from 1 to 16384, but is 0."),
    ("view.width=2.5", "view.width must be a whole number from 1 to 16384, but is 2.5."),
    (
        "view.field_of_view_deg=200",
        "view.field_of_view_deg must be above 0 and at most 170 degrees for a pinhole picture of 64 x 36 pixels, "
        "but is 200.",
    ),
    ("view.projection=flat", "view.projection must be pinhole, fisheye or equirectangular, but is 'flat'."),
    ("view.look=[0, 0, 0]", "view.look must be three numbers that are not all zero, but is [0.0, 0.0, 0.0]."),
    ("view.look=away", "view.look must be hole, forward or three numbers, but is 'away'."),
    ("view.tilt_deg=[{time=0, value=1}]", "view.tilt_deg must hold two times or more"),
    ("view.tilt_deg=[{time=0, value=1}, {time=0, value=2}]", "view.tilt_deg[1].time must be later than that before it"),
    ("view.tilt_deg=[{time=0}]", "view.tilt_deg[0]: missing key `value`"),
    ("sky.kind=cloud", "sky.kind must be stars, checkerboard, panorama or none, but is 'cloud'."),
    ("sky={kind='checkerboard', columns=3}", "sky.columns must be an even whole number from 2 to 720, but is 3."),
    ("sky={kind='panorama', file='none.png'}", "sky.file must name a file that can be read, but 'none.png': No such"),
    ("sky={kind='stars', nebulae={file='no.jpg'}}", "sky.nebulae.file must name a file that can be read, but 'no.jpg'"),
    ("sky={kind='stars', nebulae={file='no.png'}}", "sky.nebulae.file must name a picture that can be read"),
    (
        "sky={kind='stars', nebulae={file='sky.png', brightness=-1}}",
        "sky.nebulae.brightness must be a finite number from 0 on, but is -1.0.",
    ),
    (
        "sky={kind='stars', nebulae={file='sky.png', frame='moon'}}",
        "sky.nebulae.frame must be hole or galaxy, but is 'moon'.",
    ),
    (
        "sky={kind='panorama', file='sky.png', spectrum=[[700, 1], [400, 1]]}",
        "sky.spectrum must be an exponent, three of them, or a table of growing wavelengths",
    ),
    ("sky={kind='stars', radius=0}", "sky.radius must be larger than the radius of the camera, 20, but is 0."),
    (
        "sky={kind='checkerboard', radius=15}",
        "sky.radius must be larger than the radius of the camera, 20, but is 15.",
    ),
    ("disk.inner=1.5", "disk.inner must be larger than the horizon radius 1.8, but is 1.5."),
    ("disk.inner=1.8", "disk.inner must be larger than the horizon radius 1.8, but is 1.8."),
    ("disk.inner=14", "disk.inner must be smaller than disk.outer (12), but is 14."),
    ("disk.inner=-3", "disk.inner must be a positive, finite radius, but is -3.0."),
    ("disk.opacity=1.5", "disk.opacity must be a number from 0 to 1, or a function, but is 1.5."),
    (
        "disk.motion=wild",
        "disk.motion must be circular, retrograde, static, plunging or retrograde-plunging, but is 'wild'.",
    ),
    ("disk.emission.peak=-4500", "disk.emission.peak must be a temperature above 0"),
    ("disk.emission={kind='texture', file='scene.toml'}", "disk.emission.file must end in .png"),
    ("disk.emission={kind='texture', file='no.png'}", "disk.emission.file must name a picture that can be read"),
    ("disk.emission={kind='spots', number=0}", "disk.emission.number must be a whole number from 1"),
    ("light.exposure=0", 'light.exposure must be a positive, finite number, or "auto", but is 0.'),
    ("light.flare=[{share=2, width=3}]", "light.flare[0].share must lie in [0, 1], but is 2.0."),
    ("film={frames=3}", "film.end must be given, and be later than film.start (0), but is 0."),
    ("film={frames=3, duration=1}", "film must have either frames or duration, but is both."),
    ("film={frames=0}", "film.frames must be a whole number from 1 to 1000000, but is 0."),
    ("film={duration=0}", "film.duration must lie in (0, 100000] seconds, but is 0."),
    ("film={frames=2, start=-2e9}", "film.start must lie in [-1e+09, 1e+09], but is -2000000000.0."),
    (
        "film={frames=2, shutter_weight='round'}",
        "film.shutter_weight must be box, triangle, cosine or a list, but is 'round'.",
    ),
    ("film={frames=2, shutter_deg=361}", "film.shutter_deg must lie in [0, 360] degrees, but is 361."),
    ("overlays.tracks=[10, 200]", "overlays.tracks[1] must lie in [0, 180] degrees, but is 200."),
    ("disk.emission={kind='spots', number=5, seed=-1}", "disk.emission.seed must be a whole number from 0, but is -1."),
    ("camera={path={kind='geodesic', radius=9, velocity='up'}}", "camera.path.velocity must be circular, fiducial,"),
    ("film={rate=3}", "film must have either frames or duration, but is neither."),
    ("overlays.colour='blurple'", "overlays.colour must be a colour, as white or #FFD700, but is 'blurple'."),
    ("overlays.curve_colour='vilet'", "overlays.curve_colour must be a colour, as white or #FFD700, but is 'vilet'."),
    ("overlays.critical_curves=11", "overlays.critical_curves must be a whole number from 0 to 10, but is 11."),
    (
        "overlays.caption='{speed}'",
        "overlays.caption must name azimuth_deg, inclination_deg, radius, t, time in braces",
    ),
    ("quality=best", "quality must be draft, normal or high, but is 'best'."),
    ("colour=red", "unknown key `colour`; its keys are hole, camera, title, quality,"),
    ("sky=stars", "sky must be a table, but is 'stars'."),
    ("definitions.a=true", "definitions must be a table with a number or a text in each entry, but is another one."),
    ("overlays.labels=1", "overlays.labels must be true, false or beside, but is 1."),
    ("overlays.tracks=80", "overlays.tracks must be a list, but is 80."),
    ("disk.slant=1", "disk.slant must be true or false, but is 1."),
    ("view.tilt_deg=true", "view.tilt_deg must be a number, a text or a list, but is true."),
    ("view.look={r=1}", "view.look must be hole, forward or three numbers, but is a table."),
]


@for_each("change", "words", rows=BAD)
def test_what_cannot_be_is_reported_with_file_and_key(change, words, tmp_path, monkeypatch, assert_refused):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(PLAIN + DISK)
    (tmp_path / "no.png").write_text("no picture")
    Image.new("RGB", (8, 4)).save(tmp_path / "sky.png")
    assert_refused(("render", "scene.toml", "--set", change), f"Scene scene.toml: {words}")


BAD_PATHS = [
    ('kind = "expressions"\nradius = "20 - 2 * t"\n', "camera.path must move slower than light, but is 2."),
    ('kind = "expressions"\nradius = "eval(t)"\n', "camera.path.radius must be made of numbers, t, + - * / **"),
    ('kind = "expressions"\nradius = "9 + 20 / (20 - t)"\n', "camera.path.radius must have a value at t = 20, but"),
    ('kind = "expressions"\nradius = 20\ninclination_deg = "5 - t / 8"\n', "keep the inclination in [0, 180] degrees"),
    ('kind = "geodesic"\nradius = 2\n', "camera.path.velocity must not be circular where no orbit keeps its radius."),
    ('kind = "geodesic"\nradius = 1\n', "camera.path.radius must be larger than the horizon radius"),
    ('kind = "csv"\nfile = "none.csv"\n', "camera.path.file must name a file that can be read, but 'none.csv'"),
    (
        'kind = "keyframes"\nkeyframes = [{time = 0, radius = 9}, {time = 60, radius = "near"}]\n',
        "camera.path.keyframes[1].radius must be a number, but is 'near'.",
    ),
    (
        'kind = "keyframes"\nkeyframes = [{time = 0, radius = 9}, {time = 20, radius = 8}]\n',
        "camera.path must reach t = ",
    ),
]


@pytest.mark.parametrize(("path", "words"), BAD_PATHS)
def test_paths_that_cannot_be_are_reported_with_file_and_key(path, words, tmp_path, assert_refused):
    (tmp_path / "scene.toml").write_text(ON_A_PATH + path)
    assert_refused(("render", "scene.toml"), words)


def test_files_that_are_no_scenes_and_bad_options_are_reported(tmp_path, assert_refused):
    (tmp_path / "scene.toml").write_text(PLAIN)
    (tmp_path / "binary.toml").write_bytes(b"\x89PNG\xff\x00")
    (tmp_path / "broken.toml").write_text("[hole\nspin = 1")
    for arguments, words in (
        (("binary.toml",), "Scene binary.toml: it is no text"),
        (("broken.toml",), "Scene broken.toml: expected"),
        (("none.toml",), "none.toml: No such file or directory"),
        (("scene.toml", "--output", "x.gif"), "--output must end in .png, .jpg, .jpeg, .exr"),
        (("scene.toml", "--output", "none/x.png"), "--output must name a file in a folder that exists"),
        (("scene.toml", "--frame", "1"), "--frame must be a whole number from 0 to 0, but is 1."),
        (("scene.toml", "--quality", "best"), "--quality"),
        (("scene.toml", "--set", "camera"), "KEY=VALUE"),
    ):
        assert_refused(("render", *arguments), words)
    assert_refused(("scene", "--template", "moon"), "--template must be one of approach, checkerboard, disk")


def test_templates_are_listed_and_printed(capsys):
    status, out, err = run(capsys, "scene")
    assert (status, err) == (0, "") and all(f"  {name} " in out for name in first_lines())
    status, out, _ = run(capsys, "scene", "--template", "disk")
    assert status == 0 and out == template_text("disk")


@pytest.fixture
def painted(monkeypatch):
    """A renderer that costs nothing: what it was asked for, and a grey picture."""
    asked = []

    def rendered(camera, view, shown, motion, quality):
        given = {"camera": camera, "view": view, "disk": shown.matter[0], "volume": shown.matter[1]}
        asked.append({**shown._asdict(), **given, "motion": motion, "quality": quality})
        grey = np.full((view.height, view.width, 3), 0.25, np.float32)
        with stage("sky_light"):
            return scene_file.Rendering(camera, view, grey, None, 0, 7, 0.0)

    monkeypatch.setattr(scene_file, "rendered", rendered)
    return asked


def test_the_renderer_is_asked_for_the_frame(scene, painted):
    text = PLAIN + DISK + '[sky]\nkind = "checkerboard"\n[film]\nframes = 4\nend = 100\nshutter_deg = 180\n'
    read = scene(text + 'shutter_weight = "triangle"\n')
    read.rendering(2, quality="draft", scale=0.5)
    asked = painted[0]
    azimuth = read.azimuth(50.0)
    assert asked["quality"] == "draft" and asked["time"] == 50 and asked["motion"].times == (-6.25, 6.25)
    assert asked["motion"].azimuths == pytest.approx([read.azimuth(50 + part) - azimuth for part in (-6.25, 6.25)])
    assert [view.width for view in asked["motion"].views] == [32, 32] and asked["motion"].weight == "triangle"
    assert (asked["view"].width, asked["view"].height) == (32, 18)
    # Sky and disk are turned back by the camera's azimuth.
    assert asked["sky"].angle == -azimuth and asked["disk"].emission.angle == pytest.approx(-azimuth)
    with pytest.raises(ValueError, match="Argument `quality` must be one of draft, normal, high"):
        read.rendering(0, quality="best")


@pytest.mark.stand_ins
def test_the_map_is_made_once_for_a_circular_orbit(scene, monkeypatch):
    traced, shown = [], []

    def trace_view(*seen, **options):
        traced.append((seen, options))
        return SimpleNamespace(show=lambda sky, **looks: shown.append(looks["time"]))

    monkeypatch.setattr(renderer, "trace_view", trace_view)
    monkeypatch.setattr(renderer, "LAST", [])
    film = "[film]\nframes = 3\nend = 90\n"
    orbit = scene(PLAIN + DISK + film)
    for number in range(3):
        orbit.rendering(number)
    assert len(traced) == 1 and shown == [0, 30, 60]
    for change in ("view.width=48", "disk.outer=13", "disk.opacity=0.5", "light.delay=true", "sky.kind='stars'"):
        orbit.rendering(0)
        before = len(traced)
        scene(PLAIN + DISK + film, change).rendering(0)
        assert len(traced) == before + 1, change
    scene(PLAIN + DISK + film, "sky.kind='stars'", "disk.brightness=2").rendering(0)
    assert len(traced) == before + 1
    for quality in (None, "draft"):
        orbit.rendering(0, quality=quality)
    assert len(traced) == before + 3 and traced[-1][1]["quality"] == "draft"
    turning = scene(PLAIN + film, "view.tilt_deg='t'")
    for number in range(3):
        turning.rendering(number)
    assert len(traced) == before + 6


def test_stars_and_disk_shine_on_what_the_light_is_seen_by(scene, painted):
    text = PLAIN + DISK + '[sky]\nkind = "stars"\n'
    for response in ("cie", "film"):
        scene(text, f"light.response={response!r}").rendering(0)
        asked = painted[-1]
        star, disk = (getattr(part, name, part) for part, name in ((asked["sky"], "sky"), (asked["disk"], "disk")))
        emission = getattr(disk.emission, "emission", disk.emission)
        assert (star.response, emission.response) == (response, response)


def test_spots_may_differ_in_brightness_and_sense(scene, painted):
    emission = "{kind = 'spots', number = 200, brightness = [1, 3], retrograde = 0.25, fade = 'quadratic', streak = 2}"
    scene(PLAIN + DISK, f"disk.emission={emission}").rendering(0)
    spots = painted[-1]["disk"].emission
    assert 1 <= spots.brightness.min() < 1.2 < 2.8 < spots.brightness.max() <= 3
    assert 25 < spots.retrograde.sum() < 75 and spots.fade == "quadratic"
    with pytest.raises(ValueError, match=r"disk.emission.brightness must be two growing factors from 0 on"):
        scene(PLAIN + DISK, "disk.emission={kind = 'spots', number = 2, brightness = [2, 1]}")


VOLUME = """
[definitions]
height = 0.3
[volume]
inner = 6
outer = 14
density = "0.2 * exp(-(cos(theta) / height)**2 / 2) * (1 + cos(2 * phi))"
temperature = 6000
scale = 1.5
"""


def test_a_volume_is_made_of_expressions(scene, painted):
    read = scene(PLAIN + VOLUME, "camera.azimuth_deg=20", "volume.motion='1 / (0.6 + r**1.5)'")
    read.rendering(0)
    volume = painted[-1]["volume"]
    place = np.array([7.0, 12.0]), np.array([1.5, 1.9]), np.array([0.4, 5.0])
    expected = 0.2 * np.exp(-((np.cos(place[1]) / 0.3) ** 2) / 2) * (1 + np.cos(2 * (place[2] + math.radians(20))))
    assert np.allclose(volume.density(*place), expected, rtol=1e-12)
    assert np.allclose(volume.motion(*place[:2]), 1 / (0.6 + place[0] ** 1.5), rtol=1e-15)
    assert (volume.temperature, volume.scale, volume.brightness) == (6000, 1.5, 1) and not volume.symmetric
    assert scene(PLAIN + VOLUME, "sky.kind='stars'").matter.volume(0.0).brightness == 600
    law = "min(r, 7, 9) + max(theta, phi) * sqrt(abs(-r)) - log(r) + atan(r) / tan(1) + radians(degrees(r)) * sin(pi)"
    found = scene(PLAIN + VOLUME, f"volume.density='{law}'").matter.volume(0.0).density(*place)
    r, theta, phi = place
    assert np.allclose(
        found,
        np.minimum(r, 7) + np.maximum(theta, phi) * np.sqrt(r) - np.log(r) + np.arctan(r) / math.tan(1) + r * 1.2e-16,
    )


def test_a_volume_is_one_where_nothing_changes_with_time(scene, painted):
    still = scene(PLAIN + VOLUME, "volume.density='0.1 * height'")
    moving = scene(PLAIN + VOLUME, "volume.density='0.1 * height * (1 + t)'")
    for read, one in ((still, True), (moving, False)):
        assert (read.matter.volume(0.0) is read.matter.volume(1.0)) == one
        read.rendering(0)
    assert painted[0]["volume"] is still.matter.volume(0.0)
    assert moving.matter.volume(1.0).density(np.array([7.0]), np.array([1.0]), 0.0) == pytest.approx(0.06)


def test_a_volume_is_made_of_files(scene, tmp_path):
    values = np.random.default_rng(2).uniform(0, 1, (3, 4, 5))
    np.save(tmp_path / "density.npy", values)
    read = scene(PLAIN + VOLUME, "volume.density={file = 'density.npy'}", "volume.scale=2")
    assert read.matter.volume(0.0).density.shape == (3, 4, 5)
    assert "density.npy" in read.record()["files"]
    np.save(tmp_path / "colours.npy", np.ones((3, 4, 5, 3)))
    np.save(tmp_path / "heat.npy", 5000 * np.ones((3, 4, 5)))
    files = [f"volume.{law}={{file = '{name}.npy'}}" for law, name in (("colour", "colours"), ("temperature", "heat"))]
    full = scene(PLAIN + VOLUME, "volume.density={file = 'density.npy'}", *files).matter.volume(0.0)
    assert full.colour.coloured and full.colour.weighted and full.temperature.weighted and not full.density.weighted
    painted = scene(PLAIN + VOLUME, "volume.colour='#ff8000'").matter.volume(0.0)
    assert painted.colour == pytest.approx((1, 0.2158605, 0), abs=1e-6)
    before = read.record()
    np.save(tmp_path / "density.npy", values + 1)
    after = scene(PLAIN + VOLUME, "volume.density={file = 'density.npy'}", "volume.scale=2")
    assert after.record() != before and after.matter.volume(0.0) is not read.matter.volume(0.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("volume.inner=1.2", "volume.inner must be larger than the horizon radius 1.8"),
        ("volume.outer=5", "volume.inner must be smaller than `outer`|volume.inner must be smaller than volume.outer"),
        ("volume.density='r +'", "volume.density must be made of numbers"),
        ("volume.density='rho'", "volume.density must use names that are defined, but rho is not"),
        ("volume.density='7 - r'", "volume.density must be finite and not negative, but is -"),
        ("volume.temperature='log(r - 7)'", "volume.temperature must be finite and not negative"),
        ("volume.temperature=-1", "volume.temperature must be a finite number from 0 on"),
        ("volume.scale=0", "volume.scale must be a positive, finite length"),
        ("volume.motion='circlar'", "volume.motion must be circular, fiducial, static or an expression"),
        ("volume.motion='phi / 9'", "volume.motion must be the same all round"),
        ("volume.density={file = 'none.npy'}", "volume.density.file must name a file that can be read"),
        ("volume.density={file = 'scene.toml'}", "volume.density.file must name a .npy file with an array of numbers"),
        ("volume.density={file = 'flat.npy'}", "volume.density.file must have shape"),
        ("volume.colour='red'", "volume.colour must look like"),
        ("volume.colour={file = 'flat.npy'}", "volume.colour.file must have shape"),
        ("volume.brightness=-1", "volume.brightness must be a finite number from 0 on"),
        ("definitions.phi=1", "definitions must have names other than r, theta and phi where there is a volume"),
        ("volume.paint='red'", "volume: unknown key `paint`"),
    ],
)
def test_an_invalid_volume_is_refused_before_anything_is_traced(scene, tmp_path, change, message):
    np.save(tmp_path / "flat.npy", np.ones((3, 3)))
    with pytest.raises(ValueError, match=message) as caught:
        scene(PLAIN + VOLUME, change)
    assert "\n" not in str(caught.value)


def test_a_volume_needs_a_scale_beside_an_expression(scene):
    with pytest.raises(
        ValueError, match=r"volume.scale must be given where density, temperature or colour is a function"
    ):
        scene(PLAIN + VOLUME.replace("scale = 1.5", ""))


@pytest.mark.slow
def test_a_volume_before_a_disk_is_rendered_and_filmed(scene, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    film = "[film]\nframes = 2\nend = 90\n"
    read = scene(PLAIN + DISK + VOLUME + film, "view.width=16", "view.height=10")
    assert read.remarks == ()
    one, other = (read.rendering(number, quality="draft") for number in range(2))
    assert one.transmission.min() < 0.9 and one.light.max() > 0 and not np.array_equal(one.light, other.light)
    sizes = "--set", "view.width=16", "--set", "view.height=10"
    status, _, err = run(capsys, "render", "scene.toml", "--quality", "draft", *sizes, "--output", "glow.png")
    assert (status, err) == (0, "") and np.asarray(Image.open("glow.png")).max() > 100


def test_overlays_leave_the_rest_of_the_picture_as_it_is(scene, painted):
    plain = scene(PLAIN).picture(0)
    drawn = scene(PLAIN, "view.width=320", "view.height=180", "overlays.caption='r = {radius:.1f}'").picture(0)
    assert drawn.shape == (180, 320, 3) and (drawn[40:] == plain[0, 0]).all() and (drawn != plain[0, 0]).any()


CAPTIONED = ("view.width=640", "view.height=360", "overlays.caption='r = {radius}'")


def written(scene, painted, *more):
    """Rows and columns that a caption changes, and the pixels of its letters alone."""
    changed = scene(PLAIN, *CAPTIONED, *more).picture(0).astype(int)
    plain = scene(PLAIN).picture(0)[0, 0].astype(int)
    rows, columns = np.nonzero((changed != plain).any(axis=-1))
    return rows, columns, changed


@pytest.mark.parametrize(
    ("place", "up", "across"),
    [("upper left", 0, 0), ("upper centre", 0, 0.5), ("lower right", 1, 1), ("lower centre", 1, 0.5)],
)
def test_captions_are_where_they_are_wanted(scene, painted, place, up, across):
    rows, columns, _ = written(scene, painted, f"overlays.caption_place='{place}'")
    sides = rows.min() if up == 0 else 359 - rows.max(), columns.min(), 639 - columns.max()
    assert 2 < sides[0] < 20
    assert abs(sides[1] - sides[2]) <= 1 if across == 0.5 else 2 < sides[1 + across] < 20


def test_letters_have_the_size_and_the_colour_that_is_wanted(scene, painted):
    heights = {}
    for size in (3.2, 6.4):
        rows, _, picture = written(scene, painted, f"overlays.size={size}", "overlays.colour='#FFD700'")
        heights[size] = np.ptp(rows)
        gold = np.abs(picture - [255, 215, 0]).max(axis=-1) < 30
        assert gold.sum() > 8
    # The box of a line, with what is about the letters, is 1.9 times the type or so.
    assert heights[3.2] == pytest.approx(1.9 * 0.032 * 360, abs=4)
    assert heights[6.4] == pytest.approx(2 * heights[3.2], abs=2)
    # In a small picture letters stay legible; dark ones stand on white.
    rows, _, picture = written(scene, painted, "view.width=160", "view.height=90", "overlays.colour='black'")
    assert np.ptp(rows) > 12 and picture.max() > 180


@pytest.mark.stand_ins
@pytest.mark.parametrize(
    ("value", "reported"),
    [(125.6666, "125.7"), (6.03, "6.030"), (80.0, "80"), (0.01234, "0.01234"), (12345.6, "12346"), (-3.5, "−3.500")],
)
def test_numbers_in_captions_have_four_digits(value, reported):
    overlays = importlib.import_module("kerrcaustics.scene_files.overlays")
    moment = SimpleNamespace(named=lambda _name: SimpleNamespace(value=value))
    assert overlays.filled_caption("{radius}", moment) == reported


@pytest.mark.stand_ins
@for_each(radius=[60, 250, 700], direction=range(-180, 180, 45), within=[False, True])
def test_names_beside_curves_lie_in_the_picture(radius, direction, within):
    overlays = importlib.import_module("kerrcaustics.scene_files.overlays")
    view = SimpleNamespace(width=960, height=540, pixels=np.asarray)
    turn = np.linspace(0, 2 * math.pi, 720, endpoint=False)
    circle = [480, 270] + radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    name = overlays.CurveName("primary critical curve", circle, "white", direction, within)
    points, begin, room = overlays.places_beside(view, name, 16.0)
    width = 16.0 * overlays.LETTER_WIDTH * len(name.text)
    if radius == 700:
        # The circle is not in the picture.
        assert not np.isfinite(room).any()
        return
    best = int(np.argmax(room))
    end = begin[best] + np.sign(begin[best] - points[best]) * [width, 0]
    for place in (begin[best], end):
        assert 16 < place[0] < 944 and 48 < place[1] < 492
    # There is room on both sides of either curve, and thus the wanted one is taken.
    assert (np.hypot(*(begin[best] - [480, 270])) < radius) == within


@pytest.mark.stand_ins
def test_the_shadow_edge_has_its_name_in_the_shadow():
    overlays = importlib.import_module("kerrcaustics.scene_files.overlays")
    camera = kc.Camera(0.9, 10.0)
    view = kc.pictures.View.toward_hole(camera, 960, 540, 1.0)
    ax = Figure(figsize=(9.6, 5.4), dpi=100).add_axes((0, 0, 1, 1))
    rendering = SimpleNamespace(camera=camera, view=view, sky_radius=math.inf)
    overlays.draw_lines(ax, contents.OverlaysTable(shadow_edge=True, labels="beside"), rendering)
    (text,) = ax.texts
    edge = view.pixels(kc.shadow_edge(camera, 720))
    assert text.get_text() == "shadow edge" and Outline(edge).contains_point(text.get_position())


def test_a_picture_in_another_size(scene, painted, tmp_path, capsys, monkeypatch):
    flare = "[[light.flare]]\nshare = 0.1\nwidth = 3\n"
    larger = scene(PLAIN + flare).resized(128, 72)
    assert larger.size == (128, 72) and larger.contents.light.flare[0].width == 6
    assert larger.picture(0).shape == (72, 128, 3)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(PLAIN, encoding="utf-8")
    for option, value, size in (("--size", "96x50", "96 x 50"), ("--scale", "2.5", "160 x 90")):
        status, out, _ = run(capsys, "render", "scene.toml", option, value)
        assert status == 0 and f"{size} pixels" in out


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--size", "640"], "Argument --size must be WIDTHxHEIGHT in pixels, such as 640x360, but is 640."),
        (["--size", "0x10"], "Argument --size must be WIDTHxHEIGHT in pixels, such as 640x360, but is 0x10."),
        (["--size", "99999x10"], "Scene scene.toml: view.width must be a whole number from 1 to 16384, but is 99999."),
        (["--scale", "0"], "Argument --scale must be above 0 and at most 16, but is 0."),
        (["--scale", "nan"], "Argument --scale must be above 0 and at most 16, but is nan."),
        (["--size", "64x36", "--scale", "2"], "Arguments --size and --scale: only one of them can be given."),
        (["--preview", "--scale", "2"], "Argument --preview must be left out if --size or --scale is given."),
    ],
)
def test_sizes_are_refused_in_one_line(options, complaint, tmp_path, monkeypatch, assert_refused):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(PLAIN, encoding="utf-8")
    assert_refused(["render", "scene.toml", *options], complaint)


def test_a_picture_is_written_with_its_numbers(tmp_path, capsys, monkeypatch, painted):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(PLAIN, encoding="utf-8")
    for name, kind in (("a.png", "PNG"), ("b.jpg", "JPEG")):
        status, out, err = run(capsys, "render", "scene.toml", "--output", name, "--json", "-")
        entry = json.loads(out)
        assert status == 0 and "Picture" in err and entry["schema"] == "kerrcaustics/render/1"
        assert (entry["size"], entry["beams"], entry["output"]) == ([64, 36], 7, name) and entry["seconds"] > 0
        assert list(entry["stages"]) == ["sky_light", "developing", "encoding"]
        assert re.search(r"^sky light \d+\.\d s, developing \d+\.\d s, encoding \d+\.\d s$", err, re.MULTILINE)
        with Image.open(name) as picture:
            assert picture.format == kind and picture.size == (64, 36)
    assert run(capsys, "render", "scene.toml")[0] == 0 and (tmp_path / "scene.png").exists()
    status, out, _ = run(
        capsys, "render", "scene.toml", "--preview", "--set", "view.width=640", "--set", "view.height=360"
    )
    assert status == 0 and "320 x 180 pixels" in out and painted[-1]["quality"] == "draft"


def test_shares_of_the_time_say_what_leaves_each_out(tmp_path, capsys, monkeypatch, painted):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(PLAIN + "[film]\nframes = 2\nend = 80\nshutter_deg = 90\n", encoding="utf-8")
    status, out, _ = run(capsys, "render", "scene.toml", "--explain")
    assert status == 0 and re.search(r"^sky light +\d\.\d\d +\d+ % +no \[sky\] *$", out, re.MULTILINE)
    shares = [int(share) for share in re.findall(r"(\d+) %", out.partition("share")[2].partition("Motion")[0])]
    assert len(shares) == 4 and abs(sum(shares) - 100) <= 2
    assert "film.shutter_deg = 0" in out and "--quality draft" in out
    assert "film.shutter_deg" not in run(capsys, "render", "scene.toml", "--explain", "--quality", "draft")[1]


def test_every_stage_of_a_picture_has_its_key():
    names = set()
    for path in (Path(kc.__file__).parent / "scenes").rglob("*.py"):
        names |= set(re.findall(r'stage\("(\w+)"\)', path.read_text(encoding="utf-8")))
    # Frames of films have stages of their own.
    assert names and names <= set(LEFT_OUT)


def test_a_preview_of_a_film_draws_one_frame(tmp_path, capsys, monkeypatch, painted):
    """Its exposure is from its own light; a frame of the film itself needs nine others."""
    monkeypatch.chdir(tmp_path)
    film = PLAIN + '[light]\nexposure = "auto"\n[film]\nframes = 20\nend = 80\n'
    (tmp_path / "scene.toml").write_text(film, encoding="utf-8")
    status, out, _ = run(capsys, "render", "scene.toml", "--preview", "--frame", "7")
    assert status == 0 and "(auto, by this frame alone)" in out and len(painted) == 1
    status, out, _ = run(capsys, "render", "scene.toml", "--frame", "7")
    assert status == 0 and "(auto)" in out and len(painted) == 11


def test_the_progress_bar_says_stages(tmp_path, capsys, monkeypatch, painted):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(PLAIN, encoding="utf-8")
    reported = []
    monkeypatch.setattr("kerrcaustics.cli.render.progress", lambda: nullcontext(lambda *what: reported.append(what)))
    assert run(capsys, "render", "scene.toml")[0] == 0
    words, parts = zip(*reported, strict=True)
    assert words[0] == "sky light" and re.fullmatch(r"developing \(sky light \d+\.\d s\)", words[1])
    assert words[2].startswith("encoding (sky light") and parts == (0, 1 / 9, 2 / 9)


def test_an_openexr_picture_has_linear_light(tmp_path, capsys, monkeypatch, painted):
    exr = pytest.importorskip("OpenEXR")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(PLAIN, encoding="utf-8")
    assert run(capsys, "render", "scene.toml", "--output", "c.exr")[0] == 0
    with exr.File("c.exr") as file:
        assert (np.asarray(file.channels()["RGB"].pixels) == 0.25).all()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c.exr", "scene.toml"]


@pytest.mark.slow
def test_a_scene_is_what_python_renders(scene):
    text = PLAIN + DISK + '[sky]\nkind = "checkerboard"\n[light]\nbeaming = true\ndelay = true\n'
    read = scene(text.replace('"black-body", peak = 4500', '"swatches"') + "[film]\nframes = 2\nend = 80\n")
    camera = kc.Camera(0.6, 20.0)
    view = kc.pictures.View.toward_hole(camera, 64, 36, math.radians(60))
    shifts = {"beaming": True, "delay": True}
    plain = kc.render(camera, view, kc.skies.Checkerboard(), disk=kc.disks.Disk(5, 12, kc.disks.Swatches()), **shifts)
    assert np.array_equal(read.rendering(0).light, plain.light)
    assert not np.array_equal(read.rendering(1).light, plain.light)


@pytest.mark.parametrize(
    ("motion", "prograde"),
    [("circular", True), ("plunging", True), ("retrograde", False), ("retrograde-plunging", False)],
)
def test_a_disk_may_begin_at_the_isco(scene, motion, prograde):
    text = (
        PLAIN + f'[disk]\ninner = "isco"\nouter = 12\nmotion = "{motion}"\nemission = {{kind = "wisps", peak = 4500}}\n'
    )
    read = scene(text)
    disk = read.matter.disk
    assert disk.inner == disk.emission.inner == kc.isco(read.contents.hole.spin, prograde)
    with pytest.raises(ValueError, match=r"disk\.inner must be"):
        scene(text, "disk.inner='isc'")


@pytest.mark.slow
def test_another_azimuth_is_the_sky_and_the_disk_turned(scene):
    # A camera that is turned with the period of the patterns sees the same.
    text = PLAIN + '[sky]\nkind = "checkerboard"\n[disk]\ninner = 5\nouter = 12\nemission = {kind = "swatches"}\n'
    first = scene(text, "disk.opacity=0.5").rendering(0).light
    same = scene(text, "disk.opacity=0.5", "camera.azimuth_deg=72").rendering(0).light
    other = scene(text, "disk.opacity=0.5", "camera.azimuth_deg=12").rendering(0).light
    assert np.abs(same - first).max() < 1e-4 < 0.1 < np.abs(other - first).max()


@pytest.mark.slow
def test_tracks_and_critical_curves_are_drawn(scene):
    drawn = scene(PLAIN, "overlays={critical_curves=2, tracks=[80], labels=true}", "view.width=320", "view.height=180")
    picture = drawn.picture(0)
    plain = scene(PLAIN, "view.width=320", "view.height=180").picture(0)
    assert 0.005 < (picture != plain).any(axis=-1).mean() < 0.25
    # Curves and their names only where they are in the picture.
    away = ["view.width=320", "view.height=180", "view.yaw_deg=180"]
    drawn = scene(PLAIN, "overlays={critical_curves=2, labels=true}", *away)
    assert np.array_equal(drawn.picture(0), scene(PLAIN, *away).picture(0))
    with pytest.raises(ValueError, match=r"overlays.tracks must orbit the spin axis"):
        scene(PLAIN, "overlays.tracks=[80]", "camera.velocity=[0.1, 0, 0]")


@pytest.mark.slow
def test_images_of_the_poles_are_marked_in_the_colours_of_their_indices(scene):
    wide = ("view.width=640", "view.height=360", "view.field_of_view_deg=300", "view.projection='fisheye'")
    near = ("hole.spin=0.999", "camera.radius=6.03")
    drawn = scene(PLAIN, *near, *wide, "overlays={critical_curves=2, curve_colour='#00FF00', poles=true}")
    picture, rendering = drawn.picture(0), drawn.rendering(0)
    marked = 0
    for theta in (0.0, np.pi):
        images = kc.star_images(rendering.camera, (theta, 0.0), max_index=1)
        for place, index in zip(rendering.view.pixels(images.sky), images.index, strict=True):
            column, row = place.round().astype(int)
            colour = tuple(int(INDEX_ON_BLACK[index][i : i + 2], 16) for i in (1, 3, 5))
            assert np.abs(picture[row, column].astype(int) - colour).max() < 8
            marked += 1
    assert marked == 4
    # Both curves in the one colour that is given.
    green = (picture[..., 1] > 100) & (picture[..., [0, 2]].max(axis=-1) < 60)
    assert np.count_nonzero(np.diff(np.flatnonzero(green[180])) > 1) >= 2
    assert not ((picture[..., 2] > 150) & (picture[..., 0] < 150)).any()


@pytest.mark.slow
@pytest.mark.parametrize(("sky", "brightness"), [("stars", 600), ("checkerboard", 1)])
def test_a_disk_of_no_brightness_shows_before_its_sky(scene, sky, brightness):
    text, kind = PLAIN + DISK, f"sky.kind='{sky}'"
    left_out, given = (scene(text, kind, *more).rendering(0) for more in ((), (f"disk.brightness={brightness}",)))
    assert np.array_equal(left_out.light, given.light)
    picture = scene(text, kind).picture(0)
    lit = left_out.light.max(axis=2) > np.quantile(left_out.light, 0.9)
    assert picture[lit].mean() > 60


def test_spots_may_have_orbits_of_their_own(scene, painted):
    text = PLAIN + "\n[spots]\nnumber = 200\ninner = 8\nouter = 12\n"
    given = "inclination_deg=[20, 40]", "node_deg=[10, 30]", "retrograde=0.25", "brightness=[1, 3]", "fade='quadratic'"
    read = scene(text, "camera.azimuth_deg=20", *(f"spots.{entry}" for entry in given))
    read.rendering(0)
    spots = painted[-1]["volume"]
    against = spots.inclination > math.pi / 2
    tilt = np.degrees(np.where(against, math.pi - spots.inclination, spots.inclination))
    assert 20 <= tilt.min() < 21 and 39 < tilt.max() <= 40 and 25 < against.sum() < 75
    # The camera is at 20 degrees, and azimuths are from it.
    assert -10 <= np.degrees(spots.node).min() < -9 and 9 < np.degrees(spots.node).max() <= 10
    assert spots.radius.min() >= 8 and spots.radius.max() <= 12 and spots.fade == "quadratic"
    assert spots.brightness.max() > 2.8 and not read.remarks
    for change, words in (
        ("spots.node_deg=[3, 2]", "spots.node_deg must be two growing numbers"),
        ("spots.inner=1.9", "must hold radii of circular orbits"),
        ("volume={inner=6, outer=14, density=1, temperature=6000}", "spots must not stand beside volume"),
    ):
        with pytest.raises(ValueError, match=words):
            scene(text, change)
