"""The interpolated map of a picture to the sky: its error, its edges, and the images of stars that it gives."""

import math
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
import pytest
from marks import few

import kerrcaustics as kc
from kerrcaustics.scenes.cell_search import CellSearch
from kerrcaustics.scenes.colour import luminance
from kerrcaustics.scenes.footprint import bend, pixel_matrix, singular_values
from kerrcaustics.scenes.points import PointLights
from kerrcaustics.scenes.quadtree import Division, Squares
from kerrcaustics.scenes.sky_cells import CellPlaces, Patches, SkyCells, covered_pixels, covering_cells, parts_of
from kerrcaustics.spacetime.sphere import from_angles, polar_basis

NEAR = kc.Camera(spin=0.999, radius=2.6)
FAR = kc.Camera(spin=0.999, radius=6.03)
VIEWS = [
    (NEAR, kc.pictures.View.toward_hole(NEAR, 160, 90, math.radians(130), "fisheye")),
    (FAR, kc.pictures.View.toward_hole(FAR, 240, 135, math.radians(90))),
    (FAR, kc.pictures.View(160, 80, 2 * math.pi, "equirectangular")),
    (kc.Camera(0.9, 30.0, inclination=1.2, velocity="static"), kc.pictures.View(160, 120, 0.7)),
    (
        kc.Camera(0.5, 2.2, inclination=0.3, velocity="fiducial"),
        kc.pictures.View(160, 120, 2.0, forward=(0.6, 0.7, 0.2), up=(0, 1, 0)),
    ),
]


def missed(camera, traced, seed):
    """The error of the map, in pixels, in 10,000 pixels, or all that there are."""
    view, cells = traced.view, traced.sky_cells
    covering = covering_cells(cells, view.shape)
    inside = covered_pixels(covering, np.ones(len(cells.x), bool))
    some = CellPlaces.pixel_parts(np.random.default_rng(seed).permutation(inside)[:10_000], covering, 1)
    direction = Patches(cells).footprint(some, np.ones(len(some.x))).direction
    sky, steps = view.directions(some.x, some.y)
    beams = kc.trace_beams(camera, sky, index=False, crossings=False, redshift=False)
    major, minor, angle = singular_values(pixel_matrix(beams, sky, steps))
    e_theta, e_phi = polar_basis(beams.direction)
    along = e_theta * np.cos(angle)[:, None] + e_phi * np.sin(angle)[:, None]
    across = np.cross(beams.direction, along)
    minor = np.hypot(minor, bend(cells.curving[some.cell], across))
    off = direction - beams.direction
    return np.hypot((off * along).sum(axis=1) / major, (off * across).sum(axis=1) / minor)


@pytest.mark.parametrize(("camera", "view"), VIEWS[:2])
@pytest.mark.parametrize("quality", few(("draft", "normal", "high"), ("normal",)))
def test_the_map_is_as_good_as_it_says(camera, view, quality):
    traced = kc.pictures.trace_view(camera, view, quality=quality)
    error = missed(camera, traced, 1)
    assert error.max() < traced.error <= {"draft": 0.1, "normal": 0.02, "high": 0.005}[quality]
    assert kc.render(camera, view, kc.skies.Checkerboard(), quality=quality).error == traced.error


@pytest.mark.slow
@pytest.mark.parametrize("number", range(len(VIEWS)))
@pytest.mark.parametrize("scale", [1, 3, 6])
def test_large_maps_are_as_good_as_they_say(number, scale):
    camera, view = VIEWS[number]
    large = kc.pictures.View(
        view.width * scale, view.height * scale, view.field_of_view, view.projection, view.forward, view.up
    )
    traced = kc.pictures.trace_view(camera, large)
    assert missed(camera, traced, number).max() < traced.error <= 0.02


class InCircle(NamedTuple):
    """Corners of a lattice of 100 columns, and whether they lie in a circle."""

    key: np.ndarray
    inside: np.ndarray


class Covered(NamedTuple):
    """Squares of any size."""

    x: np.ndarray
    y: np.ndarray
    size: np.ndarray


@pytest.mark.parametrize("least", [1, 4])
def test_cells_are_divided_along_an_edge(least):
    traced = []

    def trace(key):
        traced.append(key)
        y, x = np.divmod(key, 100)
        return InCircle(key, np.hypot(x - 30.3, y - 25.7) < 17)

    def accept(level):
        inside = level.corners.inside[level.number]
        one_side = inside.all(axis=1) | ~inside.any(axis=1)
        (x, y, size), good = level.squares, one_side & ~level.beside(~one_side)
        return Covered(x[good], y[good], np.full(good.sum(), size)), ~good

    roots, none = Squares.over(64, 48, 16), InCircle(np.zeros(0, int), np.zeros(0, bool))
    cells, level, split = Division(100, trace, accept, least).divide(roots, none)
    keys = np.concatenate(traced)
    assert len(np.unique(keys)) == len(keys) == len(level.corners.key)
    assert (np.diff(level.corners.key) > 0).all()
    assert (level.corners.inside == trace(level.corners.key).inside).all()
    covered = np.zeros((48, 64), int)
    rest = level.squares.x[split], level.squares.y[split], np.full(split.sum(), level.squares.size)
    for x, y, size in zip(*(np.concatenate(pair) for pair in zip(cells, rest, strict=True)), strict=True):
        covered[y : y + size, x : x + size] += 1
    assert (covered == 1).all()
    assert level.squares.size == least
    assert split.any()
    only_left = Division(
        100, trace, accept, least, lambda some: Squares(some.x[some.x < 16], some.y[some.x < 16], some.size)
    )
    assert only_left.divide(roots, none)[0].x.max() < 16


