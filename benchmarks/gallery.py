"""Gallery of the public dampers: `collect RUN..` keeps figures of runs in docs/gallery, `page` prints docs/gallery.md.

    for name in utfsm labcontrol dyke; do mrpipe close-loop --config $name; done
    python -m benchmarks.gallery collect runs/utfsm runs/labcontrol runs/dyke
    python -m benchmarks.gallery page > docs/gallery.md

The measurements themselves are not part of the repository: docs/gallery keeps results, docs/images drawings of loops.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

DOCS = Path(__file__).resolve().parents[1] / "docs"
POINTS = 400
"""Most points of a drawn loop."""

DAMPERS = {
    "utfsm": (
        "Damper in a press, 30 sine tests at five currents",
        "DanielMaurelE/vRTHS_AMBC_MRdamper on GitHub, MIT licence",
    ),
    "labcontrol": (
        "Damper on a shaker, sines near 1 Hz at constant voltages",
        "labcontrol-data/mr-damper on GitHub, doi 10.5281/zenodo.4445334, MIT licence",
    ),
    "dyke": (
        "Prototype damper, random motion and random voltage",
        "NEES-2012-1158, doi 10.4231/D3V11VM6X, as converted on GitHub by Abhay3757, MIT licence",
    ),
}
_HEAD = """\
# Gallery of public dampers

Three public data sets ([where they are published](public-data.md)). Each model is judged on validation tests that no
fit has seen. NRMSE is the RMS error over the RMS of the measured force. The declared form is the Bouc-Wen model. The
traced model has the base form and the effects that `close-loop` takes.

This page is written by `python -m benchmarks.gallery page > docs/gallery.md` from the results in `docs/gallery`. The
confidence is a calibrated probability that the effect is really there.
"""


def collect(run: Path, docs: Path = DOCS) -> None:
    """Keep the results of a run of `mrpipe close-loop`, and draw the loops of its validation test of middling error."""
    from mrpipe import __version__

    name = run.name
    found = json.loads((run / "close-loop.json").read_text(encoding="utf-8"))
    tests = sorted(found["tests"], key=lambda test: test["nrmse_after"])
    shown = tests[len(tests) // 2]["name"]
    kept = {
        "name": name,
        "mrpipe_version": __version__,
        "form": found["base_form"]["taken"],
        "verdict_class": found["verdict_class"],
        "verdict": found["verdict"],
        "noise_floor_nrmse": found["noise_floor_nrmse"],
        "noise_from": found["noise_from"],
        "before_nrmse": found["before"]["nrmse"],
        "after_nrmse": found["after"]["nrmse"],
        "ceiling_nrmse": found["ceiling"]["nrmse"],
        "effects": [
            {"name": item["name"], "form": item["form"], "confidence": round(item["confidence"], 2)}
            for item in found["effects"]
        ],
        "depends_on": found["unexplained"]["depends_on"][:3],
        "tests": len(tests),
        "shown": shown,
    }
    (docs / "gallery").mkdir(exist_ok=True)
    (docs / "gallery" / f"{name}.json").write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    _draw(run, shown).savefig(docs / "images" / f"gallery-{name}.png", dpi=110)


def _draw(run: Path, shown: str) -> Any:
    """Return the loops of one test: measured, before and after, over displacement and velocity."""
    from mrpipe.artifacts import Artifact
    from mrpipe.reporting.style import AFTER, MEASURED, MODEL, figure_with_axes, label

    artifact = Artifact(run / "close-loop.h5")
    place = artifact.json("validation/names").index(shown)
    starts = artifact.array("validation/starts").astype(int)
    piece = slice(starts[place], starts[place + 1])
    channels = {
        key: artifact.array(f"validation/{key}")[piece]
        for key in ("displacement", "velocity", "measured", "before", "after")
    }
    rows = _cycles(channels["displacement"])
    figure, axes = figure_with_axes(1, 2)
    for column, key in enumerate(("displacement", "velocity")):
        axis, text = axes[0, column], ("displacement [mm]", "velocity [mm/s]")[column]
        for name, colour in (("measured", MEASURED), ("before", MODEL), ("after", AFTER)):
            axis.plot(1e3 * channels[key][rows], channels[name][rows], color=colour, linewidth=0.9, label=name)
        label(axis, text, "force [N]")
    axes[0, 0].legend(fontsize=7)
    return figure


def _cycles(displacement: Any) -> Any:
    """Return the rows of two cycles in the middle of a test, at most :data:`POINTS`."""
    centred = displacement - np.mean(displacement)
    ups = np.flatnonzero((centred[:-1] <= 0.0) & (centred[1:] > 0.0))
    middle = len(ups) // 2
    first, last = (ups[middle - 1], ups[middle + 1]) if 0 < middle < len(ups) - 1 else (0, len(displacement))
    return np.arange(first, last, max(1, (last - first) // POINTS))


def page(docs: Path = DOCS) -> str:
    """Return docs/gallery.md from the results in docs/gallery."""
    kept = {name: json.loads((docs / "gallery" / f"{name}.json").read_text(encoding="utf-8")) for name in DAMPERS}
    lines = [_HEAD, "\n| damper | declared form | traced model | noise floor | verdict |\n"]
    lines.append("| --- | --- | --- | --- | --- |\n")
    for name, item in kept.items():
        lines.append(
            f"| [{name}](#{name}) | {item['before_nrmse']:.3f} | {item['after_nrmse']:.3f} | "
            f"{item['noise_floor_nrmse']:.3f} | {item['verdict_class']} |\n"
        )
    lines += [_section(name, item) for name, item in kept.items()]
    return "".join(lines)


def _section(name: str, item: dict[str, Any]) -> str:
    title, source = DAMPERS[name]
    effects = ", ".join(f"{x['name']} ({x['form']}, confidence {x['confidence']:.2f})" for x in item["effects"])
    rest = ", ".join(str(x["state"]) for x in item["depends_on"])
    place = "the only one" if item["tests"] == 1 else f"the one of middling error among {item['tests']}"
    scatter = " The flexible model is below it: repeated cycles differ by more than noise."
    floor = scatter if item["ceiling_nrmse"] < item["noise_floor_nrmse"] else ""
    ending = f" What remains depends on {rest}." if rest else ""
    return f"""
## {name}

{title}. Source: {source}.

![Measured force of {name}, and the model before and after the tracing](images/gallery-{name}.png)

*Validation test `{item["shown"]}`, {place}. Two cycles, or the whole test
where it is not periodic.*

- Verdict: {item["verdict"]}.
- Base form taken: {item["form"]}. Named effects: {effects or "none"}.
- NRMSE {item["before_nrmse"]:.3f} before and {item["after_nrmse"]:.3f} after. A flexible residual model reaches
  {item["ceiling_nrmse"]:.3f} on the same tests.{ending}
- Noise floor: {item["noise_floor_nrmse"]:.3f}, estimated from {item["noise_from"]}.{floor}
"""


def main(arguments: list[str]) -> int:
    """Run a command of this module."""
    if arguments[:1] == ["page"]:
        sys.stdout.write(page())
        return 0
    if arguments[:1] == ["collect"] and len(arguments) > 1:
        for name in arguments[1:]:
            collect(Path(name))
        return 0
    print(__doc__, file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
