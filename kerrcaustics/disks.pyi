# The names of `kerrcaustics.disks`, as in the stub file of the package.

from .scenes.disk.disk import Disk as Disk
from .scenes.disk.emission import (
    BlackBody as BlackBody,
    PageThorne as PageThorne,
    PowerLaw as PowerLaw,
    Swatches as Swatches,
)
from .scenes.disk.function_emission import FunctionEmission as FunctionEmission
from .scenes.disk.orbiting_spots import OrbitingSpots as OrbitingSpots
from .scenes.disk.profile import LineProfile as LineProfile
from .scenes.disk.samples import Emission as Emission
from .scenes.disk.spots import Spots as Spots
from .scenes.disk.texture import Texture as Texture
from .scenes.disk.volume import Volume as Volume, VolumeGrid as VolumeGrid
from .scenes.disk.wisps import Wisps as Wisps
