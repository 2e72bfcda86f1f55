"""The explorer without a browser: states, answers, and who is let in."""

import http.client
import io
import json
import math
import os
import re
import signal
import stat
import subprocess
import sys
import time
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from urllib.parse import parse_qsl, unquote, urlsplit

import numpy as np
import pytest
from exploring import needs_server, opened, read, served
from packaging.version import Version
from PIL import Image

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.palettes import INDEX_ON_BLACK
from kerrcaustics.explorer.answers import LONGEST_QUESTION, NoState, answer, question, refusal
from kerrcaustics.explorer.backdrops import backdrop_of, checked_window, window_view
from kerrcaustics.explorer.limits import allowed
from kerrcaustics.explorer.page_data import view_of
from kerrcaustics.explorer.page_script import script
from kerrcaustics.explorer.state import PRESETS, ExplorerState
from kerrcaustics.explorer.token import kept_token
from kerrcaustics.explorer.work import FIRST, Work
from kerrcaustics.spacetime.shadow import shadow_axes, shadow_edge

STATE = ExplorerState(spin=0.9, orders=2, theta=80.0, phi=250.0)


def asked(want="star", **changes):
    return json.dumps({"id": 7, "want": want, "state": {**STATE.record(), **changes}})


@pytest.mark.parametrize("state", PRESETS.values(), ids=PRESETS)
def test_addresses_bring_states_back(state):
    texts = dict(parse_qsl(state.address(), strict_parsing=True))
    assert (
        ExplorerState.from_values({name: type(value)(texts[name]) for name, value in state.record().items()}) == state
    )


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"spin": 1.0}, "`spin` must lie in"),
        ({"spin": math.nan}, "`spin` must be a finite number"),
        ({"spin": "fast"}, "`spin`"),
        ({"radius": 1e9}, "`radius` must lie in"),
        ({"size": -1}, "`size` must lie in"),
        ({"size": 1e-9}, "`size` must lie in"),
        ({"size": 90}, "`size` must lie in"),
        ({"frequency": 0.01}, "`frequency` must lie in"),
        ({"orders": 5}, "`orders`"),
        ({"orders": True}, "`orders`"),
        ({"theta": [1]}, "`theta`"),
        ({"velocity": "circular", "inclination": 60}, "`velocity`"),
        ({"chart": "sphere"}, "`chart` must be one of"),
        ({"velocity": {}}, "`velocity` must be one of"),
        ({"file": "/etc/passwd"}, "`state` must have the keys"),
    ],
)
def test_states_that_cannot_be_are_refused(values, complaint):
    with pytest.raises(ValueError, match=complaint):
        ExplorerState.from_values(values)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "nonsense",
        "[" * 4000,
        "null",
        '{"id": 1, "want": "star", "state": {"spin": NaN}}',
        '{"id": -1, "want": "star", "state": {}}',
        '{"id": true, "want": "star", "state": {}}',
        '{"id": 1, "want": "files", "state": {}}',
        '{"id": 1, "want": ["star"], "state": {}}',
        '{"id": 1, "want": "star", "state": []}',
        " " * (LONGEST_QUESTION + 1),
    ],
)
def test_questions_that_make_no_sense_are_refused(text):
    with pytest.raises(ValueError, match="Argument `"):
        question(text)


def test_views_hold_what_the_package_gives():
    record, arrays = read(answer(*question(asked("full"))).encoded())
    caustics, images = kc.caustics(STATE.camera(), 2), kc.star_images(STATE.camera(), STATE.star(), 1)
    assert record["quality"] == "full" and record["id"] == 7
    for reported, caustic in zip(record["caustics"], caustics, strict=True):
        assert reported["circuits"] == caustic.circuits and reported["error"] == math.degrees(caustic.error)
        assert np.allclose(arrays[f"critical{caustic.order}"], caustic.sky, atol=1e-7, rtol=0)
        assert np.allclose(arrays[f"caustic{caustic.order}"], np.degrees(caustic.celestial), atol=0, rtol=1e-7)
    assert record["images"]["sky"] == images.sky.tolist() and record["images"]["certified"] is images.certified
    assert record["images"]["per_index"] == list(images.per_index.values())


