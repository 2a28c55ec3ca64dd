"""What a case models: its terms, its natural scales, its cost, and features without effect.

A feature has no effect where leaving it out changes peaks by less than the accuracy that the
case promises: model only what a scene requires.
"""

import statistics
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import xarray as xr

from compressor.analysis import (
    cylinder_words,
    describe_machine,
    healthy_body_velocity_rms,
)
from compressor.cases import (
    ACCURACY,
    CYLINDRICAL,
    Case,
    Contact,
    Study,
    points,
    to_si,
    with_ideal_joints,
)
from compressor.metrics import JOINTS
from compressor.physics import state_names
from compressor.program import Progress, no_progress
from compressor.solve import (
    JointScales,
    expected_cost,
    joint_scales,
    record,
    simulate,
    stiffness_of,
)
from compressor.studies.tradeoff.features import FEATURES, Effect, ModelFeature, comparable, compare
from compressor.studies.tradeoff.model_choices import shown_words
from compressor.studies.tradeoff.work_precision import SLOW_SECONDS, complete, faulty

SCENES = {  # by the joints with clearance
    (): "ideal joints",
    ("big_end",): "clearance at the big end",
    ("small_end",): "clearance at the small end",
    ("big_end", "small_end"): "clearance at both joints",
}


@dataclass(frozen=True)
class Advice:
    """What leaving one feature out changes.

    `needed_for` names the quantities that change by more than the case promises; `removable`: none.
    """

    key: str
    name: str
    neutral: str
    effect: Effect
    needed_for: tuple[str, ...]
    removable: bool


@dataclass(frozen=True)
class Explanation:
    """What is known of one study: of its first job, measured, and of the sweep."""

    study: str
    path: str
    jobs: int
    point: dict[str, Any]  # of the sweep's axes, at the job explained
    machine: Any  # what `compressor.analysis.describe_machine` returns
    scene: str
    unknowns: tuple[str, ...]
    active: dict[str, str]  # term -> in words
    absent: tuple[str, ...]  # terms left out, at no cost
    scales: tuple[JointScales, ...]
    expected_steps: float  # by the scales alone, before the run; 0 where these do not suffice
    expected_seconds: float
    accuracy: str  # the word, or "" where rtol is given
    rtol: float
    promise: float
    method: str
    reason: str  # why the job failed; empty when it did not
    detail: str
    seconds: float  # wall time of the job, without storing it
    solution_seconds: float  # part of it: `seconds` of the job's results
    other_work: tuple[str, ...]  # what takes the rest of it
    steps: int
    evaluations: int
    workers: int
    sweep_seconds: float  # of all jobs, if they cost what this one does
    advice: tuple[Advice, ...]


def explain(
    study: Study,
    workers: int,
    repeats: int = 5,
    progress: Progress = no_progress,
) -> Explanation:
    """Return the explanation of a study's first job, by running it without each feature.

    Times are medians of `repeats`; a job above `bench.SLOW_SECONDS` is timed once. progress:
    called with how many features have been tried, of how many.
    """
    case = study.cases[0]
    run, seconds, solution_seconds = time_case(case, 1)
    repeats = repeats if seconds < SLOW_SECONDS else 1
    ended = complete(run)
    if repeats > 1:
        run, seconds, solution_seconds = time_case(case, repeats - 1)
    active, absent = terms(case)
    if case.body and ended:
        active["body"] = body_words(case, run)
    joints = tuple(ideal_scales(case))
    unknown = case.needs_mechanism or case.lubricant
    steps, expected = (0.0, 0.0) if unknown else expected_cost(case, joints)
    return Explanation(
        study=study.name,
        path=study.path,
        jobs=len(study.cases),
        point=next(points(study)),
        machine=describe_machine(replace(study, selected=[0])),
        scene=SCENES[tuple(faulty(case))],
        unknowns=unknown_names(case),
        active=active,
        absent=absent,
        scales=joints,
        expected_steps=steps,
        expected_seconds=expected,
        accuracy=requested_accuracy(case),
        rtol=case.rtol,
        promise=promise(case),
        method=case.solve.method,
        reason=run["reason"].item(),
        detail=run.attrs.get("detail", ""),
        seconds=seconds,
        solution_seconds=solution_seconds,
        other_work=other_work(case),
        steps=int(run["steps"]),
        evaluations=int(run["evaluations"]),
        workers=workers,
        sweep_seconds=seconds * len(study.cases) / min(workers, len(study.cases)),
        advice=tuple(advise(case, repeats, progress)) if ended and run["steps"] > 0 else (),
    )