def test_every_pixel_is_seen_once():
    camera, view = VIEWS[0]
    traced = kc.pictures.trace_view(camera, view)
    total = np.zeros(view.width * view.height)
    cells = traced.sky_cells
    covering = covering_cells(cells, view.shape)
    for n in (1, 2, 4):
        part = CellPlaces.pixel_parts(covered_pixels(covering, parts_of(cells) == n), covering, n)
        x, y = np.round(part.x).astype(int), np.round(part.y).astype(int)
        np.add.at(total, y * view.width + x, part.side**2)
    for place, side, *_ in traced.sky_parts:
        x, y = np.round(place).astype(int).T
        np.add.at(total, y * view.width + x, side**2)
    assert total.reshape(traced.visible_fraction.shape) == pytest.approx(traced.visible_fraction, abs=1e-6)


def test_a_shadow_within_one_cell_is_seen():
    camera = kc.Camera(0.9, 1e6, velocity="fiducial")
    width = 2 * 5.2 / 1e6
    view = kc.pictures.View(64, 64, 16 * width)
    scene = kc.render(camera, view, kc.skies.Checkerboard())
    # The shadow is four pixels wide.
    assert (1 - scene.visible_fraction).sum() == pytest.approx(math.pi * 4, rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize(("camera", "view"), VIEWS[:3])
def test_images_of_stars_are_those_that_are_certified(camera, view):
    view = kc.pictures.View(4 * view.width, 4 * view.height, view.field_of_view, view.projection, view.forward, view.up)
    cells = kc.pictures.trace_view(camera, view).sky_cells
    cells = SkyCells(*(part[parts_of(cells) == 1] for part in cells))
    covered = np.zeros((view.height + 64, view.width + 64), bool)
    for x, y, size in zip(cells.x, cells.y, cells.size, strict=True):
        covered[y : y + size, x : x + size] = True
    rng = np.random.default_rng(3)
    theta, phi = np.arccos(rng.uniform(-1, 1, 40)), rng.uniform(0, 2 * math.pi, 40)
    stars = from_angles(theta, phi)
    with ThreadPoolExecutor(2) as pool:
        found = CellSearch(cells).images(PointLights(stars, np.ones((40, 3)), np.ones(40)), np.zeros(40), pool)
    total = 0
    for star in range(40):
        certified = kc.star_images(camera, star=(theta[star], phi[star]), max_index=3)
        place = view.pixels(certified.sky)
        inside = ((place > -0.49) & (place < np.array([view.width, view.height]) - 0.51)).all(axis=1)
        x, y = np.round(np.where(inside[:, None], place, 0)).astype(int).T
        seen = np.flatnonzero(inside & covered[y, x])
        if not len(seen):
            continue
        mine = found.place[found.star == star]
        apart = np.linalg.norm(place[seen][:, None] - mine, axis=-1)
        nearest = apart.argmin(axis=1)
        assert (apart.min(axis=1) < 0.04).all() and len(set(nearest)) == len(seen)
        pixel = view.solid_angle(view.directions(*place[seen].T)[1])
        bright = pixel / found.area[found.star == star][nearest]
        assert bright == pytest.approx(certified.magnification[seen], rel=0.01)
        total += len(seen)
    assert total > 15


@pytest.mark.slow
def test_a_star_shines_steadily_while_it_crosses_pixels():
    """JTFT allow 2 %; over the frames of a slow pan the light of one image hardly varies at all."""
    sky = np.array([-0.5, -0.6, 0.5]) / np.linalg.norm([-0.5, -0.6, 0.5])
    beam = kc.trace_beams(FAR, sky)
    catalogue = kc.skies.StarCatalogue(beam.direction[None], np.zeros(1), np.full(1, 0.65))
    field = kc.skies.StarField(catalogue, orientation=np.eye(3), band=0)
    total = []
    for frame in range(100):
        view = kc.pictures.View(24, 24, 0.004, forward=sky)
        view = kc.pictures.View(24, 24, 0.004, forward=view.directions(11.5 + 0.03 * frame, 11.5 - 0.017 * frame)[0])
        light = luminance(kc.render(FAR, view, field).light)
        x, y = np.meshgrid(np.arange(24), np.arange(24))
        total.append((light * view.solid_angle(view.directions(x, y)[1])).sum())
    assert np.ptp(total) < 0.001 * np.mean(total)
    assert np.mean(total) == pytest.approx(beam.magnification, rel=1e-3)
