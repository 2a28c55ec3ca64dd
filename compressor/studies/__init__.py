"""Studies that are built on the program, a folder each, and what three of them give to others.

A study holds all of its own but its verb, which stands in `compsim`: run, file, figures, captions,
section of the page. Nothing of it is imported before it is used.
"""

from collections.abc import Mapping
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from compressor.program import STUDY_GROUPS

if TYPE_CHECKING:
    from compressor.report import Add
    from compressor.store import Folder

STUDY_GROUPS["regimes"] = lambda: import_module(f"{__name__}.regimes.group")
FOLLOWED_FIGURES = ("bifurcation", "sections", "periods")  # of machines that were followed
# study whose module `page` has `add`, what it adds to a report -> the folder of what it is made
# from, by default; "" in that of results
PAGES = {"claims": "claims", "tradeoff": "", "alarms": "alarms"}


def find_followed(results: "Folder") -> list[str]:
    """Return the names of the stored studies of `regimes`, which have no jobs."""
    return [path.parent.name for path in Path(results).glob("regimes/*/study.json")]


def page_additions(folders: "Mapping[str, Folder]") -> "list[Add]":
    """Return the functions by which studies add to a report; folders: by the study's name."""
    return [
        partial(import_module(f"{__name__}.{name}.page").add, place=folders.get(name, place))
        for name, place in PAGES.items()
    ]
