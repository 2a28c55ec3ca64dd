"""The one door to numba: four ways to compile a function, and a choice by the kind of record.

``COMPSIM_JIT=0`` switches compilation off: the same source then runs as plain Python, for
coverage and for debugging (``make test-pure``). Machine code is kept on disk in a folder named by
a hash of all sources here: numba itself would go on using a caller's old code after a change of
what it calls in another file.
"""

import functools
import gc
import math
import os
import shutil
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from compressor.program import machine_code_folder

Function = TypeVar("Function", bound=Callable[..., Any])

COLLECTING = (200_000, 50, 50)  # gc's thresholds while numba compiles

ENABLED = os.environ.get("COMPSIM_JIT", "1") != "0"
TARGET_LOCK = threading.RLock()  # or two threads would each make a function, of two types to numba


def discard_other_code(folder: Path) -> None:
    """Remove the machine code of other sources, before that of the present ones is first made."""
    if not folder.exists():
        for old in folder.parent.glob("numba-*"):
            if old.name.split("-")[1] != folder.name.split("-")[1]:
                shutil.rmtree(old, ignore_errors=True)


class Deferred:
    """Something of numba's, made when first needed: to import that takes a third of a second."""

    def __init__(self, make: Callable[[], Any], function: Any):
        functools.update_wrapper(self, function)
        self.make = make

    @functools.cached_property
    def target(self) -> Any:
        """Return what numba makes of the function."""
        with TARGET_LOCK:
            load_numba()
            if "target" not in vars(self):  # held before another thread may look
                vars(self)["target"] = self.make()
            return vars(self)["target"]

    def __call__(self, *arguments: Any) -> Any:
        return self.target(*arguments)

    def __getattr__(self, name: str) -> Any:  # what numba reads of a function that another calls
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.target, name)


class Inlined(Deferred):
    """A Deferred that Python calls as it is written: only its callers are compiled."""

    def __call__(self, *arguments: Any) -> Any:
        return vars(self)["__wrapped__"](*arguments)


@functools.cache
def load_numba() -> None:
    """Set up numba: folder of machine code, type of `Deferred`."""
    import numba
    from numba.core import event
    from numba.core.registry import cpu_target
    from numba.extending import typeof_impl

    folder = machine_code_folder()
    discard_other_code(folder)
    numba.config.CACHE_DIR = str(folder)  # type: ignore[attr-defined]

    @typeof_impl.register(Deferred)
    def type_of(value: Deferred, _: object) -> Any:
        return cpu_target.typing_context.resolve_value_type(value.target)

    event.register("numba:compile", collect_seldom())
    # to be known before anything is compiled
    vars(without_refcount)["target"] = _without_refcount()


def collect_seldom() -> Any:
    """Return a listener that looks for garbage seldom during a compile: a tenth of its time."""
    from numba.core import event

    class Seldom(event.Listener):
        depth, before = 0, gc.get_threshold()

        def on_start(self, _: object) -> None:
            if not self.depth:
                self.before = gc.get_threshold()
                gc.set_threshold(*COLLECTING)
            self.depth += 1

        def on_end(self, _: object) -> None:
            self.depth -= 1
            if not self.depth:
                gc.set_threshold(*self.before)

    return Seldom()


def jit(function: Function, made: type[Deferred] = Deferred, **options: Any) -> Function:
    """Compile `function` on its first call and keep the machine code on disk.

    Arithmetic is IEEE's, in the order written, as it is with ``COMPSIM_JIT=0``: a product and a sum
    that were rounded once would save a twentieth of a run, but which ones are depends on what else
    was compiled before, so that workers found other last bits. A division by zero gives inf or nan,
    not an exception, so that the caller can judge a state that went wrong.
    """
    # wrappers for who does not call it would only take time to compile: for C, and some for Python
    how: Any = {
        "cache": True, "error_model": "numpy", "no_cfunc_wrapper": True,
        "no_cpython_wrapper": made is Inlined,
        # said, or what an `inline_llvm` calls were inlined, too, if it is compiled for it first
        "forceinline": False, **options,
    }  # fmt: skip

    def make() -> Any:
        import numba

        return numba.njit(**how)(function)

    deferred: Any = made(make, function)
    deferred.options = how
    return deferred if ENABLED else function


# for compiled callers alone, without the wrapper by which Python calls: it calls them as written
inner = functools.partial(jit, made=Inlined)
# the same, written by LLVM into each caller, whatever its size: that compiles in a small part of
# the time that numba's own inlining takes
inline_llvm = functools.partial(jit, made=Inlined, forceinline=True)
# the same, written by numba into its caller: for what one function calls, or a few lines. It has no
# machine code of its own, which is a third of what compiling it costs, and is not optimized again
# in each function above; where a caller gets long by it, numba's passes cost more than it saves
inline_once = functools.partial(jit, made=Inlined, inline="always")


def dispatch_on_record(field: str, special: Function, usual: Function) -> Function:
    """Return a function that is `special` for records that have a field, `usual` for all others.

    Types settle it when a caller is compiled: the other is not compiled with it.
    """

    def choose(*arguments: Any) -> Any:
        return (special if any(hasattr(one, field) for one in arguments) else usual)(*arguments)

    def make() -> Any:
        from numba.core.registry import cpu_target
        from numba.extending import overload

        for deferred, of_special in ((special, True), (usual, False)):
            # the very options: its machine code on disk serves direct callers, too
            options = vars(deferred)["options"]
            overload(choose, options)(
                implementation_for(field, of_special, vars(deferred)["__wrapped__"])
            )
        cpu_target.typing_context.refresh()
        return choose

    chosen: Any = Inlined(make, choose)
    return chosen if ENABLED else choose  # type: ignore[return-value]


def implementation_for(field: str, wanted: bool, function: Any) -> Any:
    """Return what numba asks: the function if a record has the field as wanted."""
    from numba import types

    @functools.wraps(function)  # numba compares parameters
    def implementation(*arguments: Any) -> Any:
        fields = [one.fields for one in arguments if isinstance(one, types.Record)]
        return function if any(field in names for names in fields) == wanted else None

    return implementation


def _without_refcount() -> Any:
    """Return numba's intrinsic of `without_refcount`."""
    from numba.core import types
    from numba.extending import intrinsic
    from numba.np.arrayobj import make_array, populate_array

    def borrowed(typing_context: Any, array: Any) -> Any:
        if not isinstance(array, types.Array):
            return None

        def lower(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            source = make_array(signature.args[0])(context, builder, values[0])
            view = make_array(signature.return_type)(context, builder)
            populate_array(
                view, data=source.data, shape=source.shape, strides=source.strides,
                itemsize=source.itemsize, meminfo=None,
            )  # fmt: skip
            return view._getvalue()

        return array(array), lower

    return intrinsic(borrowed)


@inline_llvm
def square_root(a: float) -> float:
    """Return the square root; nan below 0: a step that tries an impossible position is refused."""
    return math.sqrt(a) if a >= 0.0 else math.nan


def without_refcount(array: Any) -> Any:
    """Return the same array without a share in its ownership: nothing counts its references.

    Counting is atomic, at each call that takes an array: a march took 2.6 times as long.
    """
    return array


if ENABLED:
    without_refcount = Inlined(_without_refcount, without_refcount)  # type: ignore[assignment]
