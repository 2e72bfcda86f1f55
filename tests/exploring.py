"""The explorer as a program of its own, a page of it in Debian's Chromium, and the page's script without a page."""

import json
import os
import shutil
import subprocess
import sys
import time
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


def needs_server():
    for name in ("starlette", "uvicorn", "websockets"):
        pytest.importorskip(name, reason=f"{name} is missing: pip install 'kerrcaustics[explore]'")


def needs_browser():
    needs_server()
    needs_chromium()


def needs_chromium():
    pytest.importorskip("playwright", reason="playwright is missing: pip install playwright")
    if CHROMIUM is None:
        pytest.skip("Chromium is missing: apt-get install chromium")


@contextmanager
def served(*arguments):
    """The address and the process of `kerrcaustics explore`."""
    command = [sys.executable, "-m", "kerrcaustics", "explore", "--no-browser", *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ)
    try:
        yield process.stdout.readline().strip(), process
    finally:
        process.kill()
        process.communicate()


@contextmanager
def browser():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        try:
            yield opened
        finally:
            opened.close()


def until(page, condition, seconds=60):
    """Wait until an expression is true; the page's policy lets no strings be evaluated there by itself."""
    end = time.monotonic() + seconds
    while not page.evaluate(condition):
        assert time.monotonic() < end, f"{condition}: {page.evaluate('window.explorer && explorer.line()')}"
        time.sleep(0.02)


def settled(page):
    # The first view may have to wait for programs that are compiled, on a machine that others use.
    until(page, "!!window.explorer && !explorer.busy() && explorer.quality() === 'full'", 300)


def _node():
    """Node, by itself or as Playwright brings it."""
    spec = find_spec("playwright")
    driver = Path(spec.origin).parent / "driver" / "node" if spec and spec.origin else None
    return shutil.which("node") or (str(driver) if driver and driver.exists() else None)


def evaluated(body):
    """The value that the body of a function returns, beside those parts of the script that need no page."""
    from kerrcaustics.explorer.page_script import LOGIC, script

    if (node := _node()) is None:
        pytest.skip("Node is missing: pip install playwright, which brings it")
    program = f"{script(parts=LOGIC)}\nprocess.stdout.write(JSON.stringify((() => {{{body}}})()));"
    ran = subprocess.run([node, "-"], input=program, capture_output=True, text=True, timeout=60, check=False)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)
