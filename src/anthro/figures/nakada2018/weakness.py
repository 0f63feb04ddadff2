"""What is left of each limb's skill when its muscles are weaker, or some of them off: success and error."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.ticker import PercentFormatter

from anthro import cli, figures
from anthro.errors import UserError
from anthro.files import read_json

LIMBS = {"right_arm": "#0072B2", "right_leg": "#009E73", "neck_seated": "#E69F00", "core": "#D55E00"}
STRENGTHS = (100, 80, 60)  # percent
OFF = 42  # where muscles that are off stand on the axis of strengths


@dataclass(frozen=True)
class Skill:
    """A limb's success rates and median errors: at each of `STRENGTHS`, then with `off` percent of its muscles off."""

    success: list[float]
    error: list[float]
    off: int


def read(run: Path, limb: str) -> Skill:
    """Read a limb's weakness demo.

    Raises
    ------
    UserError
        Naming the file, when it is missing or incomplete.
    """
    path = Path(run) / "demos" / f"weakness_{limb}" / "metrics.json"
    metrics = read_json(path)
    off = next((name.split("_")[1] for name in metrics if name.startswith("off_")), "0")
    unit = "m" if "strength_100_median_error_m" in metrics else "deg"
    states = [*(f"strength_{percent}" for percent in STRENGTHS), f"off_{off}"]
    try:
        success, error = ([metrics[f"{s}_{what}"] for s in states] for what in ("success_rate", f"median_error_{unit}"))
    except KeyError as missing:
        raise UserError(f"{path}: no {missing}") from None
    return Skill(success, error, int(off))


def draw(run: Path) -> plt.Figure:
    """Draw success left, and right the median error over that at full strength."""
    figure, panels = plt.subplots(1, 2, figsize=(7.0, 2.9))
    for limb, colour in LIMBS.items():
        skill = read(run, limb)
        name = limb.removesuffix("_seated").replace("_", " ")
        look = {"color": colour, "marker": "o", "markersize": 4}
        for axes, values in zip(panels, (skill.success, [x / skill.error[0] for x in skill.error]), strict=True):
            axes.plot(STRENGTHS, values[:-1], **look, label=f"{name}; {skill.off} % off")
            axes.plot(OFF, values[-1], **look | {"markerfacecolor": "white"})
    for axes in panels:
        axes.set_xlim(105, OFF - 5)
        axes.set_xticks([*STRENGTHS, OFF], [*(f"{percent} %" for percent in STRENGTHS), "some off"])
        axes.axvline((STRENGTHS[-1] + OFF) / 2, color="0.7", linewidth=0.7)
        axes.set_xlabel("strength of all muscles")
    panels[0].set_ylim(-0.03, 1.03)
    panels[0].yaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    panels[0].set_title("Targets reached")
    panels[1].set_yscale("log")
    figures.log_ticks(panels[1].yaxis)
    panels[1].set_title("Median error over that at full strength")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(LIMBS))
    return figure


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
