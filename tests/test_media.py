"""Clips and pictures of the pages: none is older than what draws it."""

import importlib
import sys

import pytest

from kerrcaustics.scripts import HOME

DOCS = HOME / "docs"
SCRIPT = """
from drawn import LOOK, panel
from kerrcaustics.draw import style


def main(output):
    panel(output, style.RC)
"""
DRAWN = """
LOOK = 3
WIDTH, HEIGHT = 4, 5


def panel(output, look):
    return line(output, WIDTH)


def line(output, width):
    return width + 1


def unused():
    return HEIGHT
"""
STYLE = "RC = {'size': 10}\nOTHER = 1\n"


@pytest.fixture(scope="module")
def digests():
    if not (DOCS / "media_digests.py").exists():
        pytest.skip("this is no checkout")
    sys.path.insert(0, str(DOCS))
    try:
        yield importlib.import_module("media_digests")
    finally:
        sys.path.remove(str(DOCS))


def test_no_clip_and_no_picture_is_stale(digests):
    """Otherwise make it anew, look at it, and record it: CONTRIBUTING.md says how."""
    assert set(digests.media()) == set(digests.DRAWN_BY) == set(digests.recorded())
    stale = {}
    for name, known in digests.recorded().items():
        now = digests.digests(name)
        stale |= {f"{name}: {part}": digest for part, digest in now.items() if digest != known[part]}
    assert not stale


CHANGES = {
    "a number that is used": ("drawn", "WIDTH, HEIGHT = 4", "WIDTH, HEIGHT = 6", True),
    "a function that is used by one that is used": ("drawn", "width + 1", "width - 1", True),
    "the style": ("style", "10", "11", True),
    "the script": ("script", "panel(output,", "panel(2 * output,", True),
    "a function that is not used": ("drawn", "return HEIGHT", "return 0", False),
    "another style": ("style", "OTHER = 1", "OTHER = 2", False),
    "a comment": ("drawn", "    return line", "    # A line.\n    return line", False),
    "a docstring": ("drawn", "    return line", '    """A line."""\n    return line', False),
    "an annotation": ("drawn", "(output, look):", "(output: int, look: dict) -> int:", False),
    "the layout": ("drawn", "line(output, WIDTH)", "line(\n        output,\n        WIDTH,\n    )", False),
}


@pytest.mark.parametrize(("module", "before", "after", "alters"), CHANGES.values(), ids=CHANGES)
def test_digests_change_with_what_draws(digests, tmp_path, module, before, after, alters):
    script = SCRIPT.replace("from drawn", "from .drawn")
    places = {"script": "figures/script.py", "drawn": "figures/drawn.py", "style": "kerrcaustics/draw/style.py"}
    found = []
    for home in (tmp_path / "before", tmp_path / "after"):
        texts = {"script": script, "drawn": DRAWN, "style": STYLE}
        if home.name == "after":
            assert before in texts[module]
            texts[module] = texts[module].replace(before, after)
        for name, place in places.items():
            (home / place).parent.mkdir(parents=True, exist_ok=True)
            (home / place).write_text(texts[name], encoding="utf-8")
        found.append(digests.drawing_digest(["figures/script.py"], home=home))
    assert (found[0] != found[1]) == alters
