"""Pair creation and annihilation: a star, on its way round the sky of an orbiting camera, crosses a caustic."""

import math
from collections.abc import Iterable

import numpy as np

from kerrcaustics.results.declared import Items, quantity, result
from kerrcaustics.spacetime.camera import Camera, check_camera, sky_from_fido
from kerrcaustics.stars.images import checked_sheets
from kerrcaustics.stars.meetings import Meetings, meetings

Array = np.ndarray

_TURN = 2 * math.pi
# A camera that turns slower than this part of its terms is at rest.
_ROUND_OFF = 1e-12


@result("event/1", record="kind order indices star azimuth sky time error at_cusp remarks")
class PairEvent:
    """Two images of a star appear or vanish: the star crosses a caustic."""

    kind: str = quantity("", "", '"creation" or "annihilation", as time goes on')
    star: tuple[float, float] = quantity(
        "angle", "rad", "theta', phi' of the star relative to the camera at that moment, phi' in [0, 2 pi)"
    )
    sky: Array = quantity("axis", "1", "direction N on the camera sky where the two images meet")
    order: int = quantity("", "1", "order of the critical curve there")
    indices: tuple[int, int] = quantity("pair", "1", "Morse indices of the two images: order - 1 and order")
    azimuth: float = quantity("", "rad", "phi' unwrapped as in `Caustic.celestial`", json="phi_unwrapped_deg")
    time: float = quantity(
        "", "GM/c^3", "coordinate time, in [0, period), for a star whose phi' is that of the camera at time 0"
    )
    error: float = quantity("", "rad", "error of azimuth", json="error_rad")
    at_cusp: bool = quantity("", "1", "True where the star passes through a cusp: the pair meets a third image")
    remarks: tuple[str, ...] = quantity("", "", "what is unusual or uncertain; empty when nothing is")

    def __repr__(self) -> str:
        """One line: what, which images, when."""
        return f"<PairEvent: {self.kind} of images of index {self.indices} at time {self.time:.9g}>"


@result("events/1")
class PairEvents(Items[PairEvent]):
    """Pair events in the order of time: a sequence."""

    events: tuple[PairEvent, ...] = quantity("event", "", "the events", column="")
    remarks: tuple[str, ...] = quantity("", "", "what could not be told")


def pair_events(camera: Camera, theta: float, max_index: int = 2) -> PairEvents:
    """When pairs of images of a star are created and annihilated, over one orbit of the camera.

    Parameters
    ----------
    camera : Camera
        On a circular orbit about the spin axis: its velocity has no component but the azimuthal one.
    theta : float
        theta' of the star in radians.
    max_index : int
        0 to 6: pairs whose images have index up to it.

    Returns
    -------
    PairEvents
        A sequence of PairEvent, in the order of time.

    Errors
    ------
    `PairEvent.error`, round-off of the caustic's point, more where it runs nearly along the star's path.
    """
    angular_velocity = orbital_velocity(camera)
    height = checked_theta(theta)
    sheets = checked_sheets(camera, max_index)
    found = meetings(sheets, height)
    events = pair_events_of(camera, angular_velocity, height, found)
    return PairEvents(in_time(e for e in events if e.order <= max_index), found.remarks)


def in_time(events: Iterable[PairEvent]) -> tuple[PairEvent, ...]:
    """Events in the order of time."""
    return tuple(sorted(events, key=lambda event: event.time))


def orbital_velocity(camera: Camera) -> float:
    """Angular velocity (coordinate azimuth per coordinate time) of a camera that circles the spin axis."""
    check_camera(camera)
    v_r, v_theta, v_phi = camera.fido_velocity()
    frame = camera.frame()
    scale = frame.cylindrical_scale * frame.sin_theta
    own = frame.lapse * v_phi / scale if scale > 0 else 0.0
    angular_velocity = frame.shift + own
    turns = scale > 0 and abs(angular_velocity) > _ROUND_OFF * (abs(frame.shift) + abs(own))
    if v_r != 0 or v_theta != 0 or not turns:
        raise ValueError(
            "Argument `camera` must orbit the spin axis (a purely azimuthal velocity, and an angular velocity that is "
            f"not 0), but is {camera}."
        )
    return angular_velocity


def checked_theta(theta: float) -> float:
    """The polar angle of a star, in [0, pi]."""
    try:
        number = float(theta)
    except (TypeError, ValueError):
        number = math.nan
    if not 0 <= number <= math.pi:
        raise ValueError(f"Argument `theta` must be a number in [0, pi] radians (0 to 180 degrees), but is {theta!r}.")
    return number


def pair_events_of(camera: Camera, angular_velocity: float, theta: float, found: Meetings) -> list[PairEvent]:
    """The meetings as events, one each, in the same order."""
    period = _TURN / abs(angular_velocity)
    sky = sky_from_fido(camera.frame(), -found.points.looking)
    events = []
    for i, order in enumerate(found.order.tolist()):
        # The star's azimuth falls while the camera runs ahead.
        created = found.side[i] * angular_velocity < 0
        remarks = []
        if found.at_cusp[i]:
            remarks.append("the star passes through a cusp: the pair meets a third image there")
        if not found.known[i]:
            remarks.append("the image counts on both sides do not differ by this pair: its kind is uncertain")
        events.append(
            PairEvent(
                kind="creation" if created else "annihilation",
                star=(theta, float(found.azimuth[i])),
                sky=sky[i],
                order=order,
                indices=(order - 1, order),
                azimuth=float(found.points.azimuth[i]),
                time=float(-found.points.azimuth[i] / angular_velocity) % period,
                error=float(found.error[i]),
                at_cusp=bool(found.at_cusp[i]),
                remarks=tuple(remarks),
            )
        )
    return events
