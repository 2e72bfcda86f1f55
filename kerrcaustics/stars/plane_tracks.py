"""A source that circles in the equatorial plane, at one crossing: its pair events, and its tracks on the camera sky.

Its images are the places of one closed curve, the image of the circle (circle_arcs.py). Where the azimuth turns back
along that curve two of them meet: an event. Tracks are the curve, as far as its index is asked for.
"""

import math

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.curves.circle_arcs import Arcs, arcs_of, step_between
from kerrcaustics.curves.lens_map import LensMap, SeenLight
from kerrcaustics.curves.search_sky import search_sky
from kerrcaustics.results.declared import Items, quantity, result, usual_warnings
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import numbers, quoted, real_number
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.stars.images import StarImages, star_images

Array = np.ndarray

_TURN = 2 * math.pi


@result("plane-event/1", record="kind crossing order indices radius azimuth sky error")
class PlanePairEvent:
    """Two images of a source in the plane appear or vanish: on its circle it crosses a caustic."""

    kind: str = quantity("", "", '"creation" or "annihilation", as the azimuth of the source grows')
    crossing: int = quantity("", "1", "which crossing of the plane, from 1")
    order: int = quantity("", "1", "order of the critical curve there")
    indices: tuple[int, int] = quantity("pair", "1", "Morse indices of the two images: order - 1 and order")
    radius: float = quantity("", "GM/c^2", "of the source")
    azimuth: float = quantity("", "rad", "phi of the source at that moment, in [0, 2 pi)", json="phi_deg")
    sky: Array = quantity(
        "axis", "1", "direction N on the camera sky where the two images meet; of an Observer (alpha, beta)"
    )
    error: float = quantity("", "rad", "error of azimuth", json="error_rad")

    def __repr__(self) -> str:
        """One line: what, which images, where."""
        return f"<PlanePairEvent: {self.kind} of images of index {self.indices} at phi = {self.azimuth:.9g}>"


@result("plane-events/1")
class PlanePairEvents(Items[PlanePairEvent]):
    """Pair events of one circle at one crossing, by azimuth: a sequence."""

    events: tuple[PlanePairEvent, ...] = quantity("event", "", "the events", column="")
    certified: bool = quantity("", "1", "True as in `PlaneTracks`")
    remarks: tuple[str, ...] = quantity("", "", "what is in doubt; empty when certified")


@result(
    "plane-track/1",
    record="closed turns places sky azimuth index parity magnification redshift time time_error error",
)
class PlaneTrack:
    """One connected curve on the camera sky along which images of a source move that circles in the plane.

    Its points are in the order of the curve; a closed one does not repeat its first point. It leads through the events,
    where images of two indices meet: there `index` is that of the inner side, and `parity` is 0.
    """

    sky: Array = quantity("point axis", "1", "directions N; of an Observer (alpha, beta)")
    azimuth: Array = quantity(
        "point", "rad", "phi of the source of which there is an image here, continuous along the curve", json="phi_deg"
    )
    index: Array = quantity("point", "1", "Morse index")
    parity: Array = quantity("point", "1", "(-1)^index")
    magnification: Array = quantity(
        "point", "c^4/(GM)^2", "solid angle on the sky by area r dr dphi in the plane: 1 / |det J|"
    )
    redshift: Array = quantity("point", "1", "nu_camera / nu_source, for the plane's emitter")
    time: Array = quantity("point", "GM/c^3", "coordinate time from the source to the camera")
    time_error: Array = quantity("point", "GM/c^3", "estimated error of time")
    error: Array = quantity("point", "rad", "error of sky", json="error_rad")
    closed: bool = quantity(
        "", "1", "True for the whole circle; else both ends are events of order max_index + 1, and images go on there"
    )
    turns: int = quantity("", "1", "whole turns by which the azimuth grows along a closed track; 0 for others")
    events: tuple[PlanePairEvent, ...] = quantity("track_event", "", "events in the order of the curve")
    places: tuple[int, ...] = quantity("track_event", "1", "which point each event is", json="event_points")

    def __len__(self) -> int:
        """Number of points."""
        return len(self.index)

    def __repr__(self) -> str:
        """One line: how long, which indices, how many events."""
        shape = "closed" if self.closed else "open"
        indices = sorted(set(self.index.tolist()))
        return f"<PlaneTrack of {len(self)} points, {shape}, index {indices}, {len(self.events)} events>"


