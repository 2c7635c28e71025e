"""`mrpipe check-effect FILE`: checks an effect file against the rules for all effects."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mrpipe.cli.options import CommonOptions, with_common_options
from mrpipe.errors import CheckFailed
from mrpipe.words import shell_word


@with_common_options("config", "run", "overrides", "settings", "campaign", "jobs", "seed", "force")
def check_effect(
    options: CommonOptions,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Python file that defines EFFECT.")],
) -> None:
    """Check your own effect file against the rules for all effects."""
    from mrpipe.cli.output import print_json
    from mrpipe.effects.contract import Effect
    from mrpipe.effects.file_checks import check_file

    effect, checks = check_file(file)
    rig = "damper" if isinstance(effect, Effect) else "structure"
    failed = [item for item in checks if not item.passed]
    if options.json:
        demands = [
            {"form": item.form, "demand": item.demand, "passed": item.passed, "failure": item.failure}
            for item in checks
        ]
        print_json(
            {
                "file": str(file),
                "effect": effect.name,
                "rig": rig,
                "acts_on": effect.acts_on,
                "source": effect.source,
                "forms": [form.name for form in effect.forms],
                "passed": not failed,
                "demands": demands,
            }
        )
    else:
        print(f"{file}: effect {effect.name!r} of a {rig}, acts on {effect.acts_on}; source: {effect.source}")
        for item in checks:
            place = f"{item.form}: " if item.form else ""
            if options.quiet and item.passed:
                continue
            print(f"  {'ok    ' if item.passed else 'FAILED'}  {place}{item.demand}")
            if item.failure:
                print(f"          {item.failure}")
    if failed:
        raise CheckFailed(f"{file}: {len(failed)} of {len(checks)} demands are not met")
    if not options.json and not options.quiet:
        print(f"all {len(checks)} demands are met")
        print(f"next: mrpipe close-loop --campaign DIR --set {shell_word(f'close_loop.effect_files=[{file}]')}")


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command(name="check-effect")(check_effect)
