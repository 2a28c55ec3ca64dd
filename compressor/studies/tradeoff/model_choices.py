"""Other models of the same machine, and what each of them makes of its metrics.

A choice is a case: another law of contact or friction, twice and half the stiffness, the damping
or the last share of an oil film, oil, an elastic rod, play in the guide. `explain_models` runs
those of one case, `trade` all features of several; `compressor.studies.tradeoff.page` compares
changes with error bars.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from compressor.cases import (
    READ_BY,
    Case,
    Contact,
    Output,
    Study,
    joint_stiffness,
    law_of,
    paper_stiffness_note,
)
from compressor.metrics import METRICS
from compressor.program import PROGRAM, Progress, no_progress
from compressor.solve import simulate
from compressor.studies.tradeoff.features import (
    FEATURES,
    SERIES_ERRORS,
    ModelFeature,
    read_from_grid,
    series_errors,
    with_values,
)
from compressor.studies.tradeoff.work_precision import SLOW_SECONDS, complete, faulty
from compressor.sweep import Needs, compile_once

ITSELF = "the case itself"
MAX_SECONDS = 30.0  # of a choice
GRID = "peaks from the output grid"
SCALES = {"× 2": 2.0, "÷ 2": 0.5}  # of stiffness and damping
SAME_STIFFNESS = 1.01  # stiffnesses of two joints
GROUPS = ("contact", "friction", "lubricant", "guide", "rod")  # that a choice may fill in
NAMES = ("status", "reason", "seconds", *(n + end for n in METRICS for end in ("", "_error")))


class Choice(NamedTuple):
    """Another model: its name, its case, and the values that it has and the case file has not.

    Where there can be no such case, `case` is None and `note` says why.
    """

    name: str
    case: Case | None
    note: str = ""


def model_choices(case: Case) -> list[Choice]:
    """Return the other models of a case's machine."""
    rubs = bool(case.friction)  # a case without friction has another friction law by its first row
    rows = [row for row in FEATURES if row.is_choice or (row.key == "friction" and not rubs)]
    contact = [row for row in rows if row.key == "contact.law"]
    others = [row for row in rows if row.key != "contact.law"]
    scaled = [*scale_contact(case), *scale_film(case)]
    found = [*toggle_features(case, contact), *scaled, *toggle_features(case, others)]
    return [check_choice(choice, case) for choice in found]


def model_variants(case: Case) -> list[Choice]:
    """Return `model_choices`, and the case with every other feature toggled, or another load."""
    chosen = model_choices(case)
    others = [row for row in FEATURES if not row.is_choice and row.key != "load"]
    names = {choice.name for choice in chosen}
    found = [one for one in toggle_features(case, others) if one.name not in names]
    other = {"spring": "gas", "gas": "spring"}.get(case.load)
    if other:
        found.append(Choice(f"{other} load", replace(case, load=other)))
    return [*found, *chosen]


def toggle_features(case: Case, rows: Iterable[ModelFeature]) -> Iterator[Choice]:
    """Yield a case without each feature that it has, and with each that it has not."""
    for feature in rows:
        if feature.paid(case):
            yield Choice(feature.off, feature.remove(case))
        elif added := feature.add(case):
            yield Choice(feature.on, added)


def scale_contact(case: Case) -> Iterator[Choice]:
    """Yield a case with twice and half its contact stiffness and damping."""
    if not faulty(case):
        return
    for words, factor in SCALES.items():
        yield with_stiffness(case, f"contact stiffness {words}", factor)
    contact = case.contact
    if paper_stiffness_note(case):
        values: dict[str, Any] = {"stiffness_N_per_mm15": None, "materials": ("steel", "steel")}
        other = with_values(case, "contact", **values, geometry="internal")
        yield Choice("contact stiffness of its pins (Eq. 15)", other, "steel on steel, in a bore")
    for words, factor in SCALES.items():
        name = f"contact damping {words}"
        if contact.law == "impact" and contact.damping_N_s_per_mm > 0.0:
            damping = factor * contact.damping_N_s_per_mm
            yield Choice(name, with_values(case, "contact", damping_N_s_per_mm=damping))
        elif contact.restitution is not None and contact.restitution < 1.0:
            # such laws damp by 1 - e, to the first order
            restitution = 1.0 - factor * (1.0 - contact.restitution)
            if restitution > 0.0:
                yield Choice(name, with_values(case, "contact", restitution=restitution))
            else:
                least = 1.0 - 1.0 / factor
                yield Choice(name, None, f"needs a restitution above {least:g}")


