"""The command `explore`: a page to drag the star on."""

import secrets
import sys
import threading
import webbrowser
from importlib.util import find_spec

from kerrcaustics.cli.app import BadInput, app, stop, with_examples
from kerrcaustics.cli.options import COMMON, CommonOptions, Flag, WholeNumber
from kerrcaustics.interrupts import on_interrupt

_NEEDED = ("starlette", "uvicorn", "websockets")


@app.command(**with_examples("explore", "explore --no-browser --port 8765"))
def explore(
    *, port: WholeNumber = 0, host: str = "127.0.0.1", no_browser: Flag = False, common: CommonOptions = COMMON
) -> None:
    """Open the explorer in a browser: drag a star over the caustics, and see pairs of images being born.

    Its address, with the token that it asks for, is printed at once. Ctrl-C ends it.

    Parameters
    ----------
    port
        Port to listen at; 0 is any free one.
    host
        Address to listen at. Only this machine can reach the one by default; with any other one, whoever has the token
        can use the explorer.
    no_browser
        Open no browser: for use over ssh, with `ssh -L PORT:localhost:PORT`.
    """
    common.check()
    if not 0 <= port <= 65535:
        raise BadInput(f"Argument --port must lie in [0, 65535], but is {port}.")
    if not host:
        raise BadInput("Argument --host must be an address, but is empty.")
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if missing:
        stop(1, f"The explorer needs {', '.join(missing)}: pip install 'kerrcaustics[explore]'.")
    from kerrcaustics.explorer.server import is_loopback, listening, serve

    try:
        opened = listening(host, port)
    except OSError as error:
        raise BadInput(
            f"Argument --{'port' if port else 'host'} must be free to listen at, but is not: {error}."
        ) from None
    token = secrets.token_urlsafe(24)
    address = _address(host, opened.getsockname()[1], token)
    if common.json != "-":
        sys.stdout.write(f"{address}\n")
        sys.stdout.flush()
    common.write({"schema": "kerrcaustics/explore/1", "address": address, "token": token})
    if not is_loopback(host):
        sys.stderr.write(f"Warning: others can reach {host}, and see the token where the network is not encrypted.\n")
    if not no_browser:
        threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
    on_interrupt(lambda: "the explorer has ended.", status=0)
    serve(opened, host, token)


def _address(host: str, port: int, token: str) -> str:
    shown = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://{f'[{shown}]' if ':' in shown else shown}:{port}/?token={token}"
