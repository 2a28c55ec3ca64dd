"""The one door to numba.

``COMPSIM_JIT=0`` switches compilation off: the same source then runs as plain Python, for
coverage and for debugging (``make test-pure``).
"""

import os
from collections.abc import Callable
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable[..., Any])

ENABLED = os.environ.get("COMPSIM_JIT", "1") != "0"

if ENABLED:
    import numba

    def jit(function: Function) -> Function:
        """Compile `function` on its first call and keep the machine code on disk.

        IEEE arithmetic is kept (no fast-math) and a division by zero gives inf or nan, not an
        exception, so that the caller can judge a state that went wrong.
        """
        compiled: Any = numba.njit(cache=True, error_model="numpy")(function)
        return compiled

else:

    def jit(function: Function) -> Function:
        """Leave `function` as it is (``COMPSIM_JIT=0``)."""
        return function
