"""Every public analysis by surface and by viewer: the same class with the same fields, or a refusal with a reason.

And what claims to be complete says whether that is certified.
"""

import re
from inspect import signature
from pathlib import Path

import numpy as np
import parity
import pytest
from offenders import for_each
from parity import CALLS, GAPS, REFUSED, Cell

import kerrcaustics as kc
from kerrcaustics.curves.caustic import CausticSet

VIEWER_FIRST = ("camera", "cameras", "images", "viewer")
STUB = Path(kc.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
# Rooms above the map: of what they hold, line profiles and pictures alone are analyses.
ABOVE = ("interop", "draw", "explorer", "results", "scene_files", "scenes", "sweeps")
CELLS = parity.cells()
REFUSALS = [cell for cell in CELLS if (entry := parity.refusal_of(cell)) and entry.argument]
CLAIMING = ("caustics", "star_images", "image_counts", "count_map", "pair_events", "star_tracks", "circle_images")
# Cells of the fast tests.
QUICK = ("star_images", "image_counts", "pair_events")
CERTAIN = [
    pytest.param(
        cell, id=str(cell), marks=[] if cell[1:] == ("sky", "near") and cell.analysis in QUICK else pytest.mark.slow
    )
    for cell in CELLS
    if cell.analysis in CLAIMING and not parity.refusal_of(cell)
]


class Missing(Exception):
    """A gap that stands in the table."""


def test_every_analysis_has_a_row():
    homes = re.findall(r"^from \.(\w+)\S* import ([^(]*?|\([^)]*\))$", STUB, re.MULTILINE)
    names = [name for room, line in homes if room not in ABOVE for name in re.findall(r"(\w+) as", line)]
    functions = [name for name in names if name[0].islower()]
    first = {name: next(iter(signature(getattr(kc, name)).parameters)) for name in functions}
    # A pattern is the amplification of many sources.
    reported = {name for name, of in first.items() if of in VIEWER_FIRST} - {"diffraction_pattern"}
    assert reported == {*CALLS} - {"line_profile", *parity.PICTURES}


@for_each(analysis=CALLS)
def test_signature_has_the_surfaces_of_the_table(analysis):
    reported = {parity.gaps_of(cell) for cell in CELLS if cell.analysis == analysis and cell.surface in parity.FINITE}
    lacks = any("no `end`" in gaps for gaps in reported)
    answers = any(
        cell.analysis == analysis and cell.surface in parity.FINITE and not parity.refusal_of(cell) for cell in CELLS
    )
    if analysis not in parity.OF_MATTER and answers:
        assert parity.takes_end(analysis) != lacks


@for_each(analysis=CALLS)
def test_result_is_of_one_class_whose_fields_are_there(analysis):
    """But for the other classes, and for the fields that may be None, which stand in GAPS."""
    kind = parity.class_of(analysis)
    reported = {entry.what for entry in GAPS if analysis in entry.analyses}
    others = {other.__name__ for other in parity.classes_of(analysis)} - {kind.__name__}
    assert others == {what.removeprefix("class ") for what in reported if what.startswith("class ")}
    none = {name for what in reported if what.startswith("None: ") for name in what.removeprefix("None: ").split(", ")}
    asked = parity.ASKED if analysis in parity.ASKED_OF else set()
    assert parity.optional_fields(kind) - asked == none - asked


@for_each(entry=[*REFUSED, *GAPS])
def test_entries_of_the_tables_are_alive(entry):
    """Every analysis, surface and viewer that an entry names has a cell which no other table, or entry, decides."""
    if isinstance(entry, parity.Refusal):
        own = [cell for cell in CELLS if parity.refusal_of(cell) is entry]
    else:
        own = [cell for cell in CELLS if parity.holds(entry, cell) and not parity.refusal_of(cell)]
        assert not [cell for cell in own if parity.gaps_of(cell).count(entry.what) > 1]
    for column, names in enumerate(entry[:3]):
        assert {cell[column] for cell in own} == set(names)


@for_each(cell=REFUSALS)
def test_refusals_name_the_argument(cell):
    """A surface that no argument can ask for is refused by the signature."""
    entry = parity.refusal_of(cell)
    if cell.analysis not in parity.OF_MATTER and not parity.takes_end(cell.analysis):
        assert entry.argument == "end" or "no `end`" in {e.what for e in GAPS if cell.analysis in e.analyses}
        return
    if entry.argument == "end" and not parity.takes_end(cell.analysis):
        return
    with pytest.raises(ValueError, match=rf"^Argument `{entry.argument}` must ") as caught:
        CALLS[cell.analysis](cell)
    assert "\n" not in str(caught.value)


def _marked(cell: Cell):
    gaps = parity.gaps_of(cell)
    marks = [pytest.mark.xfail(strict=True, raises=Missing, reason="; ".join(gaps))] if gaps else []
    return pytest.param(cell, marks=marks, id=str(cell))


@pytest.mark.slow
@pytest.mark.parametrize("cell", [_marked(cell) for cell in CELLS if not parity.refusal_of(cell)])
def test_cell_holds_an_answer(cell):
    gap, reported = parity.gap_of(cell), parity.gaps_of(cell)
    assert gap is None or gap in reported, f"{cell}: {gap}, of which the table says {reported or 'nothing'}"
    if gap:
        raise Missing(gap)


@pytest.mark.parametrize("cell", CERTAIN)
def test_what_is_not_certified_has_a_reason(cell):
    answer = parity.answer_of(cell)
    for part in [answer, *(answer if isinstance(answer, CausticSet) else ())]:
        sure = bool(np.all(part.certified))
        assert sure or part.remarks
        if cell.analysis in ("pair_events", "star_tracks", "circle_images"):
            assert sure == (not part.remarks)
    if cell.analysis in ("star_images", "image_counts"):
        # The source of the table is no hard one.
        assert np.all(answer.certified)
    if cell.analysis == "caustics":
        # Far away the primary caustic is hardly larger than its error: its cusps cannot be counted.
        unsure = [curve.order for curve in answer if curve.kind == "unresolved"]
        assert answer.certified == (not unsure) and unsure == [1] * (cell[1:] in (("sky", "far"), ("beyond", "far")))