def test_commands_and_python_give_the_same(capsys):
    from command_line import run

    status, out, _ = run(capsys, *STATE.commands()[1].split()[1:], "--json", "-")
    images = view_of(STATE, "star").record["images"]
    assert status == 0 and json.loads(out)["per_index"] == {str(k): n for k, n in enumerate(images["per_index"])}
    names = {}
    exec(STATE.python(), names)
    assert names["images"].sky.tolist() == images["sky"] and len(names["caustics"]) == 2


def test_shapes_are_those_of_the_package_and_of_commands(capsys):
    from command_line import run

    record, arrays = read(answer(*question(asked("shapes", size=2.0))).encoded())
    state = ExplorerState.from_values(record["state"])
    seen = kc.magnification(state.camera(), state.star(), math.radians(2), max_index=1)
    assert (record["total"], record["error"], record["certified"]) == (seen.total, seen.error, True)
    assert record["per_index"] == list(seen.per_index.values()) and len(arrays) == len(seen.images)
    for limb, image in zip(arrays.values(), seen.images, strict=True):
        assert np.allclose(limb[:, :3], image.sky, atol=1e-7, rtol=0) and limb[:, 3].tolist() == image.index.tolist()
    status, out, _ = run(capsys, *state.commands()[-1].split()[1:], "--json", "-")
    assert status == 0 and json.loads(out)["total"] == pytest.approx(seen.total, rel=1e-12)
    names = {}
    exec(state.python(), names)
    assert names["magnification"].total == pytest.approx(seen.total, rel=1e-12)
    assert answer(*question(asked("shapes"))).record["kind"] == "refusal"


@pytest.mark.slow
def test_waves_are_those_of_the_package_and_of_commands(capsys):
    from command_line import run

    from kerrcaustics.explorer.state import LEAST_FREQUENCY
    from kerrcaustics.waves import amplification

    assert LEAST_FREQUENCY == amplification.LEAST_FREQUENCY
    record, arrays = read(answer(*question(asked("waves", frequency=3.0))).encoded())
    state = ExplorerState.from_values(record["state"])
    seen = kc.amplification(state.camera(), state.star(), 3.0, max_index=1)
    assert (record["modulus"], record["error"]) == pytest.approx((abs(seen.value[0]), seen.error[0]), rel=1e-9)
    omega, modulus, error = arrays["spectrum"].T
    assert omega[0] == pytest.approx(0.3) and omega[-1] == pytest.approx(30) and len(omega) == 400
    near = np.argmin(np.abs(omega - 3))
    assert abs(modulus[near] - record["modulus"]) < 0.1 and (error > 0).all()
    status, out, _ = run(capsys, *state.commands()[-1].split()[1:], "--json", "-")
    assert status == 0 and json.loads(out)["waves"][0]["error"] == pytest.approx(seen.error[0], rel=1e-9)
    names = {}
    exec(state.python(), names)
    assert names["waves"].value == pytest.approx(seen.value, rel=1e-12)
    assert answer(*question(asked("waves"))).record["kind"] == "refusal"


def test_coarse_curves_lie_on_the_critical_curves():
    state = replace(STATE, spin=0.87)
    record, arrays = read(view_of(state, "draft").encoded())
    assert record["quality"] == "draft" and "images" not in record
    for caustic in kc.caustics(state.camera(), 2):
        beams = kc.trace_beams(state.camera(), arrays[f"critical{caustic.order}"].astype(float))
        # Directions are rounded to float32, 6e-8 of their size, and the beam is that much wider.
        assert np.abs(beams.delta_minus / beams.delta_plus).max() < 1e-3
        assert np.abs(caustic.phi_extent - np.radians(np.ptp(arrays[f"caustic{caustic.order}"][:, 1]))) < 0.2


