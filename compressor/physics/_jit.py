"""The one door to numba.

``COMPSIM_JIT=0`` switches compilation off: the same source then runs as plain Python, for
coverage and for debugging (``make test-pure``). Machine code is kept on disk in a folder named by
a hash of all sources here: numba itself would go on using a caller's old code after a change of
what it calls in another file.
"""

import os
from collections.abc import Callable
from typing import Any, TypeVar

from compressor.program import discard_machine_code, machine_code_folder

Function = TypeVar("Function", bound=Callable[..., Any])

ENABLED = os.environ.get("COMPSIM_JIT", "1") != "0"
FUSED = {"contract"}  # of what numba calls fast-math, this alone


if ENABLED:
    import numba

    if not numba.config.CACHE_DIR:  # type: ignore[attr-defined]
        discard_machine_code(machine_code_folder())
        numba.config.CACHE_DIR = str(machine_code_folder())  # type: ignore[attr-defined]

    def _compiled(function: Function, **options: Any) -> Function:
        made: Any = numba.njit(cache=True, error_model="numpy", fastmath=FUSED, **options)(function)
        return made

    def jit(function: Function) -> Function:
        """Compile `function` on its first call and keep the machine code on disk.

        Arithmetic is IEEE's, in the order written, but that a product and a sum may be fused,
        rounded once; that takes a tenth off a step. A division by zero gives inf or nan, not an
        exception, so that the caller can judge a state that went wrong.
        """
        return _compiled(function)

    def inlined(function: Function) -> Function:
        """`jit`, written into each caller: for what a hot loop calls with arrays or tuples.

        Passing them took, with `borrowed` missing, about half of a step of the march.
        """
        return _compiled(function, inline="always")

    from numba.core import types
    from numba.extending import intrinsic
    from numba.np.arrayobj import make_array, populate_array

    def _borrowed(typing_context: Any, array: Any) -> Any:
        """The same array without a share in its ownership: nothing counts its references.

        Counting is atomic, and every call that takes an array counts twice.
        """
        if not isinstance(array, types.Array):
            return None

        def lower(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            source = make_array(signature.args[0])(context, builder, values[0])
            made = make_array(signature.return_type)(context, builder)
            populate_array(
                made, data=source.data, shape=source.shape, strides=source.strides,
                itemsize=source.itemsize, meminfo=None,
            )  # fmt: skip
            return made._getvalue()

        return array(array), lower

    borrowed: Any = intrinsic(_borrowed)

else:

    def borrowed(array: Any) -> Any:
        """The array itself (``COMPSIM_JIT=0``)."""
        return array

    def jit(function: Function) -> Function:
        """Leave `function` as it is (``COMPSIM_JIT=0``)."""
        return function

    inlined = jit
