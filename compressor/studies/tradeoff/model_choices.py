"""What else the machine of a case may be, and what each of that makes of its metrics.

A choice is a case: another law of contact or friction, twice and half the contact's stiffness and
damping, oil, an elastic rod, play in the guide; or another value of a number that the file does not
give, or that a plant can only guess (`Plausible` in the table of keys), at both ends of its range.
`explain_models` runs those of one job of a study, one at a time, `trade` all features of several
cases; `compressor.studies.tradeoff.page` compares changes with error bars.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from compressor.cases import (
    READ_BY,
    Case,
    CaseError,
    Contact,
    Output,
    PerJoint,
    Study,
    joint_stiffness,
    keys_of,
    law_of,
    paper_notes,
    path_of,
    put,
    reads,
    row_of,
    stands_for,
    value_in,
    value_of,
    values_given,
)
from compressor.metrics import BARRED, JOINTS, METRICS
from compressor.program import PROGRAM, Progress, no_progress, report_progress
from compressor.solve import simulate
from compressor.store import Folder, read_store
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
SCALES = {"÷ 2": 0.5, "× 2": 2.0}  # of the contact's stiffness and damping
SCALED = ("contact.stiffness_N_per_mm15", "contact.damping_N_s_per_mm")  # by `scale_contact`
SAME_STIFFNESS = 1.01  # stiffnesses of two joints
FOLLOWING = ("switching", "back_pressure_MPa")
OWN_CORNERS = (
    "cannot be: the paper prints the corners of its own cylinder alone; gas: {switching: exact, "
    "back_pressure_MPa: 0} has those of any"
)
GROUPS = ("contact", "friction", "lubricant", "guide", "rod")  # that a choice may fill in
WORDS = ("status", "reason", "seconds")
# of every run, and what else is shown of it: rod load, body and sensor
COMPARED = (*METRICS, *(name for name, row in BARRED.items() if row.shown and name not in METRICS))


class Choice(NamedTuple):
    """Another machine that it may be: its name, its case, and what else that assumes.

    Where there can be no such case, `case` is None and `note` says why. varied: the number that is
    another one, with which the name begins; "" of another model.
    """

    name: str
    case: Case | None
    note: str = ""
    varied: str = ""


def vary_numbers(study: Study, job: int, named: Sequence[str] = ()) -> Iterator[Choice]:
    """Yield a job with each number in doubt at both ends of its plausible range.

    In doubt is what the file does not give, and what a plant can only guess; named: other keys that
    are, though the file gives them. A key that the file sweeps is not varied, nor is the paper's
    cylinder with the corners that the paper prints of it.
    """
    case, nested = study.cases[job], study.given(job)
    given, swept = values_given(nested), {axis.key for axis in study.axes}
    for key in _doubted_keys(case, named):
        row, whole = row_of(key), key.rpartition(".")[0]
        names = {key, whole, *stands_for(key)} if stands_for(whole) else {key, *stands_for(key)}
        doubt = row.plausible if row else None
        if doubt is None or key in SCALED or not reads(case, key):
            continue
        is_named, is_given = not names.isdisjoint(named), not names.isdisjoint(given)
        value = value_in(nested, key) if is_given else value_of(case, key)
        span = doubt.given if is_given else doubt.left_out
        span = span or (doubt.left_out if is_named else None)
        if span is None or value is None or (not names.isdisjoint(swept) and not is_named):
            continue
        group, _, name = key.partition(".")
        of_gas = key.startswith("gas.")
        if of_gas and case.gas.switching == "paper" and name != "back_pressure_MPa":
            yield Choice(key, None, OWN_CORNERS, key)
            continue
        # which follow from what else is given of a cylinder, and are to stay
        held = {own: getattr(case.gas, own) for own in FOLLOWING} if of_gas else {}
        if held:
            nested = nested | {group: held | nested.get(group, {})}
        base = nested
        if stands_for(whole) and not is_given:  # the other parts stay
            base = put(nested, path_of(whole), value)
        for end in span.ends(value):
            label = f"{key} {end:.4g}"
            try:
                other = Case.resolve(put(base, path_of(key), end))
            except CaseError as error:
                yield Choice(label, None, f"cannot be: {error.problems[0]}", key)
            else:
                yield Choice(label, other, doubt.why, key)


def _doubted_keys(case: Case, named: Sequence[str]) -> Iterator[str]:
    """Yield the keys of a case; of parts with one value in common each where one is named."""
    for key in keys_of(partial(value_of, case)):
        parts = stands_for(key)
        yield from parts if {*parts}.intersection(named) else (key,)


def model_choices(case: Case) -> list[Choice]:
    """Return the other models of a case's machine."""
    case = replace(case, wear=None)  # which is of no single run
    rubs = bool(case.friction)  # a case without friction has another friction law by its first row
    rows = [row for row in FEATURES if row.is_choice or (row.key == "friction" and not rubs)]
    contact = [row for row in rows if row.key == "contact.law"]
    others = [row for row in rows if row.key != "contact.law"]
    scaled = [*scale_contact(case), *widen_bearings(case)]
    found = [*toggle_features(case, contact), *scaled, *toggle_features(case, others)]
    return [check_choice(choice, case) for choice in found]


