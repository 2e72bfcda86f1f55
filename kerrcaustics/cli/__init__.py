"""The command line. Degrees in and out; heavy modules are imported inside the commands."""

from kerrcaustics.cli import (
    amplification as amplification,
    caustics as caustics,
    counts as counts,
    doctor as doctor,
    explore as explore,
    figures as figures,
    film as film,
    images as images,
    light_curve as light_curve,
    magnification as magnification,
    render as render,
    scale as scale,
    scene as scene,
    study as study,
    sweep as sweep,
    tracks as tracks,
)
from kerrcaustics.cli.app import BadInput as BadInput, app as app, main as main
