"""What `compsim plot` is asked for, what it refuses, and how drawings become files."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from compressor.program import CompsimError
from compressor.report.figures import Drawing
from compressor.report.figures.style import render
from compressor.report.study_section import file_name
from compressor.store import Folder, publish


class PlotError(CompsimError):
    """What cannot be drawn: why, and what to do about it."""

    exit_code = 2


@dataclass(frozen=True)
class PlotChoice:
    """What to draw: names of figures, all by default; of a study the axis and the other values.

    over: the axis by its key or the end of it; at: `key=value` of other axes, else their first.
    """

    what: tuple[str, ...] = ()
    over: str = ""
    at: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ("png",)


@dataclass(frozen=True)
class Plotted:
    """A figure that was written, one file a kind."""

    paths: tuple[Path, ...]
    caption: str


def chosen(what: Sequence[str], known: Sequence[str], thing: str) -> tuple[str, ...]:
    """Return the figures that are wanted; PlotError where one is none of this thing."""
    wrong = [name for name in what if name not in known]
    if wrong:
        raise PlotError(f"{thing} has no figure {wrong[0]!r}: it has {', '.join(known)}")
    return tuple(what) or tuple(known)


def published(
    drawn: Iterable[tuple[str, str, Drawing]], output: Folder, stem: str, kinds: Sequence[str]
) -> Iterator[Plotted]:
    """Write drawings with their names and captions as files; yields each. Raises StoreError."""
    for name, caption, drawing in drawn:
        paths = []
        for kind in kinds:
            path = Path(output) / f"{file_name(stem, name)}.{kind}"
            publish(path, render(drawing, kind))
            paths.append(path)
        yield Plotted(tuple(paths), caption)
