"""Pair creation and annihilation: a star that runs round a circle crosses a caustic."""

import math
from collections.abc import Iterable
from functools import singledispatch

import numpy as np

from kerrcaustics.beams.ends import End, Wherever
from kerrcaustics.choices import event_kind
from kerrcaustics.images.circle_arcs import Arcs, arcs_of
from kerrcaustics.images.circle_folds import fold_errors, fold_orders
from kerrcaustics.images.events import Event
from kerrcaustics.images.sheets import checked_sheets
from kerrcaustics.lens_map.arguments import checked_index
from kerrcaustics.lens_map.domains import Domain, Ring, domain_of, search_surface
from kerrcaustics.lens_map.lens_map import TRAVEL_TIME, LensMap, SeenLight
from kerrcaustics.level_curves.path_events import PathEvents, path_events
from kerrcaustics.results import declared
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.results.shown import Items
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.frame import sky_from_line_of_sight
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray

_TURN = 2 * math.pi


@result(
    "event/2",
    record="kind order indices star azimuth longitude sky moment emission_time time time_error error at_cusp remarks",
)
class PairEvent(Event):
    """Two images of a star appear or vanish: the star crosses a caustic."""

    surface: End = declared.surface(json=None)
    star: tuple[float, float] = quantity(
        "angle",
        "place",
        "theta', phi' of the source relative to the camera at that moment, phi' in [0, 2 pi); in the plane r, phi",
    )
    indices: tuple[int, int] = quantity("pair", "1", "Morse indices of the two images: order - 1 and order")
    azimuth: float = quantity("", "rad", "phi' unwrapped as in `Caustic.celestial`", json="phi_unwrapped_deg")
    longitude: float = quantity(
        "", "rad", "longitude of the star on its circle, in [0, 2 pi): its phi' where that is about the spin axis"
    )
    time: float = quantity("", "GM/c^3", TRAVEL_TIME)
    time_error: float = quantity("", "GM/c^3", "error of time")
    error: float = quantity("", "rad", "error of longitude", json="error_rad")
    second_arrival: bool = quantity(
        "", "1", "True if the rays meet the sphere, within the camera's radius, for the second time"
    )
    at_cusp: bool = quantity("", "1", "True where the star passes through a cusp: the pair meets a third image")
    remarks: tuple[str, ...] = declared.remarks("remarks on what is unusual or uncertain; otherwise empty")

    def __repr__(self) -> str:
        """Summary in one line: kind, indices of the images, moment."""
        when = f"longitude {self.longitude:.9g}" if math.isnan(self.moment) else f"time {self.moment:.9g}"
        return f"<PairEvent: {self.kind} of images of index {self.indices} at {when}>"


@result("events/1")
class PairEvents(Items[PairEvent]):
    """Pair events in order of time: a sequence."""

    events: tuple[PairEvent, ...] = quantity("event", "", "the events", column="")
    camera: Viewer = declared.viewer()
    surface: End = declared.surface()
    certified: bool = declared.certified("True when nothing is in doubt")
    remarks: tuple[str, ...] = declared.remarks()


@usual_warnings
@with_progress
def pair_events(
    camera: Viewer,
    level: float,
    max_index: int = 2,
    *,
    end: Wherever | End = math.inf,
    progress: Progress | bool | None = None,
) -> PairEvents:
    """Creations and annihilations of pairs of images of a star, over one orbit of the camera.

    Parameters
    ----------
    camera : Camera or Observer
        A camera on a circular orbit about the spin axis: its velocity is purely azimuthal. For an Observer the star
        moves instead, and events are in order of its phi'.
    level : float
        theta' of the star in radians; in the plane its r.
    max_index : int
        0 to 6: highest Morse index of the images in the pairs.
    end : float, Sphere or EquatorialPlane
        Radius of the star; math.inf is the celestial sphere. An `EquatorialPlane`: the source circles in the plane,
        seen by any camera outside the plane, and events are in order of its azimuth.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    PairEvents
        A sequence of PairEvent, in order of time.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `PairEvent.error`: round-off of the point on the caustic, larger if the caustic runs nearly along the star's path.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.999, radius=6.03)
    >>> events = kc.pair_events(camera, level=1.34)
    >>> [(event.kind, event.indices) for event in events]
    [('creation', (1, 2)), ('annihilation', (1, 2))]
    """
    check_viewer(camera)
    surface, highest = search_surface(camera, end), checked_index(max_index)
    height = surface.checked_level("level", level, camera)
    return _events_on(domain_of(surface, camera), camera, surface, height, highest)


