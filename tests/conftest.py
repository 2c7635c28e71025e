"""What all tests share."""

from __future__ import annotations

from pathlib import Path

import hypothesis
import pytest

from mrpipe.artifacts import public_data_directory
from mrpipe.reporting import style

# The suite asks the same questions on every machine, however slow: a change is judged by what it changed. New examples
# are looked for with `pytest --hypothesis-profile explore`.
hypothesis.settings.register_profile("suite", derandomize=True, deadline=None)
hypothesis.settings.register_profile("explore", max_examples=1000, deadline=None)
hypothesis.settings.load_profile("suite")


EVIDENCE = {"property", "golden", "literature", "oracle", "planted", "real"}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Refuse tests without a marker that says what kind of evidence they give."""
    bare = [item.nodeid for item in items if not EVIDENCE & {marker.name for marker in item.iter_markers()}]
    if bare:
        raise pytest.UsageError(f"mark with one of {', '.join(sorted(EVIDENCE))}: {', '.join(bare[:20])}")


@pytest.fixture(scope="session", autouse=True)
def simple_figures() -> None:
    """Draw figures without keeping their texts apart, which takes half of the time: nobody looks at them here."""
    style.LAYOUT = None


@pytest.fixture(scope="session")
def public_data() -> Path:
    """Folder of the public measurements; the test is skipped where it is missing."""
    directory = public_data_directory()
    if directory is None:
        pytest.skip("the public measurements are not here: set MRPIPE_DATA to their folder")
    return directory
