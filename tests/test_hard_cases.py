"""Directions at the extremes, whose truth another program knows, against the claims of every result; see data/README.md."""

import json
import math
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scripts import STUDIES

CASES = json.loads((Path(__file__).parent / "data" / "hard_cases.json").read_text(encoding="utf-8"))["cases"]
CLAIMS = STUDIES.module("adversary.claims")
# The true error is at most this many times the reported one.
HONEST = 10.0


def request(case: dict) -> tuple:
    """Camera, end, engine and tolerance of a case, as a key."""
    camera = tuple(
        tuple(v) if isinstance(v, list) else v for v in (case[k] for k in ("spin", "radius", "inclination", "velocity"))
    )
    end = case["end"]
    return camera, math.inf if end is None else end["plane"] if isinstance(end, dict) else end, case["engine"]
