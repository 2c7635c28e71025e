"""A shear frame on a rocking base, compared with a linear frame of any stiffness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrpipe.tracing.structure.candidates import Placed, Surroundings, search
from mrpipe.tracing.structure.model import model_of
from mrpipe.tracing.structure.rounds import FrameSelection, round_of, taken


def on_rocking_base(
    simple: FrameSelection, free: FrameSelection, forms: Sequence[Placed], jobs: int, least_share: float
) -> FrameSelection | None:
    """Return the shear frame on a rocking base, if it is as good as a linear frame of any stiffness; else None.

    A rocking base without inertia is a linear frame whose stiffness is not tri-diagonal. It can therefore be detected
    only by comparison with a shear frame, and only if no other coupling is needed: the error with few parameters must
    then be that of a full stiffness matrix. A base with an edge that lifts is nonlinear, and its error may be smaller
    than that of any linear frame. A frame that bends as well as rocks is compared later, with a full stiffness matrix.

    Parameters
    ----------
    simple, free
        Shear frame and linear frame of any stiffness, without effects.
    forms
        Forms of all effects at their places.
    jobs
        Processes.
    least_share
        Least share of the residual of the shear frame above the noise that a rocking base must explain. The search is
        skipped if the forms of the base explain less than half of it at their start values.
    """
    base_forms = [item for item in forms if item.effect.acts_on == "base"]
    if not base_forms:
        return None
    about, rules = simple.about, simple.rules
    # a rocking base is visible at one of the start values already; otherwise skip the search
    screened = [search(item, simple.design, None, about, screen_only=True) for item in base_forms]
    if max(simple.share(item.solved.residual) for item in screened) < 0.5 * least_share:
        return None
    found = round_of(simple, base_forms, about, jobs)
    if not found or found[0].share < least_share:
        return None
    # the stiffness of the storeys follows once the rotation of the base is subtracted from their drift
    model = model_of(simple.design, (found[0].outcome.fitted,), about)
    own = np.array([-numbers[0] for numbers in model.linear])
    if np.all(own > 0.0):
        about = Surroundings(own, simple.rules)
        found = round_of(simple, base_forms, about, jobs) or found
    error = np.sqrt(found[0].outcome.solved.chi_square)
    of_any_linear_frame = np.sqrt(max(free.design.chi_square, 1.0))
    if error > (1.0 + rules.of_floor) * of_any_linear_frame:
        return None
    return taken(replace(simple, rounds=(found,), storey_stiffness=about.storey_stiffness), found[0])
