"""The buttons of built pages that copy a block of code: text without prompts, the keyboard, and no clipboard."""

from pathlib import Path

import pytest
from exploring import browser, needs_chromium

STYLE = Path(__file__).parents[1] / "docs" / "style"
PAGE = """<!DOCTYPE html><meta charset="utf-8"><link rel="stylesheet" href="{style}/pages.css">{before}
<script src="{style}/copy.js"></script><body>
<div class="highlight"><pre>{text}</pre></div><div class="highlight">no code</div></body>"""
NO_CLIPBOARD = "<script>Object.defineProperty(navigator, 'clipboard', {value: undefined})</script>"
# Text of a block, and what is copied of it.
COPIED = {
    "kerrcaustics demo\nmake test\n": "kerrcaustics demo\nmake test",
    "$ kerrcaustics scale \\\n  --mass 4e6\nOne M: 19.7 s\n$ ls\nout.png\n": "kerrcaustics scale \\\n  --mass 4e6\nls",
    ">>> def f(x):\n...     return x\n...\n>>> f(2)\n2\n": "def f(x):\n    return x\n\nf(2)",
    "def f(x):\n    ...\n": "def f(x):\n    ...",
    "price = 3  # $ 3, >>> no prompt\n": "price = 3  # $ 3, >>> no prompt",
}


@pytest.fixture(scope="module")
def context():
    needs_chromium()
    with browser() as chromium:
        opened = chromium.new_context()
        opened.grant_permissions(["clipboard-read", "clipboard-write"])
        yield opened


@pytest.fixture
def page_of(context, tmp_path):
    """A page, read as a file, with a block of this text; before: what comes ahead of the script."""

    def opened(text="make test\n", before=""):
        path = tmp_path / "page.html"
        path.write_text(PAGE.format(style=STYLE.as_uri(), text=text, before=before), encoding="utf-8")
        page = context.new_page()
        page.goto(path.as_uri())
        return page

    return opened


@pytest.mark.slow
def test_text_is_copied_without_prompts_and_output(page_of):
    page = page_of()
    for text, copied in COPIED.items():
        assert page.evaluate("(text) => typedText(text)", text) == copied, text


@pytest.mark.slow
def test_the_keyboard_reaches_a_button_which_shows_itself_copies_and_says_so(page_of):
    page = page_of("$ kerrcaustics demo\nA picture\n")
    button = page.locator("button")
    # None where there is no code.
    assert button.count() == 1 and button.evaluate("one => getComputedStyle(one).opacity") == "0"
    page.keyboard.press("Tab")
    assert button.evaluate("one => getComputedStyle(one).opacity") == "1"
    page.keyboard.press("Enter")
    page.get_by_text("Copied", exact=True).wait_for()
    assert page.evaluate("navigator.clipboard.readText()") == "kerrcaustics demo"


@pytest.mark.slow
def test_what_is_not_copied_is_said(page_of):
    page = page_of()
    page.evaluate("() => { navigator.clipboard.writeText = () => Promise.reject(new Error('refused')); }")
    page.locator("button").click()
    page.get_by_text("Not copied").wait_for()


@pytest.mark.slow
def test_without_a_clipboard_there_is_no_button(page_of):
    assert page_of(before=NO_CLIPBOARD).locator("button").count() == 0
