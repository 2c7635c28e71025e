"""All base forms: those of the modules of `dampers/forms`, and those of files that the configuration names."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import mrpipe.dampers.forms as package
from mrpipe.artifacts.yaml_source import nearest
from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.forms import DEFAULT_FORM
from mrpipe.dampers.user_file import module_of_file
from mrpipe.errors import UserError

LOADS_FROM = ("mrpipe.dampers.forms",)
"""Packages whose modules are found at run time; they are part of the code version of a stage."""


@cache
def base_forms() -> dict[str, BaseForm]:
    """Return name -> base form of every module of `dampers/forms` that defines FORM, simple forms first."""
    modules = (
        importlib.import_module(f"{package.__name__}.{item.name}") for item in pkgutil.iter_modules(package.__path__)
    )
    found = [form for form in (getattr(module, "FORM", None) for module in modules) if isinstance(form, BaseForm)]
    found.sort(key=lambda form: (form.name != DEFAULT_FORM, len(form.searched), form.name))
    return {form.name: form for form in found}


def form_of_file(path: Path | str) -> BaseForm:
    """Load the FORM of a file of a user.

    Raises
    ------
    UserError
        If the file is missing, cannot be run, or defines no FORM.
    """
    path = Path(path)
    remedy = "name a Python file that defines FORM = BaseForm(...) as mrpipe/dampers/forms/*.py do"
    form = getattr(module_of_file(path, "identify_damper.form_files", remedy), "FORM", None)
    if not isinstance(form, BaseForm):
        raise UserError(path, "FORM", "is missing", remedy)
    return replace(form, file=str(path))


def forms_named(
    names: Sequence[str], files: Sequence[Path | str] = (), setting: str = "identify_damper.form"
) -> dict[str, BaseForm]:
    """Return the forms of these names (all if none is given), and those of the user's files.

    Parameters
    ----------
    names
        Names of forms.
    files
        Files of the user.
    setting
        Setting that gives the names, for messages.

    Raises
    ------
    UserError
        If a name is not known, or the form of a file has the name of another form.
    """
    library = base_forms()
    own: dict[str, BaseForm] = {}
    for form in map(form_of_file, files):
        # the form of the file would otherwise take the place of the other one without a message
        if form.name in library or form.name in own:
            other = own[form.name].file if form.name in own else "the program"
            problem = f"{form.name!r} is already the name of a base form of {other}"
            raise UserError(form.file, "FORM, name", problem, "give this form another name")
        own[form.name] = form
    known = {**library, **own}
    for name in names:
        if name not in known:
            raise UserError(setting, "", f"no base form {name!r}", nearest(name, known))
    return {**{name: known[name] for name in names or library}, **own}


def base_form(name: str, file: str = "") -> BaseForm:
    """Return one base form; `file` is the user's file that defines it, if any.

    Raises
    ------
    UserError
        If the name is not known.
    """
    if file:
        return form_of_file(file)
    return forms_named([name])[name]
