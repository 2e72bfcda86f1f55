# The public names, each written once: type checkers read them here, and so does the package when it is imported.
# What functions return besides these is reached through its module.

from . import disks as disks, functional as functional, pictures as pictures, skies as skies
from .beams.beam import Beams as Beams, Rays as Rays, Status as Status
from .beams.directions import tangent_basis as tangent_basis
from .beams.ends import CelestialSphere as CelestialSphere, EquatorialPlane as EquatorialPlane, Sphere as Sphere
from .beams.paths import ray_paths as ray_paths, trapped_orbit as trapped_orbit
from .beams.trace import trace_beams as trace_beams, trace_rays as trace_rays
from .curves.caustic import Caustic as Caustic
from .curves.caustic_search import caustics as caustics
from .curves.derivatives import caustic_derivatives as caustic_derivatives
from .curves.tubes import caustic_tubes as caustic_tubes
from .explorer.widget import explore as explore
from .extended_sources.magnification import magnification as magnification
from .images.counts import count_map as count_map, image_counts as image_counts
from .images.derivatives import image_derivatives as image_derivatives
from .images.images import StarImages as StarImages, star_images as star_images
from .interop.physical_scale import PhysicalScale as PhysicalScale
from .light_curves.light_curve import light_curve as light_curve
from .light_curves.sources import Ball as Ball, Spot as Spot
from .orbits.orbit import Orbit as Orbit
from .results.datasets import to_xarray as to_xarray
from .results.records import record as record
from .results.storage import load as load, save as save
from .rings.bands import photon_rings as photon_rings
from .rings.visibility import ring_visibility as ring_visibility
from .scene_files.scene_file import SceneFile as SceneFile
from .scenes.disk.profile import line_profile as line_profile
from .scenes.render import render as render
from .scenes.screen import Screen as Screen
from .spacetime.camera import Camera as Camera
from .spacetime.kerr import isco as isco
from .spacetime.observer import Observer as Observer
from .spacetime.shadow import shadow_edge as shadow_edge
from .sweeps.reading import read_scene as read_scene
from .sweeps.run import sweep as sweep
from .tracks.circles import circle_images as circle_images
from .tracks.event_derivatives import event_derivatives as event_derivatives
from .tracks.events import pair_events as pair_events
from .tracks.following import follow_star as follow_star
from .tracks.isoradials import isoradials as isoradials
from .tracks.lines import crossings_of_line as crossings_of_line
from .tracks.tracks import star_tracks as star_tracks
from .waves.amplification import amplification as amplification
from .waves.pattern import diffraction_pattern as diffraction_pattern

__version__: str
