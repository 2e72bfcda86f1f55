"""From a movement of the pointer to the drawn picture, in headless Chromium: run this file with -s."""

import statistics
import sys
import time
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from exploring import browser, needs_browser, served, settled, until

SPINS = [0.5 + 0.2 * i for i in range(12)]  # places of the slider, -log10(1 - a)
SLIDER = "document.querySelector('input[type=range][aria-label=\"Spin a\"]')"


@pytest.fixture(scope="module")
def page():
    needs_browser()
    with served() as (address, _), browser() as opened:
        page = opened.new_page(viewport={"width": 1400, "height": 900})
        page.goto(f"{address}#theta=75&phi=100")
        settled(page)
        yield page


def reported(name, milliseconds):
    assert milliseconds
    late = sorted(milliseconds)[int(0.95 * len(milliseconds))]
    middle = statistics.median(milliseconds)
    print(f"\n{name}: median {middle:.0f} ms, 95 % {late:.0f} ms, {len(milliseconds)} pictures")


@pytest.mark.parametrize("orders", [2, 3])
def test_dragged_star(page, orders):
    page.evaluate(f"explorer.show({{orders: {orders}, theta: 75, phi: 100}})")
    settled(page)
    (x, y), *_ = page.evaluate("explorer.starSpots()")
    page.mouse.move(x, y)
    page.mouse.down()
    page.evaluate("explorer.latencies().star.length = 0")
    for i in range(150):
        page.mouse.move(x + 2 * i, y + i % 40)
        time.sleep(0.016)
    page.mouse.up()
    settled(page)
    reported(f"star dragged, {orders} orders", page.evaluate("explorer.latencies().star"))


def test_changed_spin(page):
    first, whole = [], []
    for place in SPINS:
        page.evaluate("explorer.latencies().draft.length = explorer.latencies().full.length = 0")
        for event, kept in (("input", "draft"), ("change", "full")):
            dispatched = f"{SLIDER}.dispatchEvent(new Event('{event}', {{bubbles: true}}))"
            page.evaluate(f"({SLIDER}.value = {place}, {dispatched})")
            until(page, f"explorer.latencies().{kept}.length > 0")
        first += page.evaluate("explorer.latencies().draft.slice(0, 1)")
        whole += page.evaluate("explorer.latencies().full.slice(0, 1)")
        settled(page)
    reported("spin changed, first picture", first)
    reported("spin changed, whole picture", whole)
