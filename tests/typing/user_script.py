"""A user's program, for type checkers alone: every public function, and the types of what it returns.

`tests/test_typing.py` runs mypy and basedpyright on it: `assert_type` must hold exactly, and each line that ends in
`# wrong` must be an error, and no other.
"""

from typing import Any, assert_type

import numpy as np
from matplotlib.axes import Axes

import kerrcaustics as kc
from kerrcaustics.curves.caustic import CausticSet, Cusp
from kerrcaustics.tracks.events import PairEvent

camera = kc.Camera(spin=0.999, radius=6.03, velocity="circular")
observer = kc.Observer(spin=0.9, inclination=1.0)
assert_type(camera.spin, float)
assert_type(camera.at_rest(), kc.Camera)
assert_type(camera.clock_rate, float)
assert_type(kc.isco(0.9, prograde=False), float)
assert_type(camera.plot(), Axes)
camera.spn  # wrong
camera.spin = 0.5  # wrong
kc.Camera(spin=0.9, radios=10.0)  # wrong
assert_type(kc.Observer(0.9, 1.0, 50.0), kc.Observer)
kc.Observer(0.9)  # wrong

found = kc.caustics(camera, orders=2, end=kc.Sphere(20.0))
assert_type(found, CausticSet)
assert_type(found[0], kc.Caustic)
assert_type(found[:1], tuple[kc.Caustic, ...])
primary, secondary = found
assert_type(primary, kc.Caustic)
assert_type(primary.cusps, tuple[Cusp, ...])
assert_type(primary.phi_extent, float)
assert_type(found.certified, bool)
assert_type([caustic.order for caustic in found], list[int])
assert_type(found.plot(), Axes)
primary.cups  # wrong
found.caustics  # wrong
kc.caustics(camera, order=2)  # wrong

images = kc.star_images(camera, star=(1.4, 2.9), max_index=1)
assert_type(images, kc.StarImages)
assert_type(images.per_index, dict[int, int])
assert_type(images.certified, bool)
assert_type(images.max_index, int)
assert_type(len(images), int)
assert_type(images.plot(), Axes)
images.function()(spin=0.9)
kept: np.ndarray = images.magnification
images.magnifications  # wrong
kc.star_image  # wrong

rays = kc.trace_rays(camera, [[-0.6, 0.5, 0.4]], end=kc.EquatorialPlane(1), time=True)
beams = kc.trace_beams(camera, [[-0.6, 0.5, 0.4]])
assert_type(kc.trace_rays(camera, [[-0.6, 0.5, 0.4]], end=kc.CelestialSphere()), kc.Rays)
assert_type(rays, kc.Rays)
assert_type(beams, kc.Beams)
assert_type(kc.Status(0), kc.Status)
areas: np.ndarray = beams.jacobian
rays.jacobian  # wrong
assert_type(beams.plot(), Axes)

events = kc.pair_events(camera, level=1.34)
assert_type(events[0], PairEvent)
assert_type(events[0].indices, tuple[int, int])
tracks = kc.star_tracks(camera, level=1.34, max_index=1)
assert_type(tracks.plot(), Axes)
assert_type(tracks.certified, bool)
tracks.track  # wrong
assert_type(kc.follow_star([camera], star=(1.4, 2.9)).images, tuple[kc.StarImages, ...])

bright = kc.magnification(camera, (1.4, 2.9), 0.01, profile=("linear", 0.6))
assert_type(bright.total, float)
assert_type(bright.plot(), Axes)
waves = kc.amplification(camera, (1.4, 2.9), [1.0, 2.0], method="line")
assert_type(waves.value, np.ndarray)
assert_type(waves.plot(), Axes)
assert_type(kc.diffraction_pattern(camera, ((1.5, 1.6), (3.1, 3.2)), 5.0).value, np.ndarray)
circle = kc.circle_images(camera, "galactic plane", max_index=0)
assert_type(circle.plot(), Axes)
assert_type(kc.crossings_of_line(circle, 0.3).certified, bool)
assert_type(kc.image_counts(camera, [(1.4, 2.9)]).plot(), Axes)
counts = kc.count_map(camera, rows=18)
assert_type(counts.plot(), Axes)
shape: tuple[int, ...] = counts.counts.shape

