"""The only list of limbs, nets, plants, emulators, demos and figures; a test proves that each of them is in the DAG."""

from dataclasses import dataclass

from anthro.errors import UserError

INPUTS = ("paper", "proprioceptive")  # variants of what a voluntary net is told


@dataclass(frozen=True)
class Limb:
    """One controlled limb; what it is stands in ``config/limbs/<name>.yaml``.

    Attributes
    ----------
    name : str
        Its key in `LIMBS`.
    paper : str
        The paper whose body it belongs to.
    mirror_of : str
        The limb whose mirror image it is; "" for a limb that has to be trained.
    """

    name: str
    paper: str
    mirror_of: str = ""

    @property
    def nets(self) -> dict[str, str]:
        """Its nets in `NETS`: one for each variant of the voluntary input, and the "reflex" one."""
        voluntary = {inputs: f"{self.name}_voluntary_{inputs}" for inputs in INPUTS}
        return voluntary | {"reflex": f"{self.name}_reflex"}


@dataclass(frozen=True)
class Net:
    """One DNN; its numbers stand in ``config/nets/<paper>/<name>.yaml``."""

    paper: str
    limb: str  # "" for foveation, which moves eyes and head
    role: str  # "voluntary", "reflex", "foveation" or "vision"


@dataclass(frozen=True)
class Demo:
    """One demo or measurement, written to ``demos/<name>/``.

    Attributes
    ----------
    module : str
        The module that is called.
    bodies : tuple of str
        The body that moves, or those on which is measured.
    limbs : tuple of str
        Limbs of `LIMBS` whose nets move it.
    inputs : str
        The variant of the voluntary input that is asked for; "" lets the demo use the better one.
    options : str
        What else stands on its command line.
    rollout : bool
        Whether it records a rollout, and not only numbers.
    alone : bool
        Whether it measures time, and so must have the machine to itself.
    sight : tuple of str, optional
        Limbs of `LIMBS` whose vision nets lead it, beside the foveation nets; None for a demo that does not see.
    retina : str
        Whose vision nets they are, "" for the paper's.
    """

    module: str
    bodies: tuple[str, ...]
    limbs: tuple[str, ...] = ()
    inputs: str = ""
    options: str = ""
    rollout: bool = True
    alone: bool = False
    sight: tuple[str, ...] | None = None
    retina: str = ""


@dataclass(frozen=True)
class Figure:
    """One figure or video; its label and what it is drawn from stand in ``config/papers/<paper>.yaml``."""

    paper: str
    suffix: str = "png"


@dataclass(frozen=True)
class Emulator:
    """One network that emulates a plant; its numbers stand in ``config/nets/grzeszczuk1998/<name>.yaml``.

    Attributes
    ----------
    plant : str
        Of `PLANTS`.
    part : str
        "whole", or of the dolphin "global" or "local1" to "local6".
    super_step : int
        Physical steps that it takes at once.
    """

    plant: str
    part: str
    super_step: int


LIMBS = {
    limb.name: limb
    for limb in (
        Limb("right_arm", "nakada2018"),
        Limb("left_arm", "nakada2018", mirror_of="right_arm"),
        Limb("right_leg", "nakada2018"),
        Limb("left_leg", "nakada2018", mirror_of="right_leg"),
        Limb("neck_seated", "nakada2018"),
        Limb("neck", "zhou2021"),
        Limb("core", "zhou2021"),
    )
}

NETS = {
    net: Net(limb.paper, limb.name, "reflex" if variant == "reflex" else "voluntary")
    for limb in LIMBS.values()
    for variant, net in limb.nets.items()
}

SIDES = ("left", "right")  # of the eyes; each has its own vision DNNs
SIGHTED = ("right_arm", "left_arm", "right_leg", "left_leg")  # limbs that eyes tell where to reach
UNIFORM, UNIFORM_LIMBS = "uniform_", ("right_arm",)  # eyes without a fovea, to compare with; they lead one arm
NETS |= {
    f"{eyes}{limb + '_vision' if limb else 'foveation'}_{side}": Net(
        "nakada2018", limb, "vision" if limb else "foveation"
    )
    for eyes, limbs in (("", ("", *SIGHTED)), (UNIFORM, ("", *UNIFORM_LIMBS)))
    for limb in limbs
    for side in SIDES
}

ABLATIONS = {"shapes": "A.1", "depths": "A.2", "learning_rates": "footnote 1", "core_widths": "Zhou, A"}