@pytest.mark.slow
def test_orbits_hold_the_images_of_each_moment():
    record, arrays = read(answer(*question(asked("orbit"))).encoded())
    events = kc.pair_events(STATE.camera(), math.radians(80), 1)
    assert [e["part"] for e in record["events"]][: len(events)] == [e.time / record["period"] for e in events]
    first = arrays["first"].astype(int)
    for moment in (0, 100, 259):
        images = kc.star_images(STATE.camera(), (math.radians(80), math.radians(arrays["phi"][moment])), 1)
        these = slice(first[moment], first[moment + 1])
        assert sorted(arrays["frame_numbers"][these, 0]) == sorted(images.index)


@pytest.mark.parametrize("window", [(0.0, 0.0, 250.0), (12.0, -5.0, 0.5)])
def test_windows_are_parts_of_the_panel(window):
    """Pixels are evenly spaced in angles from the middle of the shadow, as the page draws them."""
    view = window_view(STATE.camera(), window)
    x, y = np.meshgrid([0.0, 100.0, view.width - 1.0], [0.0, 321.0, view.height - 1.0])
    sky, steps = view.directions(x, y)
    forward, right, up = shadow_axes(STATE.camera(), shadow_edge(STATE.camera(), 240))
    angle, bearing = np.arccos(sky @ forward), np.arctan2(sky @ up, sky @ right)
    across, above = np.degrees(angle * np.cos(bearing)), np.degrees(angle * np.sin(bearing))
    middle, pixel = (view.width - 1) / 2, window[2] / view.width
    # The arc cosine loses half of the digits next to the middle, which is not met.
    assert np.allclose(across, window[0] + (x - middle) * pixel, atol=1e-6, rtol=0)
    assert np.allclose(above, window[1] - (y - middle) * pixel, atol=1e-6, rtol=0)
    assert np.allclose(view.pixels(sky), np.stack([x, y], axis=-1), atol=1e-6, rtol=0)
    assert np.allclose(np.linalg.norm(np.cross(*np.moveaxis(steps, -1, 0)), axis=-1), view.pixel_sizes(x, y), rtol=1e-9)


@pytest.mark.parametrize("window", [[1, 2], [0, 0, 0], [0, 0, 300], [100, 0, 200], [0, 0, "x"], "x", [1e999, 0, 1]])
def test_windows_beyond_the_sky_are_refused(window):
    with pytest.raises(ValueError, match="`window` must"):
        checked_window(window)


@pytest.mark.slow
def test_backdrops_show_their_window():
    """Within the shadow nothing shines; beside it the checkerboard does."""
    state = replace(STATE, backdrop="checkerboard")
    for window, dark in (((0.0, 0.0, 1.0), True), ((60.0, 0.0, 1.0), False)):
        message = backdrop_of(state, window)
        picture = np.asarray(Image.open(io.BytesIO(message.arrays["lensed"].tobytes())))
        assert message.record["window"] == window and picture.shape == (800, 800, 3)
        assert (picture.max() < 8) == dark


def test_cameras_that_cannot_be_are_moved_to_the_nearest():
    wanted = json.dumps({"id": 1, "want": "full", "state": {"spin": 0.0, "radius": 1.5, "velocity": "circular"}})
    _, _, state, window = question(wanted)
    assert (state.radius, state.velocity, window) == (2.02, "fiducial", None)
    limits = allowed(state)
    assert limits["radius"] == [2.02, 1000.0]
    assert "photon orbit" in limits["velocity"]["circular"] and limits["velocity"]["static"] == ""
    # What is allowed can be asked for, and what lies beyond is refused.
    for name, (low, high) in ((name, limits[name]) for name in ("spin", "radius", "inclination", "theta")):
        for value in (low, high):
            ExplorerState.from_values({"velocity": "fiducial", name: value})
        with pytest.raises(ValueError, match=f"`{name}` must"):
            ExplorerState.from_values({"velocity": "fiducial", "spin": 0.0, name: 1.001 * high})
    with pytest.raises(ValueError, match="`radius` must be larger than the horizon"):
        ExplorerState.from_values({"velocity": "fiducial", "spin": 0.0, "radius": 2.0})


