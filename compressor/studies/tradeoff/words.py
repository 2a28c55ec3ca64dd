"""What `compsim explain` and `tradeoff` find, as lines of text."""

import itertools
from collections.abc import Iterator, Sequence

import xarray as xr

from compressor.digits import by_bar, plural
from compressor.program import duration
from compressor.solve import JointScales
from compressor.studies.tradeoff.explain import Explanation
from compressor.studies.tradeoff.page import NO_CHANGE, ModelRow, ModelTable, headline, model_table
from compressor.studies.tradeoff.work_precision import fastest

CELL, WIDTH = 12, 80  # columns of a change, and of a line
INDENT = 12  # columns of a heading
MOST_SHOWN = 5  # of what moves a metric


def heading(word: str, text: str) -> str:
    """Return a text beside a heading."""
    return f"  {word:<{INDENT}}{text}"


def model_lines(place: str, table: ModelTable) -> Iterator[str]:
    """Yield for each metric what moves it most, what has no number, and a summary.

    Both ends of a number stand in one line. place: which job it is of.
    """
    yield f"{place}:"
    still = []
    numbers = zip(table.measures, table.values, table.bars, strict=True)
    for n, (m, value, bar) in enumerate(numbers):
        moving = table.most(n)
        if not moving:
            still.append(m.title)
            continue
        yield ""
        value_text = by_bar(value, bar, m.is_relative, bare=True)
        yield f"  {m.title}: {value_text} {m.unit}".rstrip()
        lines = [*change_lines(moving, n)]
        yield from lines[:MOST_SHOWN]
        if rest := len(lines) - MOST_SHOWN:
            yield from [f"    {rest} more move it less"] * (rest > 0)
    yield ""
    if still:
        yield f"  nothing is seen to move: {'; '.join(still)}"
    yield from unknown_lines(table)
    yield headline(table)


def change_lines(rows: Sequence[ModelRow], n: int) -> Iterator[str]:
    """Yield a line on each thing that moves a measure: both ends of a number, or another model."""
    for _, group in itertools.groupby(rows, key=lambda row: row.varied or row.name):
        each = [*group]
        first, varied = each[0].name, each[0].varied
        rest = [row.name.removeprefix(varied).strip() for row in each[1:]]
        cells = "".join(f"{row.cells[n]:>{CELL}}" for row in each)
        yield f"    {', '.join([first, *rest]):<{WIDTH - 4 - 2 * CELL}}{cells}"


def unknown_lines(table: ModelTable) -> Iterator[str]:
    """Yield what the case itself has no number of, and what runs assume or have no number of."""
    if table.unknown:
        yield (
            "  no change is given of what is not known, or not above 0, of the case itself: "
            + "; ".join(table.unknown)
        )
    blank = []
    for row in table.rows:
        words = [cell for cell in row.cells if cell in NO_CHANGE]
        note = row.note if not row.varied or words == [*row.cells] else ""
        texts = [*dict.fromkeys(words)] * (bool(words) and not note) + [note] * bool(note)
        if texts:
            blank.append(f"{row.name}: {', '.join(texts)}")
    if blank:
        yield "  assumed, or why there is no number of something:"
    for text in blank:
        yield f"    {text}"


def lines(facts: Explanation) -> Iterator[str]:
    """Yield an explanation as it is printed."""
    point = ", ".join(f"{key} = {value}" for key, value in facts.point.items())
    yield f"{facts.study}: {plural(facts.jobs)}" + (f"; explained: {point}" if point else "")
    machine = facts.machine.lines()
    width = max((len(thing) for thing, _ in machine), default=0)
    for number, (thing, words) in enumerate(machine):
        yield heading("" if number else "machine", f"{thing:<{width}}  {words}")
    count = len(facts.unknowns)
    solved = f"{count} degrees of freedom" if count else "closed form, nothing integrated"
    yield heading("motion", f"{facts.scene}: {solved}")
    if count:
        yield heading("", "; ".join(name.rpartition(",")[0] for name in facts.unknowns))
    for number, (term, words) in enumerate(facts.active.items()):
        yield heading("" if number else "active", f"{term}: {words}")
    if facts.absent:
        yield heading("absent", f"{', '.join(facts.absent)}: cost nothing")
    for number, text in enumerate(text for joint in facts.scales for text in scale_lines(joint)):
        yield heading("" if number else "scales", text)
    word = facts.accuracy or "given"
    yield heading("tolerance", f"{word}: rtol {facts.rtol:g}, {facts.method}, "
                  f"for errors below {percent(facts.promise)}")  # fmt: skip
    if facts.reason:
        yield heading("cost", f"unknown: the job failed, {facts.reason}: {facts.detail}")
        return
    yield from cost_lines(facts)
    for number in range(len(facts.advice)):
        yield heading("" if number else "without", describe_advice(facts, number))


