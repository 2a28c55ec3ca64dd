"""The report as one HTML page that holds its figures.

Python gives sections of plain data; the files in `templates` make markup of them, and escape every
text that they print.
"""

import base64
from collections.abc import Sequence
from dataclasses import dataclass

from jinja2 import Environment, PackageLoader, StrictUndefined


@dataclass(frozen=True)
class Section:
    """A part of the page: `template` prints its `content`, `anchor` is its id."""

    anchor: str
    title: str
    template: str
    content: object = None


@dataclass(frozen=True)
class Plate:
    """A figure that has been drawn, under the name of its files."""

    name: str
    heading: str
    caption: str
    png: bytes
    svg: bytes

    @property
    def png_base64(self) -> str:
        """The PNG as text, for an image inside a page."""
        return base64.b64encode(self.png).decode()


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


def document(sections: Sequence[Section]) -> str:
    """The whole page: a list of contents and the sections."""
    return templates().get_template("page.html").render(sections=sections)
