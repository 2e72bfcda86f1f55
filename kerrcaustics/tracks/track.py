"""A track: a connected curve on the sky of a viewer along which images of a source move."""

import numpy as np

from kerrcaustics.beams.ends import End
from kerrcaustics.lens_map.lens_map import TRAVEL_TIME
from kerrcaustics.results import declared
from kerrcaustics.results.declared import quantity, result
from kerrcaustics.results.shown import Shown
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.events import PairEvent

Array = np.ndarray


@result(
    "track/1",
    record="closed turns places sky azimuth index parity magnification magnification_error redshift redshift_error "
    "time time_error error",
)
class Track(Shown):
    """A connected curve on the camera sky along which images of a star move, through regions of several indices.

    Its points are in the order of the curve; a closed track does not repeat its first point. A track leads through the
    events, where images of two indices meet: there `index` is that of the inner side, and `parity` is 0.
    """

    camera: Viewer = declared.viewer(json=None)
    surface: End = declared.surface(json=None)
    sky: Array = quantity("point axis", "1", "directions N; of an Observer (alpha, beta)")
    azimuth: Array = quantity(
        "point",
        "rad",
        "phi' of the star relative to the camera when it has an image here, continuous along the curve. The time "
        "is -azimuth / angular velocity, plus any number of periods",
        json="phi_deg",
    )
    index: Array = quantity("point", "1", "Morse index")
    parity: Array = quantity("point", "1", "(-1)^index")
    magnification: Array = quantity(
        "point", "magnification", "1 / |det J|: area on the sky per area of the surface, r dr dphi in the plane"
    )
    magnification_error: Array = quantity("point", "magnification", "error of magnification; infinite next to events")
    redshift: Array = quantity("point", "1", "nu_camera / nu_source")
    redshift_error: Array = quantity("point", "1", "error of redshift")
    time: Array = quantity("point", "GM/c^3", TRAVEL_TIME)
    time_error: Array = quantity("point", "GM/c^3", "error of time")
    error: Array = quantity("point", "sky", "error of sky")
    closed: bool = quantity(
        "",
        "1",
        "True for a closed curve; else both ends are events of order max_index + 1, beyond which the images have a "
        "higher index, or lie next to a ring",
    )
    turns: int = quantity("", "1", "whole turns by which the azimuth grows along a closed track; 0 for others")
    events: tuple[PairEvent, ...] = quantity("track_event", "", "events in the order of the curve")
    places: tuple[int, ...] = quantity("track_event", "1", "number of the point at each event", json="event_points")

    def __len__(self) -> int:
        """Number of points."""
        return len(self.index)

    def __repr__(self) -> str:
        """Summary in one line: how long, which indices, how many events."""
        indices = sorted(set(self.index.tolist()))
        shape = "closed" if self.closed else "open"
        return f"<Track of {len(self)} points, {shape}, index {indices}, {len(self.events)} events>"
