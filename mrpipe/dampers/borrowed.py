"""Arrays that compiled code reads and writes without reference counting.

numba counts the references to every slice that a kernel passes to a step. Each count is an atomic operation, and four
of them per step take longer than most steps.
"""

from __future__ import annotations

from typing import Any

from numba.core import cgutils, types
from numba.core.errors import TypingError
from numba.extending import intrinsic


@intrinsic
def borrowed(typing_context: Any, array: Any) -> Any:
    """Return, inside compiled code, the same array without reference count; its slices are not counted either.

    The caller must keep a reference to the array itself while the returned one is in use.
    """
    del typing_context
    if not isinstance(array, types.Array):
        raise TypingError(f"borrowed() takes an array, not {array}")

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        make = context.make_array(signature.return_type)
        found = make(context, builder, value=arguments[0])
        found.meminfo = cgutils.get_null_value(found.meminfo.type)
        found.parent = cgutils.get_null_value(found.parent.type)
        return found._getvalue()

    return array(array), code
