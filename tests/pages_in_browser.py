"""Built pages in Chromium: those wider than their window, what a window does not show, and what search finds.

`python tests/pages_in_browser.py docs/_build/html` checks the widths of a build with all its figures.
"""

import sys
from pathlib import Path

from exploring import browser

WIDTHS = (360, 390, 768, 1024, 1400, 1920, 2560)

_FOUND = """() => [...document.querySelectorAll("#search-results li > a:first-child")].map(
  (link) => link.getAttribute("href").split(/[?#]/)[0])"""

# Formulas have their widths once they are set.
_SET = "async () => { await window.MathJax?.startup?.promise; }"
# Pixels by which the page is wider than the window, or the text than its column, which the theme lets scroll on phones.
_EXCESS = """() => {
  const boxes = [document.scrollingElement, ...document.querySelectorAll(".content")];
  return Math.max(...boxes.map((box) => box.scrollWidth - box.clientWidth));
}"""

# Texts of elements that end beyond the right edge of the window.
_BEYOND = """(selector) => [...document.querySelectorAll(selector)].filter(
  (one) => one.getBoundingClientRect().right > window.innerWidth).map((one) => one.textContent)"""

# Contrasts of the text of copy buttons with their ground (WCAG 2) in a theme.
_CONTRASTS = """(theme) => {
  document.body.dataset.theme = theme;
  const light = (colour) => {
    const parts = colour.match(/[\\d.]+/g).slice(0, 3).map((part) => part / 255);
    const [r, g, b] = parts.map((part) => part <= 0.03928 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05;
  };
  return [...document.querySelectorAll("div.highlight > .copy-button")].map((button) => {
    const style = getComputedStyle(button);
    const both = [light(style.color), light(style.backgroundColor)];
    return Math.max(...both) / Math.min(...both);
  });
}"""


def pages(folder):
    """The HTML files of a build that readers open by themselves."""
    return [path for path in sorted(folder.rglob("*.html")) if not {"_static", "models"} & set(path.parts)]


def too_wide(folder):
    """A line for each page and width at which something lies outside of the window."""
    lines = []
    with browser() as chromium:
        page = chromium.new_page()
        for path in pages(folder):
            page.goto(path.resolve().as_uri())
            page.evaluate(_SET)
            for width in WIDTHS:
                page.set_viewport_size({"width": width, "height": 900})
                if (excess := page.evaluate(_EXCESS)) > 0:
                    lines.append(f"{path.relative_to(folder)} at {width}: {excess} px too wide")
    return lines


def out_of_sight(path, selector, width):
    """How many elements of a page a selector finds, and the texts of those that a narrow window does not show."""
    with browser() as chromium:
        page = chromium.new_page(viewport={"width": width, "height": 900})
        page.goto(path.resolve().as_uri())
        return page.locator(selector).count(), page.evaluate(_BEYOND, selector)


def copy_buttons(path):
    """Contrasts of the buttons on blocks of code, by theme, and how many blocks of code the page has."""
    with browser() as chromium:
        page = chromium.new_page()
        page.goto(path.resolve().as_uri())
        contrasts = {theme: page.evaluate(_CONTRASTS, theme) for theme in ("light", "dark")}
        return contrasts, page.locator("div.highlight:has(pre)").count()


def search_results(folder, word):
    """The pages that the search of a build finds, best first."""
    with browser() as chromium:
        page = chromium.new_page()
        page.goto(f"{(folder / 'search.html').resolve().as_uri()}?q={word}")
        page.get_by_text("Search finished").wait_for()
        return page.evaluate(_FOUND)


if __name__ == "__main__":
    complaints = too_wide(Path(sys.argv[1]))
    print(*complaints or ["Every page fits"], sep="\n")
    sys.exit(bool(complaints))