def model_variants(case: Case) -> list[Choice]:
    """Return `model_choices`, and the case with every other feature toggled, or another load."""
    case = replace(case, wear=None)
    chosen = model_choices(case)
    others = [row for row in FEATURES if not row.is_choice and row.key != "load"]
    names = {choice.name for choice in chosen}
    found = [one for one in toggle_features(case, others) if one.name not in names]
    other = {"spring": "gas", "gas": "spring"}.get(case.load)
    if other:
        found.append(attempt(f"{other} load", partial(replace, case, load=other)))
    return [*found, *chosen]


def toggle_features(case: Case, rows: Iterable[ModelFeature]) -> Iterator[Choice]:
    """Yield a case without each feature that it has, and with each that it has not."""
    for feature in rows:
        if feature.paid(case):
            yield attempt(feature.off, partial(feature.remove, case))
        else:
            added = attempt(feature.on, partial(feature.add, case))
            if added.case or added.note:
                yield added


def attempt(
    name: str, change: Callable[[], Case | None], note: str = "", varied: str = ""
) -> Choice:
    """Return the choice of the case that a change makes, or why there can be no such case."""
    try:
        return Choice(name, change(), note, varied)
    except CaseError as error:
        return Choice(name, None, f"cannot be: {error.problems[0]}", varied)


def scale_contact(case: Case) -> Iterator[Choice]:
    """Yield a case with twice and half its contact stiffness and damping."""
    if not faulty(case):
        return
    for words, factor in SCALES.items():
        yield with_stiffness(case, f"contact stiffness {words}", factor)
    contact = case.contact
    if SCALED[0] in paper_notes(case):
        values: dict[str, Any] = {"stiffness_N_per_mm15": None, "materials": ("steel", "steel")}
        yield attempt(
            "contact stiffness of its pins (Eq. 15)",
            lambda: with_values(case, "contact", **values, geometry="internal"),
            "steel on steel, in a bore",
        )
    for words, factor in SCALES.items():
        name = f"contact damping {words}"
        if contact.law == "impact" and contact.damping_N_s_per_mm > 0.0:
            damping = factor * contact.damping_N_s_per_mm
            change = partial(with_values, case, "contact", damping_N_s_per_mm=damping)
            yield attempt(name, change, varied="contact damping")
        elif contact.restitution is not None and contact.restitution < 1.0:
            # such laws damp by 1 - e, to the first order
            restitution = 1.0 - factor * (1.0 - contact.restitution)
            if restitution > 0.0:
                change = partial(with_values, case, "contact", restitution=restitution)
                yield attempt(name, change, varied="contact damping")
            else:
                least = 1.0 - 1.0 / factor
                why = f"needs a restitution above {least:g}"
                yield Choice(name, None, why, "contact damping")


