"""Write the campaigns of some seeds: `python -m benchmarks.rigs --to DIR 17 18 19`.

Beside each campaign directory stands its truth, `rig-SEED.truth.json`.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from benchmarks.rigs.campaign import record, write
from benchmarks.rigs.cases import case_of


def main() -> None:
    """Write what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--to", type=Path, required=True)
    options = parser.parse_args()
    for seed in options.seeds:
        campaign = record(case_of(seed))
        directory = write(campaign, options.to / f"rig-{seed}")
        truth = {**campaign.case.as_row(), "truth": campaign.truth}
        directory.with_suffix(".truth.json").write_text(json.dumps(truth, indent=1), encoding="utf-8")
        print(directory, campaign.case)


if __name__ == "__main__":
    main()
