"""The stepper is of first order: half the step, half the error."""

from __future__ import annotations

import numpy as np

from anthro.body.checks.outcome import Outcome
from anthro.body.checks.subject import Subject
from anthro.progress import progress

REFERENCE = 0.00025  # s
STEPS = (0.005, 0.0025, 0.00125)  # s
SECONDS = 0.5
ACTIVATION = 0.1  # largest, constant
BAND = (1.6, 2.6)


def check(subject: Subject) -> Outcome:
    """Ratios of the errors of successive halvings in free space; each must be near two."""
    out = Outcome(subject.plan.name, "convergence")
    activation = ACTIVATION * subject.random("convergence").random(subject.body.muscle_count)
    runs = progress((rollout(subject, h, activation) for h in (REFERENCE, *STEPS)), 1 + len(STEPS), "convergence")
    reference, *states = runs
    errors = [float(np.linalg.norm(state - reference)) for state in states]
    ratios = [coarse / fine if fine > 0.0 else np.nan for coarse, fine in zip(errors, errors[1:], strict=False)]
    source = f"{SECONDS:g} s against {1e3 * REFERENCE:g} ms"
    out.add("error at 5 ms, all joints together", errors[0], "rad", source=source)
    out.add("least ratio of errors when the step is halved", min(ratios), "1", BAND[0], "min", source)
    out.add("largest ratio of errors when the step is halved", max(ratios), "1", BAND[1], "max", source)
    worst = np.argsort(-np.abs(states[0] - reference))[:10]
    out.details = {
        "steps_s": list(STEPS),
        "errors_rad": errors,
        "ratios": ratios,
        "worst": {subject.body.dof_names[i]: float(states[0][i] - reference[i]) for i in worst},
    }
    return out


def rollout(subject: Subject, step: float, activation: np.ndarray) -> np.ndarray:
    """Joint angles (m,) after `SECONDS` from rest, without ground."""
    simulator = subject.body.simulator(step)
    for _ in range(round(SECONDS / step)):
        simulator.step(activation)
    return simulator.joint_angles.copy()
