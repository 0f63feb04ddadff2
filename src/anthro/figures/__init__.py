"""One script per figure, one look for all."""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

HOUSE = Path(__file__).parent / "house.mplstyle"
TRAINING, VALIDATION = "#1b9e3f", "#d7301f"  # the paper's green and red


def command(draw: Callable, argv: Sequence[str] | None = None, description: str | None = None) -> None:
    """Run a figure script: read ``--run`` and ``--out``, draw in the house's look, save.

    Parameters
    ----------
    draw : callable
        Takes the run's folder (Path), returns a `matplotlib.figure.Figure`.
    argv : sequence of str, optional
        Arguments without the program's name.
    description : str, optional
        What ``--help`` says.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--run", required=True, type=Path, metavar="DIR", help="the run's folder, results/<run>")
    parser.add_argument("--out", required=True, type=Path, metavar="FILE", help="the figure, .png")
    given = parser.parse_args(argv)
    import matplotlib

    matplotlib.use("Agg")
    with matplotlib.style.context(HOUSE):
        figure = draw(given.run)
        save(figure, given.out)


def save(figure, path: Path) -> None:
    """Write a figure in 256 colours, atomically and without a time stamp."""
    from PIL import Image

    from anthro.files import atomic

    with atomic(path) as partial:
        figure.savefig(partial, metadata={"Software": None})
        with Image.open(partial) as drawn:
            small = drawn.convert("RGB").quantize(
                256, method=Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE
            )
        small.save(partial, format="PNG", optimize=True)


def log_ticks(axis) -> None:
    """Label a logarithmic axis in plain numbers: 1, 2 and 5 of each decade if it spans few, all digits if less."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = sorted(axis.get_view_interval())
    digits = (1.0,) if high > 200 * low else (1.0, 2.0, 5.0) if high > 4 * low else tuple(range(1, 10))
    axis.set_major_locator(LogLocator(subs=digits))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
