"""The command `explore`: a page to drag the star on."""

import html
import os
import sys
import tempfile
import threading
import time
import webbrowser
from pathlib import Path

from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput, stop
from kerrcaustics.cli.options import COMMON, CommonOptions, FileName, Flag, Port
from kerrcaustics.cli.outputs import check_page
from kerrcaustics.cli.terminal import plain_errors, progress
from kerrcaustics.extras import missing
from kerrcaustics.files import UNFINISHED
from kerrcaustics.interrupts import on_interrupt

_NEEDED = ("starlette", "uvicorn", "websockets")
# A browser that is not running yet takes a while to read its first page, seconds.
_STARTS = 60.0
_LEADS_ON = """<!doctype html>
<meta charset="utf-8">
<meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={0}">
<title>Kerr caustics explorer</title>
<a href="{0}">The explorer</a>
"""


@app.command(
    **with_examples(
        "explore", "explore --no-browser --port 8765 --token-file ~/.kerrcaustics-token", "explore --page explorer.html"
    )
)
def explore(
    *,
    port: Port = 0,
    token_file: Path | None = None,
    host: str = "127.0.0.1",
    no_browser: Flag = False,
    page: FileName | None = None,
    common: CommonOptions = COMMON,
) -> None:
    """Open the explorer in a browser: drag a star over the caustics, and see how pairs of images appear.

    The address, which contains a token, is printed at once. Ctrl-C stops the explorer.

    Parameters
    ----------
    port
        Port to listen on; 0 selects any free port.
    token_file
        File that holds the token, created if missing: with a fixed port, the address stays the same and open pages keep
        working after a restart. Only you may have read access to it.
    host
        Address to listen on. The default can be reached only from this machine; at any other address, everyone with the
        token can use the explorer.
    no_browser
        Do not open a browser: for use over ssh, with `ssh -L PORT:localhost:PORT`.
    page
        Write the standalone page to this .html file instead, and exit: the page computes in the browser, needs no
        program and no network, and can be shown on a slide.
    """
    common.check({"--page": page})
    check_page(page)
    if page is not None:
        _write_page(page, common)
        return
    if not host:
        raise BadInput("Argument --host must be an address, but is empty.")
    if lacking := missing("explore", *_NEEDED):
        stop(1, lacking)
    from kerrcaustics.explorer.server import is_loopback, listening, serve

    token = _token(token_file)
    try:
        listener = listening(host, port)
    except OSError as error:
        raise BadInput(
            f"Argument --{'port' if port else 'host'} must be free to listen on, but is not: {error}."
        ) from None
    address = _address(host, listener.getsockname()[1], token)
    if common.json != "-":
        sys.stdout.write(f"{address}\n")
        sys.stdout.flush()
    common.write({"schema": "kerrcaustics/explore/1", "address": address, "token": token}, private=True)
    if not is_loopback(host):
        sys.stderr.write(f"Warning: others can reach {host}, and see the token if the network is not encrypted.\n")
    if not no_browser:
        threading.Thread(target=_open_browser, args=(address,), daemon=True).start()
    on_interrupt(lambda: "the explorer has ended.", status=0)
    serve(listener, host, token, lasting=bool(port and token_file))


def _write_page(page: Path, common: CommonOptions) -> None:
    with plain_errors(), progress() as report:
        from kerrcaustics.explorer.still_page import write_page

        write_page(page, progress=report)
    common.say_files(page=page)


def _token(file: Path | None) -> str:
    from kerrcaustics.explorer.token import kept_token, new_token

    if file is None:
        return new_token()
    try:
        return kept_token(file.expanduser())
    except OSError as error:
        raise BadInput(f"Argument --token-file must name a file that can be read or made: {error}.") from None
    except ValueError as error:
        raise BadInput(f"Argument --token-file must {error}.") from None


def _open_browser(address: str) -> None:
    """Open the page by way of a file that only the user can read: all users see the arguments of a browser."""
    handle, name = tempfile.mkstemp(prefix="kerrcaustics-explorer-", suffix=".html")
    UNFINISHED.add(name)
    with open(handle, "w", encoding="utf-8") as file:
        file.write(_LEADS_ON.format(html.escape(address)))
    webbrowser.open(Path(name).as_uri())
    time.sleep(_STARTS)
    os.unlink(name)
    UNFINISHED.discard(name)


def _address(host: str, port: int, token: str) -> str:
    name = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://{f'[{name}]' if ':' in name else name}:{port}/?token={token}"
