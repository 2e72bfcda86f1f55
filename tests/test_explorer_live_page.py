"""The explorer in one file, in Chromium: it computes its answers itself, and asks nothing of the network."""

import json
import re

import pytest
from exploring import browser, needs_chromium, settled, until
from living import needs_kernels

from kerrcaustics.explorer.lessons import LESSONS
from kerrcaustics.explorer.live_page import notebook_script
from kerrcaustics.explorer.page_data import view_of
from kerrcaustics.explorer.state import PAGE, ExplorerState
from kerrcaustics.explorer.still_page import write_page

pytestmark = pytest.mark.slow

# Bytes of the file at most.
MOST = 1_500_000
OFF_EQUATOR = ExplorerState(spin=0.9, radius=8.0, inclination=60.0, velocity="fiducial")


@pytest.fixture(scope="module")
def chromium():
    needs_chromium()
    needs_kernels()
    with browser() as opened:
        yield opened


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("live") / "explorer.html"
    write_page(path)
    return path


@pytest.fixture
def page(chromium):
    """A page without a network; nothing may go wrong on it, and only the file and parts of it may be asked for."""
    context = chromium.new_context(viewport={"width": 1400, "height": 900}, offline=True)
    opened, wrong, asked = context.new_page(), [], []
    opened.on("console", lambda message: wrong.append(message.text) if message.type in ("error", "warning") else None)
    opened.on("pageerror", lambda error: wrong.append(str(error)))
    opened.on("request", lambda request: asked.append(request.url))
    yield opened
    context.close()
    assert wrong == [] and all(url.startswith(("file:", "blob:", "data:")) for url in asked)


def test_the_file_is_small_and_allows_itself_no_network(file):
    text = file.read_text(encoding="utf-8")
    assert len(text.encode()) < MOST
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)[1]
    assert policy.startswith("default-src 'none'; ") and "connect-src" not in policy and "unsafe-inline" not in policy
    assert "http://" not in text.replace("http://www.w3.org", "") and "https://" not in text


@pytest.mark.parametrize("state", [ExplorerState(), OFF_EQUATOR], ids=["usual", "off the equator"])
def test_the_first_answer_is_certified_and_that_of_the_program(page, file, state):
    page.goto(f"{file.as_uri()}#{state.address()}")
    settled(page)
    assert page.evaluate("explorer.certified()") is True
    images = view_of(state).record["images"]
    found = page.evaluate("explorer.images()")
    assert [image["index"] for image in found] == images["index"]
    for own, sky in zip(found, images["sky"], strict=True):
        assert own["sky"] == pytest.approx(sky, abs=1e-9)


def test_a_star_is_dragged_and_a_slider_moved(page, file):
    page.goto(file.as_uri())
    settled(page)
    ((x, y),) = page.evaluate("explorer.starSpots()")
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 31):
        page.mouse.move(x - 2 * step, y + step)
    assert page.evaluate("explorer.certified()") is not None
    page.mouse.up()
    settled(page)
    state = page.evaluate("explorer.state()")
    assert state["phi"] != 295 and page.evaluate("explorer.certified()") is True
    assert page.evaluate("explorer.latencies().star.length") > 3
    # The address is that of the state, and the state that of the address.
    until(page, f"location.hash.includes('phi={state['phi']:.6g}'.slice(0, 8))", 5)
    page.evaluate("location.hash = '#spin=0.9&orders=2'")
    until(page, "explorer.state().spin === 0.9 && explorer.quality() === 'full' && !explorer.busy()")
    spin = page.get_by_label("Spin a", exact=True)
    spin.focus()
    for _ in range(20):
        page.keyboard.press("ArrowRight")
    settled(page)
    assert page.evaluate("explorer.state().spin") > 0.9 and page.evaluate("explorer.quality()") == "full"


def test_the_tour_the_quiz_and_the_orbit_work(page, file):
    page.goto(file.as_uri())
    settled(page)
    page.get_by_role("button", name="A tour of 8 steps").click()
    for lesson in LESSONS:
        until(page, f"document.querySelector('.kc-lesson h2').textContent === '{lesson.name}'")
        settled(page)
        assert page.evaluate("explorer.counts()") == list(lesson.per_index) and page.evaluate("explorer.certified()")
        layers = page.evaluate("[explorer.light() !== null, explorer.waves() !== null]")
        assert layers == [lesson.state.size > 0, lesson.state.frequency > 0]
        if lesson.name == "One orbit":
            page.evaluate("document.querySelector('.kc-play').click()")
            until(page, "explorer.playing() && explorer.orbit() !== null")
            assert page.evaluate("explorer.orbit().events.length") >= 4
        page.evaluate("document.querySelector('[aria-label=\"Next step of the tour\"]').click()")
    page.get_by_role("button", name="A quiz: how many images?").click()
    until(page, "explorer.kept() !== null")
    assert page.evaluate("explorer.images()") == []


