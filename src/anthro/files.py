"""Files that are whole or absent: atomic writes, JSON, and HDF5 shards with a `complete` mark.

NumPy and h5py are imported where shards are read and written: many commands write JSON alone.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from anthro.errors import UserError

if TYPE_CHECKING:
    import numpy as np


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


def _sweep(path: Path) -> None:
    """Remove what a killed writer of `path` left behind."""
    for leftover in path.parent.glob(f".partial-*-{path.name}"):
        process = leftover.name.split("-")[1]
        if process.isdigit() and not _alive(int(process)):
            leftover.unlink(missing_ok=True)


@contextmanager
def atomic(path: str | os.PathLike) -> Iterator[Path]:
    """Give a temporary path beside `path`; it takes that name if the block succeeds.

    Parameters
    ----------
    path : path-like
        The file to write. Its folder is created. An older file stays until the new one is whole.

    Yields
    ------
    pathlib.Path
        A name with the same suffix, in the same folder; removed if the block raises.

    Raises
    ------
    OSError
        When the folder cannot be written.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    _sweep(path)
    partial = path.with_name(f".partial-{os.getpid()}-{path.name}")
    try:
        yield partial
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


def canonical(obj) -> str:
    """Return `obj` as JSON with sorted keys and no spaces, the form that is hashed."""
    return json.dumps(obj, sort_keys=True, separators=(",", ":"), default=_plain)


def digest(obj) -> str:
    """Return the SHA-256 (hex) of an object's canonical JSON."""
    return hashlib.sha256(canonical(obj).encode()).hexdigest()


def _plain(value):
    """Turn NumPy values and paths into what JSON knows."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise TypeError(f"{type(value).__name__} does not go into JSON")


def write_json(path: str | os.PathLike, obj) -> None:
    """Write `obj` as JSON with sorted keys, atomically; NumPy values are allowed."""
    text = json.dumps(obj, sort_keys=True, indent=1, default=_plain) + "\n"
    with atomic(path) as partial:
        partial.write_text(text, encoding="utf-8")


def read_json(path: str | os.PathLike):
    """Read a JSON file.

    Raises
    ------
    UserError
        Naming the file, when it is missing or is not JSON.
    """
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise UserError(f"{path}: no such file") from None
    except ValueError as error:
        raise UserError(f"{path}: not readable as JSON ({error})") from None


def write_shard(path: str | os.PathLike, columns: Mapping[str, np.ndarray], attrs: Mapping | None = None) -> None:
    """Write columns and attributes as one HDF5 file, atomically; the same content gives the same bytes.

    Parameters
    ----------
    path : path-like
        The file to write.
    columns : mapping of str to ndarray
        One data set a column, leading axis time or sample.
    attrs : mapping, optional
        Attributes of the file. `complete` is added, last.

    Raises
    ------
    UserError
        Naming the file, when it cannot be written (disk full); nothing is left under its name.
    """
    import h5py

    path = Path(path)
    try:
        with atomic(path) as partial:
            with h5py.File(partial, "w") as file:
                for name, values in columns.items():
                    file.create_dataset(name, data=values, track_times=False)
                file.attrs.update(attrs or {})
                file.attrs["complete"] = True
    except (OSError, RuntimeError) as error:  # h5py reports a failed flush or close as RuntimeError
        raise UserError(f"{path}: cannot be written ({error})") from None


def read_shard(path: str | os.PathLike, columns: Iterable[str] | None = None) -> tuple[dict[str, np.ndarray], dict]:
    """Read a file of `write_shard`.

    Parameters
    ----------
    path : path-like
        The file to read.
    columns : iterable of str, optional
        The columns wanted; None reads all.

    Returns
    -------
    columns : dict of str to ndarray
        In the order asked for.
    attrs : dict
        The file's attributes, `complete` among them.

    Raises
    ------
    UserError
        Naming the file, when it is missing, truncated, without its `complete` mark or a column.
    """
    import h5py

    path = Path(path)
    if not path.is_file():
        raise UserError(f"{path}: no such file")
    try:
        with h5py.File(path, "r") as file:
            if not file.attrs.get("complete", False):
                raise UserError(f"{path}: incomplete shard (no `complete` attribute); delete it and run again")
            names = list(file) if columns is None else list(columns)
            if missing := [name for name in names if name not in file]:
                raise UserError(f"{path}: no column {', '.join(missing)} (it has {', '.join(file)})")
            return {name: file[name][()] for name in names}, dict(file.attrs)
    except (OSError, RuntimeError, KeyError) as error:
        raise UserError(f"{path}: truncated or not HDF5 ({error})") from None
