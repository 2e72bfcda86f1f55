"""A recorded session with the explorer in headless Chromium."""

import json
import math
from dataclasses import replace
from itertools import pairwise
from urllib.parse import urlsplit

import numpy as np
import pytest
from exploring import browser, needs_browser, served, settled, until
from PIL import Image, ImageSequence

import kerrcaustics as kc
from kerrcaustics.explorer.lessons import LESSONS, TERMS
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
    state = page.evaluate("explorer.state()")
    start = f"kerr_a{state['spin']}_r{state['radius']}_theta{state['theta']:.7g}_phi{state['phi']:.7g}."
    assert download.value.suggested_filename.startswith(start)
    return download.value.path()


@pytest.mark.slow
def test_session(page, address):
    state = ExplorerState(spin=0.999, orders=2, theta=60.0, phi=150.0)
    page.goto(f"{address}#{state.address()}")
    settled(page)
    assert page.evaluate("explorer.counts()") == [1, 1]
    # Into the secondary caustic: of the pair, of index 1 and 2, one image is asked for.
    drag_star(page, 90, 270, 12)
    counts = page.evaluate("explorer.counts()")
    assert counts[1] == 2 and page.evaluate("explorer.certified()")
    now = page.evaluate("explorer.state()")
    images = kc.star_images(ExplorerState.from_values(now).camera(), ExplorerState.from_values(now).star(), 1)
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
    picture = exported(page, "Export an SVG picture").read_text(encoding="utf-8")
    words = ("Camera sky", "Celestial sphere", "seen from inside", "← φ′", "θ′ ↓", " of index 1; certified.")
    assert "<svg" in picture[:200] and [word for word in words if word not in picture] == []
    record = json.loads(exported(page, "Export the numbers as JSON").read_text())
    assert record["state"] == page.evaluate("explorer.state()") and len(record["caustics"]) == 2
    assert record["images"]["certified"]

    counts, here, link = page.evaluate("[explorer.counts(), explorer.state(), location.href]")
    page.goto("about:blank")
    page.goto(link)
    settled(page)
    again = page.evaluate("[explorer.counts(), explorer.state()]")
    assert (
        again[0] == counts
        and ExplorerState.from_values(again[1]).address() == ExplorerState.from_values(here).address()
    )


@pytest.mark.slow
def test_a_star_of_finite_size_has_images_with_shapes(page, address):
    page.goto(f"{address}#spin=0.5&orders=2&theta=80&phi=170")
    settled(page)
    assert page.evaluate("explorer.light()") is None
    page.get_by_label("Star radius (°)", exact=True).fill("0")
    settled(page)
    light, state = page.evaluate("[explorer.light(), explorer.state()]")
    assert state["size"] == 1 and light["certified"] and light["limbs"] == 2
    seen = kc.magnification(kc.Camera(0.5, 6.03), ExplorerState.from_values(state).star(), math.radians(1), max_index=1)
    assert light["total"] == pytest.approx(seen.total, rel=1e-12)
    assert "The star as a disc: magnification" in page.inner_text(".kc-said")
    page.keyboard.press("ArrowRight")
    page.get_by_label("Star radius (°)", exact=True).fill("-3")
    settled(page)
    assert page.evaluate("[explorer.state().size, explorer.light()]") == [0, None]


@pytest.mark.slow
def test_waves_of_a_star_are_a_layer(page, address):
    page.goto(f"{address}#spin=0.5&orders=2&theta=80&phi=170")
    settled(page)
    assert page.evaluate("explorer.waves()") is None and page.locator(".kc-spectrum").is_hidden()
    page.get_by_label("Frequency ωM", exact=True).fill("0.5")
    settled(page)
    waves, state = page.evaluate("[explorer.waves(), explorer.state()]")
    seen = kc.amplification(
        kc.Camera(0.5, 6.03), ExplorerState.from_values(state).star(), state["frequency"], max_index=1
    )
    assert state["frequency"] == 3.16 and waves["points"] == 400
    assert waves["modulus"] == pytest.approx(abs(seen.value[0]), rel=1e-9)
    assert "Its waves at ωM = 3.16" in page.inner_text(".kc-said")
    assert page.locator(".kc-spectrum").is_visible()
    page.get_by_label("Frequency ωM", exact=True).fill("-1.32")
    settled(page)
    assert page.evaluate("explorer.waves()") is None and page.locator(".kc-spectrum").is_hidden()