assert_type(kc.isoradials(camera, [20.0]).plot(), Axes)
assert_type(kc.isoradials(camera, [20.0])[0].closed, bool)
rings = kc.photon_rings(kc.Observer(spin=0.9, inclination=1.0), outer=20.0)
assert_type(rings.plot(), Axes)
assert_type(rings[1].solid_angle, float)
assert_type(rings.edge.lyapunov, np.ndarray)
assert_type(kc.ring_visibility(rings, 0.1, 0.2, scale=kc.PhysicalScale(6e9, 2e7)).error, np.ndarray)
assert_type(kc.light_curve(camera, orbit=8.0).plot(), Axes)
assert_type(kc.light_curve(camera, kc.Orbit.kepler(99.0), [0.0]).flux, np.ndarray)
assert_type(kc.light_curve(camera, 8.0, source=kc.Spot(0.2, crossings=1)).period, float)
assert_type(kc.light_curve(camera, 8.0, source=kc.Ball(0.2)).certified, bool)
assert_type(kc.line_profile(camera, 6.0, 20.0).plot(), Axes)
assert_type(kc.caustic_tubes(camera)[0].plot(), Axes)
assert_type(kc.ray_paths(camera, [[-0.6, 0.5, 0.4]]).plot(), Axes)
assert_type(kc.image_derivatives(camera, images).parameters, tuple[str, ...])
assert_type(kc.caustic_derivatives(camera, 1)[0].parameters, tuple[str, ...])
assert_type(kc.event_derivatives(camera, events).parameters, tuple[str, ...])
edge: np.ndarray = kc.shadow_edge(camera, 100)

sky: np.ndarray = kc.tangent_basis(np.array([0.0, 0.0, 1.0]))[0]
assert_type(kc.trapped_orbit(0.9, 2.5).plot(), Axes)

view = kc.pictures.View.toward_hole(camera, width=64, height=36, field_of_view=1.0)
assert_type(view, kc.pictures.View)
picture = kc.render(camera, view, kc.skies.Checkerboard(), disk=kc.disks.Disk(3.0, 9.0, kc.disks.BlackBody(4500)))
assert_type(picture.error, float)
assert_type(picture.plot(), Axes)
assert_type(picture.stages, dict[str, float])
assert_type(kc.skies.hipparcos(), kc.skies.StarCatalogue)
assert_type(kc.skies.Panorama.read("sky.png", mirror=True), kc.skies.Panorama)
assert_type(kc.disks.Texture.read("disk.png", mirror=True), kc.disks.Texture)
assert_type(kc.pictures.auto_exposure(picture.light), float)
assert_type(view.plot(), Axes)
assert_type(kc.pictures.trace_view(camera, view).plot(), Axes)
kc.pictures.trace_views(camera, view)  # wrong
kc.skies.Checkerbord()  # wrong

assert_type(kc.render(observer, kc.Screen(64, 36, size=24)).beams, int)

kc.save("images.npz", images)
assert_type(kc.load("images.npz"), Any)
assert_type(kc.record(images), dict[str, Any])
assert_type(kc.to_xarray(images).attrs, dict[Any, Any])
scene = kc.SceneFile.read("scene.toml")
assert_type(scene.frames, int)
assert_type(scene.remarks, tuple[str, ...])
scene.remark  # wrong
assert_type(kc.PhysicalScale(4.3e6, 8180.0).metres, float)
assert_type(kc.sweep(kc.read_scene("spins.toml"), "spins.zarr").points, int)
assert_type(kc.functional.__name__, str)
kc.explore(spin=0.9, radius=10.0)
assert_type(kc.__version__, str)