def scale_lines(joint: JointScales) -> Iterator[str]:
    """Yield the natural scales of a joint."""
    name = joint.joint.replace("_", " ")
    yield (
        f"{name}: the greatest force without clearance, {joint.force:.0f} N, presses the surfaces "
        f"{joint.penetration * 1e6:.0f} µm into each other"
    )
    bounces = "does not bounce" if joint.damping_ratio >= 1.0 else "bounces"
    yield (
        f"in contact the journal {bounces} (damping ratio {joint.damping_ratio:.2g}), and swings "
        f"sideways in its bore at about {joint.swing_frequency:.0f} Hz, once in "
        f"{1e3 / joint.swing_frequency:.2f} ms"
    )
    yield (
        f"longest time steps: explicit about {joint.explicit_step * 1e6:.3g} µs, limited by "
        f"{joint.limited_by}; implicit about {joint.implicit_step * 1e6:.3g} µs, limited by the "
        f"stiffness of the contact"
    )


def cost_lines(facts: Explanation) -> Iterator[str]:
    """Yield the cost of a job and of the sweep."""
    work = f" ({facts.steps} steps, {facts.evaluations} evaluations)" if facts.steps else ""
    yield heading("cost", f"{short_time(facts.seconds)} a job{work}")
    solved = f"{short_time(facts.solution_seconds)} of it for the solution (`seconds` in show)"
    rest = f", the rest for {', '.join(facts.other_work)}" if facts.other_work else ""
    yield heading("", solved + rest)
    if facts.expected_steps:
        yield heading("", f"by the scales alone about {facts.expected_steps:.1g} steps, "
                      f"{short_time(facts.expected_seconds, 1)}")  # fmt: skip
    if facts.jobs > 1:
        workers = plural(facts.workers, "worker")
        yield heading("", f"{facts.sweep_seconds:.2g} s for {plural(facts.jobs)} with {workers}, "
                      "if all cost the same")  # fmt: skip


def short_time(seconds: float, digits: int = 3) -> str:
    """Return a time in ms to some digits, or as `duration` does from a second on."""
    return duration(seconds) if seconds >= 1 else f"{1e3 * seconds:.{digits}g} ms"


def describe_advice(facts: Explanation, number: int) -> str:
    """Return the sentence on what leaving a feature out does, and whether to."""
    advice = facts.advice[number]
    effect = advice.effect
    if effect.reason:
        return f"{advice.name}: the run failed, {effect.reason}"
    saved = 1 - effect.time_ratio
    time_text = (
        f"{'saves' if saved >= 0 else 'costs'} {100 * abs(saved):.0f} % of the solution's time"
    )
    text = (
        f"{advice.name}: peak acceleration {percent(effect.change_peak_acceleration, '+')}, "
        f"contact force {percent(effect.change_peak_contact_force, '+')}, {time_text}"
    )
    if advice.removable:
        return f"{text}; less than {percent(facts.promise)}: leave it out ({advice.neutral})"
    return f"{text}; needed for {' and '.join(advice.needed_for)}"


def percent(share: float, sign: str = "") -> str:
    """Return a share in per cent, to two digits or whole."""
    return f"{100 * share:{sign}z{'.0f' if abs(share) >= 1 else '.2g'}} %"


def fastest_lines(study: xr.Dataset) -> Iterator[str]:
    """Yield the fastest method for each decade of error, and the paper's numerics."""
    width = max(len(name) for name in study["scene"].values)
    yield f"{'case':<{width}}  {'error below':>11}  {'method':<7} {'rtol':>7}  {'ms':>7}"
    for row in fastest(study):
        yield (
            f"{row['scene']:<{width}}  {row['error_below']:>11.0e}  {row['method']:<7} "
            f"{row['rtol']:>7.0e}  {1e3 * row['seconds']:>7.1f}"
        )
    for name in study["scene"].values:
        one = study.sel(scene=name)
        yield (
            f"{name}: the paper's BDF at 1e-5 takes {one['paper_seconds'].item():.2g} s; error of "
            f"acceleration {one['paper_error_acceleration'].item():.1e}, of its peak on the output "
            f"grid {one['paper_error_peak_acceleration'].item():.1e}"
        )


def trade_lines(trade: xr.Dataset) -> Iterator[str]:
    """Yield the effect of each change of the model on each scene, and its time over the scene's."""
    for scene in trade["scene"].values:
        table = model_table(trade.sel(scene=scene))
        yield from model_lines(scene, table)
        ratios = [f"{row.name} × {row.time_ratio:.2g}" for row in table.rows if row.time_ratio > 0]
        yield f"times over the case's own: {'; '.join(ratios)}"
        yield ""
    for scene in trade["scene"].values:
        one = trade.sel(scene=scene)
        yield (
            f"{scene}: the series of Eq. 3-4 would misplace the crosshead by "
            f"{one['place_error'].item():.0%} of the clearance, and change the ideal acceleration "
            f"by {one['acceleration_error'].item():.2%}"
        )
