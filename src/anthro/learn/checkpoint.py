"""Where a training stands, on disk: whole or absent, and only good for the very same training."""

import io
import os
import sys
from pathlib import Path

import torch

from anthro.files import atomic

STATE = "state.pt"


def save_state(folder: str | os.PathLike, stamp: str, state: dict) -> None:
    """Write a training's state, atomically.

    Parameters
    ----------
    folder : path-like
        The folder of resume files; created.
    stamp : str
        Digest of the spec, of the data and of what computes.
    state : dict
        Tensors, numbers, strings, lists and dicts.

    Raises
    ------
    OSError
        When it cannot be written (disk full); the state before it is untouched.
    """
    content = io.BytesIO()  # torch hides the cause of a failed write; a plain write tells it
    torch.save({"stamp": stamp, "state": state}, content)
    with atomic(Path(folder) / STATE) as partial:
        partial.write_bytes(content.getbuffer())


def load_state(folder: str | os.PathLike, stamp: str) -> dict | None:
    """Read a training's state; None when there is none, or one of another spec or of other data.

    A state that cannot be read is ignored too, with a line on stderr.
    """
    path = Path(folder) / STATE
    if not path.is_file():
        return None
    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
        same = content["stamp"] == stamp
    except Exception as error:  # noqa: BLE001  torch.load raises almost anything on a broken file
        print(f"{path}: not readable, training starts afresh ({type(error).__name__})", file=sys.stderr)
        return None
    return content["state"] if same else None


def drop_state(folder: str | os.PathLike) -> None:
    """Remove a finished training's state, and its folder if nothing else lies there."""
    folder = Path(folder)
    (folder / STATE).unlink(missing_ok=True)
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()
