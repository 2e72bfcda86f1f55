"""The last line of an interrupted program."""

import signal
import subprocess
import sys

import pytest

# A full pipe on standard error, then work or a write that waits for a reader.
FILLED = """
import os, sys, time
from kerrcaustics.interrupts import on_interrupt
on_interrupt()
os.set_blocking(2, False)
try:
    while True:
        os.write(2, b"x" * 4096)
except BlockingIOError:
    pass
os.set_blocking(2, True)
print("full", flush=True)
{then}
"""


@pytest.mark.parametrize("then", ["time.sleep(60)", "sys.stderr.write('x' * 8192); sys.stderr.flush()"])
def test_ctrl_c_ends_a_program_whose_standard_error_nobody_reads(then):
    command = [sys.executable, "-c", FILLED.format(then=then)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "full\n"
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=10) == 130
    finally:
        process.kill()
        process.communicate()
