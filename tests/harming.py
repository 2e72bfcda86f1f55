"""Helpers of tests that damage files, in every way that a disk, a program or a user does."""

import os
import shutil


def _flip(path, chance):
    content = bytearray(path.read_bytes())
    place = chance.randrange(8 * len(content))
    content[place // 8] ^= 1 << place % 8
    path.write_bytes(content)


def _replace(path, make):
    path.unlink()
    make(path)


def _fill(path):
    path.mkdir()
    (path / "notes.txt").write_text("mine")


HARM = {
    "lost": lambda path, _: path.unlink(),
    "emptied": lambda path, _: path.write_bytes(b""),
    "truncated": lambda path, chance: os.truncate(path, chance.randrange(path.stat().st_size)),
    "flipped": _flip,
    "a folder": lambda path, _: _replace(path, lambda place: place.mkdir()),
    "a pipe": lambda path, _: _replace(path, os.mkfifo),
    "a broken link": lambda path, _: _replace(path, lambda place: place.symlink_to("nowhere")),
}
"""Ways to damage a file that can be undone, by name: functions of the file and a generator of random numbers."""


def hold_a_folder(path):
    """Put a folder in the place of a file, with somebody's file in it: for a person to look at."""
    _replace(path, _fill)


def restored(good, path):
    """A fresh copy of a folder."""
    shutil.rmtree(path, ignore_errors=True)
    shutil.copytree(good, path)
    return path
