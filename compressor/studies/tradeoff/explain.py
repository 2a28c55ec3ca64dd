"""What a case models: its terms, its natural scales, its cost, and features without effect.

A feature has no effect where leaving it out changes peaks by less than the accuracy that the case
promises: model only what a scene requires.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any

import xarray as xr

from compressor.analysis import JointScales, describe_cases, healthy_twin, joint_scales
from compressor.cases import ACCURACY, Case, Study, points, to_si, with_ideal_joints
from compressor.digits import align_columns, plural
from compressor.metrics import JOINTS
from compressor.physics import state_names
from compressor.program import Progress, duration, no_progress
from compressor.solve import record, simulate
from compressor.studies.tradeoff import variants
from compressor.studies.tradeoff.page import ModelTable, model_table, percent

PEAKS = {"peak_acceleration": "acceleration", "peak_contact_force": "force"}


def explain(
    study: Study, job: int, workers: int, progress: Progress = no_progress
) -> dict[str, Any]:
    """Return what is known of a job of a study, by running it, too, without each feature.

    Seconds are the best of some runs, if they are short. `advice` is of each feature that the job
    pays for. progress: called with how many features have been tried, of how many.
    """
    case = study.cases[job]
    run, seconds = variants.run_fastest(case, 2)  # the first one may load compiled code
    good = run["status"] == "ok"
    active, absent = terms(case)
    worn = " and ".join(joint.replace("_", " ") for joint in variants.faulty(case))
    if case.body and good:
        active["body"] = body_words(case, run)
    advice: Sequence[dict[str, Any]] = ()
    if good and run["steps"] > 0:
        paid = [one for one in variants.make_variants(case) if one.left_out]
        table = model_table(variants.run_variants(case, paid, progress))
        advice = [*advise(paid, table, case)]
    return {
        "study": study.name,
        "jobs": study.jobs,
        "point": next(islice(points(study), job, None)),
        "machine": describe_cases([case]).lines(),
        "scene": f"clearance at the {worn}" if worn else "ideal joints",
        "unknowns": unknown_names(case),
        "active": active,
        "absent": absent,
        "scales": [*ideal_scales(case)],
        "accuracy": requested_accuracy(case),
        "rtol": case.rtol,
        "promise": promise(case),
        "method": case.solve.method,
        "reason": run["reason"].item(),
        "detail": run.attrs.get("detail", ""),
        "seconds": seconds,
        "solution_seconds": run["seconds"].item(),
        "other_work": other_work(case),
        "steps": int(run["steps"]),
        "evaluations": int(run["evaluations"]),
        "workers": workers,
        "sweep_seconds": seconds * study.jobs / min(workers, study.jobs),
        "advice": advice,
    }


def advise(
    paid: Sequence[variants.Variant], table: ModelTable, case: Case
) -> Iterator[dict[str, Any]]:
    """Yield how leaving each feature out changes peaks and time, and what it is needed for.

    Of the joints with clearance the greatest change counts; nan where one is not known.
    """
    left_out = {one.name: one.left_out for one in paid}
    for row in table.rows:
        changes = {}
        for name, words in PEAKS.items():
            every = [
                size
                for m, size in zip(table.measures, row.changes, strict=True)
                if m.variable == name and m.joint in ("", *variants.faulty(case))
            ]
            changes[words] = max(
                every, key=lambda size: (size != size, abs(size)), default=math.nan
            )
        yield {
            "name": row.name,
            "left_out": left_out[row.name],
            "changes": changes,
            "time_ratio": row.time_ratio,
            "needed_for": [w for w, size in changes.items() if abs(size) >= promise(case)],
            "note": row.note,
        }


def unknown_names(case: Case) -> tuple[str, ...]:
    """Return the names of the unknowns that are integrated.

    They are freedoms, bristles where friction has them, and the crank's own.
    """
    p = record(case)
    names, n, worn = state_names(p), int(p["freedoms"]), variants.faulty(case)
    bristles = names[2 * n + 2 : 2 * n + 4] if p["bristle_stiffness"] > 0.0 else ()
    found = names[:n] + tuple(
        name for name, joint in zip(bristles, JOINTS, strict=False) if joint in worn
    )
    return found + tuple(name for name in names[2 * n :] if name.startswith("crank's lag"))


def other_work(case: Case) -> list[str]:
    """Return the work of a job beside its solution, in words."""
    works = {
        "the runs that its error bars come from": case.wants_bars,
        "its time series": case.output.keep == "series",
        "the motion of its body": case.body,
        "the record of its sensor": case.sensor,
    }
    return [words for words, is_done in works.items() if is_done]


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


def ideal_scales(case: Case) -> Iterator[JointScales]:
    """Yield the natural scales of each joint with clearance, under its greatest force when ideal.

    The ideal machine has none of a case's features: its guide, drive and rod are ideal, too.
    """
    p, ideal = record(case), simulate(with_ideal_joints(case, features=False))
    for joint in variants.faulty(case):
        yield joint_scales(p, joint, float(ideal["peak_contact_force"].sel(joint=joint)))


# ---- terms in words -----------------------------------------------------------------------------


def terms(case: Case) -> tuple[dict[str, str], list[str]]:
    """Return the terms that a case computes, in words, and those that it leaves out at no cost."""
    ideal = not variants.faulty(case)
    own_keys = ("clearance_mm", "contact.law", "friction.law")  # with contact and friction
    shown = [row for row in variants.FEATURES if not (row.word or row.key.startswith(own_keys))]
    active = {row.name: paid_value(case, row) for row in shown if row.is_in(case)}
    absent = [row.name for row in shown if row.name not in active]
    if case.counterweight:
        force = to_si(case.counterweight, "kg mm") * case.omega**2
        active["counterweight"] = f"{case.counterweight:g} kg mm, {force:.4g} N"
    if ideal:
        return active, [*absent, "clearance", "contact"]
    widths = [f"{getattr(case.clearance_mm, joint):g} mm at the {joint.replace('_', ' ')}"
              for joint in variants.faulty(case)]  # fmt: skip
    active["clearance"] = ", ".join(widths)
    if case.worn_joint != case.joint:
        active["clearance"] += f"; worn: {case.worn_joint.replace('_', ' ')}"
    active["contact"] = list_fields(case.contact)
    return active, absent


def paid_value(case: Case, feature: variants.Feature) -> str:
    """Return the value by which a case pays for a feature."""
    group, dot, name = feature.key.partition(".")
    if feature.key == "friction" and case.friction:
        law = f"{case.friction.law}, " if case.friction.law else ""
        return f"{law}static {case.friction.static:g}, dynamic {case.friction.dynamic:g}"
    value = getattr(getattr(case, group), name) if dot else getattr(case, group)
    if not dot and hasattr(value, "__dataclass_fields__"):
        value = list_fields(value)
    return f"{feature.key} = {value}"


def list_fields(group: Any) -> str:
    """Return the keys of a group of a case that have a value, as text."""
    fields = {key: one for key, one in vars(group).items() if one is not None}
    return ", ".join(f"{key} {variants.format_value(one)}" for key, one in fields.items())


def body_words(case: Case, run: xr.Dataset) -> str:
    """Return how fast a case's body moves in words, and that of the healthy machine."""
    if "body_velocity_rms" not in run:
        return "no whole settled revolution, by which its velocity would be known"
    twin = healthy_twin(xr.Dataset(attrs=case.attributes()))
    own, *healthy = (
        " and ".join(f"{1e3 * rms:.3g}" for rms in one["body_velocity_rms"].values)
        for one in (run, twin) if one is not None
    )  # fmt: skip
    beside = f", with ideal joints {healthy[0]}" if healthy else ""
    return f"{own} mm/s rms along x and y{beside}"


