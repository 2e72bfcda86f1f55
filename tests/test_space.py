"""Models in space: meshes, files that need no OpenGL, and the error where there is none."""

import base64
import json
import math
import os
import re
import struct

import numpy as np
import pytest
from matplotlib.figure import Figure

import kerrcaustics as kc
from kerrcaustics.beams.paths import RayPaths, SpacePoints
from kerrcaustics.curves.tubes import CausticTube
from kerrcaustics.draw import solids, style
from kerrcaustics.draw.solid_files import write_gltf, write_html
from kerrcaustics.draw.solids import Model, SpaceCurve, Surface, in_all_space

TURN = np.linspace(0, 2 * math.pi, 24, endpoint=False)
BALL = np.stack([solids.from_angles(np.full(24, t), TURN) for t in np.linspace(0, math.pi, 13)])


@pytest.fixture
def model() -> Model:
    ball = Surface("ball", BALL, "#0072B2", 0.5, closed=True)
    line = SpaceCurve("axis", np.array([[0.0, 0, -2], [0, 0, 2]]), "#D55E00")
    return Model("A <ball>", (ball,), (line,), (("ball", "#0072B2"),), extent=2.0)


def test_triangles_cover_a_closed_surface(model):
    ball = model.surfaces[0]
    corners = ball.triangles()
    p, q, r = np.moveaxis(BALL.reshape(-1, 3)[corners], 1, 0)
    assert np.linalg.norm(np.cross(q - p, r - p), axis=1).sum() / 2 == pytest.approx(4 * math.pi, rel=0.02)
    # Those at the poles have no area and are left out.
    assert len(corners) == 2 * 24 * 12 - 2 * 24
    middle = ball.normals().reshape(13, 24, 3)[1:-1]
    assert np.abs(np.abs((middle * BALL[1:-1]).sum(axis=-1)) - 1).max() < 0.01


def test_all_space_fits_in_the_unit_sphere():
    radius = np.array([math.inf, 6.0, 2.0])
    none = np.zeros(3)
    at = SpacePoints(
        spin=0.9,
        mino_time=none,
        radius=radius,
        theta=np.full(3, 1.0),
        azimuth=none,
        time=none,
        error=none,
        time_error=none,
    )
    assert np.linalg.norm(in_all_space(at, 6.0), axis=-1) == pytest.approx([1, 0.5, 0.25])


def straight_rays() -> RayPaths:
    """Two rays of a captured and of an escaping light, and one that never was: x = -5 with z, and along the axis."""
    radius = np.array([[13.0, 5.0, 13.0], [8.0, 4.0, 1.5], [math.nan] * 3])
    theta = np.array([[math.acos(12 / 13), math.pi / 2, math.acos(-12 / 13)], [0.0] * 3, [math.nan] * 3])
    azimuth = np.array([[math.pi] * 3, [0.0] * 3, [math.nan] * 3])
    place = {"mino_time": radius, "time": radius, "error": radius, "time_error": radius}
    none = {name: np.empty((3, 0)) for name in ("radius", "theta", "azimuth", *place)}
    whole = {"status": np.array([0, 1, 1]), "index": np.array([2, 0, -1]), "turning_points": np.array([1, 0, -1])}
    conjugate = SpacePoints(spin=0.0, **none)
    return RayPaths(spin=0.0, radius=radius, theta=theta, azimuth=azimuth, conjugate=conjugate, **place, **whole)