def test_what_cannot_be_answered_is_refused_by_its_number():
    with pytest.raises(NoState) as refused:
        question(asked("orbit", spin=1.5))
    record, _ = read(refusal(refused.value).encoded())
    assert (record["id"], record["want"], record["kind"]) == (7, "orbit", "refusal")
    assert "`spin` must lie in" in record["line"]


@pytest.mark.stand_ins
def test_work_that_lasts_is_reported():
    """Between its stages, from another thread."""
    work, reported = Work(), []
    with work.reported(lambda message: reported.append(message.record)):
        time.sleep(FIRST + 0.2)
        message, data = work.answered(question(asked("full", spin=0.71)))
    assert reported[0]["stage"] == "waiting for other pages" and reported[0]["id"] is None
    assert [record["seconds"] for record in reported] == sorted(record["seconds"] for record in reported)
    assert message.record["id"] == work.number == 7 and read(data)[0]["quality"] == "full"
    assert work.progress().record["stage"] == "images of the star"
    assert read(work.answered((8, "star", None, None))[1])[0]["line"].startswith("This could not be computed")


def test_an_orbit_that_is_none_is_refused_in_words():
    record, _ = read(answer(*question(asked("orbit", velocity="static", spin=0.0))).encoded())
    assert record["kind"] == "refusal" and record["line"].startswith("Argument `") and record["id"] == 7


@pytest.fixture(scope="module")
def address():
    needs_server()
    with served() as (address, _):
        yield urlsplit(address)


def test_other_hosts_are_refused(address):
    for host, status in ((address.netloc, 200), (f"rebound.example:{address.port}", 421), ("", 421)):
        connection = http.client.HTTPConnection(address.hostname, address.port)
        connection.request("GET", "/", headers={"Host": host})
        reply = connection.getresponse()
        assert reply.status == status and "default-src 'none'" in reply.headers["Content-Security-Policy"]
    connection = http.client.HTTPConnection(address.hostname, address.port)
    connection.request("GET", "/../state.py", headers={"Host": address.netloc})
    reply = connection.getresponse()
    assert reply.status == 404 and b"kerrcaustics explore" in reply.read()


def test_closed_channels_say_why(address):
    own = address.query.split("=")[1]
    for token, host, status in ((own, address.netloc, 200), ("guess", address.netloc, 403), (own, "elsewhere", 421)):
        connection = http.client.HTTPConnection(address.hostname, address.port)
        connection.request("GET", f"/channel?token={token}", headers={"Host": host})
        assert connection.getresponse().status == status


def test_work_is_reported_while_it_lasts(address):
    with opened(address) as socket:
        socket.recv()
        # It takes several times as long as goes by before the first report.
        socket.send(asked("full", spin=0.9987, orders=4))
        reported = []
        while not reported or reported[-1]["kind"] == "progress":
            reported.append(read(socket.recv(timeout=300))[0])
    assert reported[-1]["kind"] == "view" and len(reported) > 1
    assert {(record["id"], record["want"]) for record in reported} == {(7, "full")}


def test_tokens_in_files_last(tmp_path):
    file = tmp_path / "token"
    token = kept_token(file)
    assert kept_token(file) == token and len(token) >= 16 and stat.S_IMODE(file.stat().st_mode) == 0o600
    file.chmod(0o644)
    with pytest.raises(ValueError, match="readable by you alone"):
        kept_token(file)
    file.chmod(0o600)
    file.write_text("short")
    with pytest.raises(ValueError, match="hold a token"):
        kept_token(file)