SEATED = ("neck_seated", "right_arm", "left_arm", "right_leg", "left_leg")  # limbs of the body nakada2018
REACHING = ("right_arm", "left_arm", "right_leg", "left_leg")  # of these, those that sight can lead to a place
WHOLE = ("core", "neck", "right_arm", "left_arm", "right_leg", "left_leg")  # limbs of the body whole_fixed

TIMED = ("right_arm", "right_leg", "neck_seated", "neck", "core")  # on the bodies that they are trained on
TIMED_ON = ("right_arm", "right_leg", "neck_seated", "neck", "whole_fixed")


def _both(task: str, limb: str, body: str) -> dict[str, Demo]:
    """One demo for each variant of the voluntary input."""
    name = task if task == limb else f"{task}_{limb}"
    return {
        f"{name}_{inputs}": Demo(f"anthro.demos.{task}", (body,), (limb,), inputs, f"--limb {limb}")
        for inputs in INPUTS
    }


def _seeing(task: str, sight: tuple[str, ...], options: str = "", retina: str = "", **details) -> Demo:
    """One demo of the seated body that is led by what it sees."""
    module = f"anthro.demos.{task}"
    return Demo(module, ("nakada2018",), SEATED, options=options, sight=sight, retina=retina, **details)


def _one(task: str, limb: str, body: str = "nakada2018", rollout: bool = True) -> Demo:
    """One demo of one limb."""
    return Demo(f"anthro.demos.{task}", (body,), (limb,), options=f"--limb {limb}", rollout=rollout)


DEMOS = {
    **_both("reach", "right_arm", "nakada2018"),
    **_both("reach", "left_arm", "nakada2018"),
    **_both("reach", "right_leg", "nakada2018"),
    **_both("reach", "left_leg", "nakada2018"),
    **_both("head", "neck_seated", "nakada2018"),
    **_both("head", "neck", "neck"),
    **_both("core", "core", "whole_fixed"),
    "all_six": Demo("anthro.demos.all_six", ("whole_fixed",), WHOLE),
    "weakness_right_arm": _one("weakness", "right_arm", rollout=False),
    "weakness_right_leg": _one("weakness", "right_leg", rollout=False),
    "weakness_neck_seated": _one("weakness", "neck_seated", rollout=False),
    "weakness_core": _one("weakness", "core", "whole_fixed", rollout=False),
    "hold": _one("hold", "right_arm"),
    "push": _one("push", "right_arm"),
    "on_off": Demo("anthro.demos.on_off", ("nakada2018",), SEATED, options="--limb left_arm"),
    "neck_on_off": Demo("anthro.demos.neck_on_off", ("nakada2018",), SEATED),
    "draw_butterfly": Demo("anthro.demos.draw", ("nakada2018",), SEATED, options="--shape butterfly"),
    "write": Demo("anthro.demos.draw", ("nakada2018",), SEATED, options="--shape writing"),
    "write_reclining": Demo("anthro.demos.reclining", ("nakada2018",), SEATED),
    "supine": Demo("anthro.demos.supine", ("nakada2018",), ("right_arm", "left_arm", "neck_seated")),
    "perception": _seeing("perception", ("right_arm",)),
    "perception_no_head": _seeing("perception", ("right_arm",), "--no-head"),
    "perception_one_eye": _seeing("perception", ("right_arm",), "--one-eye"),
    "perception_uniform": _seeing("perception", ("right_arm",), "--retina uniform", "uniform"),
    "cannon": _seeing("cannon", REACHING),
    "bouncing": _seeing("bouncing", ("right_arm",)),
    "shaken": _seeing("shaken", REACHING),
    "gaze": _seeing("gaze", ()),
    "sight_timing": _seeing("sight_timing", REACHING, rollout=False, alone=True),
    "timing": Demo("anthro.demos.timing", TIMED_ON, TIMED, rollout=False, alone=True),
    "eyes": Demo("anthro.eyes.benchmark", ("nakada2018",), rollout=False, alone=True),
    "solvers": Demo("anthro.motor.compare_solvers", ("right_arm",), rollout=False, alone=True),
}

PLANTS = {  # super-steps of each plant's emulators
    "passive_pendulum": (25, 50, 100),
    "active_pendulum": (25, 50, 100),
    "forced_pendulum": (50,),
    "truck": (50,),
    "lander": (50,),
    "dolphin": (50,),
}

