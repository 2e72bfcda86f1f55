"""Every public object and every result can be pickled and copied, for other processes and notebooks."""

import copy
import inspect
import math
import pickle

import numpy as np
import pytest
from made_results import KINDS, example
from offenders import for_each
from public import PUBLIC

import kerrcaustics as kc
from kerrcaustics.results.declared import LAYOUTS

CAMERA = kc.Camera(0.9, 6.0, velocity=(-0.3, 0.0, 0.2))
CATALOGUE = kc.skies.StarCatalogue([[0.0, 0.0, 1.0]], [2.0], [0.6])
EMISSION = kc.disks.BlackBody(4500.0)
RESPONSE = kc.pictures.MeasuredResponse([450, 550, 650], np.eye(3)[::-1])
VIEW = kc.pictures.View.toward_hole(CAMERA, 8, 4, 1.4)
SCENE = """
[hole]
spin = 0.6
[camera.path]
kind = "geodesic"
radius = 9
velocity = [0.0, 0.1, 0.3]
[view]
width = 64
height = 36
"""
# Objects of every public class that is no result; those of scene files are read from SCENE.
MADE = {
    "Orbit": [
        kc.Orbit.geodesic(8.0, 1.2),
        kc.Orbit.geodesic(8.0, velocity=(0.1, 0.0, 0.2)),
        kc.Orbit.kepler(100.0, 0.5),
        kc.Orbit.function(math.frexp),
    ],
    "Ball": [kc.Ball(0.2)],
    "Spot": [kc.Spot(0.2, motion="retrograde")],
    "PhysicalScale": [kc.PhysicalScale(4.3e6, 8.2e3)],
    "SceneFile": [],
    "Status": list(kc.Status),
    "PointLights": [kc.skies.PointLights(np.eye(3), np.ones((3, 3)), np.full(3, 6504.0))],
    "Checkerboard": [kc.skies.Checkerboard()],
    "Panorama": [kc.skies.Panorama(np.ones((16, 32, 3)))],
    "StarCatalogue": [CATALOGUE],
    "StarField": [kc.skies.StarField(CATALOGUE)],
    "TurnedSky": [kc.skies.TurnedSky(kc.skies.Checkerboard(), 0.3)],
    "BlackBody": [EMISSION],
    "Disk": [kc.disks.Disk(6.0, 9.0, EMISSION)],
    "OrbitingSpots": [kc.disks.OrbitingSpots([8.0, 9.0], inclination=[0.1, 3.0])],
    "PageThorne": [kc.disks.PageThorne(4500.0)],
    "PowerLaw": [kc.disks.PowerLaw(4500.0, response=RESPONSE)],
    "Spots": [kc.disks.Spots([8.0, 9.0], [0.0, 1.0])],
    "Swatches": [kc.disks.Swatches()],
    "Texture": [kc.disks.Texture(np.ones((4, 8, 3)))],
    "Volume": [kc.disks.Volume(0.1, 6504.0, inner=5.0, outer=8.0)],
    "VolumeGrid": [kc.disks.VolumeGrid(np.ones((4, 4, 1)), inner=5.0, outer=8.0)],
    "FunctionEmission": [kc.disks.FunctionEmission(np.multiply, 0.1)],
    "FunctionSky": [kc.skies.FunctionSky(np.abs, 0.1)],
    "Wisps": [kc.disks.Wisps(4500.0, 6.0, 9.0, seed=3)],
    "MeasuredResponse": [RESPONSE],
    "ShutterMotion": [kc.pictures.ShutterMotion((CAMERA, CAMERA), (VIEW, VIEW), times=(-0.2, 0.2))],
}


def same(one, other):
    """True if two objects are of one class and hold the same."""
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind in "fc")
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same, one, other))
    if inspect.ismethod(one):
        return one.__name__ == other.__name__ and same(one.__self__, other.__self__)
    if hasattr(one, "__dict__") and not callable(one):
        return type(one) is type(other) and all(same(part, vars(other)[name]) for name, part in vars(one).items())
    # NaN stands for what there is not.
    return one == other or (one != one and other != other)


def copies(one):
    """An object that was sent to another process, and both kinds of copies."""
    return pickle.loads(pickle.dumps(one)), copy.copy(one), copy.deepcopy(one)


def test_every_public_class_has_an_object_here():
    classes = {
        name
        for name, one in PUBLIC.items()
        if inspect.isclass(one) and not inspect.isabstract(one) and one not in KINDS
    }
    assert classes == set(MADE)


@for_each(name=MADE)
def test_public_objects_can_be_pickled_and_copied(name, tmp_path):
    objects = MADE[name]
    if name == "SceneFile":
        (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
        objects = [kc.read_scene(tmp_path / "scene.toml")]
        # It is sent to other processes after its camera has been looked at.
        assert objects[0].camera(0.0).radius == pytest.approx(9.0)
        assert all(again.camera(0.0) == objects[0].camera(0.0) for again in copies(objects[0]))
        return
    assert objects
    for one in objects:
        assert all(same(one, again) for again in copies(one))


@for_each(kind=KINDS, absent=[False, True])
def test_results_can_be_pickled_and_copied(kind, absent):
    made = example(kind, 2, absent)
    assert all(type(again) is kind and again == made for again in copies(made))


@pytest.mark.slow
def test_results_can_be_pickled_and_copied_after_they_are_shown():
    """With all that they keep once a notebook has drawn them."""
    camera = kc.Camera(0.9, 6.0)
    for found in (kc.caustics(camera, 1), kc.star_images(camera, (1.2, 0.3), 1), kc.shadow_edge(camera, 8)):
        if type(found) in LAYOUTS:
            found._repr_html_()
        assert all(same(found, again) for again in copies(found))
