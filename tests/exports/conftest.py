"""Structure and damper of the tests of controllers."""

from tests.control.conftest import floor_one, set_c, thesis_frame

__all__ = ["floor_one", "set_c", "thesis_frame"]
