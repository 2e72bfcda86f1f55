"""The token in the explorer's address: new for each run, or kept in a file, so that the address lasts."""

import os
import re
import secrets
from pathlib import Path

from kerrcaustics.files import read_text, writing

_BYTES, _MOST = 24, 4096
_FORM = re.compile(r"[A-Za-z0-9_-]{16,128}")
_OTHERS = 0o077


def new_token() -> str:
    """A token that nobody can guess."""
    return secrets.token_urlsafe(_BYTES)


def kept_token(path: Path) -> str:
    """The token in a file, which is made with a new one if there is none.

    Raise ValueError if others can read it or if it holds no token, OSError if it cannot be read or made.
    """
    if not path.exists():
        token = new_token()
        with writing(path, private=True) as file:
            file.write(f"{token}\n".encode())
        return token
    if os.stat(path).st_mode & _OTHERS:
        raise ValueError(f"be readable by you alone, but others can use {path} (chmod 600 fixes that)")
    token = read_text(path, _MOST).strip()
    if not _FORM.fullmatch(token):
        raise ValueError(f"hold a token of 16 to 128 letters, digits, - or _, or not exist, but {path} holds none")
    return token
