"""The controller as plain C99 and JSON for a real-time target; the same arithmetic as :mod:`mrpipe.control.kernel`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.control import kernel
from mrpipe.control.controller import Controller
from mrpipe.control.law import Law
from mrpipe.control.laws import law_named

LOADS_FROM = ("mrpipe/control/controller_template.c",)
"""Files of the program that are read at run time: they belong to the code version of a stage."""
_TEMPLATE = Path(__file__).with_name("controller_template.c")

_MACROS = (
    "MEASURED_DISPLACEMENT",
    "MEASURED_ACCELERATION",
    "MEASURED_VELOCITY",
    "MEASURED_GROUND",
    "MEASURED_FORCE",
    "MEASURED_FLOORS",
    "COMMAND_DRIVE",
    "COMMAND_FORCE",
    "COMMAND_UNCLIPPED",
    "COMMAND_DISPLACEMENT",
    "COMMAND_VELOCITY",
    "COMMAND_AMPLITUDE",
    "COMMAND_CLIPPED",
    "COMMAND_SWITCHED",
    "COMMAND_INVERSE",
    "COMMAND_FAULT",
    "COMMAND_SIZE",
)
_INNER_MACROS = tuple(
    name for name in vars(kernel) if name.isupper() and isinstance(getattr(kernel, name), int) and name not in _MACROS
)


def controller_files(controller: Controller, prefix: str, details: dict[str, Any]) -> dict[str, str]:
    """Return file name -> text of the exported folder.

    Parameters
    ----------
    controller
        What to export.
    prefix
        Of the C names.
    details
        Further entries of controller.json (where gains come from, units).
    """
    law = law_named(controller.law)
    return {
        "controller.h": _header(controller, prefix),
        "controller.c": _source(controller, law, prefix),
        "controller.json": json.dumps(_description(controller, prefix, details), indent=2) + "\n",
        "README.md": _readme(controller, prefix),
    }


def _header(controller: Controller, prefix: str) -> str:
    upper = prefix.upper()
    lines = [
        f"/* Controller of law {controller.law}: Kalman velocity, law, clipping, inverse, switch, low-pass, limits. */",
        f"#ifndef {upper}_CONTROLLER_H",
        f"#define {upper}_CONTROLLER_H",
        "",
        "/* Indices into measured[] (SI) and command[]. */",
        *(f"#define {upper}_{name} {getattr(kernel, name)}" for name in _MACROS),
        f"#define {upper}_MEASURED_SIZE {controller.measured_size}",
        f"#define {upper}_STATE_SIZE {controller.state_size}",
        f"#define {upper}_SAMPLE_TIME_S {controller.sample_time_s!r}",
        "",
        "/* Set the memory to zero before the first call and whenever the loop was open. */",
        f"void {prefix}_controller_reset(double state[{upper}_STATE_SIZE]);",
        "",
        "/* Call once a sample; hold command[COMMAND_DRIVE] until the next call. */",
        f"void {prefix}_controller_step(double state[{upper}_STATE_SIZE],",
        f"                              const double measured[{upper}_MEASURED_SIZE],",
        f"                              double command[{upper}_COMMAND_SIZE]);",
        "",
        "#endif",
        "",
    ]
    return "\n".join(lines)


def _source(controller: Controller, law: Law, prefix: str) -> str:
    upper = prefix.upper()
    numbers = ",\n".join(
        "    " + ", ".join(_literal(value) for value in controller.numbers[start : start + 4])
        for start in range(0, len(controller.numbers), 4)
    )
    layout = ", ".join(str(int(value)) for value in controller.layout)
    macros = "\n".join(f"#define {name} {getattr(kernel, name)}" for name in (*_INNER_MACROS, *_MACROS))
    text = _TEMPLATE.read_text(encoding="utf-8")
    for key, value in {
        "@PREFIX@": prefix,
        "@UPPER@": upper,
        "@MACROS@": macros,
        "@NUMBERS@": numbers,
        "@LAYOUT@": layout,
        "@LAW@": controller.law,
        "@LAW_HELPERS@": f"{law.c_helpers}\n" if law.c_helpers else "",
        "@LAW_BODY@": law.c_body,
    }.items():
        text = text.replace(key, value)
    return text


def _literal(value: float) -> str:
    """Return a C literal that reads back to the same double."""
    return float(value).hex()


def _description(controller: Controller, prefix: str, details: dict[str, Any]) -> dict[str, Any]:
    return {
        "law": controller.law,
        "prefix": prefix,
        "gains": dict(controller.gains),
        "options": asdict(controller.options),
        "sample_time_s": controller.sample_time_s,
        "measured": _places("MEASURED_"),
        "measured_size": controller.measured_size,
        "command": _places("COMMAND_"),
        "state_size": controller.state_size,
        "numbers": [float(value) for value in controller.numbers],
        "layout": [int(value) for value in np.asarray(controller.layout)],
        **details,
    }


def _limits(controller: Controller) -> str:
    """Return the largest plausible readings in words."""
    at = int(controller.layout[kernel.AT_LIMITS])
    named = {
        "displacement": (kernel.MEASURED_DISPLACEMENT, "m"),
        "acceleration": (kernel.MEASURED_ACCELERATION, "m/s2"),
        "velocity": (kernel.MEASURED_VELOCITY, "m/s"),
        "force": (kernel.MEASURED_FORCE, "N"),
    }
    limits = {name: (float(controller.numbers[at + place]), unit) for name, (place, unit) in named.items()}
    return ", ".join(f"{name} {limit:.3g} {unit}" for name, (limit, unit) in limits.items() if limit > 0.0)


def _places(prefix: str) -> dict[str, int]:
    names = (name for name in _MACROS if name.startswith(prefix) and not name.endswith("_SIZE"))
    return {name.removeprefix(prefix).lower(): getattr(kernel, name) for name in names}


def _readme(controller: Controller, prefix: str) -> str:
    upper = prefix.upper()
    floors = (
        f"\n- `{upper}_MEASURED_GROUND` and from `{upper}_MEASURED_FLOORS` on: absolute accelerations of the ground "
        f"and of {controller.floors} floors [m/s2]"
        if controller.floors
        else ""
    )
    hold = int(controller.layout[kernel.HOLD])
    return f"""# Controller of law {controller.law}

