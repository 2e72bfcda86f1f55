"""What pair events of all kinds share: at one, two images of a source appear or vanish."""

import numpy as np

from kerrcaustics.results.declared import base, quantity
from kerrcaustics.results.shown import Shown

Array = np.ndarray


@base
class Event(Shown):
    """Two images of a source appear or vanish: the source crosses a caustic."""

    kind: str = quantity(
        "",
        "",
        '"creation" or "annihilation", with increasing time; where nothing moves, on great circles and in the plane, '
        "with increasing longitude",
    )
    order: int = quantity("", "1", "order of the critical curve there, and of the caustic that the source crosses")
    moment: float = quantity(
        "",
        "GM/c^3",
        "time of the viewer when the two images meet: for a camera that orbits in [0, period), 0 when the star's phi' "
        "is its own; for a spot within the first orbit; NaN where nothing moves",
    )
    emission_time: float = quantity("", "GM/c^3", "time when the light left the source: moment minus travel time")
    sky: Array = quantity(
        "axis", "1", "direction N on the viewer's sky where the two images meet; of an Observer (alpha, beta)"
    )
