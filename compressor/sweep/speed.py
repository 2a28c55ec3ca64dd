"""How fast this machine is now, by known small pieces of work: times that are told rest on it."""

import threading
import time
import zlib
from collections.abc import Callable
from functools import cache

from compressor.sweep.execution import cores

REFERENCE = (
    "AMD EPYC of a cloud, Python 3.11, 2026, idle"  # the machine of the table of compile seconds
)
REFERENCE_SECONDS = 0.17  # that `count_words` takes there
SAMPLE_SECONDS = 0.5  # s for which threads work
TEXT = bytes(range(256)) * 64


def count_words() -> None:
    """Do a known piece of Python's work, as compiling does: words made and counted."""
    counts: dict[str, int] = {}
    for number in range(1_000_000):
        word = f"v{number % 1000}"
        counts[word] = counts.get(word, 0) + len(word)


def compress() -> None:
    """Do a known piece of work, a millisecond or so, that threads can do at once."""
    zlib.compress(TEXT * 8)


@cache
def slowness(
    piece: Callable[[], None] = count_words, clock: Callable[[], float] = time.perf_counter
) -> float:
    """Return how many times as long Python's work takes here and now as on `REFERENCE`.

    By wall time, so that other load counts. Measured once in a process.
    """
    began = clock()
    piece()
    return (clock() - began) / REFERENCE_SECONDS


def cores_at_work(
    workers: int,
    piece: Callable[[], None] = compress,
    clock: Callable[[], float] = time.perf_counter,
    own_clock: Callable[[], float] = time.thread_time,
) -> float:
    """Return how many idle cores so many workers are worth here and now.

    Fewer than they are where there are fewer cores, where others work on them, or where two share
    the hardware of one: what threads do in some time, over what one alone does in processor time.
    """

    def spent() -> float:
        began = own_clock()
        piece()
        return own_clock() - began

    alone = min(spent() for _ in range(3))
    done: list[int] = []
    began = clock()

    def work() -> None:
        while clock() - began < SAMPLE_SECONDS:
            piece()
            done.append(1)

    threads = [threading.Thread(target=work) for _ in range(min(workers, 4 * cores()))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return len(done) * alone / (clock() - began)
