"""A case with one thing otherwise: another model of its machine, or another value of a number.

`FEATURES` has a row for each feature of the model, `make_variants` makes cases of the rows, and
`vary_numbers` of the numbers in doubt: those that the file does not give, or that a plant can only
guess (`Plausible` of `cases`), at both ends of their range. `run_variants` runs them.
"""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from compressor import cases, metrics, program, solve, store, sweep
from compressor.cases import Case, Study
from compressor.metrics import JOINTS

ITSELF = "the case itself"
MAX_SECONDS = 30.0  # of a variant
SLOW_SECONDS = 0.25  # of a run that is timed once
REPEATS = 3  # of shorter ones; the fastest counts
RESTITUTION = 0.9  # of a law that damps by it, where the case has none
STEEL = ("steel", "steel")  # where a law needs materials, and the case has none
UNDAMPED = ("impact", "hertz")  # laws that no restitution damps
SCALES = {"÷ 2": 0.5, "× 2": 2.0}  # of the contact's stiffness and damping
SCALED = ("contact.stiffness_N_per_mm15", "contact.damping_N_s_per_mm")
SAME_STIFFNESS = 1.01  # stiffnesses of two joints
OWN_CORNERS = (
    "cannot be: the paper prints the corners of its own cylinder alone; gas: {switching: exact, "
    "back_pressure_MPa: 0} has those of any"
)
WORDS = ("status", "reason", "regime", "seconds")
# of every run, and what else is shown of it: rod load, body and sensor
COMPARED = (
    *metrics.METRICS,
    *(name for name, row in metrics.BARRED.items() if row.shown and name not in metrics.METRICS),
)

Values = Mapping[str, Any]  # of a case file, by dotted key
OfCase = Values | Callable[[Case], Values | None] | None  # None: not for this case


def faulty(case: Case) -> list[str]:
    """Return the joints of a case that have clearance."""
    return [joint for joint in JOINTS if getattr(case.clearance_mm, joint) > 0]


def change(case: Case, values: Values) -> Case:
    """Return a case with other values. Raises CaseError where there is no such case."""
    nested = case.values()
    for key, value in values.items():
        nested = cases.put(nested, cases.path_of(key), value)
    return Case.resolve(nested)


# ---- other models -------------------------------------------------------------------------------


def contact_values(law: str, case: Case) -> Values | None:
    """Return the values of another contact law; None without any contact.

    What the law needs and the case does not have is a default: its stiffness, steel on steel, a
    joint as long as wide, a restitution of 0.9.
    """
    contact = case.contact
    if not faulty(case):
        return None
    # without a geometry, materials would be those of pins in their bores
    values: dict[str, Any] = {"contact.law": law, "contact.geometry": contact.geometry}
    if law not in UNDAMPED:
        values["contact.restitution"] = contact.restitution or RESTITUTION
    if law in cases.CYLINDRICAL:
        length = contact.length_mm and vars(contact.length_mm)
        values["contact.length_mm"] = length or bearing_length(case)
        if not (contact.materials or contact.modulus_GPa):
            values |= {"contact.materials": STEEL, SCALED[0]: None}
    elif not (contact.materials or contact.stiffness_N_per_mm15):
        values[SCALED[0]] = type(contact)().stiffness_N_per_mm15
    return values


def friction_values(law: str, case: Case) -> Values | None:
    """Return the values of another friction law; None where nothing rubs."""
    if not case.friction or not faulty(case):
        return None
    if law == "lugre" and case.friction.ideal_joints:  # which have no bristles
        return None
    return {"friction.law": law}


def bearing_length(case: Case) -> Any:
    """Return the length of a case's bearings (mm): of its oil film, or as long as wide."""
    if case.lubricant:
        return vars(case.lubricant.bearing_length_mm)
    return 2.0 * min(vars(case.machine.pin_radius_mm).values())


def oil_values(case: Case) -> Values | None:
    """Return the values of an oil film in the bearings; None without any clearance."""
    length = bearing_length(case)
    return {"lubricant": {"bearing_length_mm": length}} if faulty(case) else None