@result("plane-tracks/1", record="camera crossing radius max_index certified remarks tracks events ends")
class PlaneTracks:
    """All tracks of a source that circles in the equatorial plane, by rays at their n-th crossing."""

    camera: Viewer = quantity("", "", "the camera", json="", column="")
    crossing: int = quantity("", "1", "which crossing of the plane, from 1")
    emitter: str = quantity("", "", "what shines there, for the redshift")
    radius: float = quantity("", "GM/c^2", "of the circle")
    max_index: int = quantity("", "1", "highest Morse index that was asked for")
    tracks: tuple[PlaneTrack, ...] = quantity("track", "", "tracks, those with images of low index first")
    events: tuple[PlanePairEvent, ...] = quantity("event", "", "events of images up to max_index, by azimuth")
    ends: tuple[PlanePairEvent, ...] = quantity(
        "end", "", "events in which an image of index max_index meets one of a higher index: the ends of open tracks"
    )
    certified: bool = quantity(
        "",
        "1",
        "True where the image of the circle is whole, and its azimuth runs on each part of it as the index there says, "
        "once round in all",
    )
    remarks: tuple[str, ...] = quantity("", "", "what is in doubt; empty when certified")

    def __repr__(self) -> str:
        """One line: the circle, how many tracks and events."""
        doubt = "" if self.certified else ", not certified"
        where = f"r = {self.radius:g}, crossing {self.crossing}"
        return f"<PlaneTracks of {where}: {len(self.tracks)} tracks, {len(self.events)} events{doubt}>"

    @usual_warnings
    def images_at(self, azimuth: ArrayLike) -> StarImages | tuple[StarImages, ...]:
        """All images of the source at an azimuth, radians, as `star_images` gives them; a tuple for an array."""
        given = numbers("azimuth", azimuth)
        if given.ndim > 1 or not np.isfinite(given).all():
            raise ValueError(
                f"Argument `azimuth` must be a finite number or a one-dimensional array, but is {quoted(azimuth)}."
            )
        end = EquatorialPlane(self.crossing, self.emitter)
        every = given.reshape(-1).tolist()
        images = tuple(star_images(self.camera, (self.radius, phi), self.max_index, end=end) for phi in every)
        return images if given.ndim else images[0]


def plane_pair_events(camera: Viewer, radius: object, max_index: int, end: EquatorialPlane) -> PlanePairEvents:
    """Events of a source that circles in the plane, of pairs with images of index up to max_index."""
    arcs = _circle(camera, radius, end)
    found = [event for event in _events(camera, arcs).values() if event.order <= max_index]
    return PlanePairEvents(_by_azimuth(found), not arcs.doubts, arcs.doubts)


def plane_tracks(camera: Viewer, radius: object, max_index: int, end: EquatorialPlane) -> PlaneTracks:
    """Tracks of a source that circles in the plane, of images of index up to max_index."""
    arcs = _circle(camera, radius, end)
    events = _events(camera, arcs)
    return PlaneTracks(
        camera=camera,
        crossing=end.crossing,
        emitter=end.emitter,
        radius=arcs.radius,
        max_index=max_index,
        tracks=_tracks(camera, arcs, events, max_index, end),
        events=_by_azimuth([event for event in events.values() if event.order <= max_index]),
        ends=_by_azimuth([event for event in events.values() if event.order == max_index + 1]),
        certified=not arcs.doubts,
        remarks=arcs.doubts,
    )


def _circle(camera: Viewer, radius: object, end: EquatorialPlane) -> Arcs:
    r, horizon = real_number("theta", radius), kerr.horizon(camera.spin)
    if not horizon < r < math.inf:
        raise ValueError(
            "Argument `theta` must be, in the equatorial plane, a finite radius larger than the horizon's "
            f"{horizon:.12g}, but is {quoted(radius)}."
        )
    return arcs_of(camera, end.crossing, r)


def _by_azimuth(events: list[PlanePairEvent]) -> tuple[PlanePairEvent, ...]:
    return tuple(sorted(events, key=lambda event: event.azimuth))


def _events(camera: Viewer, arcs: Arcs) -> dict[int, PlanePairEvent]:
    """The events of a circle, by the arc that begins there."""
    which = np.flatnonzero(arcs.folded)
    folds = arcs.low[which]
    sky = search_sky(camera).shown(folds.sky)
    error = _event_errors(arcs, folds.edge_phase, folds.distance)
    orders = np.maximum(arcs.index, np.roll(arcs.index, 1))[which].tolist()
    return {
        arc: PlanePairEvent(
            kind="creation" if arcs.sense[arc] > 0 else "annihilation",
            crossing=arcs.circles.end.crossing,
            order=order,
            indices=(order - 1, order),
            radius=arcs.radius,
            azimuth=float(folds.azimuth[i] % _TURN),
            sky=sky[i],
            error=float(error[i]),
        )
        for i, (arc, order) in enumerate(zip(which.tolist(), orders, strict=True))
    }


