"""Studies that are built on the program, a folder each; the rest of the program knows this table.

A study holds all of its own but its commands: run, file, figures, captions, section of the page.
Nothing of it is imported before it is used.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compressor.program import STUDY_FILES, STUDY_GROUPS, StudyFiles

if TYPE_CHECKING:
    from compressor.report import Add
    from compressor.store import Folder


@dataclass(frozen=True, eq=False)
class StudyKind:
    """A kind of study: where its parts are in its folder.

    `group`: the group of keys by which a case file requests it; its module `group` then has what
    `compressor.cases.StudyRequest` says.
    `figures`: what `compsim plot` draws of it; its module `plots` has `write`.
    `files`: what it keeps beside the jobs; of a kind with figures, a `result` has a study's folder.
    `has_page`: whether its module `page` has `add`, what it adds to the page of a report.
    `page_folder`: the option of `compsim report`, and the default folder, of what the page is made
    from beside the results.
    """

    name: str
    group: str = ""
    figures: tuple[str, ...] = ()
    files: StudyFiles | None = None
    has_page: bool = False
    page_folder: str = ""

    def module(self, name: str) -> Any:
        """Return a module of its folder."""
        return import_module(f"{__name__}.{self.name}.{name}")


STUDIES = (
    StudyKind("claims", has_page=True, page_folder="claims"),
    StudyKind(
        "regimes", "regimes", ("bifurcation", "sections", "periods"),
        StudyFiles("regimes/*/*.nc", "regimes/*/study.json",
                   "machines that were followed: {}", "compsim plot STUDY draws one"),
    ),
    StudyKind(
        "wear",
        files=StudyFiles("wear/*.nc", "wear/*.nc",
                         "how machines have worn", "compsim wear CONFIG... reports them"),
    ),
    StudyKind("tradeoff", has_page=True, files=StudyFiles("models/*.nc")),
    StudyKind("alarms", has_page=True, page_folder="alarms"),
)  # fmt: skip
STUDY_FILES[:] = [kind.files for kind in STUDIES if kind.files]
STUDY_GROUPS.update({kind.group: partial(kind.module, "group") for kind in STUDIES if kind.group})


def find_drawn(results: "Folder") -> dict[str, StudyKind]:
    """Return the kinds of the stored studies that `compsim plot` draws, without those of jobs."""
    drawn = ((kind, kind.files) for kind in STUDIES if kind.figures and kind.files)
    return {
        path.parent.name: kind for kind, files in drawn for path in Path(results).glob(files.result)
    }


def page_additions(folders: "Mapping[str, Folder]") -> "list[Add]":
    """Return the functions by which studies add to a report.

    folders: by the option that names them.
    """
    return [
        partial(kind.module("page").add, place=folders.get(kind.page_folder, kind.page_folder))
        for kind in STUDIES
        if kind.has_page
    ]
