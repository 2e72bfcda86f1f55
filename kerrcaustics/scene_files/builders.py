"""The sky and the disk of a scene, from the tables that describe them."""

import math
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import asdict, replace as with_entries

from kerrcaustics.interop.plate_carree import is_fits
from kerrcaustics.scene_files import matter_tables, sky_tables
from kerrcaustics.scene_files.contents import Contents, FlareTable
from kerrcaustics.scene_files.table_values import GridTable
from kerrcaustics.scene_files.validation import reject, table_errors
from kerrcaustics.scenes.catalogue import hipparcos, merged_catalogues, tilted_galaxy, tycho2
from kerrcaustics.scenes.checkerboard import Checkerboard
from kerrcaustics.scenes.colour import MeasuredResponse, ResponseLike
from kerrcaustics.scenes.disk.disk import Disk, inner_rim
from kerrcaustics.scenes.disk.emission import BlackBody, PageThorne, PowerLaw, Swatches
from kerrcaustics.scenes.disk.orbiting_spots import OrbitingSpots
from kerrcaustics.scenes.disk.samples import Emission
from kerrcaustics.scenes.disk.spots import Spots
from kerrcaustics.scenes.disk.texture import Texture
from kerrcaustics.scenes.disk.wisps import Wisps
from kerrcaustics.scenes.flare import glare_kernel, with_glare
from kerrcaustics.scenes.light_files import read_picture
from kerrcaustics.scenes.panorama import Panorama, oriented
from kerrcaustics.scenes.scene_checks import check_above_horizon, check_rims
from kerrcaustics.scenes.seen_sky import sky_end
from kerrcaustics.scenes.sky import Sky
from kerrcaustics.scenes.star_field import StarField
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray
Files = tuple[tuple[str, str], ...]

# Brightness of a disk in front of stars at which both show in one exposure.
_BEFORE_STARS = 600.0

_HALF_TURN = np.diag([-1.0, -1.0, 1.0])

_THERMAL = {
    matter_tables.BlackBodyTable: BlackBody,
    matter_tables.PowerLawTable: PowerLaw,
    matter_tables.PageThorneTable: PageThorne,
}


@lru_cache(maxsize=4)
def sky_of(table: sky_tables.SkyTable, folder: Path, files: Files, response: ResponseLike = "cie") -> Sky | None:
    """The sky; None for a black sky.

    files: names and hashes, so that changed files are read again; response: as for `black_body`.
    """
    with table_errors("sky"):
        match table:
            case sky_tables.NoSky():
                return None
            case sky_tables.StarsTable():
                return _stars(table, folder, response)
            case sky_tables.CheckerboardTable():
                return Checkerboard(**{key: value for key, value in asdict(table).items() if key != "radius"})
            case sky_tables.PanoramaTable():
                return _panorama(table, folder, np.eye(3))


def sky_radius_of(contents: Contents, viewer: Viewer) -> float:
    """The radius of the sphere with the sky, infinite by default; ValueError unless it contains the scene."""
    radius, disk = getattr(contents.sky, "radius", None), contents.disk
    rim = 0.0 if disk is None else disk.outer
    with table_errors("sky"):
        return float(sky_end(viewer, math.inf if radius is None else radius, rim).radius)


def _stars(table: sky_tables.StarsTable, folder: Path, response: ResponseLike) -> StarField:
    angles = table.galaxy_tilt_deg, table.galaxy_node_deg, table.galaxy_centre_deg
    turn = tilted_galaxy(*(math.radians(angle) for angle in angles))
    catalogue = hipparcos()
    if table.tycho2 is not None:
        with table_errors("sky", path="sky.tycho2"):
            catalogue = merged_catalogues(catalogue, tycho2(folder / table.tycho2))
    stars = StarField(catalogue, turn, table.band, table.white, response=response)
    if table.nebulae is None:
        return stars
    with table_errors("sky.nebulae"):
        # FITS files define the origin of their longitudes.
        turn = stars.galaxy @ (_HALF_TURN if is_fits(table.nebulae.file) else np.eye(3))
        picture = _panorama(table.nebulae, folder, np.eye(3) if table.nebulae.frame == "hole" else turn)
    return replace(stars, nebulae=picture)


def _panorama(table: sky_tables.PictureTable, folder: Path, frame: Array) -> Panorama:
    """A picture; frame: rotation (3, 3) of the axes to which its angles refer."""
    file = folder / table.file
    turn = frame @ oriented(np.radians(table.orientation_deg), table.mirror != is_fits(file))
    look: dict[str, Any] = {"mirror": table.mirror, "brightness": table.brightness, "spectrum": table.spectrum}
    return Panorama.read(file, turn, **look)


@lru_cache(maxsize=4)
def response_of(table: str | GridTable, folder: Path, files: Files) -> ResponseLike:
    """The response to colours of black bodies; files: as for `sky_of`."""
    if isinstance(table, str):
        return table
    with table_errors(
        "light", path="light.response.file", wavelengths="light.response.file", sensitivities="light.response.file"
    ):
        return MeasuredResponse.read(folder / table.file)


