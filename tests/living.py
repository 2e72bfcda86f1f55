"""The program of the page without a server, in Node: its kernels, its search and its answers."""

import json
import subprocess

import pytest
from exploring import node

from kerrcaustics.beams.kernels.webassembly import browser_kernels
from kerrcaustics.explorer.live_page import live_data
from kerrcaustics.explorer.page_script import live_program


def needs_kernels():
    if browser_kernels() is None:
        pytest.skip("Kernels for browsers are missing: they need ziglang, and are made by make kernels")


def ran(program, seconds=120):
    """The value that the body of an asynchronous function returns, in Node."""
    found = node()
    if found is None:
        pytest.skip("Node is missing: pip install playwright, which brings it")
    text = f"(async () => {{{program}}})().then((value) => process.stdout.write(JSON.stringify(value)));"
    process = subprocess.run([found, "-"], input=text, capture_output=True, text=True, timeout=seconds, check=False)
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout)


def answered(body):
    """The same beside the program, as `program`: its functions, its kernels and `answers` are ready."""
    needs_kernels()
    start = """
      await loadKernels(Uint8Array.from(atob(data.plain), (c) => c.charCodeAt(0)), data.layout);
      const answers = new Answers(data.rules);
      const ask = (want, state = {}, more = {}) =>
        answers.answer({ id: 1, want, state: { ...data.rules.usual, ...state }, ...more });
    """
    whole = live_program().replace("answerMessages(scope);", f"return (async () => {{{start}{body}}})();")
    return ran(f"const data = {json.dumps(live_data())};\n{whole}\nreturn liveProgram({{}});")
