"""The explorer under twenty clients that drag stars, beside some that mean no good."""

import asyncio
import contextlib
import json
import os
import time
from dataclasses import replace
from itertools import pairwise
from urllib.parse import urlsplit

import pytest
from exploring import needs_server, served

import kerrcaustics as kc
from kerrcaustics.explorer.state import ExplorerState

pytestmark = pytest.mark.slow

CLIENTS, SECONDS = 20, float(os.environ.get("EXPLORER_LOAD_SECONDS", 60))
EVENTS = [ExplorerState(spin=spin, orders=2, theta=75.0) for spin in (0.5, 0.9, 0.97, 0.999)]
GARBAGE = ["", "{", "[1]", "x" * 100_000, b"\x00" * 1000, '{"id": 1, "want": "full", "state": {"spin": NaN}}']
GARBAGE += ['{"id": 1, "want": "full", "state": {"spin": 1e308}}', '{"id": 1e99, "want": [], "state": {}}', "[" * 4000]


def record_of(data):
    return json.loads(data[8 : 8 + int.from_bytes(data[4:8], "little")])


async def drags(connected, number, end, reported):
    """A client that drags a star, and goes on to another event now and then."""
    async with connected() as socket:
        await socket.recv()
        step = 0
        while time.monotonic() < end:
            state = replace(EVENTS[(number + step // 60) % len(EVENTS)], phi=(37.0 * number + 3.1 * step) % 360)
            asked = time.monotonic()
            want = "full" if step % 60 == 0 else "star"
            await socket.send(json.dumps({"id": step, "want": want, "state": state.record()}))
            record = {"kind": "progress"}
            while record["kind"] == "progress":
                record = record_of(await asyncio.wait_for(socket.recv(), 300))
            assert record["id"] == step and record["kind"] == "view" and record["state"] == state.record()
            reported.append((state, record["images"], time.monotonic() - asked))
            step += 1
            await asyncio.sleep(0.15)


async def spoils(connected, end, wrong):
    """A client that sends nonsense, and comes with wrong tokens, from elsewhere."""
    from websockets.exceptions import WebSocketException

    step = 0
    while time.monotonic() < end:
        step += 1
        with contextlib.suppress(WebSocketException, OSError):
            async with connected(**wrong[step % len(wrong)]) as socket:
                for _ in range(300):
                    await socket.send(GARBAGE[step % len(GARBAGE)])
                await socket.recv()
        await asyncio.sleep(0.05)


def test_twenty_clients_keep_their_answers():
    needs_server()
    psutil = pytest.importorskip("psutil")
    from websockets.asyncio.client import connect

    with served() as (address, process):
        place = urlsplit(address)

        own = {"token": place.query.split("=")[1], "origin": f"http://{place.netloc}"}

        def connected(**given):
            token, origin = (own | given).values()
            return connect(f"ws://{place.netloc}/channel?token={token}", origin=origin, compression=None)

        reported, memory = [], []

        async def watched(end):
            while time.monotonic() < end:
                memory.append(psutil.Process(process.pid).memory_info().rss / 2**20)
                await asyncio.sleep(1)

        async def everything():
            end = time.monotonic() + SECONDS
            wrong = [{}, {"token": "guess"}, {"origin": "http://elsewhere"}, {"origin": None}]
            good = [drags(connected, number, end, reported) for number in range(CLIENTS)]
            await asyncio.gather(*good, *(spoils(connected, end, wrong) for _ in range(4)), watched(end))

        asyncio.run(everything())
        assert process.poll() is None
    waits = sorted(seconds for *_, seconds in reported)
    half = len(memory) // 2
    middle, late = waits[len(waits) // 2], waits[int(0.95 * len(waits))]
    print(f"{len(reported)} answers; waited {middle:.3f} s (median), {late:.3f} s (95 %)")
    print(f"memory {memory[half]:.0f} MB half way, {memory[-1]:.0f} MB at the end")
    # What is kept fills up in the first half. A program that a rare star needs for the first time in the second half
    # takes some 70 MB at once.
    steps = [late - early for early, late in pairwise(memory[half:])]
    assert sum(step for step in steps if abs(step) < 20) < 0.1 * memory[half] + 20
    for state, images, _ in reported[:: len(reported) // 40]:
        found = kc.star_images(state.camera(), state.star(), state.max_index)
        assert images["per_index"] == list(found.per_index.values()) and images["certified"] == found.certified
