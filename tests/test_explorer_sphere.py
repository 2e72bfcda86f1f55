"""The side from which the celestial sphere is drawn: from inside, as the camera sees it, unless it is turned over."""

from dataclasses import replace

import numpy as np
import pytest
from exploring import browser, evaluated, needs_browser, served, settled

import kerrcaustics as kc
from kerrcaustics.explorer.page_script import LOGIC
from kerrcaustics.explorer.state import ExplorerState
from kerrcaustics.spacetime.shadow import shadow_axes, shadow_edge

STATE = ExplorerState(spin=0.5, orders=2, theta=80.0, phi=200.0)


def test_an_image_far_from_the_hole_goes_where_the_star_is_dragged():
    """To the right from inside: phi' falls, and the image of index 0 moves to the right on the camera sky."""
    camera = STATE.camera()
    right = shadow_axes(camera, shadow_edge(camera))[1]
    images = [kc.star_images(camera, replace(STATE, phi=phi).star(), 0).sky[0] for phi in (200.0, 190.0)]
    assert np.diff(images @ right) > 0.05
    places = evaluated(
        "const charts = [new MapChart(true), new MapChart(false), new GlobeChart()];"
        "return ['inside', 'outside'].map((sphere) => charts.map((chart) => {"
        "chart.fit({ state: { ...DEFAULTS, sphere }, curves: [] }); chart.view && (chart.view.lon = 195);"
        "const f = chart.frame(400, 300), spot = (phi) => chart.spot([80, phi], f);"
        "return [spot(190)[0] - spot(200)[0], chart.under(...spot(190).slice(0, 2), f)]; }));",
        (*LOGIC, "celestial_map", "celestial_globe"),
    )
    steps = np.array([[step for step, _ in row] for row in places])
    assert (steps[0] > 5).all() and (steps[1] < -5).all() and np.allclose(steps[0], -steps[1], atol=1e-9)
    assert np.allclose(np.array([[spot for _, spot in row] for row in places]) % 360, [80, 190], atol=1e-9)


@pytest.fixture(scope="module")
def address():
    needs_browser()
    with served() as (address, _):
        yield address


@pytest.mark.slow
def test_the_sphere_is_turned_over_and_the_address_keeps_it(address):
    with browser() as chromium:
        page = chromium.new_page(viewport={"width": 1400, "height": 900})
        page.goto(f"{address}#{STATE.address()}")
        settled(page)
        ((inside, _),) = page.evaluate("explorer.starSpots()")
        button = page.get_by_role("button", name="The sphere is seen from inside: turn it over")
        button.click()
        settled(page)
        ((outside, _),) = page.evaluate("explorer.starSpots()")
        # 200 degrees: 20 to the left of the middle from inside, as far to the right from outside.
        assert outside - inside > 20 and "sphere=outside" in page.url
        page.keyboard.press("Escape")
        page.locator(".kc-celestial").click(position={"x": 5, "y": 5})
        # Arrows go where they point.
        phi = page.evaluate("explorer.state().phi")
        page.locator(".kc-celestial").press("ArrowRight")
        settled(page)
        assert page.evaluate("explorer.state().phi") == pytest.approx((phi + 1) % 360)
        # Lessons leave it as it is.
        page.get_by_role("button", name="A tour of 8 steps").click()
        settled(page)
        assert page.evaluate("explorer.state().sphere") == "outside"
        page.get_by_role("button", name="The sphere is seen from outside: turn it over").click()
        settled(page)
        assert page.evaluate("explorer.state().sphere") == "inside"


@pytest.mark.slow
def test_lessons_about_a_caustic_zoom_to_it(address):
    with browser() as chromium:
        page = chromium.new_page(viewport={"width": 1400, "height": 900})
        page.goto(f"{address}#orders=1&chart=unwrapped")
        settled(page)
        for name, zoomed in (("A pair is born", True), ("A cusp", True), ("One orbit", False)):
            page.get_by_label("Presets").select_option(name)
            settled(page)
            low, high, *_ = page.evaluate("explorer.windows().source ?? [0, 360]")
            assert (high - low < 40) == zoomed, name


def test_spheres_in_figures_say_that_they_are_seen_from_outside():
    from matplotlib.figure import Figure

    from kerrcaustics.draw.sky_axes import celestial_sphere_axes

    ax = celestial_sphere_axes(Figure().subplots())
    assert ax.get_xlim() == (-180, 180) and ax.get_xlabel() == "φ′ (deg), seen from outside"
    ax.set_xlim(-10, 10)
    assert celestial_sphere_axes(ax).get_xlim() == (-10, 10)