def rod_values(case: Case) -> Values:
    """Return the values of an elastic steel bar of the section that has the rod's mass.

    The default section is that of the default rod; another one is as wide to its depth.
    """
    machine, usual = case.machine, Case().machine
    mass = machine.rod_mass_kg / usual.rod_mass_kg
    scale = (mass * usual.rod_length_mm / machine.rod_length_mm) ** 0.5
    bar = vars(change(Case(), {"rod": True}).rod)
    return {"rod": {name: round(scale * bar[name], 2) for name in ("depth_mm", "width_mm")}}


def rubbing_values(case: Case) -> Values | None:
    """Return the values by which ideal joints rub as worn ones do; None where none is ideal."""
    if not case.friction or case.friction.law == "lugre" or len(faulty(case)) == len(JOINTS):
        return None
    return {"friction.ideal_joints": True}


def clearance_values(joint: str, case: Case) -> Values | None:
    """Return the values of a small clearance in the joint that is ideal; None of another case."""
    is_one = len(faulty(case)) == 1 and faulty(case) != [joint]
    return {"joint": "both", f"clearance_mm.{joint}": 0.001} if is_one else None


def ideal_values(joint: str, case: Case) -> Values | None:
    """Return the values by which one of two worn joints is ideal, and concentric at the start."""
    other = next(name for name in JOINTS if name != joint)
    centred = {f"initial_offset_mm.{joint}_{axis}": 0.0 for axis in "xy"}
    return {"joint": other, **centred} if len(faulty(case)) == 2 else None


class Feature(NamedTuple):
    """A feature of the model: what a case file gives with it, and without it.

    key: which a case sets that has the feature, to `word` where that is given; off: name of a case
    that is changed so. is_choice: another model of the same machine, no other machine;
    others are what `make tradeoff` tries.
    """

    name: str
    key: str
    given: OfCase
    left_out: OfCase
    off: str = ""
    is_choice: bool = False
    word: str = ""

    def is_in(self, case: Case) -> bool:
        """Return whether a case has the feature, and so pays for it."""
        value = case.load if self.key == "load" else cases.value_of(case, self.key)
        has = value == self.word if self.word else value not in (None, False, 0, "none")
        return has and cases.reads(case, self.key)


SPRING_DAMPING, GRAVITY = "spring.damping_N_s_per_mm", "machine.gravity_m_per_s2"
FEATURES = (
    Feature("friction", "friction", lambda case: {"friction": {}} if faulty(case) else None,
            {"friction": False}),
    Feature("spring damping", SPRING_DAMPING,
            lambda case: {SPRING_DAMPING: Case().spring.damping_N_s_per_mm}
            if case.load == "spring" else None,
            {SPRING_DAMPING: 0}),
    Feature("gravity", GRAVITY, {GRAVITY: 9.81}, {GRAVITY: 0}),
    Feature("back pressure", "gas.back_pressure_MPa", None, {"gas.back_pressure_MPa": 0}),
    Feature("load", "load", None, {"load": "none"}),
    Feature("gas load", "load", lambda case: {"load": "gas"} if case.load == "spring" else None,
            None, word="gas"),
    Feature("spring load", "load", lambda case: {"load": "spring"} if case.load == "gas" else None,
            None, word="spring"),
    *(Feature(f"clearance of the {joint.replace('_', ' ')}", f"clearance_mm.{joint}",
              partial(clearance_values, joint), partial(ideal_values, joint),
              f"ideal {joint.replace('_', ' ')}")
      for joint in JOINTS),
    Feature("friction of ideal joints", "friction.ideal_joints", rubbing_values,
            {"friction.ideal_joints": False}),
    Feature("friction of the guide", "guide", {"guide": True}, {"guide": None}, "ideal guide"),
    Feature("speed that gives way", "drive", {"drive": True}, {"drive": None}, "steady speed"),
    *(Feature(f"contact law: {law}", "contact.law", partial(contact_values, law),
              partial(contact_values, "impact"), "contact law: impact", True, law)
      for law in cases.CONTACT_LAWS if law != "impact"),
    *(Feature(f"friction law: {law}", "friction.law", partial(friction_values, law),
              {"friction.law": "adams"}, "friction law: adams", True, law)
      for law in cases.FRICTION_LAWS if law != "adams"),
    Feature("play of the guide", "guide.clearance_mm", {"guide.clearance_mm": 0.05},
            {"guide.clearance_mm": 0}, "guide without play", True),
    Feature("oil film", "lubricant", oil_values, {"lubricant": None}, "dry joints", True),
    Feature("elastic rod", "rod", rod_values, {"rod": None}, "rigid rod", True),
)  # fmt: skip


