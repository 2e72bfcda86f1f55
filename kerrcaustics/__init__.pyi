# The public names, each written once: type checkers read them here, and so does the package when it is imported.
# What functions return besides these is reached through its module.

from . import functional as functional
from .astronomy.physical_scale import PhysicalScale as PhysicalScale
from .beams.beam import Beams as Beams, Rays as Rays, Status as Status
from .beams.ends import CelestialSphere as CelestialSphere, EquatorialPlane as EquatorialPlane, Sphere as Sphere
from .beams.paths import RayPaths as RayPaths, ray_paths as ray_paths, trapped_orbit as trapped_orbit
from .beams.trace import trace_beams as trace_beams, trace_rays as trace_rays
from .curves.caustic import Caustic as Caustic, CausticSet as CausticSet, Cusp as Cusp, caustics as caustics
from .curves.isoradials import disk_images as disk_images
from .curves.light_curves import light_curve as light_curve
from .curves.tubes import caustic_tubes as caustic_tubes
from .draw.shown import show as show
from .explorer.widget import explore as explore
from .results.datasets import to_xarray as to_xarray
from .results.files import load as load, save as save
from .results.records import record as record
from .scene_files.reading import read_scene as read_scene
from .scene_files.scene_file import SceneFile as SceneFile
from .scenes.catalogue import (
    StarCatalogue as StarCatalogue,
    hipparcos as hipparcos,
    merged_catalogues as merged_catalogues,
    tilted_galaxy as tilted_galaxy,
    tycho2 as tycho2,
)
from .scenes.checkerboard import Checkerboard as Checkerboard
from .scenes.colour import black_body as black_body, tone_mapped as tone_mapped
from .scenes.disk.disk import Disk as Disk
from .scenes.disk.emission import (
    BlackBody as BlackBody,
    PageThorne as PageThorne,
    PowerLaw as PowerLaw,
    Swatches as Swatches,
    Texture as Texture,
)
from .scenes.disk.profile import LineProfile as LineProfile, line_profile as line_profile
from .scenes.disk.spots import Spots as Spots
from .scenes.disk.volume import Volume as Volume, VolumeGrid as VolumeGrid
from .scenes.disk.wisps import Wisps as Wisps
from .scenes.flare import glare_kernel as glare_kernel, with_glare as with_glare
from .scenes.footprint import Footprint as Footprint
from .scenes.motion import ShutterMotion as ShutterMotion
from .scenes.panorama import Panorama as Panorama, save_sky as save_sky
from .scenes.render import celestial_picture as celestial_picture, render as render, trace_view as trace_view
from .scenes.render_volume import render_volume as render_volume
from .scenes.star_field import StarField as StarField
from .scenes.turned import TurnedSky as TurnedSky
from .scenes.view import View as View
from .spacetime.camera import Camera as Camera
from .spacetime.observer import Observer as Observer
from .spacetime.shadow import shadow_edge as shadow_edge
from .spacetime.sphere import tangent_basis as tangent_basis
from .stars.circles import circle_images as circle_images
from .stars.counts import count_map as count_map, image_counts as image_counts, read_count_map as read_count_map
from .stars.derivatives import (
    caustic_derivatives as caustic_derivatives,
    image_derivatives as image_derivatives,
)
from .stars.events import pair_events as pair_events
from .stars.following import follow_star as follow_star
from .stars.images import StarImages as StarImages, star_images as star_images
from .stars.lines import crossings_of_line as crossings_of_line
from .stars.tracks import StarTracks as StarTracks, star_tracks as star_tracks
from .sweeps.engine import sweep as sweep

__version__: str
