"""Images of a great circle of the celestial sphere: curves on the camera sky, with a certificate.

The curves are those along which a star's images move while it runs round the circle (level_curves/), cut where they
meet critical curves. The certificate counts: between two such meetings as many curves must pass as the star there has
images, by the winding of the caustics.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.trace import trace_beams
from kerrcaustics.spacetime.camera import Camera, as_seen
from kerrcaustics.stars.events import PairEvents, in_time, pair_events_of
from kerrcaustics.stars.images import checked_sheets, checked_stars
from kerrcaustics.stars.level_curves.branches import Branches
from kerrcaustics.stars.level_curves.chains import Chain, chains, errors_on_sky
from kerrcaustics.stars.level_curves.circle import Circle
from kerrcaustics.stars.sheets import TOLERANCE

Array = np.ndarray

GALACTIC_POLE = (math.radians(90 - 27.12825), math.radians(192.85948))
"""North galactic pole (theta', phi') where theta' = 90 deg - declination and phi' = right ascension (J2000)."""


@dataclass(frozen=True, eq=False)
class CircleCurve:
    """One image of a great circle, or of a part of it: a curve on the camera sky.

    index: the Morse index; sky (n, 3): directions N; longitude (n,): on the circle, radians, unwrapped, growing;
    closed: the curve returns to its first point (not repeated), else it ends at critical curves; error: of the
    points on the sky, radians, the largest.
    """

    index: int
    sky: Array
    longitude: Array
    closed: bool
    error: float

    @property
    def sweep(self) -> float:
        """Longitude swept, radians; a whole number of circuits where the curve is closed."""
        swept = float(self.longitude[-1] - self.longitude[0])
        return 2 * math.pi * math.ceil(swept / (2 * math.pi)) if self.closed else swept


@dataclass(frozen=True, eq=False)
class CircleImages:
    """The images of a great circle, by Morse index.

    camera; normal: (theta', phi') of its normal, radians; curves: by index; per_index: how many curves of each;
    events: where two of its images meet, in the order of longitude; certified: at every longitude as many curves pass
    as the winding of the caustics tells; remarks: what is not sure.

    Longitude on the circle is counted from its ascending node on the celestial equator (from phi' = 0 where it is the
    equator), right-handed about the normal.
    """

    camera: Camera
    normal: tuple[float, float]
    curves: tuple[CircleCurve, ...]
    per_index: dict[int, int]
    events: PairEvents
    certified: bool
    remarks: tuple[str, ...] = field(default=())

    def __repr__(self) -> str:
        """One line: the normal, how many curves, whether certified."""
        counts = ", ".join(f"{count} of index {k}" for k, count in self.per_index.items())
        note = "" if self.certified else ", not certified"
        return f"<CircleImages of the great circle with normal {self.normal}: {counts}{note}>"


def circle_images(camera: Camera, normal: ArrayLike | str, max_index: int = 2) -> CircleImages:
    """The images of a great circle with Morse index 0 to `max_index`, as curves on the camera sky.

    Parameters
    ----------
    camera : Camera
    normal : (theta', phi') or "galactic plane"
        Of the circle's normal, radians; the galactic plane is that of stars with theta' = 90 deg - declination and
        phi' = right ascension.
    max_index : int
        0 to 6.

    Returns
    -------
    CircleImages

    Errors
    ------
    `CircleCurve.error`: round-off of n' divided by the beam's width across the circle.
    """
    sheets = checked_sheets(camera, max_index)
    angles = _checked_normal(normal)
    branches = Branches(sheets, camera, Circle.great(*angles))
    found = branches.meetings
    events = pair_events_of(camera, found)
    sky = as_seen(branches.nodes.sky, sheets.frame, camera.frame())
    error = errors_on_sky(branches, trace_beams(camera, sky, "auto", TOLERANCE), found.error)
    curves = [_curve(chain, branches, sky, error) for chain in chains(branches, over_events=False)]
    curves.sort(key=lambda curve: (curve.index, curve.longitude[0]))
    unsure = (remark for i in np.flatnonzero(~found.known) for remark in events[i].remarks)
    remarks = (*found.remarks, *branches.remarks, *unsure)
    return CircleImages(
        camera=camera,
        normal=angles,
        curves=tuple(curves),
        per_index={k: sum(curve.index == k for curve in curves) for k in range(len(sheets.sheets))},
        events=PairEvents(in_time(e for e in events if e.order <= max_index), found.remarks),
        certified=not remarks,
        remarks=remarks,
    )


def _curve(chain: Chain, branches: Branches, sky: Array, error: Array) -> CircleCurve:
    """One of the chains; sky and error of the nodes."""
    chosen, nodes = chain.nodes, branches.nodes
    # At both ends lie events, whose nodes do not tell on which of the two sheets the curve is.
    inner = chosen[nodes.event[chosen] < 0]
    turns = 2 * math.pi * np.ceil((chain.longitude[0] - math.pi) / (2 * math.pi))
    return CircleCurve(
        int(nodes.index[inner[0]]), sky[chosen], chain.longitude - turns, chain.closed, float(error[chosen].max())
    )


def _checked_normal(normal: ArrayLike | str) -> tuple[float, float]:
    if isinstance(normal, str):
        if normal == "galactic plane":
            return GALACTIC_POLE
        raise ValueError(f"Argument `normal` must be (theta', phi') or \"galactic plane\", but is {normal!r}.")
    try:
        theta, phi = (float(angle) for angle in np.asarray(normal, float))
        checked_stars([(theta, phi)])
    except (TypeError, ValueError):
        raise ValueError(
            f"Argument `normal` must be (theta', phi') in radians with theta' in [0, pi], but is {normal!r}."
        ) from None
    return theta, phi
