"""The table of figures: what each is called, what it needs, and the function that makes it.

A figure is one function under one line: it returns what is drawn, a sentence on what is shown, and
labelled numbers of it. Those of a sweep, which its axes choose, are in `sweep`.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from compressor.report.figures.drawing import INCH
from compressor.report.figures.pictures import DPI
from compressor.units import Units, unit_in

Kind = Literal["paper", "job", "study"]
NOTHING = 1e-6  # in any of the usual units: below it a number is rounding
Number = tuple[str, str]  # a label, and what is measured, with its unit


class DrawnFigure(NamedTuple):
    """A figure: what is drawn, a sentence on what is shown, and labelled numbers of it.

    note: sentences after the numbers, on the jobs that are drawn; name: of its files.
    """

    figure: go.Figure
    sentence: str
    numbers: Sequence[Number] = ()
    note: str = ""
    name: str = ""
    title: str = ""

    @property
    def caption(self) -> str:
        """Return the sentence, the numbers and the note."""
        text = "; ".join(f"{label}: {value}" for label, value in self.numbers)
        numbers = f" {text[0].upper()}{text[1:]}." if text else ""
        return self.sentence + numbers + self.note

    @property
    def size(self) -> tuple[int, int]:
        """Return width and height of the PNG in pixels."""
        layout = self.figure.layout
        return int(layout.width * DPI / INCH), int(layout.height * DPI / INCH)

    @property
    def jobs(self) -> Iterator[str]:
        """Return the keys of the jobs that its points are, which a click opens."""
        for trace in self.figure.data:
            yield from [] if trace.customdata is None else np.ravel(trace.customdata).tolist()


@dataclass(frozen=True)
class Figure:
    """A line of the table; `name`: of its files.

    `make` takes runs by the labels in `needs`, of the paper's cases; a job's run and the same
    machine without clearance, where `needs` has `clearance` or `gas` if the job has these; or the
    rows of a study and the name of its axis.
    """

    name: str
    title: str
    needs: tuple[str, ...]
    make: Callable[..., DrawnFigure]


FIGURES: dict[Kind, dict[str, Figure]] = {"paper": {}, "job": {}, "study": {}}


def figure(
    kind: Kind, name: str, title: str, *needs: str, **options: Any
) -> Callable[[Callable[..., DrawnFigure]], Callable[..., DrawnFigure]]:
    """Return a decorator that enters a function into the table; options: given to it."""

    def enter(make: Callable[..., DrawnFigure]) -> Callable[..., DrawnFigure]:
        def draw(*given: Any, **more: Any) -> DrawnFigure:
            return make(*given, **options, **more)._replace(name=name, title=title)

        FIGURES[kind][name] = Figure(name, title, needs, draw)
        return make

    return enter


def spell(values: ArrayLike, unit: str = "", units: Units = "usual") -> str:
    """Return numbers to four digits, one after the other, with their unit; rounding is 0.

    unit: of the values; units: that they are read in.
    """
    known = np.atleast_1d(np.asarray(values, float))
    unit, factor = unit_in(unit, units)
    known = np.where(abs(known) < NOTHING, 0.0, factor * known)
    return f"{', '.join(f'{float(text):g}' for text in np.char.mod('%.4g', known))} {unit}".rstrip()


def spell_span(values: np.ndarray, unit: str, units: Units) -> str:
    """Return the least and the greatest of some values, with their unit, as `spell`."""
    low, high = (spell(end, unit, units) for end in (values.min(), values.max()))
    return f"{low.partition(' ')[0]} to {high}"
