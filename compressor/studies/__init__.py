"""Studies that are built on the program, a folder each, and what they add to a report.

A study holds all of its own but its verb, which stands in `compsim`: run, file, figures, captions,
section of the page. Nothing of it is imported before it is used.
"""

from collections.abc import Mapping
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from compressor.report import Add
    from compressor.store import Folder

# study -> the module with `add`, what it adds to a report, and the folder of what that is made
# from, by default; "" in that of results
PAGES = {"tradeoff": ("tradeoff.page", ""), "alarms": ("alarms.alarms", "alarms")}


def page_additions(folders: "Mapping[str, Folder]") -> "list[Add]":
    """Return the functions by which studies add to a report; folders: by the study's name."""
    return [
        partial(import_module(f"{__name__}.{module}").add, place=folders.get(name, place))
        for name, (module, place) in PAGES.items()
    ]
