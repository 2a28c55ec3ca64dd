"""What a case costs, and which of its features have no effect.

A feature has no effect where leaving it out changes peaks by less than the accuracy that the case
promises: model only what a scene requires.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any

from compressor import cases
from compressor.cases import Case, Study
from compressor.digits import align_columns, plural
from compressor.program import Progress, duration
from compressor.studies.tradeoff import changes, variants

PEAKS = {"peak_acceleration": "acceleration", "peak_contact_force": "force"}


def explain(study: Study, job: int, workers: int, progress: Progress) -> dict[str, Any]:
    """Return what is known of a job of a study, by running it, too, without each feature.

    Seconds are the best of some runs, if they are short. `advice` is of each feature that the job
    pays for. progress: called with how many features have been tried, of how many.
    """
    case = study.cases[job]
    run, seconds = variants.run_fastest(case, 2)  # the first one may load compiled code
    advice: Sequence[dict[str, Any]] = ()
    if run["status"] == "ok" and run["steps"] > 0:
        paid = [one for one in variants.make_variants(case) if one.left_out]
        table = changes.model_table(variants.run_variants(case, paid, progress))
        advice = [*advise(paid, table, case)]
    return {
        "study": study.name,
        "jobs": study.jobs,
        "point": next(islice(cases.points(study), job, None)),
        "rtol": case.rtol,
        "promise": promise(case),
        "method": case.solve.method,
        "reason": run["reason"].item(),
        "detail": run.attrs.get("detail", ""),
        "seconds": seconds,
        "steps": int(run["steps"]),
        "evaluations": int(run["evaluations"]),
        "workers": workers,
        "sweep_seconds": seconds * study.jobs / min(workers, study.jobs),
        "advice": advice,
    }


def advise(
    paid: Sequence[variants.Variant], table: changes.ModelTable, case: Case
) -> Iterator[dict[str, Any]]:
    """Yield how leaving each feature out changes peaks and time, and what it is needed for.

    Of the joints with clearance the greatest change counts; nan where one is not known.
    """
    left_out = {one.name: one.left_out for one in paid}
    for row in table.rows:
        moved = {}
        for name, words in PEAKS.items():
            every = [
                size
                for m, size in zip(table.measures, row.changes, strict=True)
                if m.variable == name and m.joint in ("", *variants.faulty(case))
            ]
            moved[words] = max(every, key=lambda size: (size != size, abs(size)), default=math.nan)
        yield {
            "name": row.name,
            "left_out": left_out[row.name],
            "changes": moved,
            "time_ratio": row.time_ratio,
            "needed_for": [w for w, size in moved.items() if abs(size) >= promise(case)],
            "note": row.note,
        }


def promise(case: Case) -> float:
    """Return the relative error that a case may have: given by number, or of its word.

    With an rtol in place of a word it is that of the word it is as tight as, and no less than
    draft's.
    """
    if case.targets:
        return min(target for _, target in case.targets)
    promises = [tier.promise for tier in cases.ACCURACY.values() if case.rtol <= tier.rtol]
    return min(promises, default=cases.ACCURACY["draft"].promise)


# ---- as text ------------------------------------------------------------------------------------


def list_explanation(facts: dict[str, Any]) -> Iterator[str]:
    """Yield an explanation as it is printed."""
    point = ", ".join(f"{key} = {value}" for key, value in facts["point"].items())
    yield f"{facts['study']}: {plural(facts['jobs'])}" + (f"; explained: {point}" if point else "")
    within = f"for errors below {changes.percent(facts['promise'])}"
    yield f"rtol {facts['rtol']:g}, {facts['method']}, {within}"
    if facts["reason"]:
        yield f"the job failed, {facts['reason']}: {facts['detail']}"
    else:
        yield from cost_lines(facts)
    if facts["advice"]:
        limit = changes.percent(facts["promise"])
        head = ("without a feature", *PEAKS.values(), "time", f"needed, or below {limit}: can go")
        yield from align_columns([head, *map(advice_row, facts["advice"])], "<>>>")


def cost_lines(facts: dict[str, Any]) -> Iterator[str]:
    """Yield the cost of a job and of the sweep."""
    work = f" ({facts['steps']} steps, {facts['evaluations']} evaluations)" * bool(facts["steps"])
    yield f"{short_time(facts['seconds'])} a job{work}"
    if facts["jobs"] > 1:
        by = f"{plural(facts['jobs'])} with {plural(facts['workers'], 'worker')}"
        yield f"{short_time(facts['sweep_seconds'])} for {by}, if all cost the same"


def short_time(seconds: float) -> str:
    """Return a time in ms to three digits, or as `duration` does from a second on."""
    return duration(seconds) if seconds >= 1 else f"{1e3 * seconds:.3g} ms"


def advice_row(advice: dict[str, Any]) -> tuple[str, ...]:
    """Return how a feature moves peaks and time, and how to leave it out if it is not needed."""
    sizes = advice["changes"].values()
    texts = ("unknown" if math.isnan(size) else changes.percent(size, "+") for size in sizes)
    is_open = any(map(math.isnan, sizes))
    why = advice["note"] or "not known, as of a chaotic motion"
    verdict = "needed" if advice["needed_for"] else why if is_open else advice["left_out"]
    return advice["name"], *texts, f"× {advice['time_ratio']:.2g}", verdict
