"""What all tests share."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrpipe.artifacts import public_data_directory


@pytest.fixture(scope="session")
def public_data() -> Path:
    """Folder of the public measurements; the test is skipped where it is missing."""
    directory = public_data_directory()
    if directory is None:
        pytest.skip("the public measurements are not here: set MRPIPE_DATA to their folder")
    return directory
