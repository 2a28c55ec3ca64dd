"""What `compsim explain` and `tradeoff` find, as lines of text."""

import itertools
from collections.abc import Iterable, Iterator, Sequence

import xarray as xr

from compressor.digits import align_columns, by_bar, plural
from compressor.program import duration
from compressor.solve import JointScales
from compressor.studies.tradeoff.explain import Advice, Explanation
from compressor.studies.tradeoff.page import NO_CHANGE, ModelRow, ModelTable, headline, model_table
from compressor.studies.tradeoff.work_precision import fastest

CELL, WIDTH = 12, 80  # columns of a change, and of a line
INDENT = 12  # columns of a heading
MOST_SHOWN = 5  # of what moves a metric


def list_changes(place: str, table: ModelTable) -> Iterator[str]:
    """Yield for each metric what moves it most, what has no number, and a summary.

    Both ends of a number stand in one line. place: which job it is of.
    """
    yield f"{place}:"
    still = []
    numbers = zip(table.measures, table.values, table.bars, strict=True)
    for n, (m, value, bar) in enumerate(numbers):
        lines = change_lines(table.most(n), n)
        if not lines:
            still.append(m.title)
            continue
        yield ""
        yield f"  {m.title}: {by_bar(value, bar, m.is_relative, bare=True)} {m.unit}".rstrip()
        yield from lines[:MOST_SHOWN]
        if len(lines) > MOST_SHOWN:
            yield f"    {len(lines) - MOST_SHOWN} more move it less"
    yield ""
    if still:
        yield f"  nothing is seen to move: {'; '.join(still)}"
    if table.unknown:
        why = "of what is not known, or not above 0, of the case itself"
        yield f"  no change is given {why}: {'; '.join(table.unknown)}"
    yield from blank_lines(table)
    yield headline(table)


def change_lines(rows: Sequence[ModelRow], n: int) -> list[str]:
    """Return a line on each thing that moves a measure: both ends of a number, or another model."""
    lines = []
    for _, group in itertools.groupby(rows, key=lambda row: row.varied or row.name):
        first, *rest = [*group]
        names = [first.name, *(row.name.removeprefix(first.varied).strip() for row in rest)]
        cells = "".join(f"{row.cells[n]:>{CELL}}" for row in (first, *rest))
        lines.append(f"    {', '.join(names):<{WIDTH - 4 - 2 * CELL}}{cells}")
    return lines


def blank_lines(table: ModelTable) -> Iterator[str]:
    """Yield what runs assume, or why they have no number of something."""
    heads = ["  assumed, or why there is no number of something:"]
    for row in table.rows:
        words = [cell for cell in row.cells if cell in NO_CHANGE]
        note = row.note if not row.varied or words == [*row.cells] else ""
        if text := note or ", ".join(dict.fromkeys(words)):
            yield from heads
            heads = []
            yield f"    {row.name}: {text}"


def list_explanation(facts: Explanation) -> Iterator[str]:
    """Yield an explanation as it is printed."""
    point = ", ".join(f"{key} = {value}" for key, value in facts.point.items())
    yield f"{facts.study}: {plural(facts.jobs)}" + (f"; explained: {point}" if point else "")
    yield from head("machine", align_columns(facts.machine.lines()))
    count = len(facts.unknowns)
    solved = f"{count} degrees of freedom" if count else "closed form, nothing integrated"
    unknowns = "; ".join(name.rpartition(",")[0] for name in facts.unknowns)
    yield from head("motion", filter(None, (f"{facts.scene}: {solved}", unknowns)))
    yield from head("active", (f"{term}: {words}" for term, words in facts.active.items()))
    if facts.absent:
        yield from head("absent", [f"{', '.join(facts.absent)}: cost nothing"])
    yield from head("scales", (text for joint in facts.scales for text in scale_lines(joint)))
    method = f"{facts.accuracy or 'given'}: rtol {facts.rtol:g}, {facts.method}"
    yield from head("tolerance", [f"{method}, for errors below {percent(facts.promise)}"])
    if facts.reason:
        why = f"unknown: the job failed, {facts.reason}: {facts.detail}"
        yield from head("cost", [why])
        return
    yield from head("cost", cost_lines(facts))
    yield from head("without", (advice_text(facts, one) for one in facts.advice))


def head(word: str, texts: Iterable[str]) -> Iterator[str]:
    """Yield texts in a column, the first beside a heading."""
    for text in texts:
        yield f"  {word:<{INDENT}}{text}"
        word = ""


