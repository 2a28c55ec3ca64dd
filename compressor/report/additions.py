"""What others may add to a report: lines in the section of a study, and sections of their own."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from compressor.report.figures import Drawing
from compressor.report.page import Plate, Section
from compressor.store import Folder, StoredStudy

Draw = Callable[[str, str, str, Drawing], Plate]  # of name, heading, caption and drawing


class Note(NamedTuple):
    """A line in the section of a study, and a link below it: the id of a section, and its words."""

    text: str
    anchor: str
    link: str


class Chapter(NamedTuple):
    """A section with the figures that it shows."""

    section: Section
    plates: Sequence[Plate] = ()


class Additions(NamedTuple):
    """Notes by the name of the study that they are on, and chapters."""

    notes: Mapping[str, Note]
    chapters: Sequence[Chapter]


Add = Callable[[Folder, Sequence[StoredStudy], Draw], Additions]  # of the folder of results