def widen_bearings(case: Case) -> Iterator[Choice]:
    """Yield a case with bearings as long as wide, where theirs are as long as the paper's pin."""
    if case.lubricant and "lubricant.bearing_length_mm" in paper_notes(case):
        wide = PerJoint(*(2.0 * case.machine.pin_radius_mm.at(joint) for joint in JOINTS))
        change = partial(with_values, case, "lubricant", bearing_length_mm=wide)
        yield attempt("bearings as long as wide", change)


def with_stiffness(case: Case, name: str, factor: float) -> Choice:
    """Return a case with its contact stiffness, or the modulus that it follows from, scaled."""
    values: dict[str, Any] = {"materials": None}
    contact, worn = case.contact, faulty(case)
    if contact.law in ("johnson", "liu"):
        key, unit = "modulus_GPa", 1.0
        each = [composite_modulus_of(contact, joint) for joint in worn]
    else:
        key, unit, values["geometry"] = "stiffness_N_per_mm15", 1000.0**contact.exponent, None
        sizes = [(case.machine.pin_radius_mm.at(j), getattr(case.clearance_mm, j)) for j in worn]
        each = [joint_stiffness(contact, j, *at) for j, at in zip(worn, sizes, strict=True)]
    # one key serves both joints: materials may give each a stiffness of its own
    values[key] = factor * (math.prod(each) ** (1.0 / len(each)) / unit)
    alike = max(each) <= SAME_STIFFNESS * min(each)
    note = "" if alike else "of both joints"
    change = partial(with_values, case, "contact", **values)
    return attempt(name, change, note, "contact stiffness")


def composite_modulus_of(contact: Contact, joint: str) -> float:
    """Return the composite modulus E* (GPa) of a joint's contact, as given or of its materials."""
    if contact.modulus_GPa is not None:
        return contact.modulus_GPa
    # from the stiffness pi E* L of johnson, which reads no radius
    length = (contact.length_mm.at(joint) if contact.length_mm else math.nan) / 1000
    return (
        joint_stiffness(replace(contact, law="johnson"), joint, 1.0, 0.1) / (math.pi * length) / 1e9
    )


def check_choice(choice: Choice, case: Case) -> Choice:
    """Return a choice with what it assumes."""
    if choice.case is None:
        return choice
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
    if is_dataclass(value):  # of parts, told apart where they differ
        each = {part: shown_words(one) for part, one in vars(value).items()}
        alike = len({*each.values()}) == 1
        return next(iter(each.values())) if alike else ", ".join(map(" ".join, each.items()))
    return " on ".join(value) if isinstance(value, tuple) else str(value)


def bare(case: Case, limit: float = math.inf) -> Case:
    """Return a case that gives the same metrics with their error bars, and keeps no series.

    limit: seconds that its run may take.
    """
    seconds = min(case.solve.timeout_s, limit)
    solve = replace(case.solve, error_bars=True, timeout_s=seconds)
    output = Output("metrics", signals=case.output.signals)
    return replace(case, wear=None, output=output, solve=solve)


def choose_job(study: Study, folder: Folder) -> tuple[int, str]:
    """Return the number of the job of a study that is varied, and why that one.

    It is the one with the greatest known force on a joint of those stored in a folder of results;
    where there is none, the one with the greatest clearances.
    """
    if study.jobs == 1:
        return 0, "the job"
    rows = read_store(folder).rows
    positions = rows.find(study.keys)
    stored = np.flatnonzero(positions >= 0)
    if stored.size:
        numbers = rows.numbers(
            positions[stored], ("peak_contact_force", "peak_contact_force_error")
        )
        known = np.isfinite(numbers["peak_contact_force_error"])
        forces = np.where(known, numbers["peak_contact_force"], -1.0).max(axis=1)
        if forces.max() > 0.0:
            place = int(stored[forces.argmax()])
            return place, f"the one of {study.jobs} jobs with the greatest stored contact force"
    gaps = [sum(getattr(case.clearance_mm, j) for j in JOINTS) for case in study.cases]
    why = f"the one of {study.jobs} jobs with the greatest clearance, as none with a known force "
    return int(np.argmax(gaps)), f"{why}is stored"


