"""Pair creation and annihilation: a star, on its way round a circle of the celestial sphere, crosses a caustic."""

import math
from collections.abc import Iterable
from typing import overload

import numpy as np

from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.curves.search_sky import shown_line_of_sight
from kerrcaustics.results.declared import Items, quantity, result, usual_warnings
from kerrcaustics.spacetime.checks import quoted, real_number
from kerrcaustics.spacetime.viewer import Viewer, check_viewer
from kerrcaustics.stars.images import checked_index, checked_sheets
from kerrcaustics.stars.level_curves.circle import Circle
from kerrcaustics.stars.level_curves.meetings import Meetings, meetings
from kerrcaustics.stars.plane_tracks import PlanePairEvents, plane_pair_events

Array = np.ndarray

_TURN = 2 * math.pi


@result("event/1", record="kind order indices star azimuth longitude sky time error at_cusp remarks")
class PairEvent:
    """Two images of a star appear or vanish: the star crosses a caustic."""

    kind: str = quantity(
        "",
        "",
        '"creation" or "annihilation", as time goes on; on a great circle and for an Observer, as longitude grows',
    )
    star: tuple[float, float] = quantity(
        "angle", "rad", "theta', phi' of the star relative to the camera at that moment, phi' in [0, 2 pi)"
    )
    sky: Array = quantity(
        "axis", "1", "direction N on the camera sky where the two images meet; of an Observer (alpha, beta)"
    )
    order: int = quantity("", "1", "order of the critical curve there")
    indices: tuple[int, int] = quantity("pair", "1", "Morse indices of the two images: order - 1 and order")
    azimuth: float = quantity("", "rad", "phi' unwrapped as in `Caustic.celestial`", json="phi_unwrapped_deg")
    longitude: float = quantity(
        "", "rad", "longitude of the star on its circle, in [0, 2 pi): its phi' where that is about the spin axis"
    )
    time: float = quantity(
        "",
        "GM/c^3",
        "coordinate time, in [0, period), for a star whose phi' is that of the camera at time 0; NaN on great circles "
        "and for an Observer",
    )
    error: float = quantity("", "rad", "error of longitude", json="error_rad")
    at_cusp: bool = quantity("", "1", "True where the star passes through a cusp: the pair meets a third image")
    remarks: tuple[str, ...] = quantity("", "", "what is unusual or uncertain; empty when nothing is")

    def __repr__(self) -> str:
        """One line: what, which images, when."""
        when = f"longitude {self.longitude:.9g}" if math.isnan(self.time) else f"time {self.time:.9g}"
        return f"<PairEvent: {self.kind} of images of index {self.indices} at {when}>"


@result("events/1")
class PairEvents(Items[PairEvent]):
    """Pair events in the order of time: a sequence."""

    events: tuple[PairEvent, ...] = quantity("event", "", "the events", column="")
    remarks: tuple[str, ...] = quantity("", "", "what could not be told")


@overload
def pair_events(camera: Viewer, theta: float, max_index: int = ..., *, end: EquatorialPlane) -> PlanePairEvents: ...
@overload
def pair_events(camera: Viewer, theta: float, max_index: int = ..., *, end: float = ...) -> PairEvents: ...
@usual_warnings
def pair_events(
    camera: Viewer, theta: float, max_index: int = 2, *, end: float | EquatorialPlane = math.inf
) -> PairEvents | PlanePairEvents:
    """When pairs of images of a star are created and annihilated, over one orbit of the camera.

    Parameters
    ----------
    camera : Camera or Observer
        A camera on a circular orbit about the spin axis: its velocity has no component but the azimuthal one. For an
        Observer the star moves, and events are in the order of its phi'.
    theta : float
        theta' of the star in radians; in the plane its r.
    max_index : int
        0 to 6: pairs whose images have index up to it.
    end : float
        Radius of the star; math.inf is the celestial sphere. An `EquatorialPlane`: the source circles in the plane,
        seen by any camera that does not lie in it, and events are told by its azimuth.

    Returns
    -------
    PairEvents
        A sequence of PairEvent, in the order of time. For the plane `PlanePairEvents`.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `PairEvent.error`, round-off of the caustic's point, more where it runs nearly along the star's path.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.999, radius=6.03)
    >>> events = kc.pair_events(camera, theta=1.34)
    >>> [(event.kind, event.indices) for event in events]
    [('creation', (1, 2)), ('annihilation', (1, 2))]
    """
    if isinstance(end, EquatorialPlane):
        check_viewer(camera)
        return plane_pair_events(camera, theta, checked_index(max_index), end)
    check_viewer(camera)
    angular_velocity = camera.orbital_velocity()
    height = checked_theta(theta)
    found = meetings(checked_sheets(camera, max_index, end), Circle.about_spin_axis(height))
    events = pair_events_of(camera, found, height, angular_velocity)
    return PairEvents(in_time(e for e in events if e.order <= max_index), found.remarks)


def in_time(events: Iterable[PairEvent]) -> tuple[PairEvent, ...]:
    """Events in the order of time, or of longitude."""
    return tuple(sorted(events, key=lambda event: event.longitude if math.isnan(event.time) else event.time))


def checked_theta(theta: float) -> float:
    """The polar angle of a star, in [0, pi]."""
    number = real_number("theta", theta)
    if not 0 <= number <= math.pi:
        raise ValueError(
            f"Argument `theta` must be a number in [0, pi] radians (0 to 180 degrees), but is {quoted(theta)}."
        )
    return number


def pair_events_of(
    camera: Viewer, found: Meetings, theta: float | None = None, angular_velocity: float = 0.0
) -> list[PairEvent]:
    """The meetings as events, in the same order; theta and angular velocity: of a star, and of its camera's orbit."""
    sky = shown_line_of_sight(camera, found.points.line_of_sight)
    return [_event(found, i, sky[i], theta, angular_velocity) for i in range(len(found.order))]


def _event(found: Meetings, i: int, sky: Array, theta: float | None, angular_velocity: float) -> PairEvent:
    """One of the meetings."""
    order, azimuth = int(found.order[i]), float(found.points.azimuth[i])
    # The star's azimuth falls while the camera runs ahead.
    sense, time = 1.0, math.nan
    if angular_velocity:
        sense, time = -angular_velocity, -azimuth / angular_velocity % (_TURN / abs(angular_velocity))
    remarks = []
    if found.at_cusp[i]:
        remarks.append("the star passes through a cusp: the pair meets a third image there")
    if not found.known[i]:
        remarks.append("the image counts on both sides do not differ by this pair: its kind is uncertain")
    return PairEvent(
        kind="creation" if found.side[i] * sense > 0 else "annihilation",
        star=(float(found.points.theta[i]) if theta is None else theta, azimuth % _TURN),
        sky=sky,
        order=order,
        indices=(order - 1, order),
        azimuth=azimuth,
        longitude=float(found.longitude[i]),
        time=time,
        error=float(found.error[i]),
        at_cusp=bool(found.at_cusp[i]),
        remarks=tuple(remarks),
    )
