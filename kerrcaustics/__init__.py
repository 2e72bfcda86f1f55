"""Caustics and critical curves of a spinning (Kerr) black hole, on the sky of a camera near it.

>>> import kerrcaustics as kc
>>> camera = kc.Camera(spin=0.999, radius=6.03)
>>> primary, secondary, tertiary = kc.caustics(camera, orders=3)

Units G = c = M = 1, angles in radians. Names are loaded when they are first used.
"""

from importlib import import_module, metadata
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kerrcaustics.beams.beam import Beams as Beams, Rays as Rays, Status as Status
    from kerrcaustics.beams.ends import EquatorialPlane as EquatorialPlane
    from kerrcaustics.beams.paths import (
        RayPaths as RayPaths,
        SpacePoints as SpacePoints,
        ray_paths as ray_paths,
        trapped_orbit as trapped_orbit,
    )
    from kerrcaustics.beams.trace import trace_beams as trace_beams, trace_rays as trace_rays
    from kerrcaustics.curves.caustic import (
        Caustic as Caustic,
        CausticSet as CausticSet,
        Cusp as Cusp,
        caustics as caustics,
    )
    from kerrcaustics.curves.tubes import CausticTube as CausticTube, caustic_tubes as caustic_tubes
    from kerrcaustics.results.datasets import to_xarray as to_xarray
    from kerrcaustics.results.files import (
        load as load,
        load_caustics as load_caustics,
        save as save,
        save_caustics as save_caustics,
    )
    from kerrcaustics.results.records import record as record
    from kerrcaustics.scenes.catalogue import (
        StarCatalogue as StarCatalogue,
        hipparcos as hipparcos,
        merged_catalogues as merged_catalogues,
        tilted_galaxy as tilted_galaxy,
        tycho2 as tycho2,
    )
    from kerrcaustics.scenes.checkerboard import Checkerboard as Checkerboard
    from kerrcaustics.scenes.colour import black_body as black_body, tone_mapped as tone_mapped
    from kerrcaustics.scenes.footprint import Footprint as Footprint
    from kerrcaustics.scenes.panorama import Panorama as Panorama
    from kerrcaustics.scenes.render import (
        Scene as Scene,
        TracedView as TracedView,
        celestial_picture as celestial_picture,
        render as render,
        trace_view as trace_view,
    )
    from kerrcaustics.scenes.star_field import StarField as StarField
    from kerrcaustics.scenes.turned import TurnedSky as TurnedSky
    from kerrcaustics.scenes.view import View as View
    from kerrcaustics.spacetime.camera import Camera as Camera
    from kerrcaustics.spacetime.shadow import shadow_edge as shadow_edge
    from kerrcaustics.spacetime.sphere import tangent_basis as tangent_basis
    from kerrcaustics.stars.circles import (
        CircleCurve as CircleCurve,
        CircleImages as CircleImages,
        circle_images as circle_images,
    )
    from kerrcaustics.stars.counts import (
        CountMap as CountMap,
        ImageCounts as ImageCounts,
        count_map as count_map,
        image_counts as image_counts,
    )
    from kerrcaustics.stars.events import PairEvent as PairEvent, PairEvents as PairEvents, pair_events as pair_events
    from kerrcaustics.stars.following import FollowedStar as FollowedStar, follow_star as follow_star
    from kerrcaustics.stars.images import StarImages as StarImages, star_images as star_images
    from kerrcaustics.stars.lines import LineCrossings as LineCrossings, crossings_of_line as crossings_of_line
    from kerrcaustics.stars.tracks import StarTracks as StarTracks, Track as Track, star_tracks as star_tracks
    from kerrcaustics.sweeps.engine import SweepResult as SweepResult, sweep as sweep
    from kerrcaustics.sweeps.scene import read_scene as read_scene

