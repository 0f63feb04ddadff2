"""Where a training computes: on the CPU or on a GPU, in either case so that it can be repeated."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

import torch

from anthro.errors import UserError

DEVICES = ("auto", "cpu", "cuda")


def choose_device(wanted: str) -> torch.device:
    """Return the device that is asked for; "auto" takes a GPU where there is one.

    Raises
    ------
    UserError
        When it is none of `DEVICES`, or a GPU that is not there.
    """
    if wanted not in DEVICES:
        raise UserError(f"device: {wanted!r} is not one of {', '.join(DEVICES)}")
    there = torch.cuda.is_available()
    if wanted == "cuda" and not there:
        raise UserError("device: cuda is asked for, but there is no GPU that PyTorch can use")
    return torch.device("cuda" if there and wanted != "cpu" else "cpu")


@contextmanager
def repeatable(threads: int) -> Iterator[None]:
    """Compute the same bytes each time, with so many threads on the CPU.

    Raises
    ------
    UserError
        When `threads` is not positive.
    """
    if threads < 1:
        raise UserError(f"threads: {threads} is not a positive integer")
    os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")  # CUDA's matrix products ask for it
    torch.set_num_threads(threads)
    torch.use_deterministic_algorithms(True)
    torch.set_flush_denormal(True)
    try:
        yield
    finally:
        torch.set_flush_denormal(False)
