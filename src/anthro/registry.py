"""The only list of limbs, nets, demos and figures; a test proves that each of them is in the DAG."""

from dataclasses import dataclass

from anthro.errors import UserError


@dataclass(frozen=True)
class Limb:
    """One controlled limb.

    Attributes
    ----------
    nets : dict of str to str
        Its nets in `NETS`: one for each variant of the voluntary input ("paper",
        "proprioceptive") and the "reflex" one.
    """

    nets: dict[str, str]


@dataclass(frozen=True)
class Net:
    """One DNN; its numbers stand in ``config/nets/<paper>/<name>.yaml``."""

    paper: str
    limb: str
    role: str  # "voluntary" or "reflex"


@dataclass(frozen=True)
class Demo:
    """One demo or measurement, run for a limb and written to ``demos/<name>/``.

    Attributes
    ----------
    module : str
        The module that is called.
    inputs : str
        The variant of the voluntary input that is asked for; "" lets the demo use the better one.
    alone : bool
        Whether it measures time, and so must have the machine to itself.
    limb : str
        The limb of `LIMBS` that moves.
    """

    module: str
    inputs: str = ""
    alone: bool = False
    limb: str = "right_arm"


@dataclass(frozen=True)
class Figure:
    """One figure or video; its label and what it is drawn from stand in ``config/papers/<paper>.yaml``."""

    paper: str
    suffix: str = "png"


LIMBS = {
    "right_arm": Limb(
        {
            "paper": "right_arm_voluntary_paper",
            "proprioceptive": "right_arm_voluntary_proprioceptive",
            "reflex": "right_arm_reflex",
        }
    )
}

NETS = {
    "right_arm_voluntary_paper": Net("nakada2018", "right_arm", "voluntary"),
    "right_arm_voluntary_proprioceptive": Net("nakada2018", "right_arm", "voluntary"),
    "right_arm_reflex": Net("nakada2018", "right_arm", "reflex"),
}

ABLATIONS = {"shapes": "A.1", "depths": "A.2", "learning_rates": "footnote 1"}

DEMOS = {
    "reach_paper": Demo("anthro.demos.reach", inputs="paper"),
    "reach_proprioceptive": Demo("anthro.demos.reach", inputs="proprioceptive"),
    "hold": Demo("anthro.demos.hold"),
    "push": Demo("anthro.demos.push"),
    "on_off": Demo("anthro.demos.on_off"),
    "timing": Demo("anthro.demos.timing", alone=True),
    "solvers": Demo("anthro.motor.compare_solvers", alone=True),
}

FIGURES = {
    "fig02_body": Figure("nakada2018"),
    "fig03_neck": Figure("nakada2018"),
    "fig04_arm": Figure("nakada2018"),
    "fig05_leg": Figure("nakada2018"),
    "fig11_voluntary_training": Figure("nakada2018"),
    "fig13_reflex_training": Figure("nakada2018"),
    "fig21_arm_on_off": Figure("nakada2018"),
    "fig21_arm_on_off_video": Figure("nakada2018", "mp4"),
    "fig28_ablation_mse": Figure("nakada2018"),
    "fig29_ablation_time": Figure("nakada2018"),
    "learning_rates": Figure("nakada2018"),
    "reach_error": Figure("nakada2018"),
    "timing": Figure("nakada2018"),
    "solver_comparison": Figure("nakada2018"),
    "fig03_body": Figure("zhou2021"),
    "joint_sweeps": Figure("zhou2021"),
}


def limb(name: str) -> Limb:
    """Return a limb.

    Raises
    ------
    UserError
        When there is none of that name.
    """
    if name not in LIMBS:
        raise UserError(f"unknown limb {name!r}; known: {', '.join(LIMBS)}")
    return LIMBS[name]
