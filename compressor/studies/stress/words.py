"""How extreme scenes end, as lines of text."""

import json
from collections.abc import Iterator
from typing import Any

import xarray as xr

from compressor.digits import align_columns, plural
from compressor.program import duration
from compressor.studies.stress.stress import counts, repeat, slowest, worst

HEAD = ("verdict", "excess", "beyond", "error", "bar", "repeat by")


def list_scene(number: int, seed: int, drawn: str) -> Iterator[str]:
    """Yield a scene as a case file, and below it, as comments, how it ends."""
    values, row = repeat(number, seed, drawn)
    yield from (f"{key}: {json.dumps(value)}" for key, value in values.items())
    for key, value in row.items():
        if key not in ("load", "joint") and value != "":
            yield f"# {key}: {value:.3g}" if isinstance(value, float) else f"# {key}: {value}"


def list_outcomes(study: xr.Dataset) -> Iterator[str]:
    """Yield shares, the worst scenes with the command that repeats each, and the slowest one."""
    for kind, ends in counts(study).items():
        total = sum(ends.values())
        named = ", ".join(f"{name} {count}" for name, count in sorted(ends.items()))
        share = ends.get("ok", 0) / max(total, 1)
        yield f"{kind} range: {plural(total, 'scene')}, {share:.1%} ok: {named}"
    yield ""
    rows, most = [HEAD], worst(study)
    for place in range(most.sizes["scene"]):
        row = most.isel(scene=place)
        far, beyond = (f"{row[name].item():.2g}" for name in ("excess", "excess_beyond"))
        error, bar = (f"{row[name].item():.1e}" for name in ("error", "bar"))
        rows.append((row["verdict"].item(), far, beyond, error, bar, command(row, study.attrs)))
    yield from align_columns(rows, "<>>>>")
    longest = slowest(study)
    if longest is not None:
        seconds = duration(longest["seconds"].item())
        yield f"slowest ok scene: {seconds}, {command(longest, study.attrs)}"
    yield f"peak memory of a worker: {study['peak_memory'].max().item() / 2**20:.0f} MiB"


def command(row: xr.Dataset, attrs: dict[str, Any]) -> str:
    """Return the command that repeats a scene of a campaign."""
    drawn = f" --{attrs['drawn']}" if attrs.get("drawn") else ""
    return f"compsim stress --scene {row['scene'].item()} --seed {attrs['seed']}{drawn}"