def unknown_names(case: Case) -> tuple[str, ...]:
    """Return the names of the unknowns that are integrated.

    They are freedoms, bristles where friction has them, and the crank's own.
    """
    p = record(case)
    names, n = state_names(p), int(p["freedoms"])
    bristles = names[2 * n + 2 : 2 * n + 4] if p["bristle_stiffness"] > 0.0 else ()
    found = names[:n] + tuple(
        name for name, joint in zip(bristles, JOINTS, strict=False) if joint in faulty(case)
    )
    return found + tuple(name for name in names[2 * n :] if name.startswith("crank's lag"))


def time_case(case: Case, repeats: int) -> tuple[xr.Dataset, float, float]:
    """Run a case and return it, its wall time and that of its solution alone (s), both medians.

    Compiled code is there already.
    """
    run = simulate(case)
    seconds, of_solution = [], []
    for _ in range(repeats if complete(run) and run["seconds"].item() < SLOW_SECONDS else 1):
        began = time.perf_counter()
        run = simulate(case)
        seconds.append(time.perf_counter() - began)
        of_solution.append(run["seconds"].item())
    return run, statistics.median(seconds), statistics.median(of_solution)


def other_work(case: Case) -> tuple[str, ...]:
    """Return the work of a job beside its solution, in words."""
    found = ["the runs that its error bars come from"] if case.wants_bars else []
    found += ["its time series"] if case.output.keep == "series" else []
    found += ["the motion of its body"] if case.body else []
    return (*found, "the record of its sensor") if case.sensor else (*found,)


def requested_accuracy(case: Case) -> str:
    """Return the accuracy as the case file gives it; "" where it gives a tolerance."""
    if case.targets:
        return ", ".join(f"{name} to {target:g}" for name, target in case.targets)
    return "" if case.solve.rtol is not None else str(case.solve.accuracy)


def promise(case: Case) -> float:
    """Return the relative error that a case may have: given by number, or of its word.

    With an rtol in place of a word it is that of the word it is as tight as, and no less than
    draft's.
    """
    if case.targets:
        return min(target for _, target in case.targets)
    promises = [tier.promise for tier in ACCURACY.values() if case.rtol <= tier.rtol]
    return min(promises, default=ACCURACY["draft"].promise)


def terms(case: Case) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return the terms that a case computes, in words, and those that it leaves out at no cost."""
    ideal = not faulty(case)
    own_keys = ("clearance_mm", "contact.law", "friction.law")  # with contact and friction
    shown = [feature for feature in FEATURES if not feature.key.startswith(own_keys)]
    used = [f for f in shown if f.paid(case) and not (ideal and f.key == "friction")]
    active = {feature.name: paid_value(case, feature) for feature in used}
    absent = tuple(feature.name for feature in shown if feature not in used)
    if case.load == "gas" and case.gas.switching == "exact":
        active["cylinder"] = cylinder_words(case)
    if case.counterweight:
        active["counterweight"] = counterweight_words(case)
    if ideal:
        return active, (*absent, "clearance", "contact")
    widths = [f"{getattr(case.clearance_mm, joint):g} mm at the {joint.replace('_', ' ')}"
              for joint in faulty(case)]  # fmt: skip
    active["clearance"] = ", ".join(widths)
    if case.worn_joint != case.joint:
        active["clearance"] += f"; worn: {case.worn_joint.replace('_', ' ')}"
    active["contact"] = contact_words(case)
    return active, absent


def body_words(case: Case, run: xr.Dataset) -> str:
    """Return how fast a case's body moves in words, and that of the healthy machine."""
    if "body_velocity_rms" not in run:
        return "no whole settled revolution, by which its velocity would be known"
    both = run["body_velocity_rms"].values, healthy_body_velocity_rms(case)
    own, healthy = (" and ".join(f"{1e3 * one:.3g}" for one in rms) for rms in both)
    return f"{own} mm/s rms along x and y, with ideal joints {healthy}"


