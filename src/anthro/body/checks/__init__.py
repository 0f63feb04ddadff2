"""What a built body must satisfy, one module per idea; :mod:`anthro.body.check` runs them.

A check takes a :class:`~anthro.body.checks.subject.Subject` and returns an
:class:`~anthro.body.checks.outcome.Outcome`: rows for the scorecard and all details for the report.
"""

from anthro.body.checks import (
    attachments,
    convergence,
    inventory,
    mass,
    moment_arms,
    paths,
    quiet,
    ranges,
    signs,
    stability,
    strength,
    symmetry,
)

CHECKS = {
    "inventory": inventory.check,
    "mass": mass.check,
    "symmetry": symmetry.check,
    "range_of_motion": ranges.check,
    "paths": paths.check,
    "attachments": attachments.check,
    "signs": signs.check,
    "moment_arms": moment_arms.check,
    "strength": strength.check,
    "stability": stability.check,
    "convergence": convergence.check,
    "quiet": quiet.check,
}

__all__ = ["CHECKS"]
