"""Section of the report: the exported controller."""

from __future__ import annotations

from mrpipe.control.controller import Controller
from mrpipe.reporting.sink import Sink


def describe(sink: Sink, controller: Controller, law: str, folder: str) -> None:
    """Write the section: size and sampling rate of the exported controller."""
    sink.text(
        f"Law {law} as C99 at {controller.options.rate_hz:g} Hz, with {len(controller.numbers)} parameters and "
        f"{controller.state_size} state variables, in `{folder}/`."
    )