def counterweight_words(case: Case) -> str:
    """Return what a counterweight comes to in words, and by how much it lowers order 1."""
    force = to_si(case.counterweight, "kg mm") * case.omega**2
    words = f"{case.counterweight:g} kg mm opposite to the crank pin, {force:.4g} N"
    share = case.machine.balance
    if share is None:
        return words
    return (
        f"{words}: {share.rotating:g} of what turns with the pin and {share.reciprocating:g} of "
        "what reciprocates"
    )


def material_words(case: Case) -> str:
    """Return the materials of the joints with clearance in words; "" without any."""
    materials = case.contact.materials
    pairs = dict.fromkeys(materials.at(joint) for joint in faulty(case)) if materials else ()
    return " and ".join(" on ".join(pair) for pair in pairs)


def contact_words(case: Case) -> str:
    """Return the law, stiffness, exponent and damping of a contact in words, with their sources."""
    contact, usual = case.contact, Contact()
    shape = f"p = {contact.exponent:g}"
    if contact.law in CYLINDRICAL:
        material = material_words(case) or f"E* = {contact.modulus_GPa:g} GPa"
        lengths = dict.fromkeys(
            contact.length_mm.at(joint) for joint in faulty(case) if contact.length_mm
        )
        shape = f"{' and '.join(f'{length:g}' for length in lengths)} mm long"
    elif contact.materials:
        where = "in their bores" if contact.geometry == "internal" else "as of two discs"
        each = {
            f"{stiffness_of(case, joint) / 1000.0**contact.exponent:.4g}" for joint in faulty(case)
        }
        material = f"K = {' and '.join(sorted(each))} N/mm^p (Eq. 15, pins {where}: "
        material += material_words(case) + ")"
    else:
        paper = contact.stiffness_N_per_mm15 == usual.stiffness_N_per_mm15
        source = "Table 3, of a pin of 10 mm radius" if paper else "given"
        material = f"K = {contact.stiffness_N_per_mm15:g} N/mm^p ({source})"
    if contact.law != "impact":
        restitution = contact.restitution
        damped = "undamped" if restitution is None else f"restitution {restitution:g} (given)"
    else:
        damping = contact.damping_N_s_per_mm, contact.full_damping_mm
        paper = damping == (usual.damping_N_s_per_mm, usual.full_damping_mm)
        damped = f"C_max = {damping[0]:g} N s/mm from {damping[1]:g} mm on "
        damped += "(Table 3)" if paper else "(given)"
    return f"{contact.law}, {material}, {shape}, {damped}"


def paid_value(case: Case, feature: ModelFeature) -> str:
    """Return the value by which a case pays for a feature."""
    group, dot, name = feature.key.partition(".")
    if feature.key == "friction" and case.friction:
        law = f"{case.friction.law}, " if case.friction.law else ""
        return f"{law}static {case.friction.static:g}, dynamic {case.friction.dynamic:g}"
    value = getattr(getattr(case, group), name) if dot else getattr(case, group)
    if not dot and hasattr(value, "__dataclass_fields__"):
        fields = {key: one for key, one in vars(value).items() if one is not None}
        value = ", ".join(f"{key} {shown_words(one)}" for key, one in fields.items())
    return f"{feature.key} = {value}"


def ideal_scales(case: Case) -> Iterator[JointScales]:
    """Yield the natural scales of each joint with clearance, under its greatest force when ideal.

    The ideal machine has none of a case's features: its guide, drive and rod are ideal, too.
    """
    p, ideal = record(case), simulate(with_ideal_joints(case, features=False))
    for joint in faulty(case):
        yield joint_scales(p, joint, float(ideal["peak_contact_force"].sel(joint=joint)))


def paid_features(case: Case) -> list[ModelFeature]:
    """Return the features of the model that a case pays for."""
    return [feature for feature in FEATURES if feature.paid(case)]


def advise(case: Case, repeats: int, progress: Progress) -> Iterator[Advice]:
    """Yield the effect of each feature that a case pays for, and whether it could be left out."""
    paid = paid_features(case)
    if not paid:
        return
    allowed, known = promise(case), simulate(comparable(case))
    for done, feature in enumerate(paid):
        progress(done, len(paid), "")
        effect = compare(case, feature.remove(case), repeats, known)
        needed = {
            "peak acceleration": effect.change_peak_acceleration,
            "contact force": effect.change_peak_contact_force,
        }
        needed_for = tuple(name for name, change in needed.items() if not abs(change) < allowed)
        yield Advice(feature.key, feature.name, feature.neutral, effect, needed_for, not needed_for)
