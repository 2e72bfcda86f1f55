"""The page while the program computes, is stopped, has ended, and is back: nothing old is called certified."""

import signal
from urllib.parse import urlsplit

import pytest
from exploring import browser, needs_browser, served, settled, until

from kerrcaustics.explorer.state import ExplorerState

pytestmark = pytest.mark.slow

STATE = ExplorerState(spin=0.9, orders=2, theta=80.0, phi=250.0)
WORDS = "['.kc-badge', '.kc-said', '.kc-panel-camera canvas', '.kc-banner'].map((s) => document.querySelector(s))"
TEXTS = f"{WORDS}.map((e) => e.hidden ? '' : e.ariaLabel ?? e.textContent)"
DIM = "['.kc-images', '.kc-caustics', '.kc-code', '.kc-camera'].map((s) => !!document.querySelector(s + '.kc-old'))"


@pytest.fixture
def page():
    needs_browser()
    with browser() as opened:
        yield opened.new_page(viewport={"width": 1400, "height": 900})


@pytest.fixture(scope="module")
def address():
    needs_browser()
    with served() as (address, _):
        yield address


def typed(page, label, text):
    field = page.get_by_label(f"{label}, number")
    field.fill(text)
    field.press("Enter")


def is_silent_about_certificates(page):
    badge, said, sky, _ = page.evaluate(TEXTS)
    return "certified" not in badge + said + sky


def check_old(page):
    """Everything that belongs to another camera is dim, and no word calls it certified."""
    assert is_silent_about_certificates(page) and page.evaluate(DIM) == [True] * 4
    assert page.get_by_role("button", name="Export the numbers as JSON").is_disabled()


def check_new(page, spin):
    settled(page)
    badge, said, sky, banner = page.evaluate(TEXTS)
    assert page.evaluate(DIM) == [False] * 4 and banner == ""
    assert all("certified" in text and "not certified" not in text for text in (badge, said, sky))
    assert page.evaluate("explorer.state().spin") == spin and f"{spin}" in page.locator(".kc-code").text_content()


def test_a_stopped_program_leaves_nothing_certified(page):
    with served() as (address, process):
        page.goto(f"{address}#{STATE.address()}")
        check_new(page, 0.9)
        process.send_signal(signal.SIGSTOP)
        typed(page, "Spin a", "0.8")
        check_old(page)
        assert page.evaluate(TEXTS)[0].startswith("computing")
        until(page, "explorer.line().includes('has not answered')", 20)
        check_old(page)
        assert "no connection" in page.evaluate(TEXTS)[0]
        # The camera and the star of before: what is shown is theirs.
        typed(page, "Spin a", "0.9")
        until(page, "explorer.freshness().images === 'current'", 5)
        typed(page, "Spin a", "0.8")
        check_old(page)
        process.send_signal(signal.SIGCONT)
        check_new(page, 0.8)


def test_a_program_that_is_back_is_found_again(page, tmp_path):
    token = str(tmp_path / "token")
    with served("--token-file", token) as (address, process):
        port = str(urlsplit(address).port)
        page.goto(f"{address}#{STATE.address()}")
        check_new(page, 0.9)
        process.kill()
        process.wait()
        # At once, on a machine that others use. A port was not named: the page says how.
        until(page, "explorer.line().includes('--port')", 20)
        typed(page, "Spin a", "0.8")
        check_old(page)
        page.keyboard.press("Space")
        until(page, "!explorer.playing()", 5)
        assert page.locator(".kc-clock").text_content() == ""
    with served("--port", port, "--token-file", token) as (again, process):
        assert again == address
        check_new(page, 0.8)
        process.kill()
        process.wait()
        # Nothing is advised that was done.
        until(page, "explorer.line().includes('Start it again as before')", 20)
        assert "--token-file" not in page.evaluate("explorer.line()")
    with served("--port", port):
        # A program with another token is not taken for the one of before.
        until(page, "explorer.line().includes('token in this address')", 90)
        assert "--token-file" in page.evaluate("explorer.line()")


