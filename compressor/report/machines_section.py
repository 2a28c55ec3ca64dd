"""The section of a report about machines: where the paper's claims hold, and what decides them."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from compressor.cases import Case
from compressor.machines import (
    change,
    deciding,
    flips,
    is_mass_plane,
    read_machines,
    sensitivity,
    spoken,
    summary,
)
from compressor.report.figures import Drawing
from compressor.report.figures.claims import OF_MASSES, draw_claims_map, draw_sensitivity
from compressor.report.page import Plate, Section
from compressor.store import Folder

SEARCH = "-search"


@dataclass(frozen=True)
class Part:
    """One file of judged machines: what is said of it, and its figure."""

    name: str
    sentences: list[str]
    plate: Plate | None


def machine_files(folder: Folder) -> dict[str, xr.Dataset]:
    """The files of judged machines in a folder by name, mass planes first; none without a folder.

    Raises StoreError for a file that is something else.
    """
    paths = sorted(Path(folder).glob("*.nc"), key=lambda path: path.stem)
    found = {path.stem: read_machines(path) for path in paths}
    return dict(sorted(found.items(), key=lambda item: not is_mass_plane(item[1])))


def machine_drawings(
    files: dict[str, xr.Dataset],
) -> Iterator[tuple[str, list[str], str, Drawing | None]]:
    """Name, sentences, heading and drawing of each file."""
    for name, found in files.items():
        if "best" in found.attrs:
            yield name, [*change(found)], "", None
        elif is_mass_plane(found):
            yield name, [*summary(found), borders(found)], *plane(found)
        else:
            table = sensitivity(found) if not (found["status"] == "").any() else None
            if table is None:
                yield name, [*summary(found)], "", None
            else:
                names = [spoken(str(one)) for one in table["assumption"].values]
                heading = "Which assumption decides which claim"
                sentences = [*summary(found), *deciding(table)]
                yield name, sentences, heading, draw_sensitivity(table, names)


def plane(found: xr.Dataset) -> tuple[str, Drawing]:
    """The heading and the map of a mass plane."""
    default = Case.from_values({}).machine
    place = default.rod_mass_kg, default.reciprocating_mass_kg
    return "The paper's claims over the mass plane", draw_claims_map(found, place)


def borders(found: xr.Dataset) -> str:
    """How often neighbours on the map differ, in words."""
    parts = []
    for claim in OF_MASSES:
        one = flips(found, claim)
        parts.append(f"claim {claim} {one.flips} ({one.within} within the error)")
    pairs = flips(found, OF_MASSES[0]).pairs
    return f"Of {pairs} pairs of neighbours, one holds and the other does not: {', '.join(parts)}."


def machine_sections(parts: list[Part]) -> Iterator[Section]:
    """The section, where there are machines."""
    if parts:
        title = "In which machines the paper's claims hold"
        yield Section("machines", title, "machines.html", parts)