EMULATORS = {
    "_".join([plant, *([] if part == "whole" else [part]), f"n{steps}"]): Emulator(plant, part, steps)
    for plant, super_steps in PLANTS.items()
    for steps in super_steps
    for part in (("global", *(f"local{j}" for j in range(1, 7))) if plant == "dolphin" else ("whole",))
}

TASKS = {  # control tasks, and the plants whose emulators they are learned through
    "pendulum": "active_pendulum",
    "truck": "truck",
    "lander": "lander",
    "dolphin": "dolphin",
}

FIGURES = {
    "fig02_body": Figure("nakada2018"),
    "fig03_neck": Figure("nakada2018"),
    "fig04_arm": Figure("nakada2018"),
    "fig05_leg": Figure("nakada2018"),
    "fig10_neck_training": Figure("nakada2018"),
    "fig11_voluntary_training": Figure("nakada2018"),
    "fig13_reflex_training": Figure("nakada2018"),
    "fig14_sight": Figure("nakada2018"),
    "fig15_retina": Figure("nakada2018"),
    "fig16_vision_training": Figure("nakada2018"),
    "fig17_foveation": Figure("nakada2018"),
    "fig18_limb_sight": Figure("nakada2018"),
    "fig20_neck_on_off": Figure("nakada2018"),
    "fig20_neck_on_off_video": Figure("nakada2018", "mp4"),
    "fig21_arm_on_off": Figure("nakada2018"),
    "fig21_arm_on_off_video": Figure("nakada2018", "mp4"),
    "fig22_perception": Figure("nakada2018"),
    "fig22_perception_video": Figure("nakada2018", "mp4"),
    "fig23_cannon": Figure("nakada2018"),
    "fig23_cannon_video": Figure("nakada2018", "mp4"),
    "fig25_bouncing": Figure("nakada2018"),
    "fig25_bouncing_video": Figure("nakada2018", "mp4"),
    "fig26_drawing": Figure("nakada2018"),
    "fig26_butterfly_video": Figure("nakada2018", "mp4"),
    "fig26_writing_video": Figure("nakada2018", "mp4"),
    "fig27_reclining": Figure("nakada2018"),
    "fig27_reclining_video": Figure("nakada2018", "mp4"),
    "fig28_ablation_mse": Figure("nakada2018"),
    "fig29_ablation_time": Figure("nakada2018"),
    "learning_rates": Figure("nakada2018"),
    "reach_error": Figure("nakada2018"),
    "saliency": Figure("nakada2018"),
    "sight_ablations": Figure("nakada2018"),
    "vision_error": Figure("nakada2018"),
    "weakness": Figure("nakada2018"),
    "timing": Figure("nakada2018"),
    "solver_comparison": Figure("nakada2018"),
    "fig03_body": Figure("zhou2021"),
    "fig05_core_training": Figure("zhou2021"),
    "fig15_width_ablation": Figure("zhou2021"),
    "joint_sweeps": Figure("zhou2021"),
    "fig10_plants": Figure("grzeszczuk1998"),
    "fig12_error": Figure("grzeszczuk1998"),
    "fig12_other_plants": Figure("grzeszczuk1998"),
    "fig13_pendulum": Figure("grzeszczuk1998"),
    "fig13_pendulum_video": Figure("grzeszczuk1998", "mp4"),
    "fig13_truck": Figure("grzeszczuk1998"),
    "fig13_truck_video": Figure("grzeszczuk1998", "mp4"),
    "fig13_lander": Figure("grzeszczuk1998"),
    "fig13_lander_video": Figure("grzeszczuk1998", "mp4"),
    "fig13_dolphin": Figure("grzeszczuk1998"),
    "fig13_dolphin_video": Figure("grzeszczuk1998", "mp4"),
    "fig14_convergence": Figure("grzeszczuk1998"),
    "table2_timing": Figure("grzeszczuk1998"),
    "regularisation": Figure("grzeszczuk1998"),
    "search_comparison": Figure("grzeszczuk1998"),
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


def mirrored_nets(left_limbs: str) -> dict[str, str]:
    """Return the nets that are made from another limb's, and these: with left limbs "mirrored", not with "trained"."""
    return {
        net: LIMBS[limb.mirror_of].nets[variant]
        for limb in LIMBS.values()
        if limb.mirror_of and left_limbs == "mirrored"
        for variant, net in limb.nets.items()
    }
