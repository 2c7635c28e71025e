"""Writes docs/base-forms.md from the base forms: `python -m mrpipe.dampers.document > docs/base-forms.md`."""

from __future__ import annotations

import sys

from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.library import base_forms
from mrpipe.dampers.parameters import Parameter

_HEAD = """\
# Base forms of a damper

A damper is a base form, its numbers, and effects. `mrpipe identify-damper` fits all base forms of this page and
compares them; `mrpipe close-loop` starts from this comparison and adds [effects](effects.md).

The force of a base form is

    f = F_y(u) z + c0(u) w' + F_p(u) p

where u is the drive behind its lag, z between -1 and 1 is the normalised hysteretic force that the form gives, and w'
is the velocity of the rod, or that of an inner element. Only forms with a second yielding part have the last term. F_y,
c0 and F_p are laws of the drive that are chosen by leaving out levels of the drive. The parameters below are those that
a form has in addition to these laws and to the rate `eta` of the lag.

Bounds are multiples of scales of the campaign: `stroke` is half the largest peak-to-peak displacement, `speed` and
`acceleration` are the largest values of the motion, `drive` is the largest drive, and `force` is the RMS of the force.

A file of yours can define a further form: `identify_damper.form_files` and `close_loop.form_files` name such files, and
`mrpipe/dampers/forms/` holds the files of this page as examples.

This page is written by `python -m mrpipe.dampers.document > docs/base-forms.md`.
"""


def as_markdown() -> str:
    """Return the page."""
    forms = sorted(base_forms().values(), key=lambda form: form.name)
    lines = [_HEAD, "\n| base form | family | parameters that are fitted |\n| --- | --- | --- |\n"]
    for form in forms:
        count = len(form.searched) + len(form.amplitudes)
        lines.append(f"| [{form.name}](#{form.name}) | {form.family or form.name} | {count} |\n")
    return "".join([*lines, *map(_form, forms)])


def _form(form: BaseForm) -> str:
    lines = [f"\n## {form.name}\n\n{form.summary[:1].upper()}{form.summary[1:]}.\n\n**Source:** {form.source}.\n"]
    if form.coupled:
        lines.append("\nThe hysteretic force depends on the laws of the drive; both are fitted in turn.\n")
    if form.parameters:
        lines.append("\n| parameter | unit | meaning | searched |\n| --- | --- | --- | --- |\n")
        lines += [f"| `{item.name}` | {item.unit} | {item.meaning} | {_range(item)} |\n" for item in form.parameters]
    return "".join(lines)


def _range(item: Parameter) -> str:
    if item.role == "constant":
        return f"no: equals {_scale(item)}"
    if item.role == "amplitude":
        return "solved for exactly"
    return f"{item.lower:g} to {item.upper:g}{'' if item.scale == 'one' else f' times {_scale(item)}'}"


def _scale(item: Parameter) -> str:
    """Return the scale of a campaign in words, such as `force/stroke`."""
    return f"`{item.scale.replace('one/', '1/')}`"


if __name__ == "__main__":
    sys.stdout.write(as_markdown())
