"""A recorded session with the explorer in headless Chromium."""

import json
from urllib.parse import urlsplit

import pytest
from exploring import browser, needs_browser, served, settled, until

import kerrcaustics as kc
from kerrcaustics.explorer.state import ExplorerState


@pytest.fixture(scope="module")
def address():
    needs_browser()
    with served() as (address, _):
        yield address


@pytest.fixture(scope="module")
def chromium(address):
    with browser() as opened:
        yield opened


@pytest.fixture
def page(chromium, address):
    """A page that complains of nothing, and asks nobody else."""
    page = chromium.new_page(viewport={"width": 1400, "height": 900})
    wrong, asked = [], []
    page.on("console", lambda message: wrong.append(message.text) if message.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.on("websocket", lambda socket: asked.append(socket.url))
    yield page
    page.close()
    assert wrong == []
    own = urlsplit(address).netloc
    assert {urlsplit(url).netloc for url in asked if not url.startswith(("blob:", "data:"))} == {own}


def drag_star(page, theta, phi, steps):
    (x, y), *_ = page.evaluate("explorer.starSpots()")
    to = page.evaluate(f"explorer.spot({theta}, {phi})")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(*to, steps=steps)
    page.mouse.up()
    settled(page)


def exported(page, name):
    with page.expect_download() as download:
        page.get_by_role("button", name=name).click()
    return download.value.path()


@pytest.mark.slow
def test_session(page, address):
    state = ExplorerState(orders=2, theta=60.0, phi=150.0)
    page.goto(f"{address}#{state.address()}")
    settled(page)
    assert page.evaluate("explorer.counts()") == [1, 1]
    # Into the secondary caustic: of the pair, of index 1 and 2, one image is asked for.
    drag_star(page, 90, 270, 12)
    counts = page.evaluate("explorer.counts()")
    assert counts[1] == 2 and page.evaluate("explorer.certified()")
    now = page.evaluate("explorer.state()")
    images = kc.star_images(ExplorerState.of(now).camera(), ExplorerState.of(now).star(), 1)
    assert counts == list(images.per_index.values())
    assert page.evaluate("explorer.images().map((i) => i.magnification)") == images.magnification.tolist()

    page.keyboard.press("Space")
    until(page, "explorer.orbit() !== null && explorer.playing()")
    before = page.evaluate("explorer.state().phi")
    until(page, f"explorer.state().phi !== {before}")
    assert page.evaluate("explorer.orbit().events.length") >= 2
    page.keyboard.press("Space")
    settled(page)
    assert not page.evaluate("explorer.playing()")

    page.get_by_label("Spin a", exact=True).fill("2")
    settled(page)
    assert page.evaluate("explorer.state().spin") == 0.99
    assert exported(page, "Export a PNG picture").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert b"<svg" in exported(page, "Export an SVG picture").read_bytes()[:200]
    record = json.loads(exported(page, "Export the numbers as JSON").read_text())
    assert record["state"] == page.evaluate("explorer.state()") and len(record["caustics"]) == 2
    assert record["images"]["certified"]

    counts, here, link = page.evaluate("[explorer.counts(), explorer.state(), location.href]")
    page.goto("about:blank")
    page.goto(link)
    settled(page)
    again = page.evaluate("[explorer.counts(), explorer.state()]")
    assert again[0] == counts and ExplorerState.of(again[1]).address() == ExplorerState.of(here).address()


@pytest.mark.slow
def test_keys_move_the_star_and_change_the_spin(page, address):
    page.goto(f"{address}#spin=0.5&orders=2&theta=80&phi=100")
    settled(page)
    for key in ("ArrowRight", "ArrowRight", "ArrowUp", "Shift+ArrowDown", "]"):
        page.keyboard.press(key)
    settled(page)
    state = page.evaluate("explorer.state()")
    assert (round(state["theta"], 9), state["phi"]) == (79.1, 102) and 0.5 < state["spin"] < 0.6


def test_what_cannot_be_is_said(page, address):
    page.goto(f"{address}#spin=0.5&orders=2&velocity=circular&radius=2&inclination=90")
    settled(page)
    assert page.evaluate("explorer.state().velocity") == "fiducial"
    page.goto("about:blank")
    page.goto(f"{address}#chart=nothing")
    until(page, "!!window.explorer && explorer.quality() === 'full'")
    assert page.evaluate("explorer.state().chart") == "map" and "`chart`" in page.evaluate("explorer.line()")


@pytest.mark.slow
def test_page_without_a_program(chromium, tmp_path):
    from kerrcaustics.explorer.still_page import CAMERAS, write_page

    write_page(tmp_path / "explorer.html", CAMERAS[:2], [70.0, 90.0])
    page = chromium.new_page(viewport={"width": 1400, "height": 900})
    wrong, asked = [], []
    page.on("console", lambda message: wrong.append(message.text) if message.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto((tmp_path / "explorer.html").as_uri())
    settled(page)
    assert page.evaluate("[explorer.state().spin, explorer.state().theta]") == [0.999, 70]
    # Controls show what there is, and no others stand there.
    labels = page.locator(".kc-controls select").evaluate_all("nodes => nodes.map((node) => node.ariaLabel)")
    sliders = page.locator(".kc-controls input[type=range]").evaluate_all(
        "nodes => nodes.map((n) => [n.ariaLabel, n.max])"
    )
    assert labels == ["Camera"] and sliders == [["Star θ′ (°)", "1"], ["Star φ′ (°)", "360"]]
    assert page.get_by_label("Camera", exact=True).locator("option").count() == 2
    page.get_by_label("Camera", exact=True).select_option("1")
    settled(page)
    assert page.evaluate("[explorer.state().spin, explorer.certified()]") == [0.0, True]
    page.get_by_label("Camera", exact=True).select_option("0")
    for key, theta in (("ArrowDown", 90), ("ArrowDown", 90), ("ArrowUp", 70)):
        page.keyboard.press(key)
        settled(page)
        assert page.evaluate("[explorer.state().theta, explorer.freshness().images]") == [theta, "current"]
    drag_star(page, 89, 250, 5)
    state, counts = page.evaluate("[explorer.state(), explorer.counts()]")
    assert state["theta"] == 90 and counts == [1, 2]
    images = kc.star_images(ExplorerState.of(state).camera(), ExplorerState.of(state).star(), 1)
    assert counts == list(images.per_index.values())
    page.keyboard.press("Space")
    until(page, "explorer.playing() && explorer.orbit() !== null")
    page.close()
    assert wrong == [] and all(url.startswith(("file:", "blob:", "data:")) for url in asked)
