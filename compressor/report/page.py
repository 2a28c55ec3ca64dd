"""The report as an HTML page with its figures beside it.

Python gives sections of plain data; the files in `templates` make markup of them, and escape every
text that they print.
"""

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup


@dataclass(frozen=True)
class Section:
    """A part of the page: `template` prints its `content`, `anchor` is its id."""

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
    png: bytes
    svg: bytes
    csv: str
    script: str
    alt: str
    jobs: tuple[str, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the PNG in pixels, as its head has them."""
        width, height = struct.unpack(">II", self.png[16:24])
        return width, height

    @property
    def files(self) -> dict[str, bytes]:
        """The files beside the page by their names."""
        texts = {"csv": self.csv, "js": self.script}
        data = {"png": self.png, "svg": self.svg} | {k: t.encode() for k, t in texts.items()}
        return {f"{self.name}.{kind}": content for kind, content in data.items()}


def templates() -> Environment:
    """The page's templates: they escape what they print, and what they lack is an error."""
    return Environment(
        loader=PackageLoader(__name__.rpartition(".")[0]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def document(sections: Sequence[Section], jobs: Mapping[str, Any]) -> str:
    """The whole page: the first section, a list of contents, and the other sections.

    jobs: by key what a click on a job's point tells, as plain data.
    """
    facts = json.dumps(jobs).replace("<", "\\u003c")
    return templates().get_template("page.html").render(sections=sections, jobs=Markup(facts))