def _event_errors(
    arcs: Arcs, edge_phase: Float[Array, " folds"], distance: Float[Array, " folds"]
) -> Float[Array, " folds"]:
    """Errors of azimuth: that of the rays, and what they miss the circle by, times the slope of the caustic there.

    The beams are flat, so that J's rows, (dr, r dphi), are along the caustic.
    """
    if not len(edge_phase):
        return edge_phase
    _, beams = arcs.circles.beams(edge_phase, distance)
    along_r, along_phi = np.linalg.norm(beams.jacobian, axis=-1).T
    miss = np.abs(np.log(np.asarray(beams.radius) / arcs.radius))
    return np.asarray(beams.error + (beams.error + miss) * along_phi / along_r)


def _tracks(
    camera: Viewer, arcs: Arcs, events: dict[int, PlanePairEvent], max_index: int, end: EquatorialPlane
) -> tuple[PlaneTrack, ...]:
    if not len(arcs.index):
        return ()
    lens_map = LensMap(camera, end)
    light = lens_map.seen(arcs.low.sky)
    times = np.stack([np.asarray(light.time), np.asarray(light.time_error)])
    error = lens_map.errors(arcs.low.sky, _errors_on_sky(arcs, light.beams))
    chains = _chains(arcs.index <= max_index)
    tracks = [_track(arcs, chain, events, light, times, error) for chain in chains]
    return tuple(sorted(tracks, key=lambda track: (track.index.min(), not track.closed, len(track))))


def _chains(kept: Array) -> list[Int[Array, " _"]]:
    """Nodes of connected pieces: of the whole circle once, of others with the node at which each ends."""
    if kept.all():
        return [np.arange(len(kept))]
    starts = np.flatnonzero(kept & ~np.roll(kept, 1))
    stops = np.flatnonzero(~kept & np.roll(kept, 1))
    return [(i + np.arange(int(((stops - i) % len(kept)).min()) + 1)) % len(kept) for i in starts.tolist()]


def _errors_on_sky(arcs: Arcs, beams: Beams) -> Float[Array, " nodes"]:
    """Errors of the nodes' directions, radians.

    Where the beam is flat its direction is that in which the ratio of its diameters vanishes: the error is that of the
    ratio by its slope, which the nodes next to it tell.
    """
    low = arcs.low
    size = np.where(low.ratio == 0, 1, np.abs(low.ratio))
    miss = np.abs(np.log(low.radius / arcs.radius))
    plain = arcs.radius * (low.error + miss) / np.where(low.minor == 0, 1, low.minor)
    gaps = (np.linalg.norm(low.sky - np.roll(low.sky, k, axis=0), axis=1) / np.roll(size, k) for k in (1, -1))
    return np.where(arcs.folded, np.maximum(*gaps) * beams.jacobian_error, plain)


def _track(
    arcs: Arcs,
    chain: Int[Array, " _"],
    events: dict[int, PlanePairEvent],
    light: SeenLight,
    times: Float[Array, "2 nodes"],
    error: Float[Array, " nodes"],
) -> PlaneTrack:
    """One of the chains of nodes."""
    closed = len(chain) == len(arcs.index)
    low, folded = arcs.low[chain], arcs.folded[chain]
    steps = step_between(low, arcs.high[chain])
    index = np.where(folded, np.maximum(arcs.index, np.roll(arcs.index, 1))[chain], arcs.index[chain])
    places = np.flatnonzero(folded)
    return PlaneTrack(
        sky=light.sky[chain],
        azimuth=low.azimuth[0] + np.concatenate([[0], np.cumsum(steps[:-1])]),
        index=index,
        parity=np.where(folded, 0, 1 - 2 * (index % 2)),
        magnification=np.where(folded, np.inf, light.magnification[chain]),
        redshift=light.redshift[chain],
        time=times[0, chain],
        time_error=times[1, chain],
        error=error[chain],
        closed=closed,
        turns=round(steps.sum() / _TURN) if closed else 0,
        events=tuple(events[i] for i in chain[places].tolist()),
        places=tuple(places.tolist()),
    )
