"""A page that works from a file, with no program behind it: the explorer, and the states of a grid."""

import base64
import hashlib
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from kerrcaustics.explorer.lessons import LESSONS, Lesson, lessons
from kerrcaustics.explorer.page_script import script
from kerrcaustics.explorer.state import PAGE, ExplorerState
from kerrcaustics.explorer.still_states import CAMERAS, THETAS, kinds_of, messages, requests
from kerrcaustics.files import writing
from kerrcaustics.results.progress import Progress, with_progress


@with_progress
def write_page(
    path: Path,
    cameras: Sequence[ExplorerState] = CAMERAS,
    thetas: Sequence[float] = THETAS,
    tour: Sequence[Lesson] = LESSONS,
    *,
    progress: Progress | bool | None = None,
) -> None:
    """Write the page of some cameras on circular orbits, stars at some heights (degrees), and a tour.

    The states of the usual page come with the package; others are computed, a fraction of a second each.
    """
    known = messages(requests(cameras, thetas, tour))
    texts = {request: base64.b64encode(data).decode() for request, data in known.items()}
    states = {
        "views": [texts["view", camera] for camera in cameras],
        "thetas": list(thetas),
        "orbits": [[texts["orbit", replace(camera, theta=theta)] for theta in thetas] for camera in cameras],
        "presets": [{"name": f"a = {one.spin:g}, r = {one.radius:g}", "state": one.record()} for one in cameras],
        "lessons": [{kind: texts[kind, lesson.state] for kind in kinds_of(lesson.state)} for lesson in tour],
        "words": lessons(tour),
    }
    with writing(path) as file:
        file.write(_page(json.dumps(states)).encode())


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
