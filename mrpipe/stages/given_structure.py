"""`identify-frame` for a structure that the configuration gives: nothing is identified, the matrices are checked.

This stage replaces the stage on a campaign if the section `structure` describes a structure.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext
from mrpipe.words import in_percent

if TYPE_CHECKING:
    from mrpipe.config.model import RunSettings


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.reporting import given_structure as section
    from mrpipe.structures.given import floor_heights, structure_from_settings
    from mrpipe.structures.given_storage import given_summary, read_matrix, write_given
    from mrpipe.structures.given_units import input_units
    from mrpipe.structures.reduction import reduced_structure

    settings = context.settings.structure
    full = structure_from_settings(settings, read_matrix, warn=context.warn)
    reduced = reduced_structure(full, settings.reduction)
    if settings.reduction.method != "none":
        context.warn(
            f"the structure was reduced from {full.floors} to {reduced.frame.floors} degrees of freedom "
            f"({settings.reduction.method}); the largest error of the response to ground motion up to "
            f"{reduced.band_high_hz:.3g} Hz is {in_percent(reduced.error, digits=3)} of the largest response"
        )
    heights = floor_heights(settings, read_matrix)
    summary = {**given_summary(full, reduced, heights), "input_units": input_units(settings)}
    with context.write("frame.h5") as artifact:
        write_given(artifact, reduced, summary)
    section.describe(context.report, reduced.frame, summary)
    return summary


def _check(settings: Any) -> None:
    """Check that the section says where the matrices are, and that the places that it names exist."""
    from mrpipe.errors import UserError
    from mrpipe.structures.given_storage import read_matrix
    from mrpipe.structures.named import require_places

    if not settings.structure.given:
        problem = "describes a structure, but no file, parameter set, storeys or modes"
        remedy = "give file, frame, storeys, storey_table or mode_shapes, or leave the section out"
        raise UserError("structure", "", problem, remedy)
    require_places(settings.structure, read_matrix)


VARIANTS = (
    Stage(
        name="identify-frame",
        summary="Check the structure that the configuration gives, reduce it, and compute its modes.",
        run=_run,
        after=("identify-damper",),
        settings=("structure",),
        outputs=("frame.h5",),
        check=_check,
    ),
)


def variant(configuration: RunSettings, given: str = "") -> Stage | None:
    """Return the stage if the configuration gives a structure; None if a campaign is to be identified.

    A section that describes matrices without their file has this stage too, which refuses it: a campaign that is
    identified in its place would not be what the user means.

    Parameters
    ----------
    configuration
        The whole configuration.
    given
        Entry of `campaigns` that the user named on the command line, empty for none.
    """
    structure = getattr(configuration, "structure", None)
    if structure is None or given == "frame":
        return None
    return VARIANTS[0] if structure.given or structure.described else None