Plain C99 without allocation, files or libraries but `math.h`. Build with `cc -std=c99 -c controller.c` and link `-lm`;
a compiler that contracts `a*b+c` (some do on their own) changes the last digits: `-ffp-contract=off` avoids it.

Call `{prefix}_controller_reset` once, then `{prefix}_controller_step` every {controller.sample_time_s:g} s with

- `{upper}_MEASURED_DISPLACEMENT`: damper displacement [m]
- `{upper}_MEASURED_ACCELERATION`: damper acceleration, floor less ground [m/s2]
- `{upper}_MEASURED_VELOCITY`: damper velocity [m/s], read only where the controller was built without a filter{floors}

and hold `command[{upper}_COMMAND_DRIVE]` (A or V, as the damper was measured) until the next call. The other entries of
`command` are the desired force before and after clipping, the estimated motion, whether clipping and switch acted, and
`{upper}_COMMAND_FAULT`. The damper force is positive where it resists the motion.

## Faulty readings

A reading is refused if it is NaN or infinite, or larger than the largest plausible one ({_limits(controller)}).

- For up to {hold} samples in a row ({1e3 * hold * controller.sample_time_s:.0f} ms) the last good reading replaces it;
  `{upper}_COMMAND_FAULT` is 1.
- After that, and before the first good sample, the drive is {controller.options.safe_drive:g};
  `{upper}_COMMAND_FAULT` is 2.
- At the next sample with good readings the controller starts anew, and `{upper}_COMMAND_FAULT` is 0.

Whatever the readings are, the drive is finite and lies between 0 and the drive limit, and the memory stays finite. This
holds for code compiled without `-ffast-math`, which would drop the test for NaN.

`controller.json` holds gains, options and all numbers.
"""
