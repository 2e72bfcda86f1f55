"""Skies and disks whose light is a function of the place, against the same light by other ways."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scenes.footprint import Footprint
from kerrcaustics.spacetime.sphere import polar_basis

CAMERA = kc.Camera(0.9, 10.0, 1.2)
BOARD = kc.skies.Checkerboard(rows=9, columns=18)


def picture(sky=None, scale=1, **matter):
    """A picture, or the means of scale x scale pixels of a larger one."""
    view = kc.pictures.View.toward_hole(CAMERA, 48 * scale, 30 * scale, 1.2)
    light = kc.render(CAMERA, view, sky, **matter).light
    return light.reshape(30, scale, 48, scale, 3).mean(axis=(1, 3))


def on_board(direction):
    """The board's light at points: averages over next to nothing."""
    still = np.broadcast_to(1e-9 * np.eye(2), (len(direction), 2, 2))
    return BOARD.light(Footprint(direction, still, np.zeros(len(direction)), np.ones(len(direction))), False, False)


def footprints(count, major, minor):
    rng = np.random.default_rng(3)
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    angle = rng.uniform(0, math.pi, count)
    axes = np.stack([np.stack([np.cos(angle), -np.sin(angle)]), np.stack([np.sin(angle), np.cos(angle)])])
    matrix = np.moveaxis(axes, -1, 0) @ np.diag([major, minor])
    return Footprint(direction, matrix, np.zeros(count), np.ones(count))


@pytest.mark.parametrize(("major", "minor"), [(0.01, 0.01), (0.2, 0.02), (0.4, 0.4)])
def test_a_plane_wave_has_its_mean_over_a_gaussian(major, minor):
    """Of cos(k . n) about n in a plane it is exp(-k^2 d^2 / 2), with the deviations d along both axes."""
    prints, k = footprints(400, major, minor), 5.0
    sky = kc.skies.FunctionSky(lambda n: 1 + np.cos(k * n[:, [2]]) * np.ones(3), detail=0.02)
    light = sky.light(prints, False, False)[:, 0]
    slope = polar_basis(prints.direction)[0][:, 2] * k
    along = np.stack([prints.matrix[:, 0, i] for i in (0, 1)], axis=-1)
    square = ((slope[:, None] * along / 2) ** 2).sum(axis=1)
    flat = 1 + np.cos(k * prints.direction[:, 2]) * np.exp(-square / 2)
    # The sphere falls away from its tangents by half the square; points are no Gaussian beyond two deviations.
    assert np.abs(light - flat).max() < 0.003 + k * (major / 2) ** 2


def test_a_board_as_a_function_is_the_board():
    """Edges of swatches pass between points: no pixel is off by more than a twelfth, nor all of them by 0.2 %."""
    ours, exact = picture(kc.skies.FunctionSky(on_board, detail=0.005)), picture(BOARD)
    assert np.abs(ours - exact).max() < 0.085 * exact.max() and abs(ours.mean() / exact.mean() - 1) < 0.002


def spiral(radius, azimuth):
    return np.repeat(1 + 0.8 * np.cos(3 * azimuth - 6 * np.log(radius))[:, None], 3, axis=1)


@pytest.mark.slow
def test_a_function_on_a_disk_is_that_of_its_texture():
    """In a picture six times as large: in one of this size textures are blurred across the rims."""
    radii = 18 - 12 * (np.arange(1200) + 0.5) / 1200
    azimuths = 2 * math.pi * (np.arange(2400) + 0.5) / 2400
    drawn = spiral(*(part.ravel() for part in np.meshgrid(radii, azimuths, indexing="ij"))).reshape(1200, 2400, 3)
    ours = picture(disk=kc.disks.Disk(6.0, 18.0, kc.disks.FunctionEmission(spiral, detail=0.1)), beaming=True)
    exact = picture(scale=6, disk=kc.disks.Disk(6.0, 18.0, kc.disks.Texture(drawn)), beaming=True)
    assert exact.max() > 0.5 and np.abs(ours - exact).max() < 0.025 * exact.max()
    assert abs(ours.mean() / exact.mean() - 1) < 0.005


@pytest.mark.parametrize(
    ("returned", "words"),
    [
        (lambda n: n[:, 0], "must return light of the shape"),
        (lambda n: n - 2, "must return finite numbers that are not negative"),
        (lambda n: np.full(n.shape, math.nan), "must return finite numbers"),
        (lambda n: n.astype(str), "`function`"),
    ],
)
def test_what_is_no_light_is_refused(returned, words):
    with pytest.raises(ValueError, match=words):
        picture(kc.skies.FunctionSky(returned, detail=0.1))


@pytest.mark.parametrize("kind", [kc.skies.FunctionSky, kc.disks.FunctionEmission])
def test_what_is_no_function_is_refused(kind):
    with pytest.raises(ValueError, match="`function` must be a function of"):
        kind(3.0, 0.1)
    with pytest.raises(ValueError, match="`detail` must be a positive"):
        kind(spiral, 0.0)
