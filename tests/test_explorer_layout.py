"""The explorer on windows, phones and in cells of notebooks: nothing is cut off, and it says what it waits for."""

import pytest
from exploring import browser, needs_chromium, until

from kerrcaustics.explorer.answers import answer, greeting, question
from kerrcaustics.explorer.live_page import notebook_script
from kerrcaustics.explorer.state import PAGE, ExplorerState
from kerrcaustics.explorer.still_page import write_page

pytestmark = pytest.mark.slow

STATE = ExplorerState(spin=0.5, orders=3, theta=84.6, phi=323.0)
# What stands out of its card, or of the page, by more than a rounded pixel.
OUTSIDE = """() => {
  const cards = ".kc-panel, .kc-controls, .kc-tables > section, .kc-invitation, .kc-lesson, .kc-orbit, .kc-head";
  const parts = [...document.querySelectorAll(`.kc-explorer :is(button, select, input, table, h1, h2, canvas)`)];
  const wide = [document.scrollingElement, ...document.querySelectorAll(".kc-scroll")];
  const out = (part) => {
    const [a, b] = [part, part.closest(cards)].map((node) => node?.getBoundingClientRect());
    return a.width && b && (a.right > b.right + 1 || a.left < b.left - 1);
  };
  const name = (node) => node.ariaLabel || node.textContent || node.className;
  return [...parts.filter(out), ...wide.filter((box) => box.scrollWidth > box.clientWidth)].map(name);
}"""
# A cell of a notebook, and a model whose messages wait for their answers.
CELL = """([state, width]) => {
  document.body.innerHTML = '<div style="display: flex"><span>[1]:</span><div id="cell"></div></div>';
  const cell = document.getElementById("cell");
  cell.style.cssText = `flex: none; width: ${width}px`;
  window.sent = [];
  const on = (name, heard) => name === "msg:custom" && (window.heard = heard);
  widget.render({ el: cell, model: { get: () => state, on, off() {}, send: (message) => sent.push(message) } });
}"""
REPLY = "(bytes) => heard({ kind: 'message' }, [new DataView(Uint8Array.from(bytes).buffer)])"


@pytest.fixture(scope="module")
def chromium():
    needs_chromium()
    with browser() as opened:
        yield opened


@pytest.fixture(scope="module")
def still(tmp_path_factory):
    path = tmp_path_factory.mktemp("still") / "explorer.html"
    write_page(path)
    return path.as_uri()


def shown(chromium, address, width, **settings):
    page = chromium.new_context(viewport={"width": width, "height": 850}, **settings).new_page()
    page.goto(address)
    until(page, "!!window.explorer?.busy && !explorer.busy() && explorer.quality() === 'full'", 60)
    return page


@pytest.mark.parametrize("width", [1400, 1280, 1180, 1081, 1080, 900, 390])
def test_nothing_stands_out_of_its_card(chromium, still, width):
    for scheme in ("light", "dark"):
        page = shown(chromium, still, width, color_scheme=scheme)
        if width <= 700:
            page.locator(".kc-controls summary").click()
        assert page.evaluate(OUTSIDE) == []
        page.get_by_role("button", name="Take the tour").click()
        assert page.evaluate(OUTSIDE) == []
        page.context.close()


def test_on_a_phone_the_controls_are_folded_and_a_finger_drags_the_star(chromium, still):
    page = shown(chromium, still, 390, has_touch=True, is_mobile=True)
    summary = page.locator(".kc-controls summary")
    assert "a = 0.5" in summary.inner_text() and page.locator(".kc-slider").first.is_hidden()
    # The camera sky is on the first screen.
    assert page.locator(".kc-camera").bounding_box()["y"] < 450
    page.locator(".kc-celestial").scroll_into_view_if_needed()
    ((x, y),) = page.evaluate("explorer.starSpots()")
    before = page.evaluate("explorer.state().phi")
    session = page.context.new_cdp_session(page)
    for kind, at in (("touchStart", x), ("touchMove", x + 30), ("touchMove", x + 60), ("touchEnd", None)):
        points = [] if at is None else [{"x": at, "y": y}]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    until(page, "!explorer.busy()")
    # To the right, from inside.
    assert 20 < (before - page.evaluate("explorer.state().phi")) % 360 < 180
    summary.click()
    assert page.locator(".kc-slider").first.is_visible()
    page.set_viewport_size({"width": 1200, "height": 850})
    until(page, "document.querySelector('.kc-controls details').open", 5)
    assert summary.is_hidden()
    page.context.close()


def in_a_cell(chromium, width):
    page = chromium.new_page(viewport={"width": 1400, "height": 1000})
    page.set_content("<!doctype html><body></body>")
    page.add_style_tag(content=(PAGE / "explorer.css").read_text(encoding="utf-8"))
    page.add_script_tag(type="module", content=notebook_script().replace("export default", "window.widget ="))
    until(page, "!!window.widget", 10)
    page.evaluate(CELL, [STATE.record(), width])
    return page


def answered(page):
    """Answer what the widget asks, until it asks nothing more."""
    done = 0
    while done < len(sent := page.evaluate("sent")):
        for message in sent[done:]:
            reply = greeting() if message["kind"] == "hello" else answer(*question(message["text"]))
            page.evaluate(REPLY, list(reply.encoded()))
        done = len(sent)
        page.wait_for_timeout(400)


def test_a_widget_says_that_it_waits_for_the_kernel(chromium):
    page = in_a_cell(chromium, 760)
    line = page.locator(".kc-work")
    assert line.inner_text() == "Waiting for the kernel … 0 s"
    until(page, "document.querySelector('.kc-work').textContent.includes('cells before')", 10)
    answered(page)
    assert line.is_hidden() and "certified" in page.locator(".kc-badge").inner_text()
    page.close()


@pytest.mark.parametrize("width", [1100, 900, 760, 560])
def test_a_widget_keeps_to_the_width_of_its_cell(chromium, width):
    page = in_a_cell(chromium, width)
    answered(page)
    assert page.evaluate(OUTSIDE) == []
    # No panel is tall and narrow.
    sizes = [page.locator(f".kc-{name}").bounding_box() for name in ("camera", "celestial")]
    assert all(size["height"] < 1.15 * size["width"] for size in sizes)
    page.close()