@singledispatch
def _events_on(domain: Domain, camera: Viewer, surface: End, level: float, max_index: int) -> PairEvents:
    """Events of a source that circles on a sphere."""
    angular_velocity = camera.orbital_velocity()
    on_path = path_events(checked_sheets(camera, max_index, surface), Circle(level, surface.axes))
    events = pair_events_of(camera, surface, on_path, level, angular_velocity)
    chosen = [(event, known) for event, known in zip(events, on_path.known, strict=True) if event.order <= max_index]
    sure = not on_path.remarks and all(known for _, known in chosen)
    return PairEvents(in_time(event for event, _ in chosen), camera, surface, sure, on_path.remarks)


@_events_on.register
def _events_in_ring(domain: Ring, camera: Viewer, surface: End, level: float, max_index: int) -> PairEvents:
    arcs = arcs_of(domain, level)
    events = [event for event in arc_events(camera, arcs, surface).values() if event.order <= max_index]
    return PairEvents(in_time(events), camera, surface, not arcs.remarks, arcs.remarks)


def in_time(events: Iterable[PairEvent]) -> tuple[PairEvent, ...]:
    """Events in order of time, or of longitude."""
    return tuple(sorted(events, key=when))


def when(event: PairEvent) -> float:
    """The moment of an event, or the longitude of its source where that moves."""
    return event.longitude if math.isnan(event.moment) else event.moment


def arc_events(camera: Viewer, arcs: Arcs, surface: End) -> dict[int, PairEvent]:
    """The events of a circle in the plane, by the arc that begins at each."""
    which = np.flatnonzero(arcs.folded)
    folds = arcs.low[which]
    light, error = LensMap(camera, surface).light_at(folds.sky), fold_errors(arcs)
    orders = fold_orders(arcs).tolist()
    return {
        arc: PairEvent(
            surface=surface,
            kind=event_kind(arcs.sense[arc]),
            star=(arcs.radius, float(folds.azimuth[i] % _TURN)),
            sky=light.sky[i],
            order=order,
            indices=(order - 1, order),
            azimuth=float(folds.azimuth[i]),
            longitude=float(folds.azimuth[i] % _TURN),
            moment=math.nan,
            emission_time=math.nan,
            time=float(light.time[i]),
            time_error=float(light.time_error[i]),
            error=float(error[i]),
            second_arrival=False,
            at_cusp=False,
            remarks=(),
        )
        for i, (arc, order) in enumerate(zip(which.tolist(), orders, strict=True))
    }


def pair_events_of(
    camera: Viewer, surface: End, events: PathEvents, level: float | None = None, angular_velocity: float = 0.0
) -> list[PairEvent]:
    """Events of a path as results; level and angular velocity: of a star, and of its camera's orbit."""
    lens_map = LensMap(camera, surface)
    sky = sky_from_line_of_sight(lens_map.sky.search_camera.frame(), events.points.line_of_sight)
    light = lens_map.light_at(sky, events.second_arrival)
    return [_event(surface, events, i, light, level, angular_velocity) for i in range(len(events.order))]


def _event(
    surface: End, events: PathEvents, i: int, light: SeenLight, level: float | None, angular_velocity: float
) -> PairEvent:
    """The event of one entry."""
    order = int(events.order[i])
    theta, azimuth = (float(angle[i]) for angle in surface.angles(events.points.direction, events.points.azimuth))
    # The star's azimuth falls while the camera runs ahead.
    sense, moment = 1.0, math.nan
    if angular_velocity:
        sense, moment = -angular_velocity, -azimuth / angular_velocity % (_TURN / abs(angular_velocity))
    remarks = []
    if events.at_cusp[i]:
        remarks.append("the star passes through a cusp: the pair meets a third image there")
    if not events.known[i]:
        remarks.append("the image counts on both sides do not differ by this pair: its kind is uncertain")
    return PairEvent(
        surface=surface,
        kind=event_kind(events.side[i] * sense),
        star=(theta if level is None else level, azimuth % _TURN),
        sky=light.sky[i],
        order=order,
        indices=(order - 1, order),
        azimuth=azimuth,
        longitude=float(events.longitude[i]),
        moment=moment,
        emission_time=moment - float(light.time[i]),
        time=float(light.time[i]),
        time_error=float(light.time_error[i]),
        error=float(events.error[i]),
        second_arrival=bool(events.second_arrival[i]),
        at_cusp=bool(events.at_cusp[i]),
        remarks=tuple(remarks),
    )