def test_paths_are_drawn_from_above_and_from_the_side():
    """Places in x and z; captured rays grey; the outline of the hole and of a disk on edge."""
    ax = straight_rays().plot(Figure().add_subplot(), plane="xz", disk=(6.0, 10.0))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x (M)", "z (M)")
    rays = {line.get_label(): line for line in ax.lines}
    x, z = rays["index 2"].get_data()
    assert x == pytest.approx([-5, -5, -5]) and z == pytest.approx([12, 0, -12], abs=1e-12)
    assert rays["index 2"].get_color() == style.index_colour(2)
    assert rays["captured"].get_color() == solids.CAPTURED_COLOUR and rays["captured"].get_ydata()[-1] == 1.5
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["index 2", "captured"]
    (hole,) = ax.patches
    assert (hole.width, hole.height) == (4.0, 4.0)
    edges = [line.get_xdata() for line in ax.lines[:2]]
    assert np.allclose(edges, [[-6, -10], [6, 10]])
    above = straight_rays().plot(Figure().add_subplot(), disk=(6.0, 10.0), colour="green")
    assert above.get_ylabel() == "y (M)" and {line.get_color() for line in above.lines} == {"green"}
    assert len(above.patches) == 2
    with pytest.raises(ValueError, match="Argument `plane` must be one of xy, xz, but is 'yz'"):
        straight_rays().plot(Figure().add_subplot(), plane="yz")


@pytest.mark.slow
def test_the_hole_is_oblate_from_the_side():
    points = kc.trapped_orbit(0.9, 1.0, 20)
    hole = points.plot(Figure().add_subplot(), plane="xz").patches[0]
    horizon = 1 + math.sqrt(0.19)
    assert hole.height == pytest.approx(2 * horizon) and hole.width == pytest.approx(2 * math.hypot(horizon, 0.9))


OBSERVERS = [kc.Observer(spin=0.9, inclination=1.1, radius=radius) for radius in (1e5, math.inf)]


@pytest.mark.slow
@pytest.mark.parametrize("observer", OBSERVERS, ids=["finite", "infinity"])
def test_rays_of_observers_fill_the_picture(observer):
    """Rays come from the edge of the model and leave there; those far from the hole are left out."""
    paths = kc.ray_paths(observer, [[8.0, 2.0], [-1.0, 1.0], [500.0, 0.0]], 400, start=100.0)
    model = solids.rays_model(observer, paths, reach=12.0)
    rays = {line.name: line.points for line in model.lines if "ray" in line.name}
    assert [*rays] == ["ray of index 1", "captured ray"]
    far = np.linalg.norm(rays["ray of index 1"], axis=1)
    assert 10 < far[0] < 12.5 and 10 < far[-1] < 12.5 and far.min() < 8
    assert np.linalg.norm(rays["captured ray"][-1]) < 2
    marks = [line.points for line in model.lines if line.name == "camera"]
    assert len(marks) == 3 and np.all(np.isfinite(marks)) and np.linalg.norm(np.mean(marks, axis=(0, 1))) < 12.1
    assert ("at infinity" in model.title) == math.isinf(observer.radius)


@pytest.mark.parametrize("observer", OBSERVERS, ids=["finite", "infinity"])
def test_tubes_of_observers_end_on_the_celestial_sphere(observer):
    radius, turn = np.repeat([[math.inf], [30.0], [5.0], [1.8]], 24, axis=1), np.tile(TURN, (4, 1))
    none = np.zeros((4, 24))
    of_time = {name: none for name in ("mino_time", "time", "error", "time_error")}
    points = SpacePoints(
        spin=0.9, radius=radius, theta=2 + 0.1 * np.sin(turn), azimuth=3 + 0.1 * np.cos(turn), **of_time
    )
    tube = CausticTube(1, points, np.zeros((4, 24, 2)), True, ())
    assert kc.to_xarray(tube).sky.shape == (4, 24, 2)
    model = solids.tubes_model(observer, (tube,))
    size = np.linalg.norm(model.surfaces[1].points, axis=-1)
    # The last row lies within the ergosphere. Radii up to 30 M are drawn as at 30 M.
    assert size == pytest.approx(np.repeat([[1], [0.5], [5 / 35]], 24, axis=1))
    mark = np.mean([line.points for line in model.lines if line.name == "camera"], axis=(0, 1))
    assert np.linalg.norm(mark) == pytest.approx(1 / (1 + 30 / observer.radius))