@pytest.mark.slow
def test_keys_move_the_star_and_change_the_spin(page, address):
    page.goto(f"{address}#spin=0.5&orders=2&theta=80&phi=100")
    settled(page)
    for key in ("ArrowRight", "ArrowRight", "ArrowUp", "Shift+ArrowDown", "]"):
        page.keyboard.press(key)
    settled(page)
    state = page.evaluate("explorer.state()")
    # The sphere is seen from inside: phi' grows to the left.
    assert (round(state["theta"], 9), state["phi"]) == (79.1, 98) and 0.5 < state["spin"] < 0.6


def test_what_cannot_be_is_said(page, address):
    page.goto(f"{address}#spin=0.5&orders=2&velocity=circular&radius=2&inclination=90")
    settled(page)
    assert page.evaluate("explorer.state().velocity") == "fiducial"
    page.goto("about:blank")
    page.goto(f"{address}#chart=nothing")
    until(page, "!!window.explorer && explorer.quality() === 'full'")
    assert page.evaluate("explorer.state().chart") == "map" and "`chart`" in page.evaluate("explorer.line()")


@pytest.mark.slow
def test_page_that_computes_nothing(chromium, tmp_path):
    from kerrcaustics.explorer.still_page import CAMERAS, write_page

    tour = (*LESSONS[1:3], *LESSONS[6:])
    cameras = (CAMERAS[1], replace(CAMERAS[1], spin=0.0))
    write_page(tmp_path / "explorer.html", cameras, [70.0, 90.0], tour, live=False)
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
    images = kc.star_images(ExplorerState.from_values(state).camera(), ExplorerState.from_values(state).star(), 1)
    assert counts == list(images.per_index.values())
    page.keyboard.press("Space")
    until(page, "explorer.playing() && explorer.orbit() !== null")
    page.get_by_role("button", name="A tour of 4 steps").click()
    for lesson in tour:
        until(page, f"document.querySelector('.kc-lesson h2').textContent === '{lesson.name}'")
        settled(page)
        assert page.evaluate("explorer.counts()") == list(lesson.per_index) and page.evaluate("explorer.certified()")
        layers = page.evaluate("[explorer.light() !== null, explorer.waves() !== null]")
        assert layers == [lesson.state.size > 0, lesson.state.frequency > 0]
        page.evaluate("document.querySelector('[aria-label=\"Next step of the tour\"]').click()")
    page.get_by_role("button", name="A quiz: how many images?").click()
    until(page, "explorer.kept() !== null")
    assert page.evaluate("explorer.images()") == []
    page.close()
    assert wrong == [] and all(url.startswith(("file:", "blob:", "data:")) for url in asked)


@pytest.mark.slow
def test_the_tour_shows_its_lessons_and_terms_say_what_they_mean(page, address):
    page.goto(f"{address}#orders=1")
    settled(page)
    page.get_by_role("button", name="A tour of 8 steps").click()
    for lesson in LESSONS[:2]:
        settled(page)
        assert page.evaluate("explorer.counts()") == list(lesson.per_index) and page.evaluate("explorer.certified()")
        assert lesson.look_for in page.get_by_label("Tour", exact=True).inner_text()
        page.get_by_role("button", name="Next step of the tour").focus()
        page.keyboard.press("Enter")
    term = page.locator(".kc-lesson dfn[data-term=caustic]").first
    term.focus()
    assert TERMS["caustic"] in page.get_by_role("tooltip").inner_text()
    page.keyboard.press("Escape")
    assert page.get_by_role("tooltip").count() == 0


# Pixels by which the page, a table or the longest words of a select are wider than their place.
_EXCESS = """() => {
  const hidden = [document.scrollingElement, ...document.querySelectorAll(".kc-scroll")];
  const wanted = (select) => {
    const copy = select.parentNode.appendChild(select.cloneNode(true));
    copy.style.width = "max-content";
    const width = copy.offsetWidth;
    copy.remove();
    return width - select.offsetWidth;
  };
  const selects = [...document.querySelectorAll(".kc-controls select")];
  return Math.max(...hidden.map((box) => box.scrollWidth - box.clientWidth), ...selects.map(wanted));
}"""