class Variant(NamedTuple):
    """A case with one thing otherwise: its name, the case, and what else that assumes.

    Where there can be no such case, `case` is None and `note` says why. varied: the number that is
    another one, with which the name begins; left_out: how a case file leaves out what the case has
    and this one has not.
    """

    name: str
    case: Case | None
    note: str = ""
    varied: str = ""
    left_out: str = ""


def make_variants(case: Case) -> Iterator[Variant]:
    """Yield a case without each feature that it has, and with each that it may have."""
    for row in FEATURES:
        is_in = row.is_in(case)
        values = row.left_out if is_in else row.given
        values = values(case) if callable(values) else values
        if values is not None:
            name = (row.off or f"no {row.name}") if is_in else row.name
            yield vary(case, name, values, left_out=file_text(values) if is_in else "")


def file_text(values: Values) -> str:
    """Return the first of some values as a case file has it."""
    key, value = next(iter(values.items()))
    return f"no {key}" if value is None else f"{key}: {str(value).lower()}"


def other_models(case: Case) -> Iterator[Variant]:
    """Yield the other models of a case's machine: laws, stiffness, damping, oil, rod and guide.

    A case without friction has another friction law by having any.
    """
    choices = {row.name for row in FEATURES if row.is_choice}
    choices |= {row.off for row in FEATURES if row.is_choice}
    choices |= set() if case.friction else {"friction"}
    yield from (one for one in make_variants(case) if one.name in choices)
    yield from scale_contact(case)


def vary(case: Case, name: str, values: Values, note: str = "", **more: Any) -> Variant:
    """Return a variant of a case by other values, with what it assumes, or why it cannot be."""
    try:
        other = change(case, values)
    except cases.CaseError as error:
        return Variant(name, None, f"cannot be: {error.problems[0]}", **more)
    return Variant(
        name, other, ", ".join(filter(None, [note, *list_assumed_values(case, other)])), **more
    )


def list_assumed_values(case: Case, other: Case) -> Iterator[str]:
    """Yield the values that the other case reads and the case has not, as `key value`."""
    for key in cases.keys_of(partial(cases.value_of, other)):
        value = cases.value_of(other, key)
        is_new = value != cases.value_of(case, key) or not cases.reads(case, key)
        if value and not isinstance(value, str | bool) and is_new and cases.reads(other, key):
            whole, _, name = key.rpartition(".")
            yield f"{key if cases.stands_for(whole) else name} {format_value(value)}"


