"""Calls of all public functions that take numbers, with arguments with which they work."""

import numpy as np

import kerrcaustics as kc

CAMERA, VIEW, PLANE = kc.Camera(0.9, 10.0, 1.2), kc.pictures.View(8, 8, 1.0), kc.EquatorialPlane(1)
SKY, STAR, SOURCE, LIGHT = np.array([[-0.6, 0.5, 0.4]]), (1.4, 0.3), (6.0, 0.3), np.zeros((4, 8, 3))
CATALOGUE = kc.skies.StarCatalogue([[1.0, 0.0, 0.0]], [1.0], [1.0])
SEES, ENDS = {"camera": CAMERA}, {"camera": CAMERA, "max_index": 1, "end": 30.0}
IN_PLANE = {"camera": CAMERA, "max_index": 1, "end": PLANE}
RAYS = {"camera": CAMERA, "sky": SKY, "tolerance": 1e-10, "end": 20.0}
RIMS = {"inner": 6.0, "outer": 10.0}
RINGS = kc.photon_rings(kc.Observer(spin=0.9, inclination=1.2), max_order=1)
# Functions, and arguments with which they work.
CALLS = [
    (kc.Camera, {"spin": 0.9, "radius": 10.0, "inclination": 1.2, "velocity": (0.1, 0.0, 0.0)}),
    (kc.Observer, {"spin": 0.9, "inclination": 1.2, "radius": 50.0}),
    (kc.EquatorialPlane, {"crossing": 1}),
    (kc.isco, {"spin": 0.9}),
    (kc.trace_rays, RAYS),
    (kc.trace_beams, RAYS),
    (kc.ray_paths, {**SEES, "sky": SKY, "n": 10, "end": 20.0}),
    (kc.trapped_orbit, {"spin": 0.9, "impact": 0.1, "n": 10, "oscillations": 1.0}),
    (kc.shadow_edge, {**SEES, "n": 10}),
    (kc.caustics, {**SEES, "orders": 1, "end": 30.0}),
    (kc.caustics, {**SEES, "orders": 1, "end": PLANE}),
    (kc.caustic_derivatives, {**SEES, "orders": 1}),
    (kc.caustic_tubes, {**SEES, "orders": 1, "radii": [20.0, 30.0]}),
    (kc.star_images, {**ENDS, "star": STAR}),
    (kc.star_images, {**IN_PLANE, "star": SOURCE}),
    (kc.star_tracks, {**ENDS, "level": 1.4}),
    (kc.star_tracks, {**IN_PLANE, "level": 6.0}),
    (kc.pair_events, {**ENDS, "level": 1.4}),
    (kc.pair_events, {**IN_PLANE, "level": 6.0}),
    (kc.image_counts, {**ENDS, "stars": [STAR]}),
    (kc.image_counts, {**IN_PLANE, "stars": [SOURCE]}),
    (kc.count_map, ENDS),
    (kc.count_map, {**IN_PLANE, "radii": [6.0]}),
    (kc.circle_images, {**SEES, "normal": (0.3, 0.1), "max_index": 1}),
    (kc.magnification, {"viewer": CAMERA, "source": STAR, "size": 0.01, "max_index": 1, "power": 1.0}),
    (kc.amplification, {"viewer": CAMERA, "source": STAR, "frequencies": [1.0], "max_index": 1}),
    (
        kc.diffraction_pattern,
        {"viewer": CAMERA, "region": [(1.5, 1.6), (3.1, 3.2)], "frequency": 5.0, "max_index": 1, "pixels": 2},
    ),
    (kc.follow_star, {"cameras": [CAMERA], "star": STAR, "max_index": 1}),
    (kc.isoradials, {**SEES, "radii": [6.0], "crossings": 1, "points": 16}),
    (kc.photon_rings, {"viewer": CAMERA, "max_order": 1, **RIMS}),
    (kc.ring_visibility, {"rings": RINGS, "u": [0.1], "v": [0.2], "order": 1, "position_angle": 0.1}),
    (kc.Ball, {"size": 0.1}),
    (kc.Spot, {"size": 0.1, "crossings": 1, "power": 4.0, "points": 90}),
    (kc.light_curve, {**SEES, "orbit": 8.0, "times": 10, "size": 0.1, "crossings": 1}),
    (kc.line_profile, {**SEES, **RIMS, "emissivity": 3.0, "crossing": 1, "bins": 10, "radii": 4, "turns": 16}),
    (
        kc.pictures.View,
        {"width": 8, "height": 8, "field_of_view": 1.0, "forward": (-1.0, 0.0, 0.0), "up": (0.0, 0.0, 1.0)},
    ),
    (kc.Screen, {"width": 8, "height": 8, "size": 24.0, "centre": (0.0, 0.0), "up": (0.0, 1.0)}),
    (kc.render, {**SEES, "view": VIEW, "time": 1.0}),
    (
        kc.pictures.render_volume,
        {**SEES, "view": VIEW, "volume": kc.disks.Volume(1.0, 4000.0, 6.0, 10.0, 0.5), "step": 0.5},
    ),
    (kc.skies.celestial_picture, {"sky": kc.skies.Checkerboard(), "height": 8}),
    (
        kc.pictures.ShutterMotion,
        {"cameras": (CAMERA,) * 2, "views": (VIEW,) * 2, "azimuths": (0.0, 0.1), "times": (0.0, 1.0)},
    ),
    (kc.skies.Checkerboard, {"rows": 4, "columns": 8, "gap": 0.1}),
    (kc.skies.Panorama, {"light": LIGHT, "orientation": np.eye(3), "aspect": 16.0}),
    (kc.skies.FunctionSky, {"function": np.abs, "detail": 0.1}),
    (kc.skies.TurnedSky, {"sky": kc.skies.Checkerboard(), "angle": 0.1}),
    (kc.skies.PointLights, {"direction": [[1.0, 0.0, 0.0]], "flux": [[1.0, 1.0, 1.0]], "temperature": [6504.0]}),
    (kc.skies.StarCatalogue, {"direction": [[1.0, 0.0, 0.0]], "magnitude": [1.0], "colour_index": [1.0]}),
    (
        kc.skies.StarField,
        {"catalogue": CATALOGUE, "orientation": np.eye(3), "band": 1.0, "white": 6504.0, "sweep": 0.1},
    ),
    (kc.skies.tilted_galaxy, {"tilt": 0.1, "node": 0.1, "centre": 0.1}),
    (kc.disks.Disk, {**RIMS, "emission": kc.disks.BlackBody(4500.0), "opacity": 0.5, "brightness": 1.0}),
    (kc.disks.BlackBody, {"peak": 4500.0}),
    (kc.pictures.MeasuredResponse, {"wavelengths": [450.0, 550.0, 650.0], "sensitivities": np.eye(3)}),
    (kc.disks.PageThorne, {"peak": 4500.0}),
    (kc.disks.PowerLaw, {"peak": 4500.0, "exponent": 0.7, "at": 10.0}),
    (kc.disks.Swatches, {"rows": 4, "columns": 8, "gap": 0.1}),
    (kc.disks.Texture, {"light": LIGHT}),
    (kc.disks.Spots, {"radius": 8.0, "azimuth": 0.1, "temperature": 4000.0, "size": 0.1, "streak": 0.1}),
    (kc.disks.OrbitingSpots, {"radius": 8.0, "phase": 0.1, "inclination": 0.2, "node": 0.3, "size": 0.1}),
    (kc.disks.Wisps, {**RIMS, "peak": 4500.0, "depth": 1.0, "contrast": 1.0, "seed": 0}),
    (kc.disks.FunctionEmission, {"function": np.multiply, "detail": 0.1}),
    (kc.disks.Volume, {**RIMS, "density": 1.0, "temperature": 4000.0, "scale": 0.5, "brightness": 1.0}),
    (kc.disks.VolumeGrid, {**RIMS, "values": np.ones((3, 3, 3))}),
    (kc.pictures.black_body, {"temperature": 4000.0, "white": 6504.0}),
    (kc.pictures.tone_mapped, {"light": LIGHT, "exposure": 1.0, "curve": "asinh", "softening": 30.0}),
    (kc.pictures.auto_exposure, {"light": LIGHT, "curve": "asinh", "softening": 30.0}),
    (kc.pictures.clipped_fraction, {"light": LIGHT, "exposure": 1.0}),
    (kc.pictures.with_glare, {"light": LIGHT, "spread": np.ones((3, 3))}),
    (kc.pictures.glare_kernel, {"share": 0.2, "width": 2.0, "falloff": 3.0}),
    (kc.PhysicalScale, {"mass": 1e6, "distance": 1e3}),
]


def is_numeric(value):
    """True for numbers and arrays of them."""
    # Radii of different rows make no array, and texts and objects no numbers.
    return not isinstance(value, str | bool) and np.asarray(value).dtype.kind in "fi"