@pytest.mark.slow
def test_nothing_is_cut_off_on_a_phone(page, address):
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto(f"{address}#orders=3&spin=0.7&radius=10&velocity=static")
    settled(page)
    page.locator(".kc-controls summary").click()
    page.get_by_text("The same on the command line and in Python").click()
    assert page.evaluate(_EXCESS) <= 0


@pytest.mark.slow
def test_a_refused_number_is_forgotten_when_another_is_edited(page, address):
    page.goto(f"{address}#orders=2&spin=0.5")
    settled(page)
    for name, number in (("Radius r (M)", "-4"), ("Inclination (°)", "200")):
        page.get_by_label(f"{name}, number", exact=True).fill(number)
        page.keyboard.press("Enter")
    notes = page.locator(".kc-note:visible")
    assert [text.split(" is not")[0] for text in notes.all_inner_texts()] == ["200"]
    assert page.locator("[aria-invalid=true]").count() == 1
    page.get_by_label("Spin a, number", exact=True).fill("0.9")
    page.keyboard.press("Enter")
    settled(page)
    assert notes.count() == 0


@pytest.mark.slow
def test_a_first_visit_is_invited_to_drag_and_to_the_tour(page, address):
    page.goto(address)
    settled(page)
    assert page.evaluate("[explorer.state().spin, explorer.invites()]") == [0.5, True]
    invitation = page.locator(".kc-invitation")
    drag_star(page, 88, 322, 10)
    # Into the secondary caustic: the pair that the line promises.
    assert page.evaluate("[explorer.counts(), explorer.invites()]") == [[1, 2, 2], False]
    assert invitation.is_visible()
    page.get_by_role("button", name="Take the tour").click()
    settled(page)
    assert invitation.is_hidden() and "1 of 8" in page.get_by_label("Tour", exact=True).inner_text()
    # A link is no first visit.
    link = page.url
    page.goto("about:blank")
    page.goto(link)
    settled(page)
    assert invitation.is_hidden() and not page.evaluate("explorer.invites()")


@pytest.mark.slow
def test_the_quiz_hides_images_until_an_answer(page, address):
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto(f"{address}#orders=2&spin=0.9")
    settled(page)
    page.get_by_role("button", name="A quiz: how many images?").click()
    until(page, "explorer.kept() !== null")
    hidden, state = page.evaluate("[explorer.kept(), explorer.state()]")
    images = kc.star_images(ExplorerState.from_values(state).camera(), ExplorerState.from_values(state).star(), 1)
    assert hidden == list(images.per_index.values()) and images.certified
    assert page.evaluate("explorer.images()") == [] and "certified" not in page.inner_text("header")
    page.get_by_role("textbox", name="How many images").fill(str(sum(hidden)))
    page.keyboard.press("Enter")
    verdict = page.get_by_label("Quiz", exact=True).inner_text()
    assert "Right." in verdict and "1 of 1 right" in verdict
    assert page.evaluate("explorer.counts()") == hidden
    # Another star, which somebody moves before an answer.
    page.get_by_role("button", name="Another star").click()
    until(page, "explorer.kept() !== null")
    page.locator(".kc-controls summary").click()
    page.get_by_label("Star θ′ (°)", exact=True).fill("120")
    settled(page)
    assert page.evaluate("explorer.kept()") is None and sum(page.evaluate("explorer.counts()")) > 0


@pytest.mark.slow
def test_an_orbit_is_recorded_as_a_gif(page, address):
    page.goto(f"{address}#orders=1&spin=0.5&theta=80")
    settled(page)
    star = page.evaluate("explorer.state().phi")
    page.get_by_label("Speed of the orbit").select_option("4")
    with page.expect_download(timeout=120_000) as download:
        page.get_by_role("button", name="Record one orbit as a GIF").click()
    settled(page)
    assert page.evaluate("explorer.state().phi") == star
    with Image.open(download.value.path()) as film:
        frames = [np.asarray(frame.convert("L"), float) for frame in ImageSequence.Iterator(film)]
    assert len(frames) == 48 and frames[0].shape == (720, 1240) and film.info["duration"] == 80
    # The star moves in all frames: each differs from the one before.
    assert min(np.abs(a - b).max() for a, b in pairwise(frames)) > 50
