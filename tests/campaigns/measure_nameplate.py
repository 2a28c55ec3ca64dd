"""Keep what the case file of `compsim init machine` gives (make nameplate, about three minutes).

Writes a small JSON file with the numbers that compressor/docs/my-machine.md shows, and the keys of
the jobs: another case file or model makes others, and test_kept_results.py then asks for a new run.
What decides it: numbers that a plant can only guess, each at both ends of its plausible range, as
`compsim explain --models` takes them, natural frequencies of foundations, and the share of the
clearance in which the oil film gets no thinner.
"""

from dataclasses import replace
from tempfile import TemporaryDirectory

from compsim import cli
from result_pages import keep, provenance, run_campaign

import compressor
from compressor.cases.examples import templates
from compressor.cases.load import load_studies
from compressor.studies.tradeoff.variants import Variant, vary_numbers

BEFORE, WORN = 0.24, 0.4  # mm: the oil still cushions the pin of the file; it hammers
DECIDING = (
    "lubricant.bearing_length_mm.small_end", "lubricant.viscosity_mPa_s",
    "machine.rod_inertia_kg_m2", "machine.rod_centre_mm", "gas.valve_loss_percent.suction",
    "gas.discharge_MPa", "body.casing_mass_kg", "machine.balance.reciprocating",
)  # fmt: skip
GIVEN = {  # beside the value of the file
    "body.frequency_x_Hz": (30.0, 40.0, 80.0), "lubricant.last_share": (0.01, 0.05),
}  # fmt: skip
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
    names = {"key": "key", "clearance_mm": "clearance_mm_small_end", "regime": "regime"}
    found = {name: study[one].values.tolist() for name, one in names.items()}
    for name in SHOWN:
        found |= {name: number(study[name]), f"{name}_error": number(study[f"{name}_error"])}
    return [dict(zip(found, row, strict=True)) for row in zip(*found.values(), strict=True)]


def decided(study):
    """What each number in doubt makes of two jobs: rows of the number, its value and metrics."""
    sizes = [round(case.clearance_mm.small_end, 9) for case in study.cases]
    every = {size: [*machines(study, sizes.index(size))] for size in (BEFORE, WORN)}
    for pair in zip(*every.values(), strict=True):
        one = pair[0]
        assert {other.name for other in pair} == {one.name}
        found = {"number": one.varied, "value": one.name.removeprefix(one.varied).strip()}
        for size, other in zip(every, pair, strict=True):
            run = compressor.simulate(other.case)
            found[f"{size:g}"] = {metric: number(run[metric])[0] for metric in DECIDED}
        yield found


def machines(study, job):
    """A job as it is, with each deciding number at both ends, and with each given value."""
    case = study.cases[job]
    yield Variant("", case)
    yield from (one for one in vary_numbers(study, job) if one.varied in DECIDING)
    for key, values in GIVEN.items():
        group, _, name = key.partition(".")
        for value in values:
            changed = replace(getattr(case, group), **{name: value})
            yield Variant(f"{key} {value:g}", replace(case, **{group: changed}), varied=key)


def main(target):
    path = str(templates()["machine"].path)
    with TemporaryDirectory() as place:
        assert cli.main(["run", path, "-r", place, "--quiet"]) == 0
        with compressor.open_study(place, "machine") as study:
            kept = provenance("make nameplate") | {"rows": rows(study)}
    keep(target, kept | {"decides": [*decided(load_studies(path)[0])]})


if __name__ == "__main__":
    run_campaign(main)
