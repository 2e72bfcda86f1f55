"""Results with a surface or a quantity of a user: records of what is declared, and one line about what is not."""

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.beams.ends import SKY
from kerrcaustics.results.declared import LAYOUTS, derived, result

CAMERA, STAR = kc.Camera(0.9, 10.0, 1.2), (1.7, 3.1)


class OwnSky(kc.CelestialSphere):
    """A surface that is not declared as a result."""

    def bare(self):
        return SKY


class DeclaredSky(OwnSky):
    """A surface that is declared."""


class WarmCamera(kc.Camera):
    """A camera with a quantity more."""

    @property
    @derived("", "1")
    def warmth(self):
        """The warmth of the camera."""
        return 7.0


@pytest.fixture(scope="module", autouse=True)
def declared():
    """The two classes are results while this file is tested, and no longer."""
    made = [
        result("declared-sky/1", record="radius name=own", eq=True)(DeclaredSky),
        result("warm-camera/1", record="spin warmth", eq=True)(WarmCamera),
    ]
    yield
    for kind in made:
        del LAYOUTS[kind]


@pytest.fixture(scope="module")
def images(declared):
    return {kind: kc.star_images(CAMERA, STAR, 0, end=kind()) for kind in (OwnSky, DeclaredSky)}


def test_a_surface_that_is_declared_has_a_record(images):
    entry = kc.record(images[DeclaredSky])
    assert entry["name"] == "own" and len(entry["images"]) == len(images[DeclaredSky])


def test_a_surface_that_is_not_declared_is_named(images):
    words = r"^Argument `result` must hold results alone, but holds OwnSky: .* needs the decorator `.*result\("
    with pytest.raises(ValueError, match=words) as caught:
        kc.record(images[OwnSky])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", [OwnSky, DeclaredSky])
def test_a_file_holds_no_surface_of_a_user(images, kind, tmp_path):
    with pytest.raises(ValueError, match=f"^Argument `result` must hold classes .* holds {kind.__name__}: ") as caught:
        kc.save(tmp_path / "images.npz", images[kind])
    assert "\n" not in str(caught.value) and not list(tmp_path.iterdir())


def test_a_quantity_of_a_user_is_in_records_and_not_in_files(tmp_path):
    camera = WarmCamera(0.9, 10.0)
    assert kc.record(camera) == {"schema": "kerrcaustics/warm-camera/1", "spin": 0.9, "warmth": 7.0}
    with pytest.raises(ValueError, match=r"^Argument `result` must hold classes of kerrcaustics alone, but holds Warm"):
        kc.save(tmp_path / "camera.npz", camera)
    assert not list(tmp_path.iterdir())


def test_own_surfaces_are_seen_as_the_celestial_sphere(images):
    plain = kc.star_images(CAMERA, STAR, 0)
    for own in images.values():
        np.testing.assert_allclose(own.sky, plain.sky, atol=1e-12)
