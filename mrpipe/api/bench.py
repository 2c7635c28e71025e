"""Bench tests in a notebook: load, prepare, fit a damper, trace the residual."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mrpipe.api.options import settings_of, silent
from mrpipe.campaigns import Campaign
from mrpipe.campaigns import load_campaign as _load_campaign
from mrpipe.dampers.model import DamperModel
from mrpipe.errors import UserError
from mrpipe.fitting.comparison import Comparison, JudgedFit
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.verdict.summary import Tracing
from mrpipe.words import in_percent

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


def load_campaign(directory: str | Path) -> Campaign:
    """Read a measured campaign.

    Parameters
    ----------
    directory
        Folder with campaign.yaml and the files that it names.

    Raises
    ------
    UserError
        If something is wrong with the campaign; the message names the file and the key.
    """
    return _load_campaign(Path(directory))


@dataclass(frozen=True)
class PreparedTests(Sequence[PreparedTest]):
    """Tests after filtering, offset removal and differentiation; a sequence of PreparedTest.

    Attributes
    ----------
    tests
        The tests.
    campaign
        Campaign that they come from.
    findings
        Findings of the preparation.
    """

    tests: tuple[PreparedTest, ...]
    campaign: Campaign
    findings: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.tests)

    def __getitem__(self, index: Any) -> Any:
        return self.tests[index]

    def __iter__(self) -> Iterator[PreparedTest]:
        return iter(self.tests)

    def __str__(self) -> str:
        roles = [test.role for test in self.tests]
        return (
            f"{self.campaign.name}: {len(self.tests)} tests, {roles.count('training')} for training and "
            f"{roles.count('validation')} for validation"
        )

    def to_frame(self) -> pd.DataFrame:
        """Return all samples: columns test, role, time_s, displacement_m, velocity_m_s, drive, force_n."""
        import pandas as pd

        parts = [
            pd.DataFrame(
                {
                    "test": test.name,
                    "role": test.role,
                    "time_s": test.time_s,
                    "displacement_m": test.displacement_m,
                    "velocity_m_s": test.velocity_m_s,
                    "drive": test.drive,
                    "force_n": test.force_n,
                }
            )
            for test in self.tests
        ]
        return pd.concat(parts, ignore_index=True)

    def plot(self) -> Figure:
        """Return the force of the validation tests over displacement and velocity."""
        from mrpipe.reporting.style import COLOURS, figure_with_axes, label

        figure, axes = figure_with_axes(1, 2)
        shown = [test for test in self.tests if test.role == "validation"] or list(self.tests)
        for number, test in enumerate(shown[: len(COLOURS)]):
            colour = COLOURS[number]
            axes[0, 0].plot(1e3 * test.displacement_m, test.force_n, color=colour, linewidth=0.8, label=test.name)
            axes[0, 1].plot(1e3 * test.velocity_m_s, test.force_n, color=colour, linewidth=0.8)
        label(axes[0, 0], "displacement [mm]", "force [N]")
        label(axes[0, 1], "velocity [mm/s]", "force [N]")
        axes[0, 0].legend(fontsize=7)
        return figure


def prepare(campaign: Campaign | str | Path, **settings: Any) -> PreparedTests:
    """Filter, remove offsets, differentiate and find the steady cycles.

    Parameters
    ----------
    campaign
        A campaign or its folder.
    settings
        Settings of the section `prepare`.

    Raises
    ------
    UserError
        If a test cannot be prepared, for example because it is too short for the filters.
    """
    from mrpipe.config.sections.prepare import PrepareSettings
    from mrpipe.signals.preparation import prepare_campaign

    loaded = campaign if isinstance(campaign, Campaign) else load_campaign(campaign)
    prepared = prepare_campaign(loaded, settings_of(PrepareSettings, "prepare", settings), silent)
    return PreparedTests(tuple(item.test for item in prepared.tests), loaded, tuple(prepared.findings))


@dataclass(frozen=True)
class DamperFit:
    """Base forms fitted to bench tests, and the one that was chosen.

    Attributes
    ----------
    damper
        The chosen model; `damper.force(...)` computes its force for a motion.
    chosen
        Fit and errors of the chosen form.
    comparison
        All forms that were tried.
    """

    damper: DamperModel
    chosen: JudgedFit
    comparison: Comparison

    def __str__(self) -> str:
        from mrpipe.fitting.comparison import reason_of_choice

        return (
            f"{self.damper.form}: validation NRMSE {self.chosen.validation.nrmse:.4f}, "
            f"fit {in_percent(self.chosen.validation.fit_percent / 100.0, 1)}. "
            f"{reason_of_choice(self.chosen, self.comparison.judged)}"
        )

    def to_frame(self) -> pd.DataFrame:
        """Return the comparison, a row for each form."""
        import pandas as pd

        from mrpipe.fitting.summary import comparison_rows

        return pd.DataFrame(comparison_rows(self.comparison.judged))


def fit_damper(tests: PreparedTests, **settings: Any) -> DamperFit:
    """Fit the base forms of a damper and choose one.

    Parameters
    ----------
    tests
        Prepared tests.
    settings
        Settings of the section `identify_damper`, such as `form="dahl"`.

    Raises
    ------
    UserError
        If a form is not known, or no test trains.
    """
    from mrpipe.fitting.choice import compare_and_choose
    from mrpipe.fitting.settings import IdentifyDamperSettings

    chosen_settings = settings_of(IdentifyDamperSettings, "identify_damper", settings)
    _require(tests, "training")
    comparison, chosen = compare_and_choose(chosen_settings, list(tests), progress=silent)
    return DamperFit(chosen.fit.model, chosen, comparison)


def _require(tests: Sequence[PreparedTest], *roles: str) -> None:
    """Raise where no test has one of the roles."""
    for role in roles:
        if not any(test.role == role for test in tests):
            raise UserError("tests", role, f"no {role} test", f"give at least one test the role {role}")


@dataclass(frozen=True)
class Traced:
    """The verdict of a tracing.

    Attributes
    ----------
    summary
        The summary that `mrpipe close-loop --json` prints.
    damper
        The damper with the named effects.
    tracing
        Fits, recordings and forces before and after.
    """

    summary: dict[str, Any]
    damper: DamperModel
    tracing: Tracing

    @property
    def verdict(self) -> str:
        """The verdict as a sentence."""
        return str(self.summary["verdict"])

    def __str__(self) -> str:
        before, after = self.summary["before"]["nrmse"], self.summary["after"]["nrmse"]
        floor = self.summary["noise_floor_nrmse"]
        return f"{self.verdict}; validation NRMSE {before:.4f} before, {after:.4f} after, noise floor {floor:.4f}"

    def to_frame(self) -> pd.DataFrame:
        """Return the candidates with their errors, best first."""
        import pandas as pd

        return pd.DataFrame(self.summary["candidates"])

    def plot(self) -> Figure:
        """Return the measured force, the model before and the model after, over displacement, for one test."""
        from mrpipe.reporting.style import COLOURS, MEASURED, figure_with_axes, label

        validation = self.tracing.validation
        end = int(validation.starts[1]) if len(validation.starts) > 1 else len(validation.displacement)
        x = 1e3 * np.asarray(validation.displacement[:end])
        figure, axes = figure_with_axes(1, 1, width=5.0, height=3.6)
        for values, colour, name in (
            (self.tracing.measured, MEASURED, "measured"),
            (self.tracing.before, COLOURS[4], "before"),
            (self.tracing.after, COLOURS[0], "after"),
        ):
            axes[0, 0].plot(x, np.asarray(values)[:end], color=colour, linewidth=0.9, label=name)
        label(axes[0, 0], "displacement [mm]", "force [N]", validation.names[0])
        axes[0, 0].legend(fontsize=7)
        return figure


def trace(tests: PreparedTests, *, seed: int = 2011, jobs: int = 1, **settings: Any) -> Traced:
    """Trace the residual of the damper model to the physical effect that it lacks.

    Parameters
    ----------
    tests
        Prepared tests with at least one validation test.
    seed
        Seed of the resampling.
    jobs
        Processes.
    settings
        Settings of the section `close_loop`.

    Raises
    ------
    UserError
        If no test trains, or none validates, or if the campaign declares an unknown effect.
    """
    from mrpipe.config.sections.close_loop import CloseLoopSettings
    from mrpipe.effects.declared import declared_effects
    from mrpipe.effects.library import damper_effects, effects_named, load_effect_file
    from mrpipe.tracing.bench.trace import trace_campaign
    from mrpipe.tracing.loop.augmented import traced_damper
    from mrpipe.tracing.options import tracing_options

    chosen = settings_of(CloseLoopSettings, "close_loop", settings)
    _require(tests, "training", "validation")
    library = effects_named(chosen.candidates, chosen.effect_files)
    campaign = tests.campaign
    traced = trace_campaign(
        list(tests),
        library,
        declared_effects(campaign.declared_effects, {**damper_effects(), **library}, campaign.file),
        tracing_options(chosen),
        rng=np.random.default_rng(seed),
        jobs=jobs,
        progress=silent,
    )
    files = {load_effect_file(path).name: str(path) for path in chosen.effect_files}
    damper = traced_damper(traced.selection.chosen, traced.drive_unit, effect_files=files)
    return Traced({"campaign": tests.campaign.name, **traced.summary}, damper, traced)
