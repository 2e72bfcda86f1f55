"""The explorer as a program of its own, a page of it in Debian's Chromium, and the page's script without a page."""

import json
import math
import os
import shutil
import struct
import subprocess
import sys
import time
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


def needs_server():
    for name in ("starlette", "uvicorn", "websockets"):
        pytest.importorskip(name, reason=f"{name} is missing: pip install '.[explore]'")


def needs_browser():
    needs_server()
    needs_chromium()


def needs_chromium():
    pytest.importorskip("playwright", reason="playwright is missing: pip install playwright")
    if CHROMIUM is None:
        pytest.skip("Chromium is missing: apt-get install chromium")


@contextmanager
def served(*arguments, before=None):
    """The address and the process of `kerrcaustics explore`; before: a function that the process calls first."""
    command = [sys.executable, "-m", "kerrcaustics", "explore", "--no-browser", *arguments]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    process = subprocess.Popen(command, env=os.environ, preexec_fn=before, **pipes)
    try:
        yield process.stdout.readline().strip(), process
    finally:
        process.kill()
        process.communicate()


def read(data):
    """Record and arrays of an encoded message, read as the page reads them."""
    assert data[:4] == b"KCX1"
    (size,) = struct.unpack("<I", data[4:8])
    record, body = json.loads(data[8 : 8 + size]), data[8 + size :]
    arrays = {}
    for name, place in record["arrays"].items():
        count = math.prod(place["shape"])
        kind = {"f4": "<f4", "u1": "u1"}[place["type"]]
        arrays[name] = np.frombuffer(body, kind, count, place["offset"]).reshape(place["shape"])
    return record, arrays


def opened(address, **changes):
    """A connection as a browser's page makes it, or with some of it changed."""
    from websockets.sync.client import connect

    given = {"token": address.query.split("=")[1], "origin": f"http://{address.netloc}", **changes}
    host = {"additional_headers": {"Host": given["host"]}} if "host" in given else {}
    return connect(f"ws://{address.netloc}/channel?token={given['token']}", origin=given["origin"], **host)


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
    # The first view may have to wait, on a machine that others use.
    until(page, "!!window.explorer && !explorer.busy() && explorer.quality() === 'full'", 300)


def node():
    """Node, by itself or as Playwright brings it."""
    spec = find_spec("playwright")
    driver = Path(spec.origin).parent / "driver" / "node" if spec and spec.origin else None
    return shutil.which("node") or (str(driver) if driver and driver.exists() else None)


def evaluated(body, parts=None):
    """The value that the body of a function returns, beside parts of the script: those of LOGIC need no page."""
    from kerrcaustics.explorer.page_script import LOGIC, script

    if (found := node()) is None:
        pytest.skip("Node is missing: pip install playwright, which brings it")
    program = f"{script(parts=parts or LOGIC)}\nprocess.stdout.write(JSON.stringify((() => {{{body}}})()));"
    ran = subprocess.run([found, "-"], input=program, capture_output=True, text=True, timeout=60, check=False)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)
