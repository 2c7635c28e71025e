"""Steps of a chain as addresses of their machine code, for kernels that are called thousands of times.

If a kernel receives a tuple of functions, numba examines each of them at every call. This takes 2 ms and holds the
interpreter lock. An array of addresses avoids it.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from mrpipe.artifacts import IntArray
from mrpipe.dampers.plant import STEP_SIGNATURE, Chain


def addresses_of(chain: Chain) -> IntArray:
    """Return the addresses of the functions of a chain, which compiled code calls through :func:`step_at`."""
    return np.array([_address(function) for function in chain.functions], dtype=np.int64)


@cache
def _address(function: Any) -> int:
    """Return the address of the machine code of a step; the cache keeps the function and its code in memory."""
    compiled = function.get_compile_result(STEP_SIGNATURE)
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


@intrinsic
def step_at(typing_context: Any, address: Any) -> Any:
    """Return, inside compiled code, the step function at an address of :func:`addresses_of`."""
    del typing_context, address
    function = types.FunctionType(STEP_SIGNATURE)

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        del signature
        pointer = cgutils.create_struct_proxy(function)(context, builder)
        pointer.jit_addr = builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))
        return pointer._getvalue()

    return function(types.int64), code