@pytest.mark.parametrize(
    ("label", "wrong", "name", "allowed"),
    [
        ("Spin a", "1.5", "spin", "from 0 to 0.9999"),
        ("Radius r (M)", "-4", "radius", "from 1.4503 to 1000 M"),
        ("Inclination (°)", "", "inclination", "from 0 to 180°"),
    ],
)
def test_numbers_out_of_range_are_refused_beside_them(page, address, label, wrong, name, allowed):
    page.goto(f"{address}#{STATE.address()}")
    settled(page)
    typed(page, label, wrong)
    field = page.get_by_label(f"{label}, number")
    assert page.evaluate("explorer.state()")[name] == getattr(STATE, name)
    assert float(field.input_value()) == getattr(STATE, name) and field.get_attribute("aria-invalid") == "true"
    assert allowed in page.locator(".kc-note:visible").text_content()
    typed(page, label, str(getattr(STATE, name)))
    assert page.locator(".kc-note:visible").count() == 0


def test_a_decimal_comma_is_read_as_a_point_in_every_field(page, address):
    page.goto(f"{address}#{STATE.address()}")
    settled(page)
    typed_texts = {"Spin a": "0,7", "Radius r (M)": "6,03", "Inclination (°)": "90,0", "Star θ′ (°)": "70,25"}
    for label, text in {
        **typed_texts,
        "Star φ′ (°)": "250,5",
        "Star radius (°)": "0,5",
        "Frequency ωM": "0,25",
    }.items():
        page.get_by_label(f"{label}, number").fill("")
        page.get_by_label(f"{label}, number").press_sequentially(text)
        page.keyboard.press("Enter")
    settled(page)
    state = page.evaluate("explorer.state()")
    names = ("spin", "radius", "inclination", "theta", "phi", "size", "frequency")
    assert [state[name] for name in names] == [0.7, 6.03, 90, 70.25, 250.5, 0.5, 0.25]
    assert page.locator(".kc-note:visible").count() == 0


def test_cameras_that_cannot_be_are_moved_and_it_is_said(page, address):
    """Toward a hole that does not spin, from a radius within its horizon, and back to an orbit."""
    page.goto(f"{address}#spin=0.9&radius=1.5&velocity=circular&orders=1")
    settled(page)
    assert page.evaluate("explorer.state().velocity") == "fiducial"
    page.get_by_label("Spin a", exact=True).fill("0")
    settled(page)
    assert page.evaluate("[explorer.state().radius, explorer.freshness().images]") == [2.02, "current"]
    notes = page.locator(".kc-note:visible").all_text_contents()
    assert "at least 2.02 M" in notes[0] and "must not be circular" in notes[1]
    typed(page, "Radius r (M)", "6")
    settled(page)
    assert page.evaluate("explorer.state().velocity") == "circular"
    assert page.locator(".kc-note:visible").count() == 0


def test_a_caustic_that_is_shown_stays_in_sight_and_the_sky_behind_follows(page, address):
    page.goto(f"{address}#{STATE.address()}")
    settled(page)
    page.get_by_role("button", name="Zoom to the secondary caustic").click()
    typed(page, "Spin a", "0.5")
    settled(page)
    window = page.evaluate("explorer.windows().source")
    celestial = page.evaluate("explorer.curves()[1]")
    assert all(window[2] <= theta <= window[3] for theta, _ in celestial)
    assert max(theta for theta, _ in celestial) - min(theta for theta, _ in celestial) > 0.5 * (window[3] - window[2])
    page.get_by_label("Sky behind the curves").select_option("checkerboard")
    settled(page)
    until(page, "explorer.windows().picture !== null", 300)
    wide = page.evaluate("explorer.windows().picture[2]")
    for _ in range(4):
        page.get_by_role("button", name="Zoom in").first.click()
    until(page, f"explorer.windows().picture[2] < {wide} / 2", 300)