def format_value(value: Any) -> str:
    """Return a value of a case file as text."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if hasattr(value, "__dataclass_fields__"):  # of parts, told apart where they differ
        each = {part: format_value(one) for part, one in vars(value).items()}
        alike = len({*each.values()}) == 1
        return next(iter(each.values())) if alike else ", ".join(map(" ".join, each.items()))
    return " on ".join(value) if isinstance(value, tuple) else str(value)


def scale_contact(case: Case) -> Iterator[Variant]:
    """Yield a case with twice and half its contact stiffness and damping.

    With the stiffness of its pins too, and bearings as long as wide, where those are the paper's.
    """
    contact, notes = case.contact, cases.paper_notes(case)
    if faulty(case):
        for words, factor in SCALES.items():
            values, note = scaled_stiffness(case, factor)
            name = f"contact stiffness {words}"
            yield vary(case, name, values, note, varied="contact stiffness")
        if SCALED[0] in notes:
            values = {"contact.materials": STEEL, "contact.geometry": "internal", SCALED[0]: None}
            yield vary(case, "contact stiffness of its pins (Eq. 15)", values,
                       "steel on steel, in a bore")  # fmt: skip
        for words, factor in SCALES.items():
            name, more = f"contact damping {words}", {"varied": "contact damping"}
            if contact.law == "impact" and contact.damping_N_s_per_mm > 0.0:
                yield vary(case, name, {SCALED[1]: factor * contact.damping_N_s_per_mm}, **more)
            elif contact.restitution is not None and contact.restitution < 1.0:
                # such laws damp by 1 - e, to the first order
                restitution = 1.0 - factor * (1.0 - contact.restitution)
                if restitution > 0.0:
                    yield vary(case, name, {"contact.restitution": restitution}, **more)
                else:
                    note = f"needs a restitution above {1.0 - 1.0 / factor:g}"
                    yield Variant(name, None, note, **more)
    if case.lubricant and "lubricant.bearing_length_mm" in notes:
        wide = {joint: 2.0 * case.machine.pin_radius_mm.at(joint) for joint in JOINTS}
        yield vary(case, "bearings as long as wide", {"lubricant.bearing_length_mm": wide})


def scaled_stiffness(case: Case, factor: float) -> tuple[Values, str]:
    """Return the values of a scaled contact stiffness, or modulus, and a note of both joints.

    One key serves both joints, which materials may give a stiffness each: their geometric mean.
    """
    contact, worn = case.contact, faulty(case)
    values: dict[str, Any] = {"contact.materials": None}
    if contact.law in cases.CYLINDRICAL:
        key, unit = "contact.modulus_GPa", 1e9
        lines = change(case, {"contact.law": "johnson"})  # whose stiffness is pi E* L
        length = contact.length_mm
        assert length
        each = [solve.stiffness_of(lines, j) / (math.pi * length.at(j) / 1e3) for j in worn]
        each = [contact.modulus_GPa * unit] if contact.modulus_GPa else each
    else:
        key, unit = SCALED[0], 1000.0**contact.exponent
        each = [solve.stiffness_of(case, joint) for joint in worn]
    values[key] = factor * (math.prod(each) ** (1.0 / len(each)) / unit)
    return values, "" if max(each) <= SAME_STIFFNESS * min(each) else "of both joints"


# ---- numbers in doubt ---------------------------------------------------------------------------


def vary_numbers(study: Study, job: int) -> Iterator[Variant]:
    """Yield a job with each number in doubt at both ends of its plausible range.

    In doubt is what the file does not give, and what a plant can only guess. A key that the file
    sweeps is not varied, nor is the paper's cylinder with the corners that the paper prints of it.
    """
    case, nested = study.cases[job], study.given(job)
    given, swept = cases.values_given(nested), {axis.key for axis in study.axes}
    for key in cases.keys_of(partial(cases.value_of, case)):
        whole = key.rpartition(".")[0]
        names = {key, *cases.stands_for(key)} | ({whole} if cases.stands_for(whole) else set())
        doubt = cases.PLAUSIBLE.get(key) or cases.PLAUSIBLE.get(whole)
        if doubt is None or key in SCALED or not cases.reads(case, key) or names & swept:
            continue
        is_given = not names.isdisjoint(given)
        value = cases.value_of(nested if is_given else case, key)
        span = doubt.given if is_given else doubt.left_out
        if span is None or value is None:
            continue
        base = nested
        if key.startswith("gas."):
            if case.gas.switching == "paper" and key != "gas.back_pressure_MPa":
                yield Variant(key, None, OWN_CORNERS, key)
                continue
            # which follow from what else is given of a cylinder, and are to stay
            held = {key.removeprefix("gas."): cases.value_of(case, key) for key in cases.FOLLOWING}
            base = nested | {"gas": held | nested.get("gas", {})}
        if cases.stands_for(whole) and not is_given:  # the other parts stay
            base = cases.put(base, cases.path_of(whole), value)
        for end in span.ends(value):
            label = f"{key} {end:.4g}"
            try:
                other = Case.resolve(cases.put(base, cases.path_of(key), end))
                yield Variant(label, other, doubt.why, key)
            except cases.CaseError as error:
                yield Variant(label, None, f"cannot be: {error.problems[0]}", key)


# ---- runs ---------------------------------------------------------------------------------------


def choose_job(study: Study, folder: store.Folder) -> tuple[int, str]:
    """Return the number of the job of a study that matters most, and why that one.

    It is the one with the greatest known force on a joint of those stored in a folder of results;
    where there is none, the one with the greatest clearances.
    """
    if study.jobs == 1:
        return 0, "the job"
    stored = store.read_store(folder)
    positions = stored.find(study.keys)
    there = np.flatnonzero(positions >= 0)
    if there.size:
        numbers = stored.numbers(
            positions[there], ("peak_contact_force", "peak_contact_force_error")
        )
        known = np.isfinite(numbers["peak_contact_force_error"])
        forces = np.where(known, numbers["peak_contact_force"], -1.0).max(axis=1)
        if forces.max() > 0.0:
            place = int(there[forces.argmax()])
            return place, f"the one of {study.jobs} jobs with the greatest stored contact force"
    gaps = [sum(getattr(case.clearance_mm, j) for j in JOINTS) for case in study.cases]
    why = f"the one of {study.jobs} jobs with the greatest clearance, as none with a known force "
    return int(np.argmax(gaps)), f"{why}is stored"


def explain_models(
    study: Study, job: int, progress: program.Progress = program.no_progress
) -> xr.Dataset:
    """Run a job of a study, with every number in doubt, and by every other model of its machine.

    Returns the Dataset of `run_variants`.
    """
    case = replace(study.cases[job], wear=None)  # which is of no single run
    return run_variants(case, [*vary_numbers(study, job), *other_models(case)], progress)


def run_variants(
    case: Case, others: Iterable[Variant], progress: program.Progress = program.no_progress
) -> xr.Dataset:
    """Run a case and its variants; return their metrics with error bars, dim `choice`, in SI.

    The first is the case itself, alone if it fails. Metrics are nan where a run failed, which
    `status` and `reason` show, and where there is no such case, whose `status` is missing.
    `seconds`: of the solution, the best of some runs; `varied`, `note`: of the variant.
    """
    every = [Variant(ITSELF, case), *others]
    # each variant has little time, which compiling its equations would use up
    parts = sweep.needed_parts([one.case for one in every if one.case])
    sweep.compile_once(parts, lambda remark: progress(0, len(every), remark))
    runs: list[xr.Dataset] = []
    names = [name + end for name in COMPARED for end in ("", "_error")]
    for one in program.report_progress(every, progress):
        if one.case is None:
            runs.append(without_numbers(runs[0]))
            continue
        # the first run of the case itself may load compiled code
        limit, least = (MAX_SECONDS, 1) if runs else (math.inf, 2)
        seconds = min(one.case.solve.timeout_s, limit)
        settings = replace(one.case.solve, error_bars=True, timeout_s=seconds)
        output = cases.Output("metrics", signals=one.case.output.signals)
        run, _ = run_fastest(replace(one.case, wear=None, output=output, solve=settings), least)
        runs.append(run[[*WORDS, *(name for name in names if name in run)]])
        if runs[0]["status"] != "ok":
            break
    lacking = without_numbers(runs[0])  # where a failed run has nothing of body and sensor
    whole = [run.assign({n: lacking[n] for n in lacking if n not in run}) for run in runs]
    table = xr.concat([run[[*lacking]].drop_attrs() for run in whole], "choice")
    for name in lacking:
        table[name].attrs = runs[0][name].attrs
    for column, field in (("choice", "name"), ("note", "note"), ("varied", "varied")):
        values = [getattr(one, field) for one in every[: len(runs)]]
        table[column] = "choice", np.array(values, object)
    return table.assign_attrs(detail=runs[0].attrs.get("detail", ""))


def run_fastest(case: Case, least: int) -> tuple[xr.Dataset, float]:
    """Run a case as often as `least`, and again where it is short.

    Returns the run whose solution took the least wall time, and its own wall time with all else, s.
    """
    runs: list[tuple[xr.Dataset, float]] = []
    while len(runs) < least or (len(runs) < REPEATS and runs[-1][0]["seconds"] < SLOW_SECONDS):
        began = time.perf_counter()
        run = solve.simulate(case)
        runs.append((run, time.perf_counter() - began))
        if run["status"] != "ok":
            break
    return min(runs, key=lambda one: one[0]["seconds"].item())


def without_numbers(run: xr.Dataset) -> xr.Dataset:
    """Return a run without numbers, as of a case that cannot be."""
    words = {"status": "missing", "reason": "", "regime": ""}
    return run.assign({name: run[name] * math.nan for name in run if name not in words} | words)