def test_the_quiz_takes_a_hole_that_spins(page, file):
    page.goto(f"{file.as_uri()}#spin=0")
    settled(page)
    page.get_by_role("button", name="A quiz: how many images?").click()
    until(page, "explorer.kept() !== null")
    assert page.evaluate("explorer.state().spin") == 0.5 and page.evaluate("explorer.images()") == []


def test_what_only_the_program_has_is_said(page, file):
    page.goto(f"{file.as_uri()}#size=2")
    settled(page)
    assert "works without a program" in page.evaluate("explorer.line()")
    page.goto("about:blank")
    page.goto(f"{file.as_uri()}#chart=nothing")
    until(page, "!!window.explorer && explorer.quality() === 'full'")
    assert page.evaluate("explorer.state().chart") == "map" and "`chart`" in page.evaluate("explorer.line()")
    page.goto("about:blank")
    page.goto(f"{file.as_uri()}#radius=2&velocity=circular")
    settled(page)
    assert page.evaluate("explorer.state().velocity") == "fiducial"
    assert "must not be circular" in page.locator(".kc-choice .kc-note").first.inner_text()


@pytest.mark.parametrize("backdrop", ["checkerboard", "stars"])
def test_the_sky_is_seen_behind_the_curves(page, file, backdrop):
    page.goto(f"{file.as_uri()}#backdrop={backdrop}")
    settled(page)
    until(page, "explorer.windows().picture !== null", 20)
    dark, all_ = page.evaluate("""() => {
      const canvas = document.querySelector(".kc-camera");
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      let dark = 0;
      for (let i = 0; i < data.length; i += 4) dark += data[i] + data[i + 1] + data[i + 2] < 30;
      return [dark, data.length / 4];
    }""")
    assert 0.05 * all_ < dark < 0.97 * all_


def test_an_embedded_page_has_no_controls(page, file):
    page.goto(f"{file.as_uri()}?embed#spin=0.9&orders=2")
    settled(page)
    assert page.locator(".kc-controls").is_hidden() and page.locator(".kc-exports").is_hidden()
    assert page.locator(".kc-camera").is_visible() and "certified" in page.locator(".kc-badge").inner_text()
    # Screen readers get the counts.
    assert "images: " in page.locator("[aria-live=polite]").inner_text()


WITHOUT = {
    "WebAssembly": "delete window.WebAssembly",
    "workers": "delete window.Worker",
    "SIMD": """
  const validate = WebAssembly.validate;
  WebAssembly.validate = (bytes) => bytes.length > 8 ? false : validate(bytes)""",
}


@pytest.mark.parametrize("lacking", WITHOUT)
def test_a_browser_that_lacks_something_has_the_page_all_the_same(page, file, lacking):
    page.add_init_script(WITHOUT[lacking])
    page.goto(file.as_uri())
    settled(page)
    assert page.evaluate("explorer.certified()") is True
    offers = page.locator(".kc-offered")
    assert offers.count() == (lacking == "WebAssembly")
    if offers.count():
        assert "forbids WebAssembly: the page has 2 cameras" in offers.inner_text()


def test_a_notebook_goes_on_where_no_kernel_answers(chromium):
    page = chromium.new_page()
    page.set_content("<!doctype html><body><div id='cell'></div></body>")
    page.add_style_tag(content=(PAGE / "explorer.css").read_text(encoding="utf-8"))
    page.add_script_tag(type="module", content=notebook_script().replace("export default", "window.widget ="))
    until(page, "!!window.widget", 10)
    state = json.dumps(ExplorerState(spin=0.9, orders=2).record())
    page.evaluate(f"""() => {{
      const model = {{ get: () => ({state}), on() {{}}, off() {{}}, send() {{}} }};
      window.leave = widget.render({{ el: document.getElementById("cell"), model }});
    }}""")
    until(page, "document.querySelector('.kc-badge').textContent.includes('certified')", 30)
    assert page.get_by_label("Spin a", exact=True).is_visible()
    page.evaluate("leave()")
    page.close()
