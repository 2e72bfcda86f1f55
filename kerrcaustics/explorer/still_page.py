"""The explorer in one file, which needs no program and no network.

It computes its answers itself; where the browser forbids that, it shows the nearest of a few stored states.
"""

import base64
import hashlib
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from kerrcaustics.explorer.lessons import LESSONS, Lesson, lessons
from kerrcaustics.explorer.live_page import live_data
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
    live: bool = True,
    progress: Progress | bool | None = None,
) -> None:
    """Write the page.

    cameras, thetas, tour: the stored states are those of some cameras on circular orbits, with stars at some heights
    (degrees), and those of a tour. Those of the usual page come with the package; others are computed, a fraction of a
    second each.
    live: False for a page that computes nothing; so it is, too, where no kernels for browsers were built.
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
        "live": live_data() if live else None,
    }
    with writing(path) as file:
        file.write(_page(json.dumps(states)).encode())


def _page(states: str) -> str:
    page = script("still", live=True)
    style = (PAGE / "explorer.css").read_text(encoding="utf-8")
    # No network: the worker is a part of the script, and what the kernels are made of is in the page.
    sources = f"script-src '{_hash(page)}' 'wasm-unsafe-eval'; style-src '{_hash(style)}'; worker-src blob:"
    policy = f"default-src 'none'; {sources}; img-src blob: data:"
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