def brightness_of(matter: matter_tables.DiskTable | matter_tables.VolumeTable, sky: sky_tables.SkyTable) -> float:
    """The brightness of a disk or a volume; by default one that shows in front of the sky."""
    if matter.brightness is not None:
        return matter.brightness
    return _BEFORE_STARS if isinstance(sky, sky_tables.StarsTable) else 1.0


@lru_cache(maxsize=4)
def disk_of(
    table: matter_tables.DiskTable,
    brightness: float,
    spin: float,
    folder: Path,
    files: Files,
    response: ResponseLike = "cie",
) -> Disk:
    """The disk; invalid numbers raise ValueError. files, response: as for `sky_of`."""
    table = with_entries(table, inner=inner_rim(table.inner, table.motion, spin))
    with table_errors("disk"):
        check_rims(table.inner, table.outer)
        check_above_horizon(float(table.inner), spin)
    with table_errors("disk.emission"):
        emission = _emission(table.emission, table, folder, response)
    opacity, slant = table.opacity, table.slant
    if isinstance(emission, Wisps):
        opacity, slant = emission.opacity if opacity is None else opacity, bool(slant)
    with table_errors("disk"):
        return Disk(table.inner, table.outer, emission, opacity, table.motion, slant, brightness)


def _emission(
    table: matter_tables.EmissionTable, disk: matter_tables.DiskTable, folder: Path, response: ResponseLike
) -> Emission:
    match table:
        case matter_tables.BlackBodyTable() | matter_tables.PowerLawTable() | matter_tables.PageThorneTable():
            return _THERMAL[type(table)](**asdict(table), response=response)
        case matter_tables.SwatchesTable():
            return Swatches(**asdict(table))
        case matter_tables.TextureTable():
            return Texture.read(folder / table.file, mirror=table.mirror)
        case matter_tables.SpotsTable():
            return _spots(table, disk, response)
        case matter_tables.WispsTable():
            return Wisps(inner=float(disk.inner), outer=disk.outer, **asdict(table), response=response)


def _spots(table: matter_tables.SpotsTable, disk: matter_tables.DiskTable, response: ResponseLike) -> Spots:
    """Spots with places and temperatures that are evenly distributed."""
    low, high = table.temperature
    if not 0 < low <= high:
        reject("disk.emission.temperature", "be two growing temperatures above 0", list(table.temperature))
    random = np.random.default_rng(table.seed)
    square, azimuth, warmth = random.random((3, table.number))
    inner = float(disk.inner)
    radius = np.sqrt(inner**2 + square * (disk.outer**2 - inner**2))
    temperature = low + warmth * (high - low)
    dim, bright = table.brightness
    if not 0 <= dim <= bright:
        reject("disk.emission.brightness", "be two growing factors from 0 on", list(table.brightness))
    share, sense = random.random((2, table.number))
    more = {"brightness": dim + share * (bright - dim), "retrograde": sense < table.retrograde, "fade": table.fade}
    return Spots(radius, 2 * math.pi * azimuth, temperature, table.size, table.streak, response, **more)


@lru_cache(maxsize=4)
def orbiting_spots_of(
    table: matter_tables.OrbitingSpotsTable, spin: float, response: ResponseLike = "cie"
) -> OrbitingSpots:
    """Spots at random places of random orbits; invalid numbers raise ValueError."""
    random = np.random.default_rng(table.seed)
    parts = random.random((7, table.number))
    pairs = "temperature", "brightness", "inclination_deg", "node_deg"
    for name in pairs:
        low, high = getattr(table, name)
        if not low <= high:
            reject(f"spots.{name}", "be two growing numbers", [low, high])
    low, high = np.array([getattr(table, name) for name in pairs]).T[..., None]
    temperature, brightness, inclination, node = low + (high - low) * parts[:4]
    with table_errors("spots"):
        check_rims(table.inner, table.outer)
        inclination = np.where(parts[4] < table.retrograde, 180 - inclination, inclination)
        radius = np.sqrt(table.inner**2 + parts[5] * (table.outer**2 - table.inner**2))
        angles = 2 * math.pi * parts[6], np.radians(inclination), np.radians(node)
        light = temperature, table.size, table.streak, response, brightness, table.fade
        spots = OrbitingSpots(radius, *angles, *light)
        spots.check(spin)
    return spots


def add_glare(light: Array, flare: tuple[FlareTable, ...], folder: Path, scale: float) -> Array:
    """Light (h, w, 3) with all halos of the lens; scale: scale of the picture, by which widths are multiplied."""
    for i, halo in enumerate(flare):
        with table_errors(f"light.flare[{i}]"):
            light = with_glare(light, point_spread(halo, folder, scale))
    return light


def point_spread(halo: FlareTable, folder: Path, scale: float) -> Array:
    """A point spread function; files have the pixels of the whole picture."""
    if halo.file is not None:
        return read_picture(folder / halo.file)
    return glare_kernel(halo.share or 0.0, (halo.width or 0.0) * scale, halo.falloff)