_HOMES = {
    "Beams": "beams.beam",
    "Camera": "spacetime.camera",
    "Caustic": "curves.caustic",
    "CausticSet": "curves.caustic",
    "Checkerboard": "scenes.checkerboard",
    "CausticTube": "curves.tubes",
    "CircleCurve": "stars.circles",
    "CircleImages": "stars.circles",
    "CountMap": "stars.counts",
    "Cusp": "curves.caustic",
    "EquatorialPlane": "beams.ends",
    "FollowedStar": "stars.following",
    "Footprint": "scenes.footprint",
    "ImageCounts": "stars.counts",
    "LineCrossings": "stars.lines",
    "PairEvent": "stars.events",
    "PairEvents": "stars.events",
    "Panorama": "scenes.panorama",
    "Rays": "beams.beam",
    "Scene": "scenes.render",
    "StarCatalogue": "scenes.catalogue",
    "StarField": "scenes.star_field",
    "RayPaths": "beams.paths",
    "SpacePoints": "beams.paths",
    "StarImages": "stars.images",
    "StarTracks": "stars.tracks",
    "Status": "beams.beam",
    "TracedView": "scenes.render",
    "SweepResult": "sweeps.engine",
    "Track": "stars.tracks",
    "TurnedSky": "scenes.turned",
    "View": "scenes.view",
    "black_body": "scenes.colour",
    "caustic_tubes": "curves.tubes",
    "caustics": "curves.caustic",
    "celestial_picture": "scenes.render",
    "circle_images": "stars.circles",
    "count_map": "stars.counts",
    "crossings_of_line": "stars.lines",
    "follow_star": "stars.following",
    "hipparcos": "scenes.catalogue",
    "image_counts": "stars.counts",
    "load": "results.files",
    "load_caustics": "results.files",
    "merged_catalogues": "scenes.catalogue",
    "pair_events": "stars.events",
    "render": "scenes.render",
    "ray_paths": "beams.paths",
    "read_scene": "sweeps.scene",
    "record": "results.records",
    "save": "results.files",
    "save_caustics": "results.files",
    "shadow_edge": "spacetime.shadow",
    "star_images": "stars.images",
    "star_tracks": "stars.tracks",
    "sweep": "sweeps.engine",
    "tangent_basis": "spacetime.sphere",
    "tilted_galaxy": "scenes.catalogue",
    "to_xarray": "results.datasets",
    "tone_mapped": "scenes.colour",
    "trace_beams": "beams.trace",
    "trace_rays": "beams.trace",
    "trace_view": "scenes.render",
    "trapped_orbit": "beams.paths",
    "tycho2": "scenes.catalogue",
}

__all__ = [
    "Beams",
    "Camera",
    "Caustic",
    "CausticSet",
    "CausticTube",
    "Checkerboard",
    "CircleCurve",
    "CircleImages",
    "CountMap",
    "Cusp",
    "EquatorialPlane",
    "FollowedStar",
    "Footprint",
    "ImageCounts",
    "LineCrossings",
    "PairEvent",
    "PairEvents",
    "Panorama",
    "RayPaths",
    "Rays",
    "Scene",
    "SpacePoints",
    "StarCatalogue",
    "StarField",
    "StarImages",
    "StarTracks",
    "Status",
    "SweepResult",
    "TracedView",
    "Track",
    "TurnedSky",
    "View",
    "black_body",
    "caustic_tubes",
    "caustics",
    "celestial_picture",
    "circle_images",
    "count_map",
    "crossings_of_line",
    "follow_star",
    "hipparcos",
    "image_counts",
    "load",
    "load_caustics",
    "merged_catalogues",
    "pair_events",
    "ray_paths",
    "read_scene",
    "record",
    "render",
    "save",
    "save_caustics",
    "shadow_edge",
    "star_images",
    "star_tracks",
    "sweep",
    "tangent_basis",
    "tilted_galaxy",
    "to_xarray",
    "tone_mapped",
    "trace_beams",
    "trace_rays",
    "trace_view",
    "trapped_orbit",
    "tycho2",
]
__version__ = metadata.version("kerrcaustics")


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
