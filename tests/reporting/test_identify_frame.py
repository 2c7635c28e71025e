"""What the report says of the method of an identification."""

from __future__ import annotations

import pytest

from mrpipe.reporting.identify_frame import method_in_words


@pytest.mark.property
def test_an_ambient_identification_is_not_called_a_fit_of_forced_tests() -> None:
    assert "forced tests" in method_in_words(True)
    assert "forced" not in method_in_words(False) and "without the excitation" in method_in_words(False)
