# The names of `kerrcaustics.skies`, as in the stub file of the package.

from .scenes.catalogue import (
    StarCatalogue as StarCatalogue,
    hipparcos as hipparcos,
    merged_catalogues as merged_catalogues,
    tilted_galaxy as tilted_galaxy,
    tycho2 as tycho2,
)
from .scenes.celestial_picture import celestial_picture as celestial_picture
from .scenes.checkerboard import Checkerboard as Checkerboard
from .scenes.footprint import Footprint as Footprint
from .scenes.function_sky import FunctionSky as FunctionSky
from .scenes.panorama import Panorama as Panorama, save_sky as save_sky
from .scenes.points import PointLights as PointLights
from .scenes.sky import Sky as Sky
from .scenes.star_field import StarField as StarField
from .scenes.turned_sky import TurnedSky as TurnedSky