def test_newest_question_wins_and_garbage_is_answered(address):
    with opened(address) as socket:
        assert read(socket.recv())[0]["kind"] == "greeting"
        socket.send("garbage")
        socket.send(b"\x00\x01")
        assert [read(socket.recv())[0]["kind"] for _ in range(2)] == ["refusal", "refusal"]
        for number in range(100):
            socket.send(json.dumps({"id": number, "want": "star", "state": STATE.record() | {"phi": float(number)}}))
        reported = []
        while not reported or reported[-1] != 99:
            record = read(socket.recv(timeout=60))[0]
            reported += [record["id"]] * (record["kind"] != "progress")
        assert len(reported) < 100 and reported == sorted(reported)


def test_floods_and_huge_messages_end_the_connection(address):
    from websockets.exceptions import ConnectionClosed

    for text, times, code in (("x", 2000, 1008), ("x" * 100_000, 1, 1009)):
        with opened(address) as socket, pytest.raises(ConnectionClosed) as closed:
            for _ in range(times):
                socket.send(text)
            while True:
                socket.recv(timeout=20)
        reported = closed.value.rcvd
        # uvicorn before 0.54 ends a connection whose message is too long without saying why.
        assert reported.code == code if reported else (code == 1009 and Version(version("uvicorn")) < Version("0.54"))
    with opened(address) as socket:
        assert read(socket.recv())[0]["kind"] == "greeting"


def test_interrupt_ends_it_at_once():
    needs_server()
    with served() as (address, process), opened(urlsplit(address)) as socket:
        socket.recv()
        # In the midst of work.
        socket.send(asked("full", spin=0.985, orders=4))
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=3) == 0
        assert process.stderr.read() == "kerrcaustics: Interrupted: the explorer has ended.\n"


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--port", "99999"], "--port must lie in"),
        (["--port", "x"], "must be a whole number"),
        (["--host", "999.1.1.1"], "--host must be free"),
        (["--json", "missing/file.json"], "--json must name a file in a folder that exists"),
        (["--token-file", "missing/token"], "--token-file must name a file that can be read or made"),
    ],
)
def test_bad_input_is_refused(assert_refused, arguments, complaint):
    needs_server()
    assert_refused(["explore", "--no-browser", *arguments], complaint)


def test_the_token_is_for_the_user_alone(tmp_path):
    """Neither the file of --json nor the arguments of the browser show it to others."""
    needs_server()
    browser, seen, file = tmp_path / "browser", tmp_path / "seen", tmp_path / "explorer.json"
    browser.write_text(f'#!/bin/sh\necho "$@" > {seen}.part; mv {seen}.part {seen}\n')
    browser.chmod(0o755)
    command = [sys.executable, "-m", "kerrcaustics", "explore", "--json", str(file)]
    env = {**os.environ, "BROWSER": f"{browser} %s", "TMPDIR": str(tmp_path)}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=env)
    try:
        address = process.stdout.readline().strip()
        end = time.monotonic() + 60
        while not seen.exists() and time.monotonic() < end:
            time.sleep(0.02)
        arguments, token = seen.read_text(), urlsplit(address).query.split("=")[1]
        page = Path(unquote(re.search(r"file://(\S+)", arguments)[1]))
        assert token not in arguments and f"url={address}" in page.read_text()
        assert [stat.S_IMODE(path.stat().st_mode) for path in (page, file)] == [0o600, 0o600]
        assert json.loads(file.read_text())["token"] == token
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60)
    assert not page.exists()


def test_the_page_has_the_palettes_of_plots():
    colours = json.loads(script().split(";", 1)[0].removeprefix("const PALETTES = "))
    assert set(colours) == {"light", "dark"}
    assert colours["light"]["order"][0] == style.order_colour(1) and colours["dark"]["index"][1] == INDEX_ON_BLACK[1]
