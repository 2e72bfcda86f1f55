"""Images of a great circle of the celestial sphere: curves on the camera sky, with a certificate.

A star that runs round the circle has images that move along these curves (level_curves/), which end on critical curves.
The certificate is a count: between two such events the number of curves must equal that of the star's images, which
the winding of the caustics gives.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.ends import End, Wherever
from kerrcaustics.choices import suggestion
from kerrcaustics.images.certificates import certificate_of
from kerrcaustics.images.sheets import checked_sheets
from kerrcaustics.lens_map.arguments import checked_place
from kerrcaustics.lens_map.domains import search_surface
from kerrcaustics.lens_map.lens_map import TRAVEL_TIME, LensMap, SeenLight
from kerrcaustics.level_curves.branches import Branches
from kerrcaustics.level_curves.chains import Chain, chains, errors_on_sky
from kerrcaustics.results import declared
from kerrcaustics.results.declared import derived, quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.results.shown import Shown
from kerrcaustics.spacetime.checks import quoted
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.viewer import Viewer, check_viewer
from kerrcaustics.tracks.events import PairEvents, in_time, pair_events_of

Array = np.ndarray

GALACTIC_POLE = (math.radians(90 - 27.12825), math.radians(192.85948))
"""North galactic pole (theta', phi') where theta' = 90 deg - declination and phi' = right ascension (J2000)."""


@result(
    "circle-curve/1",
    record="index closed longitude_from longitude_to ends error",
    points="sky longitude time time_error",
)
class CircleCurve(Shown):
    """An image of a great circle, or of a part of it: a curve on the camera sky."""

    camera: Viewer = declared.viewer(json=None)
    surface: End = declared.surface(json=None)
    index: int = quantity("", "1", "Morse index")
    sky: Array = quantity("point axis", "1", "directions N; of an Observer (alpha, beta)")
    longitude: Array = quantity("point", "rad", "longitude on the circle, unwrapped, growing")
    time: Array = quantity("point", "GM/c^3", TRAVEL_TIME)
    time_error: Array = quantity("point", "GM/c^3", "error of time")
    closed: bool = quantity(
        "",
        "1",
        "True if the curve returns to its first point (not repeated), otherwise it ends at critical curves",
    )
    error: float = quantity("", "sky", "the largest error of the points on the sky")

    @property
    @derived("", "rad")
    def longitude_from(self) -> float:
        """Longitude at which the curve begins."""
        return float(self.longitude[0])

    @property
    @derived("", "rad")
    def longitude_to(self) -> float:
        """Longitude at which the curve ends, unwrapped."""
        return float(self.longitude[0] + self.sweep)

    @property
    @derived("curve_end axis", "1")
    def ends(self) -> Array:
        """Both ends of an open curve."""
        return self.sky[:0] if self.closed else self.sky[[0, -1]]

    @property
    def sweep(self) -> float:
        """Longitude swept, radians; a whole number of circuits where the curve is closed."""
        swept = float(self.longitude[-1] - self.longitude[0])
        return 2 * math.pi * math.ceil(swept / (2 * math.pi)) if self.closed else swept


@result("counts/1", record="camera surface kind=circle max_index normal certified remarks per_index curves events")
class CircleImages(Shown):
    """The images of a great circle, by Morse index.

    Longitude on the circle is counted from its ascending node on the celestial equator (from phi' = 0 where it is the
    equator), right-handed about the normal.
    """

    camera: Viewer = declared.viewer()
    surface: End = declared.surface()
    normal: tuple[float, float] = quantity("angle", "rad", "theta', phi' of the circle's normal", given=True)
    curves: tuple[CircleCurve, ...] = quantity("curve", "", "images of the circle, by index")
    per_index: dict[int, int] = quantity("morse_index", "1", "number of curves, by index")
    events: PairEvents = quantity("event", "", "events at which two of its images meet, in order of longitude")
    certified: bool = declared.certified(
        "True if the number of curves at every longitude is that required by the winding of the caustics"
    )
    remarks: tuple[str, ...] = declared.remarks(default=())

    @property
    @derived("", "1")
    def max_index(self) -> int:
        """Highest Morse index requested."""
        return max(self.per_index)

    def __repr__(self) -> str:
        """Summary in one line: the normal, how many curves, whether certified."""
        counts = ", ".join(f"{count} of index {k}" for k, count in self.per_index.items())
        note = "" if self.certified else ", not certified"
        return f"<CircleImages of the great circle with normal {self.normal}: {counts}{note}>"


@usual_warnings
@with_progress
def circle_images(
    camera: Viewer,
    normal: ArrayLike | str,
    max_index: int = 2,
    *,
    end: Wherever | End = math.inf,
    progress: Progress | bool | None = None,
) -> CircleImages:
    """The images of a great circle with Morse index 0 to `max_index`, as curves on the camera sky.

    Parameters
    ----------
    camera : Camera or Observer
    normal : (theta', phi') or "galactic plane"
        Direction of the circle's normal, radians; the galactic plane is that of stars with theta' = 90 deg -
        declination and phi' = right ascension.
    max_index : int
        0 to 6.
    end : float or Sphere
        Radius of the circle, that of the camera or larger; math.inf is the celestial sphere. Within the camera's
        radius images are followed from the source, which is not possible for great circles.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    CircleImages

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `CircleCurve.error`: round-off of n' divided by the beam's width across the circle.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> circle = kc.circle_images(camera, normal=(0.3, 0.0), max_index=0)
    >>> circle.per_index, circle.certified
    ({0: 1}, True)
    """
    check_viewer(camera)
    surface = search_surface(camera, end)
    if not certificate_of(surface, camera, 0).follows:
        raise ValueError(
            f"Argument `end` must be math.inf or at least the camera's radius {camera.radius:.12g} for a great circle, "
            f"but is {quoted(end)}."
        )
    angles = _checked_normal(normal, camera)
    sheets = checked_sheets(camera, max_index, surface)
    branches = Branches(sheets, camera, Circle.great(*angles))
    events = branches.events
    pair_events = pair_events_of(camera, surface, events)
    lens_map = LensMap(camera, surface)
    at = lens_map.light_at(branches.nodes.sky)
    error = lens_map.errors(branches.nodes.sky, errors_on_sky(branches, at, events.error))
    curves = [_curve(lens_map, chain, branches, at, error) for chain in chains(branches, over_events=False)]
    curves.sort(key=lambda curve: (curve.index, curve.longitude[0]))
    unsure = (remark for i in np.flatnonzero(~events.known) for remark in pair_events[i].remarks)
    remarks = (*events.remarks, *branches.remarks, *unsure)
    return CircleImages(
        camera=camera,
        surface=surface,
        normal=angles,
        curves=tuple(curves),
        per_index={k: sum(curve.index == k for curve in curves) for k in range(len(sheets.sheets))},
        events=PairEvents(
            in_time(e for e in pair_events if e.order <= max_index), camera, surface, not remarks, remarks
        ),
        certified=not remarks,
        remarks=remarks,
    )


def _curve(lens_map: LensMap, chain: Chain, branches: Branches, light: SeenLight, error: Array) -> CircleCurve:
    """The curve of a chain; light of the nodes, and their errors on the sky."""
    chosen, nodes = chain.nodes, branches.nodes
    # The nodes at both ends are events and lie on two sheets: inner nodes show the sheet of the curve.
    inner = chosen[nodes.event[chosen] < 0]
    turns = 2 * math.pi * np.ceil((chain.longitude[0] - math.pi) / (2 * math.pi))
    return CircleCurve(
        camera=lens_map.viewer,
        surface=lens_map.surface,
        index=int(nodes.index[inner[0]]),
        sky=light.sky[chosen],
        longitude=chain.longitude - turns,
        time=light.time[chosen],
        time_error=light.time_error[chosen],
        closed=chain.closed,
        error=float(error[chosen].max()),
    )


def _checked_normal(normal: ArrayLike | str, camera: Viewer) -> tuple[float, float]:
    if isinstance(normal, str):
        if normal == "galactic plane":
            return GALACTIC_POLE
        end = suggestion(normal, ["galactic plane"])
        raise ValueError(
            f"Argument `normal` must be (theta', phi') or \"galactic plane\", but is {quoted(normal)}{end}"
        )
    return checked_place("normal", normal, camera)
