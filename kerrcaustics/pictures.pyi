# The names of `kerrcaustics.pictures`, as in the stub file of the package.

from .scenes.colour import MeasuredResponse as MeasuredResponse, black_body as black_body
from .scenes.flare import glare_kernel as glare_kernel, with_glare as with_glare
from .scenes.motion import ShutterMotion as ShutterMotion
from .scenes.render_volume import render_volume as render_volume
from .scenes.screen import Screen as Screen
from .scenes.tones import (
    auto_exposure as auto_exposure,
    clipped_fraction as clipped_fraction,
    tone_mapped as tone_mapped,
)
from .scenes.traced_view import trace_view as trace_view
from .scenes.view import View as View
