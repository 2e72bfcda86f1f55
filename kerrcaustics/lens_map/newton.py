"""Newton's method on the sky map, for many stars at once, without leaving the sheet that each search is on."""

import numpy as np

from kerrcaustics.beams import calls
from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.ends import SKY, End
from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.lens_map import newton_limits as limits
from kerrcaustics.lens_map.domains import domain_of
from kerrcaustics.lens_map.search_sky import TOLERANCE
from kerrcaustics.lens_map.sky_chart import chart_of, straight
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.sphere import lengths
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_MOST_STEPS = 80


def find_roots(
    camera: Viewer,
    star: Float[Array, "searches axes"],
    index: Int[Array, " searches"],
    sky: Float[Array, "searches 3"],
    most_steps: int = _MOST_STEPS,
    *,
    end: End = SKY,
) -> tuple[Int[Array, " images"], Float[Array, "images 3"], Float[Array, " images"]]:
    """Directions on the sky that show the stars, from first guesses `sky`.

    A search stays where the Morse index is `index`: a step that would leave, or that brings the ray's end no closer to
    the star, is shortened. Searches for images that do not exist come to rest on a critical curve and are left out, as
    are those that take more than `most_steps`. star: vectors of the surface `end` on which the stars lie.

    Returns: which searches found an image, its direction, and the error of that in radians: the error of the end and
    what is left of the way to the star, divided by the smaller diameter of the beam.
    """
    # Directions toward the hole itself have no place in the chart.
    charted = camera == camera.at_rest() and not domain_of(end, camera).falls
    edge, surface = chart_of(camera).even_edge if charted else np.zeros((1, 4)), end.bare()
    if edge is None or surface.in_plane or not len(star):
        return step_by_step(camera, star, index, sky, most_steps, end, charted)
    columns = [sky, star, index.astype(float)]
    found, error, state = calls.roots(camera, columns, surface, (charted, len(edge), most_steps), edge)
    rest = np.flatnonzero(state == limits.UNSURE)
    if len(rest):
        which, places, errors = step_by_step(
            camera, star[rest], index[rest], sky[rest], most_steps, end.rows(rest), charted
        )
        found[rest[which]], error[rest[which]], state[rest[which]] = places, errors, limits.FOUND
    which = np.flatnonzero(state == limits.FOUND)
    return which, found[which], error[which]


def step_by_step(
    camera: Viewer,
    star: Float[Array, "searches axes"],
    index: Int[Array, " searches"],
    sky: Float[Array, "searches 3"],
    most_steps: int,
    end: End,
    charted: bool,
) -> tuple[Int[Array, " images"], Float[Array, "images 3"], Float[Array, " images"]]:
    """`find_roots` by beams of either engine, all searches together."""
    stepped, n = chart_of(camera).stepped if charted else straight, len(star)
    sky, step = sky.copy(), np.zeros((n, 3))
    residual, error, part = np.full(n, np.inf), np.full(n, np.nan), np.ones(n)
    converged = np.zeros(n, bool)
    active = np.arange(n)
    trial, taken = sky, np.zeros(n)
    for _ in range(most_steps):
        beams = beams_of_directions(camera, trial, "auto", TOLERANCE, crossings=False, redshift=False, end=end.bare())
        target_step, distance = _newton_step(end, star[active], trial, beams)
        before = residual[active]
        # A linear map would bring n' closer by the part of the step that is taken; a third of that is asked for.
        allowed = (beams.index == index[active]) & (distance < residual[active] * (1 - taken / 3))
        # As close as the errors of the beams allow: no step is better, and none is needed.
        settled = ~allowed & (residual[active] < limits.MOST_ERRORS * beams.error) & (part[active] == 1)
        # Newton's method squares the residual: where one more step ends within the error, it is not traced. On a fold
        # a step is long, and what it leaves goes by its square.
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            curving = limits.CURVING / np.minimum(np.abs(beams.delta_minus), 1) ** 2
            left = distance**2 * np.maximum(limits.SAFETY * distance / before**2, curving)
        last = allowed & (taken == 1) & (left <= beams.error) & (distance > limits.ERRORS * beams.error)
        better = active[allowed]
        sky[better], step[better], residual[better] = trial[allowed], target_step[allowed], distance[allowed]
        with np.errstate(divide="ignore"):
            off = beams.error + np.where(last, left, distance)
            error[better] = (off * end.scale(beams) / np.abs(beams.delta_minus))[allowed]
        part[better] = np.minimum(1, 4 * part[better])
        part[active[~allowed]] /= 4
        done = settled | (allowed & (distance <= limits.ERRORS * beams.error))
        converged[active[done | last]] = True
        going = last | (~done & (part[active] > limits.SHORTEST_PART) & np.isfinite(residual[active]))
        # Where a beam is flat within rounding no step is known.
        going &= np.isfinite(step[active]).all(axis=1)
        active, last = active[going], last[going]
        if active.size == 0:
            break
        trial, taken = stepped(sky[active], step[active], part[active])
        sky[active[last]] = trial[last]
        active, trial, taken = active[~last], trial[~last], taken[~last]
        if active.size == 0:
            break
    which = np.flatnonzero(converged)
    return which, sky[which], error[which]


def _newton_step(
    end: End, star: Float[Array, "searches axes"], sky: Float[Array, "searches 3"], beams: Beams
) -> tuple[Float[Array, "searches 3"], Float[Array, " searches"]]:
    """The step on the sky that a linear map would ask for, and the distance of the star from the end of the ray.

    The distance is the angle between both, in the plane their distance relative to r.
    """
    scale = end.scale(beams)
    chord = lengths(star - end.ends(beams)) / scale
    # In the plane a chord may be longer than those of a unit circle.
    distance = 2 * np.arcsin(np.minimum(chord / 2, 1)) + np.maximum(chord - 2, 0)
    flat = end.displacement(beams, star)
    size = lengths(flat)
    flat *= (distance * scale / np.where(size == 0, 1, size))[:, None]
    return beams.pulled_back(sky, flat), np.where(np.isfinite(distance), distance, np.inf)
