"""The chains of a study put together as one labelled Dataset."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from compressor.analysis import SPOKEN
from compressor.cases import OF_JOINTS, Case
from compressor.metrics import JOINTS
from compressor.store import Folder, StoreError, coordinate_names, read_dataset, swept_column
from compressor.studies.regimes.chains import FOLDER, REMEDY, labels, read_chain
from compressor.studies.regimes.confirm import verdict_attrs
from compressor.studies.regimes.group import Regimes
from compressor.studies.regimes.run import FILE
from compressor.studies.regimes.values import COORDINATES, NUMBERS, TEXTS

MISSING = "missing"  # status of a value that was not run


def open_regimes(results: Folder, study: str) -> xr.Dataset:
    """Return a study's chains in a folder of results, as far as they were run.

    Dims: the study's own axes (or `job`, where it is no grid), `direction` (up, down), the followed
    key by its coordinate's name, which stands in the attribute `over`, going up, and those of the
    variables (`values.NUMBERS`). `differs` and `confirmed` say where up and down
    end differently. Values that were not run have the status `missing` and numbers of nan. Raises
    StoreError where there is no such study.
    """
    folder = Path(results) / FOLDER / study
    manifest = read_manifest(folder)
    request = Regimes(**manifest["regimes"])
    chains = [[read_stored(folder / f"{key}.nc") for key in keys] for keys in manifest["chains"]]
    axes = {axis["key"]: axis["values"] for axis in manifest["axes"]}
    names = coordinate_names([*axes, request.over])
    over, ways = names[request.over], [*request.directions]
    outer, shape = layout(manifest, names)
    values, attrs_of_over = swept_column(request.over, request.values)
    attrs_of_over["long_name"] += of_joint(request.over, chains)
    coordinates = outer | {
        "direction": ("direction", ways, {"long_name": "which way it is followed"}),
        over: (over, values, attrs_of_over),
        **labels(),
    }
    dims = (*[name for name, (dim, *_) in outer.items() if name == dim], "direction", over)
    if not manifest["is_grid"]:
        dims = ("job", "direction", over)
    variables: dict[str, tuple] = {}
    for name, phrase in TEXTS.items():
        values = stack_chains(chains, request, name).reshape(*shape, len(ways), request.n)
        variables[name] = dims, values, {"long_name": phrase}
    for name, (inner, unit, phrase) in NUMBERS.items():
        values = stack_chains(chains, request, name, inner)
        values = values.reshape(*shape, len(ways), request.n, *values.shape[3:])
        variables[name] = (*dims, *inner), values, {"units": unit, "long_name": phrase}
    if manifest["pairs"]:
        every = [read_stored(folder / f"pair-{key}.nc") for key in manifest["pairs"]]
        variables |= verdicts(every, (*dims[:-2], over), (*shape, request.n))
    turns = variables["section"][1].shape[len(dims)]
    number = {"long_name": "Poincaré point, one a revolution", "units": "1"}
    coordinates["revolution"] = "revolution", np.arange(1, turns + 1), number
    attrs = {"study": study, "over": over, "over_key": request.over, "log": int(request.log)}
    attrs["oiled"] = int(is_oiled(chains))
    attrs |= {"title": manifest["title"]} if "title" in manifest else {}
    attrs |= {name: getattr(request, name) for name in ("section_deg", "settle_rev", "measure_rev")}
    return xr.Dataset(variables, coordinates, attrs)


def of_joint(over: str, chains: Sequence[Sequence[xr.Dataset | None]]) -> str:
    """Return whose clearance is followed, " of the small end"; "" of another key or of several."""
    joints = {case.joint for case in cases_of(chains) if over in OF_JOINTS}
    if len(joints) != 1:
        return ""
    joint = joints.pop()
    return f" of {'' if joint == 'both' else 'the '}{SPOKEN[joint]}" if joint in SPOKEN else ""


def is_oiled(chains: Sequence[Sequence[xr.Dataset | None]]) -> bool:
    """Return whether the joints of some chain have oil."""
    return any(case.lubricant for case in cases_of(chains))


def cases_of(chains: Sequence[Sequence[xr.Dataset | None]]) -> list[Case]:
    """Return the different cases that chains began with."""
    texts = {str(chain.attrs["case"]) for pair in chains for chain in pair if chain is not None}
    return [Case.from_attribute(text) for text in texts]


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return the manifest of a study: its keys, axes and chains. Raises StoreError."""
    path = folder / FILE
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError as error:
        problem = "there is no regimes study of this name"
        raise StoreError(folder, problem, "compsim run a case file with regimes") from error
    except (OSError, ValueError) as error:
        raise StoreError(path, f"cannot be read: {error}", REMEDY) from error


def read_stored(path: Path) -> xr.Dataset | None:
    """Return a stored chain or pair; None where there is none."""
    if not path.exists():
        return None
    return read_chain(path) if not path.name.startswith("pair-") else read_dataset(path, REMEDY)


def layout(
    manifest: dict[str, Any], names: dict[str, str]
) -> tuple[dict[str, tuple], tuple[int, ...]]:
    """Return the coordinates of a study's own axes, and the shape of its machines."""
    found: dict[str, tuple] = {}
    for axis in manifest["axes"]:
        name = names[axis["key"]]
        values, attrs = swept_column(axis["key"], axis["values"])
        found[name] = (name if manifest["is_grid"] else "job"), values, attrs
    if manifest["is_grid"]:
        return found, tuple(len(axis["values"]) for axis in manifest["axes"])
    return found, (len(manifest["chains"]),)


def stack_chains(
    chains: Sequence[Sequence[xr.Dataset | None]],
    request: Regimes,
    name: str,
    inner: tuple[str, ...] = (),
) -> np.ndarray:
    """Return a variable of all chains, (machine, direction, value going up, ...).

    Missing values are nan, or of texts empty; where states have other lengths, so are their ends.
    """
    known = [chain[name].values for pair in chains for chain in pair if chain is not None]
    sizes = {"revolution": request.measure_rev, "joint": len(JOINTS),
             "coordinate": len(COORDINATES), "mode": 3, "number": 0}  # fmt: skip
    shape = tuple(max([values.shape[1 + n] for values in known], default=sizes[dim])
                  for n, dim in enumerate(inner))  # fmt: skip
    whole = (len(chains), len(request.directions), request.n)
    if name in TEXTS:
        found = np.full(whole, MISSING if name == "status" else "", object)
    else:
        found = np.full((*whole, *shape), math.nan)
    for machine, pair in enumerate(chains):
        for way, chain in enumerate(pair):
            if chain is not None:
                values = chain[name].values
                at = np.arange(len(values))
                at = at if request.directions[way] == "up" else request.n - 1 - at
                inside: Any = tuple(slice(0, n) for n in values.shape[1:])
                found[(machine, way, at, *inside)] = values
    return found


def verdicts(
    pairs: Sequence[xr.Dataset | None], dims: tuple[str, ...], shape: tuple[int, ...]
) -> dict[str, tuple]:
    """Return the verdicts on values, over machine and value; 0 where it is not known yet."""
    found = {}
    for name, attrs in verdict_attrs().items():
        columns = [np.zeros(shape[-1], int) if p is None else p[name].values for p in pairs]
        found[name] = dims, np.array(columns).reshape(shape), attrs
    return found
