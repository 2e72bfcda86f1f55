"""Data of a page that computes its answers itself: kernels, rules of the state, and the greeting."""

import base64
import gzip
import json
from typing import Any

from kerrcaustics.beams.kernels.webassembly import browser_kernels
from kerrcaustics.explorer.answers import greeting
from kerrcaustics.explorer.limits import NEAREST, STEPS
from kerrcaustics.explorer.page_script import script
from kerrcaustics.explorer.state import CHOICES, MOST_ORDERS, RANGES, ExplorerState
from kerrcaustics.scenes.checkerboard import COLOURS, DARKER, GAP_COLOUR, Checkerboard


def live_data(*, plain: bool = True) -> dict[str, Any] | None:
    """The data as JSON has them; None where kernels for browsers were not built.

    plain: True with the kernels for browsers without SIMD, which are not compressed: these seldom unpack anything.
    """
    kernels = browser_kernels()
    if kernels is None:
        return None
    packed = gzip.compress(kernels.simd, mtime=0)
    return {
        "simd": base64.b64encode(packed).decode(),
        "plain": base64.b64encode(kernels.plain).decode() if plain else None,
        "layout": kernels.layout,
        "rules": rules(),
        "greeting": greeting().record,
    }


def rules() -> dict[str, Any]:
    """Ranges, choices and usual values of a state, the nearest camera, and the checkerboard."""
    board = Checkerboard()
    return {
        "ranges": {**RANGES, "orders": (1, MOST_ORDERS)},
        "choices": CHOICES,
        "usual": ExplorerState().record(),
        "nearest": (NEAREST, STEPS),
        "checkerboard": {
            "rows": board.rows,
            "columns": board.columns,
            "gap": board.gap,
            "darker": DARKER,
            "colours": COLOURS,
            "gapColour": GAP_COLOUR,
        },
    }


def notebook_script() -> str:
    """The script of the page in a notebook, with what it needs where no kernel answers, but for old browsers."""
    return f"const LIVE = {json.dumps(live_data(plain=False))};\n{script('notebook', live=True)}"
