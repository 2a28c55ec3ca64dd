"""Studies that are built on the program, a folder each; the rest of the program knows this table.

A study holds all of its own: run, file, figures, captions, section of the page, commands. Nothing
of it is imported before it is used, but for its commands, which the command line lists.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compressor.program import STUDY_FILES, STUDY_GROUPS, StudyFiles

if TYPE_CHECKING:
    import click

    from compressor.cases import Study
    from compressor.report import Add
    from compressor.store import Folder

RECORDS = "Work with measured records"  # a heading of `compsim --help`


@dataclass(frozen=True, eq=False)
class StudyKind:
    """A kind of study: where its parts are in its folder.

    `verbs`: of the command line, which its module `command` has; `compsim --help` lists them under
    `heading`.
    `group`: the group of keys by which a case file requests it; its module `command` then has
    `check_options`, `run_studies`, `ahead` and `ahead_lines`, and its module `group` what
    `compressor.cases.StudyRequest` says.
    `figures`: what `compsim plot` draws of it; its module `plots` has `write`.
    `files`: what it keeps beside the jobs; of a kind with figures, a `result` has a study's folder.
    `has_page`: whether its module `page` has `add`, what it adds to the page of a report.
    `page_folder`: the option of `compsim report`, and the default folder, of what the page is made
    from beside the results.
    """

    name: str
    verbs: tuple[str, ...] = ()
    group: str = ""
    figures: tuple[str, ...] = ()
    files: StudyFiles | None = None
    has_page: bool = False
    page_folder: str = ""
    heading: str = "Study a machine or the model"

    def module(self, name: str) -> Any:
        """Return a module of its folder."""
        return import_module(f"{__name__}.{self.name}.{name}")


STUDIES = (
    StudyKind("claims", ("claims",), has_page=True, page_folder="claims"),
    StudyKind(
        "regimes", group="regimes", figures=("bifurcation", "sections", "periods"),
        files=StudyFiles("regimes/*/*.nc", "regimes/*/study.json",
                         "machines that were followed: {}", "compsim plot STUDY draws one"),
    ),
    StudyKind(
        "wear", ("wear",),
        files=StudyFiles("wear/*.nc", "wear/*.nc",
                         "how machines have worn", "compsim wear CONFIG... reports them"),
    ),
    StudyKind("diagnosis", ("dataset", "identify"), heading=RECORDS),
    StudyKind("tradeoff", ("tradeoff", "explain"), has_page=True, files=StudyFiles("models/*.nc")),
    StudyKind("stress", ("stress",)),
    StudyKind("search", ("find",)),
    StudyKind("compare", ("compare",), heading=RECORDS),
    StudyKind("calibrate", ("calibrate",), heading=RECORDS),
    StudyKind("alarms", ("alarms",), has_page=True, page_folder="alarms"),
)  # fmt: skip
STUDY_FILES[:] = [kind.files for kind in STUDIES if kind.files]
STUDY_GROUPS.update({kind.group: partial(kind.module, "group") for kind in STUDIES if kind.group})


def verbs_by_heading() -> "dict[str, list[click.Command]]":
    """Return the commands of all studies by their headings in `compsim --help`."""
    found: dict[str, list[click.Command]] = {kind.heading: [] for kind in STUDIES if kind.verbs}
    for kind in STUDIES:
        found[kind.heading] += [getattr(kind.module("command"), verb) for verb in kind.verbs]
    return found


def kind_of(study: "Study") -> StudyKind | None:
    """Return the kind of study that a case file has a group of; None of a file of jobs."""
    request = study.request
    return next((kind for kind in STUDIES if request and kind.group == request.group), None)


def by_kind(studies: "Iterable[Study]") -> "dict[StudyKind | None, list[Study]]":
    """Return studies by their kind, those of jobs by None."""
    found: dict[StudyKind | None, list[Study]] = {}
    for study in studies:
        found.setdefault(kind_of(study), []).append(study)
    return found


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
