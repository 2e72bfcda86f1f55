"""Questions 1 and 3: crossings of the equatorial plane on critical curves, and of images."""

from dataclasses import dataclass
from functools import partial

import jax
import numpy as np
from skimage.measure import find_contours

import kerrcaustics as kc
from kerrcaustics.beams.closed_form.polar_motion import polar_swing
from kerrcaustics.beams.closed_form.radial_motion import radial_motion
from kerrcaustics.curves.critical_curves import critical_curves
from kerrcaustics.images.search import ImageSearch
from kerrcaustics.images.sheet_grids import Sheet
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.lens_map import sky_lines
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.frame import Frame, photon_of, sky_from_line_of_sight
from kerrcaustics.spacetime.settings import own_settings

Array = np.ndarray

_TOLERANCE = 1e-12
_BLOCK = 512
# Critical points whose rays end so many errors from the equatorial plane: the end itself may be the next crossing.
_IN_PLANE = 10.0
# A sheet's grid is made so many times finer to draw lines theta' = const.
_FINER = 3
_PER_CIRCUIT = 2 * np.pi


@dataclass(frozen=True)
class CriticalCrossings:
    """Crossings of rays of one critical curve: one entry a point.

    order; crossings (n,) of the equatorial plane, -1 where the ray ends in the plane; phase (n,), the polar phase in
    half oscillations: from a camera on the equator, whole numbers are crossings, half ones polar turning points;
    theta (n,): theta' of the end, radians.
    """

    order: int
    crossings: Array
    phase: Array
    theta: Array


def critical_crossings(camera: kc.Camera, orders: int) -> list[CriticalCrossings]:
    """Crossings along the critical curves of order 1 to `orders`."""
    found = critical_curves(camera, orders, tolerance=_TOLERANCE)
    camera, frame = found.map.camera, found.map.camera.frame()
    curves = []
    for curve in found:
        points = curve.points
        sky = sky_from_line_of_sight(frame, points.line_of_sight)
        beams = kc.trace_beams(camera, sky, "auto", _TOLERANCE, redshift=False)
        in_plane = np.abs(beams.direction[:, 2]) <= _IN_PLANE * beams.error
        crossings = np.where(in_plane, -1, np.asarray(beams.crossings))
        curves.append(CriticalCrossings(curve.order, crossings, polar_phase(camera, sky), points.theta))
    return curves


@own_settings()
def polar_phase(camera: kc.Camera, sky: Array) -> Array:
    """Half oscillations in theta (n,) of the rays in directions sky (n, 3), from the camera to infinity."""
    blocks = []
    for first in range(0, len(sky), _BLOCK):
        block = sky[first : first + _BLOCK]
        # All blocks of one length, so that one program serves them.
        full = np.concatenate([block, np.repeat(block[-1:], _BLOCK - len(block), axis=0)])
        blocks.append(np.asarray(_phase(camera.frame(), tuple(full.T), on_equator=camera.on_equator))[: len(block)])
    return np.concatenate(blocks) / np.pi


@partial(jax.jit, static_argnames="on_equator")
def _phase(frame: Frame, sky: tuple, *, on_equator: bool) -> jax.Array:
    light = photon_of(frame, sky)
    quartic = radial.factor(frame, light)
    return polar_swing(frame, light, on_equator=on_equator).rate * radial_motion(frame, light, quartic).time


def crossings_by_index(camera: kc.Camera, found: ImageSearch, stars: int) -> Array:
    """Numbers of images (stars, crossings, index) of each star with so many equator crossings and that Morse index."""
    images = found.images
    beams = kc.trace_beams(camera.at_rest(), images.sky, "auto", _TOLERANCE, index=False, redshift=False)
    crossings = np.asarray(beams.crossings)
    table = np.zeros((stars, crossings.max() + 1, found.counts.shape[1]), int)
    np.add.at(table, (images.star, crossings, images.index), 1)
    return table


@dataclass(frozen=True)
class Life:
    """Images of one star that move along one arc: index, equator crossings, and circuits of phi' from birth to death.

    closed: the arc is a closed curve, and the image lives for ever; `circuits` is then that of the closed curve.
    """

    index: int
    crossings: int
    circuits: float
    closed: bool


def lives(sheets: Sheets, theta: float) -> list[Life]:
    """Lives of all images of a star with polar angle theta' (radians, off the equator) while phi' goes round.

    On a sheet the map has no fold, so phi' runs one way along each arc theta' = const: an image is born at one end of
    the arc and dies at the other. For cameras on the equator, whose lines of symmetry no arc meets.
    """
    found = []
    for sheet in sheets.sheets:
        turn, part = _fine_grid(sheet)
        grid = _cos_theta(sheets, sheet, turn, part)
        for row, column in (line.T for line in find_contours(grid, np.cos(theta))):
            place = np.interp(row, np.arange(len(turn)), turn), np.interp(column, np.arange(len(part)), part)
            closed = bool(row[0] == row[-1] and column[0] == column[-1])
            sky = sheets.sky(sky_lines.line_of_sight(sheets.camera, place[0], sheet.depth(*place)))
            beams = kc.trace_beams(sheets.camera, sky, "auto", _TOLERANCE, index=False, redshift=False)
            # Past the spin axis the unwrapped azimuth may jump by whole turns.
            azimuth = np.unwrap(beams.azimuth)
            crossings = int(np.median(np.asarray(beams.crossings)))
            found.append(Life(sheet.index, crossings, abs(azimuth[-1] - azimuth[0]) / _PER_CIRCUIT, closed))
    return sorted(found, key=lambda life: (life.crossings, life.index))


def _fine_grid(sheet: Sheet) -> tuple[Array, Array]:
    return tuple(np.interp(np.arange(0, len(v) - 1 + 0.5 / _FINER, 1 / _FINER), np.arange(len(v)), v)
                 for v in (sheet.edge_phase, sheet.part))  # fmt: skip


def _cos_theta(sheets: Sheets, sheet: Sheet, turn: Array, part: Array) -> Array:
    turn, part = np.meshgrid(turn, part, indexing="ij")
    sky = sheets.sky(sky_lines.line_of_sight(sheets.camera, turn, sheet.depth(turn, part)))
    return kc.trace_rays(sheets.camera, sky, "auto", _TOLERANCE).direction[..., 2]
