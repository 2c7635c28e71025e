"""Log messages of other packages."""

from __future__ import annotations

import logging

import pytest

from mrpipe.log_levels import errors_only

pytestmark = pytest.mark.property


def test_the_levels_of_a_package_are_as_before_also_after_an_error() -> None:
    whole, module, other = (logging.getLogger(name) for name in ("a-package", "a-package.module", "a-package-2"))
    whole.setLevel(logging.DEBUG)
    module.setLevel(logging.INFO)  # npTDMS gives each of its modules a level
    other.setLevel(logging.INFO)
    with pytest.raises(ValueError, match="unreadable"), errors_only("a-package"):
        for logger in (whole, module):
            assert not logger.isEnabledFor(logging.WARNING) and logger.isEnabledFor(logging.ERROR)
        assert other.isEnabledFor(logging.INFO)
        raise ValueError("unreadable")
    assert [whole.level, module.level, other.level] == [logging.DEBUG, logging.INFO, logging.INFO]
