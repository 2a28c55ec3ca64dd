"""Keep what the case file of `compsim init machine` gives (make nameplate, about five minutes).

Writes a small JSON file with the numbers that compressor/docs/my-machine.md shows, and the keys of
the jobs: another case file or model makes others, and test_kept_results.py then asks for a new run.
The same is run with other shares of the clearance in which the oil film gets no thinner: how far
the answer depends on that assumption. What decides it: numbers that a plant can only guess, each at
both ends of its plausible range, as `compsim explain --models` takes them, and natural frequencies
of foundations.
"""

from dataclasses import replace
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory

from compsim import cli
from result_pages import keep, provenance, run_campaign

import compressor
from compressor.cases.examples import templates
from compressor.cases.load import load_studies
from compressor.studies.tradeoff.variants import Variant, vary_numbers

CLEARANCE = 0.2  # mm
LAST_SHARES = (0.05, 0.01)  # beside the default, which is that of the file

BEFORE, WORN = 0.24, 0.4  # mm: the oil still cushions the pin of the file; it hammers
DECIDING = (
    "lubricant.bearing_length_mm.small_end", "lubricant.viscosity_mPa_s",
    "machine.rod_inertia_kg_m2", "machine.rod_centre_mm", "gas.valve_loss_percent.suction",
    "gas.discharge_MPa", "body.casing_mass_kg", "machine.balance.reciprocating",
)  # fmt: skip
FOUNDATIONS = (30.0, 40.0, 80.0)  # Hz, along the cylinder, beside that of the file
DECIDED = ("peak_contact_force", "sensor_rms", "body_velocity_rms")

SHOWN = (
    "peak_contact_force", "impacts_per_rev", "rod_load_reversal_angle", "sensor_rms",
    "body_velocity_rms",
)  # fmt: skip


def number(values):
    """The value of the small end, or along x, of each job."""
    for name, index in (("joint", "small_end"), ("axis", "x")):
        values = values.sel({name: index}) if name in values.dims else values
    return [float(f"{value:.6g}") for value in values.values.ravel()]


def rows(study):
    """One row a job: its key, clearance, regime, and each number with its error bar."""
    found = {"key": study["key"].values, "clearance_mm": study["clearance_mm_small_end"].values,
             "regime": study["regime"].values}  # fmt: skip
    for name in SHOWN:
        found |= {name: number(study[name]), f"{name}_error": number(study[f"{name}_error"])}
    return [dict(zip(found, (plain(v) for v in row), strict=True))
            for row in zip(*found.values(), strict=True)]  # fmt: skip


def oils():
    """The peak force on the small end at 0.2 mm: as in the file, and dry."""
    (study,) = load_studies(templates()["machine"].path)
    case = next(one for one in study.cases if one.clearance_mm.small_end == CLEARANCE)
    films = {"file": case.lubricant, "dry": None}
    return {name: peak(replace(case, lubricant=film)) for name, film in films.items()}


def peak(case):
    """The greatest force on the small end (N), with its error bar; what kind of motion it has."""
    run = compressor.simulate(case)
    (force,), (error,) = (number(run[f"peak_contact_force{end}"]) for end in ("", "_error"))
    known = isfinite(error)
    return {"force": force if known else None, "error": error if known else None,
            "regime": run.attrs["regime"]}  # fmt: skip


def decided():
    """What each number in doubt makes of two jobs: rows of the number, its value and metrics."""
    (study,) = load_studies(templates()["machine"].path)
    sizes = [round(case.clearance_mm.small_end, 9) for case in study.cases]
    every = {size: [*machines(study, sizes.index(size))] for size in (BEFORE, WORN)}
    rows = []
    for pair in zip(*every.values(), strict=True):
        one = pair[0]
        assert {other.name for other in pair} == {one.name}
        found = {"number": one.varied, "value": one.name.removeprefix(one.varied).strip()}
        for size, other in zip(every, pair, strict=True):
            run = compressor.simulate(other.case)
            found[f"{size:g}"] = {metric: number(run[metric])[0] for metric in DECIDED}
        rows.append(found)
    return rows


def machines(study, job):
    """A job as it is, with each deciding number at both ends, and on each foundation."""
    case, key = study.cases[job], "body.frequency_x_Hz"
    yield Variant("", case)
    yield from (one for one in vary_numbers(study, job) if one.varied in DECIDING)
    for frequency in FOUNDATIONS:
        body = replace(case.body, frequency_x_Hz=frequency)
        yield Variant(f"{key} {frequency:g}", replace(case, body=body), varied=key)


def plain(value):
    return value.item() if hasattr(value, "item") else value


def main(target):
    """Run the case file, also with other films, and write the file."""
    with TemporaryDirectory() as place:
        found = {}
        for share in (None, *LAST_SHARES):
            words = [] if share is None else ["--set", f"lubricant.last_share={share}"]
            folder = str(Path(place, f"{share}"))
            assert (
                cli.main(["run", str(templates()["machine"].path), "-r", folder, "--quiet", *words])
                == 0
            )
            with compressor.open_study(folder, "machine") as study:
                found[share] = rows(study)
        films = [{"last_share": share, "rows": found[share]} for share in LAST_SHARES]
        kept = provenance("make nameplate") | {"rows": found[None], "films": films, "oils": oils()}
        kept["decides"] = decided()
    keep(target, kept)


if __name__ == "__main__":
    run_campaign(main)
