"""What a result of alarms looks like: its figure, its files, and its section of a report."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from compressor.report import (
    CYCLE,
    GREY,
    AddedContent,
    Additions,
    Cell,
    Chapter,
    LineStyle,
    PageTable,
    Plate,
    PlotlyFigure,
    Section,
    StudyNote,
    TableRow,
    file_name,
    make_grid,
    title_figure,
    write_figure,
)
from compressor.store import Folder, StoredStudy, read_dataset, write_dataset
from compressor.studies.alarms.alarms import list_numbers, list_rows, list_warnings, rank_alarms

FILE, FIGURE = "alarms.nc", "alarms.png"
REMEDY = "compsim alarms STUDY -o the folder writes it again"
MAX_KINDS = 6  # kinds of alarm that have a line: the first to see wear
CAPTION = (
    "Share of windows in which an alarm trips, by clearance, each kind with its best filter; "
    "dashed: the share from which on it detects."
)


def draw_alarms(found: xr.Dataset, title: str = "") -> PlotlyFigure:
    """Return a panel a joint: the share of windows in which alarms trip, by clearance.

    Of the first level of noise, and of the kinds that see wear first over all joints.
    """
    joints = found["joint"].values.tolist()
    drawing, grid = make_grid(1, len(joints), 3.6)
    kinds = found["kind"].values
    best = {joint: {kinds[place]: place for place in rank_alarms(found, joint)} for joint in joints}
    first = sorted(
        best[joints[0]], key=lambda kind: sum([*one].index(kind) for one in best.values())
    )
    for panel, joint in zip(grid.flat, joints, strict=True):
        mine = found.isel(noise=0, state=np.flatnonzero(found["worn_joint"].values == joint))
        for kind, line in zip(first[:MAX_KINDS], CYCLE, strict=False):
            shares = mine["detection"].isel(alarm=best[joint][kind]).sel(end="value").values
            style = replace(line, marker="circle", markersize=3.5)
            panel.plot(mine["clearance"].values, shares, style, kind)
        panel.rule(LineStyle(GREY, (3.7, 1.6), 0.8), y=found.attrs["detected"])
        panel.title = f"({'abc'[joints.index(joint)]}) {joint.replace('_', ' ')}"
        panel.x.title = "clearance (mm)"
        panel.span("y", -0.02, 1.04)
    grid.flat[0].y.title, drawing.title = "windows in which it trips", title
    return drawing.figure()


def write_alarms(found: xr.Dataset, output: Folder, title: str) -> list[Path]:
    """Write a result as netCDF and as a figure; return their paths. title: of the machine."""
    figure = draw_alarms(found, title_figure(title, "alarms by clearance"))
    path = write_figure(Path(output, FIGURE), figure)
    return [write_dataset(Path(output, FILE), found), path]


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
    plates = [Plate(file_name("alarms", name), "Alarms by clearance", CAPTION, draw_alarms(found))]
    head, *rows = list_rows(found)
    table = PageTable(head, [TableRow([Cell(text) for text in row]) for row in rows], lead=3)
    lines = [*list_numbers(found), *list_warnings(found)]
    content = AddedContent(table, (), lines, plates, study.title, study.notes)
    anchor, title = file_name("alarms-of", name), f"Which alarm sees wear first in study {name}"
    section = Section(anchor, title, "addition.html", content)
    line = f"{found.sizes['alarm']} alarms were judged by its records."
    note = StudyNote(line, anchor, "Which alarm sees wear first")
    return Additions({name: note}, [Chapter(section, plates)])