def explain_models(
    study: Study, job: int = 0, named: Sequence[str] = (), progress: Progress = no_progress
) -> xr.Dataset:
    """Run a job of a study, with every number in doubt, and by every other model of its machine.

    named: as of `vary_numbers`. Returns the Dataset of `tabulate` with the attributes `study` and
    `key` (of the job). If the job itself fails, it is the only row.
    """
    case = study.cases[job]
    choices = [*vary_numbers(study, job, named), *model_choices(case)]
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
    needs = Needs.of(every)
    compile_once(needs, lambda remark: progress(0, total, remark))
    progress(0, total, "")
    # the first one may load compiled code
    runs = [compared(fastest_run(bare(case), max(2, repeats)))]
    if not complete(runs[0]):
        return runs
    for one in report_progress(choices, lambda done, _, remark: progress(1 + done, total, remark)):
        other = one.case and bare(one.case, MAX_SECONDS)
        runs.append(compared(fastest_run(other, repeats)) if other else empty_run(runs[0]))
    return runs


def fastest_run(case: Case, repeats: int) -> xr.Dataset:
    """Run a case, again where it is short, and return the run of the least wall time."""
    run = simulate(case)
    again = repeats - 1 if complete(run) and run["seconds"] < SLOW_SECONDS else 0
    every = [run, *(simulate(case) for _ in range(again))]
    return min(every, key=lambda one: float(one["seconds"]))


def compared(run: xr.Dataset) -> xr.Dataset:
    """Return what is compared of a run, with its attributes."""
    names = (name + end for name in COMPARED for end in ("", "_error"))
    return run[[*WORDS, *(name for name in names if name in run)]]


def empty_run(run: xr.Dataset) -> xr.Dataset:
    """Return a run without numbers, as of a case that cannot be."""
    lacking = {name: values * math.nan for name, values in run.items() if name not in WORDS[:2]}
    return run.assign(lacking | {"status": "missing", "reason": ""}).assign_attrs(regime="")


def tabulate(every: Sequence[Choice], runs: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return the metrics of runs of choices with their error bars, dim `choice`, all in SI.

    The first is the case itself. Metrics and bars are nan where a run failed, which `status` and
    `reason` show; `status` is missing where there is no such case, and `note` says why. `regime` is
    as in a run, `seconds` is the wall time.
    """
    every, names = every[: len(runs)], [*runs[0]]
    unknown = empty_run(runs[0])  # where a failed run has nothing of body and sensor
    whole = [run.assign({n: unknown[n] for n in names if n not in run}) for run in runs]
    table = xr.concat([run[names].drop_attrs() for run in whole], "choice")
    for name in names:
        table[name].attrs = runs[0][name].attrs
    regimes = [str(run.attrs.get("regime", "")) for run in runs]
    words = {
        "regime": (regimes, "how far the motion can be foretold"),
        "note": ([one.note for one in every], "assumed values, or why it cannot be"),
        "varied": ([one.varied for one in every], "the number that is another one"),
    }
    for name, (values, phrase) in words.items():
        table[name] = "choice", np.array(values, object), {"long_name": phrase}
    titles = np.array([one.name for one in every], object)
    table = table.assign_coords(choice=("choice", titles, {"long_name": "choice of the model"}))
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
    lacking = {"status": "missing", "reason": "", "regime": "", "note": "", "varied": ""}
    whole = [data.reindex(choice=names, fill_value=lacking) for data in tables]
    scenes = xr.DataArray(list(cases), dims="scene", name="scene", attrs={"long_name": "case"})
    joined = xr.concat(whole, scenes, combine_attrs="override")
    errors = np.array([series_errors(case) for case in cases.values()])
    for number, (name, phrase) in enumerate(SERIES_ERRORS.items()):
        joined[name] = "scene", errors[:, number], {"units": "1", "long_name": phrase}
    return joined
