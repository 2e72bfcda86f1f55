"""Errors of the magnification, the frequency ratio and the travel time of images, from beams beside them."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from kerrcaustics.beams.emitters import EMITTERS, redshift
from kerrcaustics.lens_map.lens_map import LensMap, SeenLight
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.frame import photon_of
from kerrcaustics.spacetime.sphere import moved, tangent_basis

Array = np.ndarray

# Half-width of the differences, by the major diameter of the beam: the end of the ray moves by as much.
_STEP = 1e-3
# Rounding of a direction, and of what is computed from one, relative to it.
_OF_SKY, _OF_VALUE = 4e-16, 4e-15
# Step in ln r for slopes.
_BESIDE = 1e-6


@dataclass(frozen=True)
class MeasuredLight(SeenLight):
    """Light with the errors of its values, for directions that have an error; `time_error` holds that of both.

    error: of the places on the viewer's sky, radians, or M on a screen.
    """

    error: Float[Array, " n"]
    magnification_error: Float[Array, " n"]
    redshift_error: Float[Array, " n"]


def measured_light(
    lens_map: LensMap,
    light: SeenLight,
    sky: Float[Array, "n 3"],
    error: Float[Array, " n"],
    second_arrival: Bool[Array, " n"] | None = None,
    residual: Float[Array, " n"] | None = None,
) -> MeasuredLight:
    """The light of directions on the search sky, which are known to an error in radians.

    A circle of n' becomes an ellipse on the sky, in which the direction lies: `error` is its semi-major axis, and the
    other one is shorter as the beam is flat. All values change over it, and have errors of their own. Errors are
    infinite where the direction may be critical, and where rays beside it miss the surface on both sides.

    Parameters: residual, for points on the image of a circle in the plane, the errors of ln r there. `error` is then
    their distance from that image, and values change over it, along the steepest rise of r.
    """
    surface, beams = lens_map.surface, light.beams
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        step = _STEP / light.spread
        ways = [sign * step[:, None] * axis for axis in tangent_basis(sky) for sign in (1, -1)]
        sides = np.concatenate([moved(sky, way) for way in ways])
        beside = lens_map.light_at(sides, None if second_arrival is None else np.tile(second_arrival, len(ways)))

        def slopes(value: Array, values: Array) -> Array:
            """Derivatives (axis, image, ...) on the sky, from one side where rays on the other miss the surface."""
            up, down = np.moveaxis(values.reshape(2, 2, *value.shape), 1, 0)
            up, down = np.where(np.isnan(up), 2 * value - down, up), np.where(np.isnan(down), 2 * value - up, down)
            return (up - down) / (2 * step.reshape(-1, *[1] * (value.ndim - 1)))

        # The direction that the beam stretches most, here on the search sky: the Jacobian has it on the viewer's own.
        first, second = slopes(surface.ends(beams), surface.ends(beside.beams))
        turn = np.arctan2(2 * (first * second).sum(-1), (first**2 - second**2).sum(-1)) / 2
        ratio = np.abs(beams.delta_minus) / beams.delta_plus
        rise = None if residual is None else slopes(np.log(beams.radius), np.log(beside.beams.radius))

        def off(slope: Array, rounding: Array | float) -> Array:
            """The change over the ellipse or the residual, and over the rounding of the direction."""
            major = np.abs(slope[0] * np.cos(turn) + slope[1] * np.sin(turn))
            minor = np.abs(slope[1] * np.cos(turn) - slope[0] * np.sin(turn))
            change = error * (minor + ratio * major)
            if rise is not None:
                change = residual * np.abs((slope * rise).sum(axis=0)) / (rise**2).sum(axis=0)
            return change + rounding * np.hypot(minor, major)

        area, areas = (np.sign(one.beams.determinant) / one.magnification for one in (light, beside))
        # What is wrong with a beam is nearly that of another direction: its area is far better than its diameters.
        aside = _OF_SKY + 2 * beams.diameter_error / light.spread
        lost = 2 * beams.diameter_error + _OF_VALUE + off(slopes(area, areas), aside) * light.magnification
        of_magnification = np.where(lost < 1, lost / (1 - lost), np.inf) * light.magnification
        of_redshift = off(slopes(light.redshift, beside.redshift), _OF_SKY) + _OF_VALUE * np.abs(light.redshift)
        of_time = off(slopes(light.time, beside.time), 0.0) + light.time_error
    values: dict[str, Any] = vars(light) | {
        "error": lens_map.errors(sky, error),
        "time_error": _infinite_if_unknown(of_time, light.time),
        "magnification_error": _infinite_if_unknown(of_magnification, light.magnification),
        "redshift_error": _infinite_if_unknown(of_redshift, light.redshift),
    }
    return MeasuredLight(**values)


def redshift_slope(
    lens_map: LensMap, motion: str, sky: Float[Array, "n 3"], radius: Float[Array, " n"]
) -> Float[Array, " n"]:
    """The size of d ln redshift / d ln r of emitters that photons meet in the plane; infinite if none are beside.

    The radius at which a photon of known constants arrives has a separate error.

    Parameters: motion, that of the emitters; sky, directions on the search sky; radius, where they end.
    """
    camera, emitter = lens_map.sky.search_camera, EMITTERS[motion]
    photon = photon_of(camera.frame(), tuple(sky.T))

    def log_ratio(sign: int, outward: bool) -> Array:
        place = radius * np.exp(sign * _BESIDE), 0.0
        return np.log(redshift(emitter, camera.spin, (photon.b, photon.q), place, 1.0, np.array(outward)))

    slopes = [np.abs(log_ratio(1, sense) - log_ratio(-1, sense)) / (2 * _BESIDE) for sense in (True, False)]
    return np.nan_to_num(np.maximum(*slopes), nan=np.inf)


def _infinite_if_unknown(error: Float[Array, " n"], value: Float[Array, " n"]) -> Float[Array, " n"]:
    """Errors, infinite where nothing is known of them though there is a value."""
    return np.where(np.isnan(error) & ~np.isnan(value), np.inf, error)
