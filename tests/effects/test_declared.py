"""Effects that a campaign declares are known, or the error names the line."""

from pathlib import Path

import pytest

from mrpipe.effects.declared import declared_effects
from mrpipe.effects.library import damper_effects
from mrpipe.errors import UserError


@pytest.mark.golden
def test_declared_effects_are_those_of_the_library_and_an_unknown_one_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "campaign.yaml"
    file.write_text("campaign: a\ndeclared_effects:\n  - heating\n  - backlsh\n", encoding="utf-8")
    known = damper_effects()
    assert declared_effects(["heating", "backlash"], known, file) == [known["heating"], known["backlash"]]
    with pytest.raises(UserError) as caught:
        declared_effects(["heating", "backlsh"], known, file)
    said = str(caught.value)
    assert said.startswith(f"{file}: line 4, declared_effects[1]: unknown effect 'backlsh'")
    assert "did you mean backlash?" in said


@pytest.mark.golden
def test_a_base_form_among_the_declared_effects_is_named_as_such(tmp_path: Path) -> None:
    file = tmp_path / "campaign.yaml"
    file.write_text("campaign: a\ndeclared_effects: [rate-dependent-yield]\n", encoding="utf-8")
    with pytest.raises(UserError, match="is a base form of the damper and no effect; leave it out here"):
        declared_effects(["rate-dependent-yield"], damper_effects(), file)
