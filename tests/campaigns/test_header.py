"""The head of a campaign is read without its data files."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrpipe.campaigns.header import read_header
from mrpipe.errors import UserError

pytestmark = pytest.mark.property

FRAME = """
campaign: tower
rig: shear-frame
declared_effects: [joint-friction]
channels: {}
tests:
  - {name: a, file: missing.csv, role: training, kind: sweep}
  - {name: b, file: missing.csv, role: validation, law: vd, gains: {c_n_s_m: 650}}
"""


def test_kinds_laws_and_effects(tmp_path: Path) -> None:
    (tmp_path / "campaign.yaml").write_text(FRAME, encoding="utf-8")
    header = read_header(tmp_path)
    assert (header.campaign, header.rig, header.declared_effects) == ("tower", "shear-frame", ("joint-friction",))
    assert header.kinds == {"sweep", "closed-loop"}
    assert header.laws == {1: ("vd", ("c_n_s_m",))}
    assert read_header(tmp_path / "campaign.yaml") == header


def test_a_folder_without_a_campaign(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such campaign"):
        read_header(tmp_path)