def scale_film(case: Case) -> Iterator[Choice]:
    """Yield a case with oil of twice and half its viscosity, and with such last shares."""
    if not case.lubricant or not faulty(case):
        return
    names = {"viscosity_mPa_s": "viscosity", "last_share": "last share of the oil film"}
    for (key, name), (words, factor) in product(names.items(), SCALES.items()):
        value = factor * getattr(case.lubricant, key)
        yield Choice(f"{name} {words}", with_values(case, "lubricant", **{key: value}))


def with_stiffness(case: Case, name: str, factor: float) -> Choice:
    """Return a case with its contact stiffness, or the modulus that it follows from, scaled."""
    values: dict[str, Any] = {"materials": None, "small_end_materials": None}
    contact, worn = case.contact, faulty(case)
    if contact.law in ("johnson", "liu"):
        key, unit = "modulus_GPa", 1.0
        each = [composite_modulus_of(contact.at(joint)) for joint in worn]
    else:
        key, unit, values["geometry"] = "stiffness_N_per_mm15", 1000.0**contact.exponent, None
        sizes = [(case.machine.pin_radius(j), getattr(case.clearance_mm, j)) for j in worn]
        each = [joint_stiffness(contact.at(j), *at) for j, at in zip(worn, sizes, strict=True)]
    # one key serves both joints: materials may give each a stiffness of its own
    values[key] = factor * (math.prod(each) ** (1.0 / len(each)) / unit)
    alike = max(each) <= SAME_STIFFNESS * min(each)
    return Choice(name, with_values(case, "contact", **values), "" if alike else "of both joints")


def composite_modulus_of(contact: Contact) -> float:
    """Return the composite modulus E* (GPa) of a joint's contact, as given or of its materials."""
    if contact.modulus_GPa is not None:
        return contact.modulus_GPa
    # from the stiffness pi E* L of johnson, which reads no radius
    length = (contact.length_mm or math.nan) / 1000
    return joint_stiffness(replace(contact, law="johnson"), 1.0, 0.1) / (math.pi * length) / 1e9


def check_choice(choice: Choice, case: Case) -> Choice:
    """Return a choice with what it assumes, or with what forbids it."""
    if choice.case is None:
        return choice
    problems = bare(choice.case).problems
    if problems:
        return Choice(choice.name, None, f"cannot be: {problems[0]}")
    notes = [*filter(None, [choice.note]), *assumed_values(case, choice.case)]
    return choice._replace(note=", ".join(notes))


def assumed_values(case: Case, other: Case) -> Iterator[str]:
    """Yield the values of the other case's groups that the case has not, as `key value`."""
    for name in GROUPS:
        old, new = getattr(case, name), getattr(other, name)
        if new is None or new == old:
            continue
        for field in fields(new):
            key, value = field.name, getattr(new, field.name)
            if value is None or key == "law" or not is_read(name, key, new):
                continue
            known = old is not None and is_read(name, key, old)
            if not known or value != getattr(old, key):
                text = f"{value:.4g}" if isinstance(value, float) else shown_words(value)
                yield f"{key} {text}"


def is_read(name: str, key: str, group: Any) -> bool:
    """Return whether the law of a group reads a key."""
    readers = READ_BY.get(name, {}).get(key)
    return readers is None or law_of(group) in readers


def shown_words(value: Any) -> str:
    """Return a value of a case file as text: a number in six digits, a word, or two materials."""
    if isinstance(value, float):
        return f"{value:g}"
    return " on ".join(value) if isinstance(value, tuple) else str(value)


def bare(case: Case, limit: float = math.inf) -> Case:
    """Return a case that gives the same metrics with their error bars, and keeps no series.

    limit: seconds that its run may take.
    """
    seconds = min(case.solve.timeout_s, limit)
    solve = replace(case.solve, error_bars=True, timeout_s=seconds)
    return replace(case, body=None, sensor=None, wear=None, output=Output("metrics"), solve=solve)


def explain_models(study: Study, progress: Progress = no_progress) -> xr.Dataset:
    """Run the first job of a study, and every other model of its machine.

    Returns the Dataset of `tabulate` with the attributes `study` and `key` (of the job). If the job
    itself fails, it is the only row.
    """
    case = study.cases[0]
    choices = model_choices(case)
    data = tabulate([Choice(ITSELF, case), *choices], run_choices(case, choices, 1, progress))
    return data.assign_attrs({"study": study.name, "key": case.key})