def scale_lines(joint: JointScales) -> Iterator[str]:
    """Yield the natural scales of a joint."""
    depth, hertz = f"{joint.penetration * 1e6:.0f} µm", joint.swing_frequency
    load = f"the greatest force without clearance, {joint.force:.0f} N"
    yield f"{joint.joint.replace('_', ' ')}: {load}, presses the surfaces {depth} into each other"
    bounces = "does not bounce" if joint.damping_ratio >= 1.0 else "bounces"
    yield (
        f"in contact the journal {bounces} (damping ratio {joint.damping_ratio:.2g}), and swings "
        f"sideways in its bore at about {hertz:.0f} Hz, once in {1e3 / hertz:.2f} ms"
    )
    yield (
        f"longest time steps: explicit about {joint.explicit_step * 1e6:.3g} µs, limited by "
        f"{joint.limited_by}; implicit about {joint.implicit_step * 1e6:.3g} µs, limited by the "
        f"stiffness of the contact"
    )


def cost_lines(facts: Explanation) -> Iterator[str]:
    """Yield the cost of a job and of the sweep."""
    work = f" ({facts.steps} steps, {facts.evaluations} evaluations)" if facts.steps else ""
    yield f"{short_time(facts.seconds)} a job{work}"
    solved = f"{short_time(facts.solution_seconds)} of it for the solution (`seconds` in show)"
    rest = f", the rest for {', '.join(facts.other_work)}" if facts.other_work else ""
    yield solved + rest
    if facts.expected_steps:
        seconds = short_time(facts.expected_seconds, 1)
        yield f"by the scales alone about {facts.expected_steps:.1g} steps, {seconds}"
    if facts.jobs > 1:
        by = f"{plural(facts.jobs)} with {plural(facts.workers, 'worker')}"
        yield f"{facts.sweep_seconds:.2g} s for {by}, if all cost the same"


def short_time(seconds: float, digits: int = 3) -> str:
    """Return a time in ms to some digits, or as `duration` does from a second on."""
    return duration(seconds) if seconds >= 1 else f"{1e3 * seconds:.{digits}g} ms"


def advice_text(facts: Explanation, advice: Advice) -> str:
    """Return the sentence on what leaving a feature out does, and whether to."""
    effect = advice.effect
    if effect.reason:
        return f"{advice.name}: the run failed, {effect.reason}"
    saved = 1 - effect.time_ratio
    changes = (
        f"peak acceleration {percent(effect.change_peak_acceleration, '+')}",
        f"contact force {percent(effect.change_peak_contact_force, '+')}",
        f"{'saves' if saved >= 0 else 'costs'} {100 * abs(saved):.0f} % of the solution's time",
    )
    text = f"{advice.name}: {', '.join(changes)}"
    if advice.removable:
        return f"{text}; less than {percent(facts.promise)}: leave it out ({advice.neutral})"
    return f"{text}; needed for {' and '.join(advice.needed_for)}"


def percent(share: float, sign: str = "") -> str:
    """Return a share in per cent, to two digits or whole."""
    return f"{100 * share:{sign}z{'.0f' if abs(share) >= 1 else '.2g'}} %"


def list_fastest(study: xr.Dataset) -> Iterator[str]:
    """Yield the fastest method for each decade of error, and the paper's numerics."""
    rows = [("case", "error below", "method", "rtol", "ms")]
    for row in fastest(study):
        error, rtol = (f"{row[name]:.0e}" for name in ("error_below", "rtol"))
        rows.append((row["scene"], error, row["method"], rtol, f"{1e3 * row['seconds']:.1f}"))
    yield from align_columns(rows, "<><>>")
    for name in study["scene"].values:
        one = study.sel(scene=name)
        seconds, error, peak = (
            one[f"paper_{what}"].item()
            for what in ("seconds", "error_acceleration", "error_peak_acceleration")
        )
        yield (
            f"{name}: the paper's BDF at 1e-5 takes {seconds:.2g} s; error of acceleration "
            f"{error:.1e}, of its peak on the output grid {peak:.1e}"
        )


def list_trade(trade: xr.Dataset) -> Iterator[str]:
    """Yield the effect of each change of the model on each scene, and its time over the scene's."""
    for scene in trade["scene"].values:
        one = trade.sel(scene=scene)
        table = model_table(one)
        yield from list_changes(scene, table)
        ratios = [f"{row.name} × {row.time_ratio:.2g}" for row in table.rows if row.time_ratio > 0]
        yield f"times over the case's own: {'; '.join(ratios)}"
        place, acceleration = one["place_error"].item(), one["acceleration_error"].item()
        yield (
            f"the series of Eq. 3-4 would misplace the crosshead by {place:.0%} of the clearance, "
            f"and change the ideal acceleration by {acceleration:.2%}"
        )
        yield ""
