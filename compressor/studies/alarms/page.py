"""The section of a report about alarms: its table, remarks and figures, of what was written."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from compressor.report import (
    Additions,
    Cell,
    Chapter,
    PageTable,
    Plate,
    Section,
    StudyNote,
    TableRow,
    file_name,
)
from compressor.store import Folder, StoredStudy, read_dataset
from compressor.studies.alarms.figures import caption, draw_alarms
from compressor.studies.alarms.words import heading, list_remarks, table_rows

FILE = "alarms.nc"
REMEDY = "compsim alarms STUDY -o the folder writes it again"


@dataclass(frozen=True)
class AlarmsContent:
    """What the section shows: sentences before the table, and below it, and figures.

    `title`, `notes`: what the study's case file says of the machine.
    """

    sentences: list[str]
    table: PageTable
    remarks: list[str]
    plates: list[Plate]
    title: str
    notes: str


def add(results: Folder, studies: Sequence[StoredStudy], place: Folder) -> Additions:
    """Return the section of the alarms that are in a folder, and a line on their study.

    Nothing where there are none, or of a study that is not stored. Raises StoreError for a file
    that is something else.
    """
    path = Path(place or "", FILE)
    if not place or not path.exists():
        return Additions({}, [])
    found = read_dataset(path, REMEDY)
    name = str(found.attrs.get("study"))
    study = next((study for study in studies if study.name == name), None)
    if study is None:
        return Additions({}, [])
    plates = []
    for level, noise in enumerate(found["noise"].values.tolist()):
        title = "Alarms by clearance" + (f", with noise of {noise:g} m/s²" if noise else "")
        words = file_name("alarms", name, *([f"noise-{noise:g}"] if noise else []))
        plates.append(Plate(words, title, caption(found, level), draw_alarms(found, level)))
    head, rows = table_rows(found)
    cells = PageTable(head, [TableRow([Cell(text) for text in row]) for row in rows])
    before, after = (
        [t[0].upper() + t[1:] for t in part(found)] for part in (heading, list_remarks)
    )
    content = AlarmsContent(before, cells, after, plates, study.title, study.notes)
    anchor = file_name("alarms-of", name)
    title = f"Which alarm sees wear first in study {name}"
    section = Section(anchor, title, "compressor.studies.alarms:alarms.html", content)
    line = f"{found.sizes['alarm']} alarms were judged by its records."
    note = StudyNote(line, anchor, "Which alarm sees wear first")
    return Additions({name: note}, [Chapter(section, plates)])
