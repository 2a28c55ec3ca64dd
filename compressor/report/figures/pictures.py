"""The pictures of finished figures, made by two processes where there are cores for them."""

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor

from matplotlib.figure import Figure

from compressor.report.figures.style import render

KINDS = ("png", "svg")
MIN_FIGURES_FOR_TWO = 3  # figures for which a second process is worth its start

_inherited: dict[str, Figure] = {}  # what a process finds that was forked while they stood here


def pictures(figures: Mapping[str, Figure], headings: Mapping[str, str]) -> dict[str, bytes]:
    """Return PNG and SVG of each figure by the names of their files; tells on stderr what is drawn.

    A forked process takes figures from the first on, this one from the last on until they meet: a
    figure need not be sent then, which matplotlib's formatters often forbid. Where threads run,
    whose locks a fork may copy, or the system has no fork, all is done here.
    """
    alone = len(figures) < MIN_FIGURES_FOR_TWO or threading.active_count() > 1 or not can_fork()
    made = one_by_one(figures, headings) if alone else by_two(figures, headings)
    return {
        f"{name}.{kind}": picture
        for name in figures
        for kind, picture in zip(KINDS, made[name], strict=True)
    }


def can_fork() -> bool:
    """Return whether the system can copy a process, and has a core for the copy."""
    affinity = getattr(os, "sched_getaffinity", None)
    cores = len(affinity(0)) if affinity else os.cpu_count() or 1
    return cores > 1 and "fork" in multiprocessing.get_all_start_methods()


def both(figure: Figure) -> tuple[bytes, ...]:
    """Return a figure as PNG and as SVG."""
    return tuple(render(figure, kind) for kind in KINDS)


def one_by_one(
    figures: Mapping[str, Figure], headings: Mapping[str, str]
) -> dict[str, tuple[bytes, ...]]:
    """Return all figures in this process."""
    made = {}
    for name, figure in figures.items():
        report_figure(headings[name])
        made[name] = both(figure)
    return made


def by_two(
    figures: Mapping[str, Figure], headings: Mapping[str, str]
) -> dict[str, tuple[bytes, ...]]:
    """Return all figures in this process and a copy of it."""
    made, sent, waiting = {}, {}, deque(figures)
    _inherited.update(figures)
    context = multiprocessing.get_context("fork")
    pool = ProcessPoolExecutor(1, context, signal.signal, (signal.SIGINT, signal.SIG_DFL))

    def send(_: object = None) -> None:
        """Give the copy the next figure, when it has made one."""
        with contextlib.suppress(IndexError, RuntimeError):  # there is none; it has died
            name = waiting.popleft()
            sent[name] = pool.submit(draw_inherited, name, headings[name])
            sent[name].add_done_callback(send)

    try:
        send()
        while waiting:
            with contextlib.suppress(IndexError):
                name = waiting.pop()
                report_figure(headings[name])
                made[name] = both(figures[name])
        for name in figures.keys() - made.keys():
            with contextlib.suppress(KeyError, OSError, RuntimeError):  # it has died
                made[name] = sent[name].result()
    finally:
        _inherited.clear()
        pool.shutdown(cancel_futures=True)
    lost = {name: figure for name, figure in figures.items() if name not in made}
    return made | one_by_one(lost, headings)


def draw_inherited(name: str, heading: str) -> tuple[bytes, ...]:
    """Return the pictures of a figure, in the copied process."""
    report_figure(heading)
    return both(_inherited[name])


def report_figure(heading: str) -> None:
    """Say what is being drawn, in one write: two processes share the stream."""
    with contextlib.suppress(OSError):
        sys.stderr.write(f"drawing {heading}\n")
        sys.stderr.flush()
