"""The light of balls whose image is smooth, on made-up maps of the sky, against their integral."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.light_curves.ball_passes import Passes, RayAims
from kerrcaustics.light_curves.smooth_light import smooth_light

MIDDLE = np.array([0.6, -0.48, 0.64])
FIRST = np.array([0.8, 0.36, -0.48])
SIZE = 0.02
# How much a made-up image is bent over the ball, and how much its light changes.
BEND, SLOPE = 0.03, 0.01


def sky_at(place):
    """Lambert's coordinates about MIDDLE, along FIRST and a second tangent, of the ray past a place (n,), in radii."""
    return 0.01 * (place + 0.4 * place.conj() + BEND * (place**2 + 0.7j * abs(place) ** 2 - 0.5 * place.conj() ** 2))


def light_at(place):
    """g^4 there."""
    return 0.8 * (1 + SLOPE * (place.real - 0.6 * place.imag + 0.3 * place.real * place.imag))


def slopes(place, step=1e-5):
    """du / dxi, by differences."""
    return np.stack([(sky_at(place + step * way) - sky_at(place - step * way)) / (2 * step) for way in (1, 1j)])


def passes_at(place, mirrored):
    """Rays past places, with derivatives as they are with axes that do not turn from ray to ray: so they are wrong."""
    sky = sky_at(place)
    sky = sky.conj() if mirrored else sky
    n = len(place)
    flat = np.stack([sky.real, sky.imag], axis=-1)
    square = (flat**2).sum(axis=1, keepdims=True)
    second = np.cross(MIDDLE, FIRST)
    rays = MIDDLE * (1 - square / 2) + (flat @ np.stack([FIRST, second])) * np.sqrt(1 - square / 4)
    linear = np.linalg.inv(np.array([[1.4, 0.0], [0.0, -0.6 if mirrored else 0.6]]) * 0.01) * SIZE
    frame = np.stack([FIRST, second])
    return Passes(
        sky=rays,
        time=np.zeros(n),
        time_deficit=np.zeros(n),
        place=SIZE * np.stack([place.real, place.imag], axis=-1),
        by_sky=np.array([linear @ frame @ np.stack(kc.tangent_basis(ray)).T for ray in rays]),
        by_time=np.zeros((n, 2)),
        light=light_at(place),
        relative_error=np.zeros(n),
        index_kept=np.ones(n, bool),
    )


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.stand_ins
def test_the_area_of_an_image_does_not_depend_on_derivatives(mirrored):
    def rays_through(aims, aim):
        return passes_at((aim[:, 0] + 1j * aim[:, 1]) / SIZE, mirrored), np.ones(len(aim), bool)

    ball = SimpleNamespace(size=SIZE, passes=lambda aims: passes_at(np.zeros(1, complex), mirrored))
    ball.rays_through = rays_through
    aims = RayAims(MIDDLE[None], np.zeros(1), np.zeros(1), np.zeros(1, bool), np.zeros((1, 2, 3)))
    flux, error, smooth = smooth_light(ball, aims)
    # Gauss' formula over the disc.
    nodes, weights = np.polynomial.legendre.leggauss(20)
    radius, angle = np.sqrt((1 + nodes) / 2), np.arange(40) * math.pi / 20
    place = radius[:, None] * np.exp(1j * angle)
    by_x, by_y = slopes(place)
    area = (by_x.conj() * by_y).imag
    true = (weights[:, None] * light_at(place) * area).sum() * math.pi / 2 / 20 / (4 * math.pi**2 * SIZE**2) / 2
    assert smooth.all()
    assert abs(flux[0] - true) < error[0] + 1e-9 * true
    assert error[0] < 1e-4 * true
    # So much is at stake.
    assert abs(flux[0] / (light_at(0j) * area_in_the_middle() / (4 * math.pi * SIZE**2)) - 1) > 1e-4


def area_in_the_middle():
    by_x, by_y = slopes(np.zeros(1, complex))
    return float((by_x.conj() * by_y).imag[0])
