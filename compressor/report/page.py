"""The report as an HTML page with its figures beside it.

Python gives sections of plain data; the files in `templates` make markup of them, and escape every
text that they print.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING, Any, NamedTuple

from jinja2 import ChoiceLoader, Environment, FunctionLoader, PackageLoader, StrictUndefined
from markupsafe import Markup

if TYPE_CHECKING:
    from compressor.report.figures import Drawing


@dataclass(frozen=True)
class Section:
    """A part of the page: `template` prints its `content`, `anchor` is its id.

    A template that lies in the folder `templates` of another package is named `package:file`.
    """

    anchor: str
    title: str
    template: str
    content: object = None


@dataclass(frozen=True)
class Plate:
    """A figure that has been drawn, under the name of its files.

    script: what the page draws it from interactively; csv: its numbers; alt: what is seen; jobs:
    the keys of the jobs that its points are.
    """

    name: str
    heading: str
    caption: str
    figure: "Drawing"
    csv: str
    script: str
    alt: str
    jobs: tuple[str, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the PNG in pixels."""
        width, height = self.figure.canvas.get_width_height()
        return width, height

    @property
    def texts(self) -> dict[str, str]:
        """The files beside the page that are no pictures, by their names."""
        return {f"{self.name}.csv": self.csv, f"{self.name}.js": self.script}


class Running(NamedTuple):
    """How a run stands while its page is written: its jobs, and seconds, None where unknown."""

    done: int  # failed ones among them
    failed: int
    total: int
    eta_s: float | None = None
    every_s: float = 5.0  # between two pages
    at: str = ""  # the time of day
    drawn: str = ""  # when its figures were

    @property
    def left(self) -> str:
        """How long the run will still take, in words; "" where that is not known."""
        if self.eta_s is None:
            return ""
        minutes = round(self.eta_s / 60)
        if minutes < 1:
            return "under a minute"
        return f"about {minutes} min" if minutes < 100 else f"about {minutes / 60:.0f} h"


def templates() -> Environment:
    """Return the page's templates: they escape what they print, and what they lack is an error."""
    return Environment(
        loader=ChoiceLoader([PackageLoader(__package__), Elsewhere(template_elsewhere)]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


class Elsewhere(FunctionLoader):
    """Loads templates by a function, and lists none of them."""

    def list_templates(self) -> list[str]:
        """Return no name."""
        return []


def template_elsewhere(name: str) -> str | None:
    """Return the text of a template `package:file`; None of a name without a package."""
    package, _, file = name.rpartition(":")
    return files(package).joinpath("templates", file).read_text("utf-8") if package else None


def document(
    sections: Sequence[Section], jobs: Mapping[str, Any], running: Running | None = None
) -> str:
    """Return the whole page: the first section, a list of contents, and the other sections.

    jobs: by key what a click on a job's point tells, as plain data. running: how the run stands
    that the page is written beside.
    """
    facts = Markup(json.dumps(jobs).replace("<", "\\u003c"))
    page = templates().get_template("page.html")
    return page.render(sections=sections, jobs=facts, running=running)


def restated(page: str, before: Running, now: Running) -> str:
    """Return a page that was written beside a run, with how the run stands now."""
    status = templates().get_template("status.html")
    return page.replace(status.render(running=before), status.render(running=now))
