"""The section of a report about machines: where the paper's claims hold, and what decides them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from compressor.cases import Case
from compressor.report import Additions, Chapter, Drawing, Plate, Section, file_name
from compressor.store import Folder, StoredStudy
from compressor.studies.claims.figures import OF_MASSES, draw_claims_map, draw_sensitivity
from compressor.studies.claims.findings import (
    change,
    consistency,
    coordinate_in_words,
    count_claims,
    flips,
    is_mass_plane,
    rank_assumptions,
    sensitivity,
    summary,
)
from compressor.studies.claims.study import about_machine, read_machines

MAP = (
    "Blue holds, red does not, by how far the claim is from its threshold; lines are where the "
    "verdict changes, the ring marks the default masses. Claims 1 and 2 hold at every machine "
    "here: masses do not enter them."
)
BARS = (
    "Shares of the variance of a claim's margin over all machines, with 95 % intervals: by an "
    "assumption alone (main effect), and with its interactions (total)."
)
NO_FIGURE = ("", "", None)


@dataclass(frozen=True)
class MachinesFile:
    """One file of judged machines: what is said of it, and its figure.

    `title`, `notes`: what its case file says of the machine.
    """

    name: str
    sentences: list[str]
    plate: Plate | None
    title: str = ""
    notes: str = ""


def machine_files(folder: Folder) -> dict[str, xr.Dataset]:
    """Return the files of judged machines in a folder by name, mass planes first.

    None without a folder.

    The machines that a search looked at are left out: what it found has a file of its own. Raises
    StoreError for a file that is something else.
    """
    paths = sorted(Path(folder).glob("*.nc"), key=lambda path: path.stem)
    paths = [path for path in paths if "-search" not in path.stem]
    found = {path.stem: read_machines(path) for path in paths}
    return dict(sorted(found.items(), key=lambda item: not is_mass_plane(item[1])))


def machine_drawings(
    files: dict[str, xr.Dataset],
) -> Iterator[tuple[str, list[str], str, str, Drawing | None]]:
    """Yield the name, sentences, heading, caption and drawing of each file."""
    for name, found in files.items():
        if "looked" in found.attrs:
            yield name, [*change(found)], *NO_FIGURE
        elif is_mass_plane(found):
            sentences = [*summary(found), consistency(found), borders(found)]
            yield name, sentences, *plane(found)
        else:
            table = sensitivity(found) if not (found["status"] == "").any() else None
            if table is None:
                yield name, [*summary(found)], *NO_FIGURE
            else:
                names = [coordinate_in_words(str(one)) for one in table["assumption"].values]
                heading = "Which assumption decides which claim"
                sentences = [*summary(found), *rank_assumptions(table)]
                yield name, sentences, heading, BARS, draw_sensitivity(table, names)


def plane(found: xr.Dataset) -> tuple[str, str, Drawing]:
    """Return the heading, the caption and the map of a mass plane."""
    default = Case.from_values({}).machine
    place = default.rod_mass_kg, default.reciprocating_mass_kg
    held = count_claims(found)
    caption = MAP if held[1][1] == held[1][2] == held[0] else MAP.partition(" Claims 1")[0]
    return "The paper's claims over the mass plane", caption, draw_claims_map(found, place)


def borders(found: xr.Dataset) -> str:
    """Describe how often neighbours on the map differ."""
    parts = []
    for claim in OF_MASSES:
        one = flips(found, claim)
        parts.append(f"claim {claim} {one.flips} ({one.within} within the error)")
    pairs = flips(found, OF_MASSES[0]).pairs
    return f"Of {pairs} pairs of neighbours, one holds and the other does not: {', '.join(parts)}."


def add(results: Folder, studies: Sequence[StoredStudy], place: Folder) -> Additions:
    """Return the section of the judged machines that are in a folder; nothing where none are.

    Raises StoreError for a file that is something else.
    """
    parts, found = [], machine_files(place) if place else {}
    for name, sentences, heading, caption, drawing in machine_drawings(found):
        plate = Plate(file_name("machines", name), heading, caption, drawing) if drawing else None
        parts.append(MachinesFile(name, sentences, plate, *about_machine(found[name])))
    if not parts:
        return Additions({}, [])
    title = "In which machines the paper's claims hold"
    section = Section("machines", title, "compressor.studies.claims:machines.html", parts)
    return Additions({}, [Chapter(section, [part.plate for part in parts if part.plate])])
