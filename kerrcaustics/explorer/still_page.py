"""A page that works from a file, with no program behind it: the explorer, and the states of a grid."""

import base64
import hashlib
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from kerrcaustics.explorer.answers import orbit_of, shapes_of, waves_of
from kerrcaustics.explorer.lessons import LESSONS, Lesson, lessons
from kerrcaustics.explorer.page_data import Message, view_of
from kerrcaustics.explorer.page_script import script
from kerrcaustics.explorer.state import PAGE, ExplorerState
from kerrcaustics.files import writing
from kerrcaustics.results.progress import Progress, in_steps, with_progress

CAMERAS = tuple(
    ExplorerState(spin=spin, radius=radius, theta=76.0, phi=330.0, orders=3 if spin == 0.5 else 2)
    for spin, radius in ((0.999, 6.03), (0.0, 6.03), (0.5, 6.03), (0.9, 6.03), (0.999, 2.6), (0.9, 2.6))
)
THETAS = (30.0, 60.0, 70.0, 76.0, 80.0, 84.0, 88.0, 90.0, 100.0, 120.0, 150.0)
"""Heights of stars, degrees; on each, all longitudes."""
_MOMENTS = 240


@with_progress
def write_page(
    path: Path,
    cameras: Sequence[ExplorerState] = CAMERAS,
    thetas: Sequence[float] = THETAS,
    tour: Sequence[Lesson] = LESSONS,
    *,
    progress: Progress | bool | None = None,
) -> None:
    """Write the page of some cameras on circular orbits, stars at some heights (degrees), and a tour."""
    views, orbits = [], []
    for camera in in_steps("camera", cameras):
        views.append(_text(view_of(camera)))
        orbits.append([_text(orbit_of(replace(camera, theta=theta), _MOMENTS)) for theta in thetas])
    states = {
        "views": views,
        "thetas": list(thetas),
        "orbits": orbits,
        "presets": [{"name": f"a = {one.spin:g}, r = {one.radius:g}", "state": one.record()} for one in cameras],
        "lessons": [_star(lesson.state) for lesson in tour],
        "words": lessons(tour),
    }
    with writing(path) as file:
        file.write(_page(json.dumps(states)).encode())


def _star(state: ExplorerState) -> dict[str, str | None]:
    return {
        "view": _text(view_of(state)),
        "orbit": _text(orbit_of(state, _MOMENTS)) if state.has_orbit else None,
        "shapes": _text(shapes_of(state)) if state.size else None,
        "waves": _text(waves_of(state)) if state.frequency else None,
    }


def _page(states: str) -> str:
    page = script("still")
    style = (PAGE / "explorer.css").read_text(encoding="utf-8")
    policy = f"default-src 'none'; script-src '{_hash(page)}'; style-src '{_hash(style)}'; img-src blob: data:"
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n<title>Kerr caustics explorer</title>\n'
        f'<style>{style}</style>\n</head>\n<body class="kc-page">\n<main id="explorer"></main>\n'
        f'<script type="application/json" id="states">{states}</script>\n'
        f'<script type="module">{page}</script>\n</body>\n</html>\n'
    )


def _hash(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"


def _text(message: Message) -> str:
    return base64.b64encode(message.encoded()).decode()
