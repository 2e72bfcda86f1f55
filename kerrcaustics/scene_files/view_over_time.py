"""The view, or the screen, of a scene, whose values may change with time."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

from kerrcaustics.scene_files.camera_tables import ViewTable
from kerrcaustics.scene_files.cameras import CameraPath, value_at, varied
from kerrcaustics.scene_files.orientation import axes_of
from kerrcaustics.scene_files.validation import reject, table_errors
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.screen import Screen
from kerrcaustics.scenes.view import View, widest_field
from kerrcaustics.spacetime.viewer import Viewer

if TYPE_CHECKING:
    from kerrcaustics.spacetime.camera import Camera

# Values of a view, and of a screen, that may change with time.
_VARIED_VIEW, _VARIED_SCREEN = ("field_of_view_deg", "tilt_deg", "yaw_deg", "pitch_deg"), ("size", "tilt_deg")


@dataclass(frozen=True)
class ViewOverTime:
    """The view of a scene at any time."""

    table: ViewTable
    path: CameraPath

    def values(self, time: float) -> dict[str, float]:
        """The values that may change with time, by the paths of their keys."""
        moment = self.path.values_at(time)
        return {entry: value_at(varying, moment) for entry, varying in self._varied.items()}

    def raster(self, camera: Viewer, time: float, scale: float, trial: bool = False) -> Raster:
        """A view or a screen; trial: a view with fixed axes, for checks that need not locate the shadow."""
        table, values = self.table, self.values(time)
        width, height = (max(round(scale * pixels), 1) for pixels in (table.width, table.height))
        with table_errors("view"):
            if table.size is not None:
                tilt, centre = math.radians(values["view.tilt_deg"]), (values[f"view.centre[{i}]"] for i in (0, 1))
                return Screen(width, height, values["view.size"], tuple(centre), (math.sin(tilt), math.cos(tilt)))
            field, *turns = (values[f"view.{key}"] for key in _VARIED_VIEW)
            assert table.look is not None and table.projection is not None
            widest = math.degrees(widest_field(table.projection, width, height))
            if not 0 < field <= widest * (1 + 1e-12):
                shape = f"a {table.projection} picture of {width} x {height} pixels"
                reject("view.field_of_view_deg", f"be above 0 and at most {widest:.6g} degrees for {shape}", field)
            fixed = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
            axes = fixed if trial else axes_of(cast("Camera", camera), table.look, turns)
            return View(width, height, math.radians(field), table.projection, *axes)

    @cached_property
    def _varied(self) -> dict[str, Any]:
        """Values that may change with time, by the paths of their keys."""
        table = self.table
        keys = _VARIED_VIEW if table.size is None else _VARIED_SCREEN
        values = {f"view.{key}": getattr(table, key) for key in keys}
        values |= {f"view.centre[{i}]": value for i, value in enumerate(table.centre or ())}
        return {entry: varied(entry, value, self.path) for entry, value in values.items()}
