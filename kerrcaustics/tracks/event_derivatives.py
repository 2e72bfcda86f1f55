"""Derivatives of pair events by the hole, the viewer and the path: implicit differentiation of the lens map.

At an event the place s on the sky obeys det J(p, s) = 0, and x_1(p, s) = level, the first coordinate of the path. So
both equations give how s changes with a number p or with the level, and with it x_2, where the event is, and the
travel time.
"""

import math
from functools import partial

import numpy as np

from kerrcaustics.beams.ends import SKY, End
from kerrcaustics.lens_map.expansions import REFINED, expanded, inverse, source_parameters, with_errors
from kerrcaustics.lens_map.search_sky import search_sky
from kerrcaustics.results import declared
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.viewer import Viewer, check_viewer
from kerrcaustics.tracks.events import PairEvent, PairEvents

Array = np.ndarray

# The longitude of an event is the azimuth of its source, if the path is a circle about the spin axis.
_SAME = 1e-6


@result("event-derivatives/1", record="parameters", rows="azimuth time error")
class EventDerivatives(Shown):
    """Derivatives of pair events, in their order, with respect to the viewer's parameters and the level of the path.

    For a camera that orbits, the moment of an event is -azimuth / angular_velocity.
    """

    parameters: tuple[str, ...] = quantity(
        "parameter",
        "",
        "parameters of the derivatives, lengths in M and angles in radians: spin, radius, inclination of the viewer "
        "(no radius for an Observer at infinity); the level: theta, in the plane source_radius",
    )
    azimuth: Array = quantity("event parameter", "1", "derivatives of the azimuth of the source at the event")
    time: Array = quantity("event parameter", "GM/c^3", "derivatives of the travel time")
    error: Array = quantity(
        "event kind", "1", "estimated errors of the derivatives of azimuth and of time, relative to their largest"
    )
    camera: Viewer = declared.viewer()
    surface: End = declared.surface()

    def __len__(self) -> int:
        """Number of events."""
        return len(self.azimuth)


@usual_warnings
def event_derivatives(camera: Viewer, events: PairEvents) -> EventDerivatives:
    """Derivatives of the azimuth and of the travel time at which pairs of images are created and annihilated.

    Parameters
    ----------
    camera : Camera or Observer
        Viewer of the events. Its velocity does not affect the azimuth.
    events : PairEvents
        Result of `pair_events` for this viewer, or `StarTracks.events`, on any surface.

    Returns
    -------
    EventDerivatives

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `EventDerivatives.error`: as for `image_derivatives`. If the caustic runs along the path of the source, as at a
    cusp that points along it, the derivatives are infinite, and the errors equally large.

    References
    ----------
    The implicit function theorem.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.999, radius=6.03)
    >>> change = kc.event_derivatives(camera, kc.pair_events(camera, level=1.34))
    >>> change.parameters, change.azimuth.shape
    (('spin', 'radius', 'inclination', 'theta'), (2, 4))
    """
    check_viewer(camera)
    _check_events(camera, events)
    surface = events[0].surface if len(events) else SKY
    searched = search_sky(camera)
    viewer = searched.search_camera
    parameters = (*viewer.parameters, source_parameters(surface)[0])
    if not len(events):
        none = np.empty((0, len(parameters)))
        return EventDerivatives(parameters, none, none, np.empty((0, 2)), camera, surface)
    sky = viewer.places(searched.to_search(np.array([event.sky for event in events])))
    error = REFINED * np.linalg.norm(sky, axis=1)
    (azimuth, time), errors = with_errors(partial(_of_events, viewer, surface, list(events)), viewer, sky, error)
    time = time + [searched.time_slope * (name == "radius") for name in parameters]
    return EventDerivatives(parameters, azimuth, time, errors, camera, surface)


def _check_events(camera: Viewer, events: object) -> None:
    """Raise ValueError unless events are those of a source that circles about the spin axis, as the viewer sees it."""
    if not isinstance(events, PairEvents):
        raise ValueError(f"Argument `events` must be PairEvents, but is {type(events).__name__}.")
    axes = camera.places(np.zeros((0, 3))).shape[-1]
    if any(len(event.sky) != axes for event in events):
        raise ValueError(f"Argument `events` must be those that `camera` sees, at places ({camera.sky_coordinates}).")
    if any(abs(math.sin((event.longitude - event.star[1]) / 2)) > _SAME for event in events):
        raise ValueError(
            "Argument `events` must be those of a source that circles about the spin axis, but its path is a great "
            "circle about another one."
        )


def _of_events(
    viewer: Viewer,
    surface: End,
    events: list[PairEvent],
    sky: Float[Array, "rays axes"],
    number: Int[Array, " rays"],
    density: float,
) -> tuple[Float[Array, "rays numbers"], Float[Array, "rays numbers"]]:
    """Derivatives of the azimuth and of the time of events, for rays next to them.

    number: of the event that each ray belongs to.
    """
    place = np.array([(event.star[0], event.azimuth) for event in events])[number]
    at = expanded(viewer, surface, sky, density, np.array([event.second_arrival for event in events])[number])
    tangents = surface.tangents(place)
    to_places = inverse(tangents)
    along, given = (to_places @ part[:, : tangents.shape[1]] for part in (at.sky, at.given))
    count = len(sky)
    # Changes of det J and of the first coordinate: none, but for the level itself.
    target_step = np.zeros((count, 2, given.shape[2] + 1))
    target_step[:, 0, :-1], target_step[:, 1, :-1], target_step[:, 1, -1] = -at.given[:, 4], -given[:, 0], 1.0
    moved = inverse(np.stack([at.sky[:, 4], along[:, 0]], axis=1)) @ target_step
    fixed = np.pad(np.stack([given[:, 1], at.given[:, 3]], axis=1), ((0, 0), (0, 0), (0, 1)))
    azimuth, time = np.moveaxis(fixed + np.stack([along[:, 1], at.sky[:, 3]], axis=1) @ moved, 1, 0)
    return azimuth, time