# ---- as text ------------------------------------------------------------------------------------


def list_explanation(facts: dict[str, Any]) -> Iterator[str]:
    """Yield an explanation as it is printed."""
    point = ", ".join(f"{key} = {value}" for key, value in facts["point"].items())
    yield f"{facts['study']}: {plural(facts['jobs'])}" + (f"; explained: {point}" if point else "")
    count = len(facts["unknowns"])
    solved = f"{count} degrees of freedom" if count else "closed form, nothing integrated"
    method = f"{facts['accuracy'] or 'given'}: rtol {facts['rtol']:g}, {facts['method']}"
    failed = f"unknown: the job failed, {facts['reason']}: {facts['detail']}"
    parts = {
        "machine": align_columns(facts["machine"]),
        "motion": [
            f"{facts['scene']}: {solved}",
            *filter(None, ["; ".join(name.rpartition(",")[0] for name in facts["unknowns"])]),
        ],
        "active": [f"{term}: {words}" for term, words in facts["active"].items()],
        "absent": [f"{', '.join(facts['absent'])}: cost nothing"] if facts["absent"] else [],
        "scales": [text for joint in facts["scales"] for text in scale_lines(joint)],
        "tolerance": [f"{method}, for errors below {percent(facts['promise'])}"],
        "cost": [failed] if facts["reason"] else [*cost_lines(facts)],
    }
    lines = [("", word if n == 0 else "", text)
             for word, texts in parts.items() for n, text in enumerate(texts)]  # fmt: skip
    yield from align_columns(lines)
    if facts["advice"]:
        limit = percent(facts["promise"])
        head = ("without a feature", *PEAKS.values(), "time", f"needed, or below {limit}: can go")
        yield from align_columns([head, *map(advice_row, facts["advice"])], "<>>>")