def run_choices(
    case: Case, choices: Sequence[Choice], repeats: int, progress: Progress
) -> list[xr.Dataset]:
    """Run a case, then its choices; of those that are short, return the fastest of repeats.

    A choice that cannot be has a run of nan. Ends early where the case itself fails.
    """
    total = 1 + len(choices)
    # each choice has little time, which compiling its equations would use up
    every = [case, *(one.case for one in choices if one.case)]
    needs = Needs.of(every)._replace(horizon=True)
    compile_once(needs, lambda remark: progress(0, total, remark))
    progress(0, total, "")
    runs = [fastest_run(bare(case), max(2, repeats))]  # the first one may load compiled code
    if not complete(runs[0]):
        return runs
    for done, one in enumerate(choices, 1):
        progress(done, total, "")
        other = one.case and bare(one.case, MAX_SECONDS)
        runs.append(fastest_run(other, repeats) if other else empty_run(runs[0]))
    progress(total, total, "")
    return runs


def fastest_run(case: Case, repeats: int) -> xr.Dataset:
    """Run a case, again where it is short, and return the run of the least wall time."""
    run = simulate(case)
    again = repeats - 1 if complete(run) and run["seconds"] < SLOW_SECONDS else 0
    every = [run, *(simulate(case) for _ in range(again))]
    return min(every, key=lambda one: float(one["seconds"]))


def empty_run(run: xr.Dataset) -> xr.Dataset:
    """Return a run without numbers, as of a case that cannot be."""
    lacking = {name: run[name] * math.nan for name in NAMES if run[name].dtype.kind == "f"}
    return run.assign(lacking | {"status": "missing", "reason": ""}).assign_attrs(regime="")


def tabulate(every: Sequence[Choice], runs: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return the metrics of runs of choices with their error bars, dim `choice`, all in SI.

    The first is the case itself. Metrics and bars are nan where a run failed, which `status` and
    `reason` show; `status` is missing where there is no such case, and `note` says why. `regime` is
    as in a run, `seconds` is the wall time.
    """
    every = every[: len(runs)]
    table = xr.concat([run[[*NAMES]].drop_attrs() for run in runs], "choice")
    for name in NAMES:
        table[name].attrs = runs[0][name].attrs
    regimes = [str(run.attrs.get("regime", "")) for run in runs]
    words = {
        "regime": (regimes, "how far the motion can be foretold"),
        "note": ([one.note for one in every], "assumed values, or why it cannot be"),
    }
    for name, (values, phrase) in words.items():
        table[name] = "choice", np.array(values, object), {"long_name": phrase}
    names = np.array([one.name for one in every], object)
    table = table.assign_coords(choice=("choice", names, {"long_name": "choice of the model"}))
    attrs = {"title": "metrics by choices of the model", "program": PROGRAM}
    return table.assign_attrs(attrs | {"detail": runs[0].attrs.get("detail", "")})


def trade(
    cases: Mapping[str, Case], repeats: int = 3, progress: Progress = no_progress
) -> xr.Dataset:
    """Return the metrics of cases under every change of the model; dims (scene, choice).

    Variables as `tabulate` has them.

    A change that a scene has no use for is missing there. `place_error` is that of the series
    kinematics as a share of the clearance, `acceleration_error` that of its acceleration (L2). Each
    case needs a joint with clearance.
    """
    found = {name: model_variants(case) for name, case in cases.items()}
    total, before = sum(2 + len(choices) for choices in found.values()), 1
    tables = []
    for scene, case in cases.items():
        choices = found[scene]

        def report_part(done: int, of: int, remark: str, before: int = before) -> None:
            progress(before + done, total, remark)

        runs = run_choices(case, choices, repeats, report_part)
        before += 2 + len(choices)
        if complete(runs[0]):
            runs.append(read_from_grid(runs[0], simulate(replace(bare(case), output=Output()))))
        tables.append(tabulate([Choice(ITSELF, case), *choices, Choice(GRID, case)], runs))
    names = [*dict.fromkeys(str(name) for data in tables for name in data["choice"].values)]
    lacking = {"status": "missing", "reason": "", "regime": "", "note": ""}
    whole = [data.reindex(choice=names, fill_value=lacking) for data in tables]
    scenes = xr.DataArray(list(cases), dims="scene", name="scene", attrs={"long_name": "case"})
    joined = xr.concat(whole, scenes, combine_attrs="override")
    errors = np.array([series_errors(case) for case in cases.values()])
    for number, (name, phrase) in enumerate(SERIES_ERRORS.items()):
        joined[name] = "scene", errors[:, number], {"units": "1", "long_name": phrase}
    return joined
