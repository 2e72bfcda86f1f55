"""Lines across the shadow edge, on which the radius of a crossing of the equatorial plane is known.

On each of them (sky_lines.py) the radius of the n-th crossing grows from that of the horizon, where rays fall in before
they cross, to infinity, where they escape before.
"""

import math

import numpy as np
from jaxtyping import Float
from scipy.optimize import elementwise

from kerrcaustics.beams.beam import Status
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.beams.trace import trace_rays
from kerrcaustics.lens_map.search_sky import as_seen
from kerrcaustics.lens_map.sky_lines import beside_edge, line_reach
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.frame import sky_from_line_of_sight
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Places on each side of the shadow edge where a line is looked at, evenly in the logarithm of their distance from it.
_PLACES, _CLOSEST = 60, 1e-13
# Rays of the search.
_COARSE, _FINE = 1e-6, 1e-12


class CrossingLines:
    """Lines across the shadow edge, on which the radius of one crossing is known at some places."""

    def __init__(
        self, camera: Viewer, edge_phase: Float[Array, " lines"], end: EquatorialPlane, engine: str = "auto"
    ) -> None:
        """Look at all lines."""
        self.camera, self.edge_phase, self.end, self.engine = camera, edge_phase, end, engine
        reach = line_reach(camera, edge_phase)[:, None]
        sides = math.pi - reach[:, 0], reach[:, 0]
        inward, outward = (np.geomspace(_CLOSEST, 0.999999 * far, _PLACES, axis=1) for far in sides)
        self.distance = np.concatenate([-inward[:, ::-1], outward], axis=1)
        self.level = self.inverse(np.broadcast_to(edge_phase[:, None], self.distance.shape), self.distance, _COARSE)

    def sky(self, edge_phase: Array, distance: Array) -> Float[Array, "*batch 3"]:
        """Directions N of the camera at places on lines."""
        line_of_sight = beside_edge(self.camera, edge_phase, distance / line_reach(self.camera, edge_phase))
        rest = self.camera.at_rest().frame()
        return as_seen(sky_from_line_of_sight(rest, line_of_sight), rest, self.camera.frame())

    def inverse(self, edge_phase: Array, distance: Array, tolerance: float) -> Float[Array, "*batch"]:
        """1 / r of the crossing: 0 where the ray escapes before, twice the horizon's where it falls in."""
        rays = trace_rays(self.camera, self.sky(edge_phase, distance), self.engine, tolerance, end=self.end)
        assert rays.radius is not None
        lost = np.where(rays.status == Status.CAPTURED, 2 / kerr.horizon(self.camera.spin), 0.0)
        return np.where(np.isfinite(rays.radius), 1 / rays.radius, lost)

    def places(self, radius: float | Array, edge_phase: Array, low: Array, high: Array) -> list[Array]:
        """Turn and distance of the points of circles' images between places on lines."""

        def over(distance: Array, edge_phase: Array, inverse: Array) -> Array:
            return self.inverse(edge_phase, distance, _FINE) - inverse

        inverse = np.broadcast_to(1 / np.asarray(radius), edge_phase.shape)
        tight = {"xrtol": 4e-16, "xatol": 1e-17}
        found = elementwise.find_root(over, (low, high), args=(edge_phase, inverse), tolerances=tight)
        return [edge_phase, found.x]