def scale_lines(joint: JointScales) -> Iterator[str]:
    """Yield the natural scales of a joint."""
    depth, hertz = f"{joint.penetration * 1e6:.0f} µm", joint.swing_frequency
    load = f"the greatest force without clearance, {joint.force:.0f} N"
    yield f"{joint.joint.replace('_', ' ')}: {load}, presses the surfaces {depth} into each other"
    yield (
        f"in contact: damping ratio {joint.damping_ratio:.2g} (it bounces below 1); the journal "
        f"swings sideways in its bore at about {hertz:.0f} Hz, once in {1e3 / hertz:.2f} ms"
    )


def cost_lines(facts: dict[str, Any]) -> Iterator[str]:
    """Yield the cost of a job and of the sweep."""
    work = f" ({facts['steps']} steps, {facts['evaluations']} evaluations)" * bool(facts["steps"])
    yield f"{short_time(facts['seconds'])} a job{work}"
    rest = f", the rest for {', '.join(facts['other_work'])}" if facts["other_work"] else ""
    solved = short_time(facts["solution_seconds"])
    yield f"{solved} of it for the solution (`seconds` in show){rest}"
    if facts["jobs"] > 1:
        by = f"{plural(facts['jobs'])} with {plural(facts['workers'], 'worker')}"
        yield f"{short_time(facts['sweep_seconds'])} for {by}, if all cost the same"


def short_time(seconds: float) -> str:
    """Return a time in ms to three digits, or as `duration` does from a second on."""
    return duration(seconds) if seconds >= 1 else f"{1e3 * seconds:.3g} ms"


def advice_row(advice: dict[str, Any]) -> tuple[str, ...]:
    """Return how a feature moves peaks and time, and how to leave it out if it is not needed."""
    sizes = advice["changes"].values()
    changes = ("unknown" if math.isnan(size) else percent(size, "+") for size in sizes)
    is_open = any(map(math.isnan, sizes))
    why = advice["note"] or "not known, as of a chaotic motion"
    verdict = "needed" if advice["needed_for"] else why if is_open else advice["left_out"]
    return advice["name"], *changes, f"× {advice['time_ratio']:.2g}", verdict