def test_binary_gltf_can_be_read_again(model, tmp_path):
    write_gltf(model, tmp_path / "ball.glb")
    data = (tmp_path / "ball.glb").read_bytes()
    magic, version, size = struct.unpack("<4sII", data[:12])
    assert (magic, version, size) == (b"glTF", 2, len(data))
    length = struct.unpack("<I", data[12:16])[0]
    tree, binary = json.loads(data[20 : 20 + length]), data[28 + length :]
    assert [mesh["name"] for mesh in tree["meshes"]] == ["axis", "ball"]
    primitive = tree["meshes"][1]["primitives"][0]
    accessor = tree["accessors"][primitive["attributes"]["POSITION"]]
    view = tree["bufferViews"][accessor["bufferView"]]
    places = np.frombuffer(binary, np.float32, 3 * accessor["count"], view["byteOffset"]).reshape(-1, 3)
    # glTF's y points upward.
    assert np.allclose(places[:, [2, 0, 1]], BALL.reshape(-1, 3), atol=1e-7)
    assert accessor["max"] == pytest.approx(places.max(axis=0))
    assert tree["materials"][1]["alphaMode"] == "BLEND"


def test_gltf_as_text_holds_its_numbers(model, tmp_path):
    write_gltf(model, tmp_path / "ball.gltf")
    tree = json.loads((tmp_path / "ball.gltf").read_text())
    kind, numbers = tree["buffers"][0]["uri"].split(",")
    assert kind == "data:application/octet-stream;base64"
    assert len(base64.b64decode(numbers)) == tree["buffers"][0]["byteLength"]
    with pytest.raises(ValueError, match="Argument `path` must end"):
        write_gltf(model, tmp_path / "ball.obj")


def test_page_loads_nothing(model, tmp_path):
    write_html(model, tmp_path / "ball.html")
    page = (tmp_path / "ball.html").read_text()
    assert not re.search(r"https?://|<link|src=|@[A-Z]+@|import\(|fetch\(|url\(", page)
    assert "A &lt;ball&gt;" in page
    tree = json.loads(re.search(r'id="model">(.*?)</script>', page)[1])
    numbers = base64.b64decode(re.search(r'id="numbers">(.*?)</script>', page)[1])
    begin, size = tree["parts"][0]["points"]
    assert np.allclose(np.frombuffer(numbers, np.float32, size, begin), BALL.ravel(), atol=1e-7)


def test_no_opengl_is_a_clear_error_and_the_rest_works(model, tmp_path, tmp_path_factory, monkeypatch):
    space = pytest.importorskip("kerrcaustics.draw.space")
    space.check_opengl.cache_clear()
    # What is tried in a process of its own ends it there, as VTK does without the packages.
    broken = tmp_path_factory.mktemp("broken")
    (broken / "pyvista.py").write_text("import os; os.abort()")
    monkeypatch.setenv("PYTHONPATH", str(broken), prepend=os.pathsep)
    try:
        with pytest.raises(space.NoOpenGLError, match="libegl1, libegl-mesa0, libgl1-mesa-dri"):
            space.write_model(model, tmp_path, "ball")
    finally:
        space.check_opengl.cache_clear()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["ball.glb", "ball.html"]


@pytest.mark.slow
def test_a_picture_shows_the_model(model, tmp_path):
    space = pytest.importorskip("kerrcaustics.draw.space")
    try:
        space.check_opengl()
    except space.NoOpenGLError:
        pytest.skip("no OpenGL here")
    from matplotlib.image import imread

    space.write_png(model, tmp_path / "ball.png")
    picture = imread(tmp_path / "ball.png")[..., :3]
    assert picture.shape == (1200, 1600, 3)
    assert np.all(picture[600, 5] == 1)
    # The ball is blue, and lets the axis show.
    red, _, blue = picture[600, 700]
    assert blue > red + 0.1
    assert picture[600, 800, 0] > red
