"""`compsim explain`: terms, scales and cost of a case, and what moves its metrics."""

import dataclasses
import itertools
import json
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import click

from compressor.digits import by_bar
from compressor.program import duration
from compsim.options import configs_argument, jobs_option, limit, results_option, setting
from compsim.progress import ProgressReporter
from compsim.screen import (
    DONE,
    SOME_FAILED,
    WIDTH,
    caution,
    jsonable,
    machine_lines,
    plural,
    print_text,
    say,
    say_wrapped,
    wrap_line,
)

if TYPE_CHECKING:
    from compressor.cases import Study
    from compressor.solve import JointScales
    from compressor.studies.tradeoff.explain import Explanation
    from compressor.studies.tradeoff.page import ModelRow, ModelTable

INDENT = 12  # columns of a heading


@click.command()
@configs_argument
@jobs_option("Estimate the sweep's cost with this many worker processes.")
@click.option("--models", is_flag=True,
              help="Measure instead what moves each metric, numbers or models.")  # fmt: skip
@click.option("--vary", "named", multiple=True, metavar="KEY",
              help="With --models: also this number, though the file gives it.")  # fmt: skip
@results_option
@setting
@limit
@click.option("--json", "as_json", is_flag=True, help="Print the same as JSON, a list of studies.")
def explain(
    configs: tuple[str, ...],
    jobs: int | None,
    models: bool,
    named: tuple[str, ...],
    folder: str,
    overrides: tuple[str, ...],
    max_jobs: int,
    as_json: bool,
) -> int:
    """Estimate the cost, scales and droppable features of a case.

    \b
    compsim explain machine.yaml
    compsim explain machine.yaml --models

    Runs the first job of each case file, and again without each feature that costs time. With
    --models it runs the job with the greatest contact force that the folder -r has stored, or the
    one with the greatest clearance where it has none, and again with one thing otherwise at a time:
    each number that the file does not give, or that a plant can only guess, at both ends of its
    plausible range (the table of keys has them), other laws of contact and friction, oil, an
    elastic rod and play in the guide, or without where the case has them. It says what moves each
    metric most; all is stored in models/ of the folder -r, a file for each job, and the report of
    that folder shows it. --set clearance_mm=0.3 chooses another job. Exit code 3 where such a job
    fails.
    """
    if named and not models:
        raise click.UsageError("--vary names what --models varies: add --models")
    check_named(named)
    from compressor.cases import load_studies

    studies = load_studies(*configs, overrides=overrides, max_jobs=max_jobs, follow=False)
    caution(studies)
    if models:
        return explain_models(studies, folder, named, overrides, as_json)
    from compressor.studies.tradeoff.explain import explain as explained
    from compressor.sweep import cores

    found = []
    for study in studies:
        which = f"the first of {study.jobs} jobs" if study.jobs > 1 else "the job"
        say_job(study, 0, which, "with and without each of its features")
        with ProgressReporter(False, "features") as progress:
            found.append(explained(study, jobs or cores(), progress=progress))
        if not as_json:
            print_text("\n".join(lines(found[-1])))
    if as_json:
        plain = [jsonable(dataclasses.asdict(one)) for one in found]
        print_text(json.dumps(plain, indent=1, ensure_ascii=False))
    return SOME_FAILED if any(one.reason for one in found) else DONE


def check_named(keys: Sequence[str]) -> None:
    """Raise UsageError for a key that has no plausible range."""
    from compressor.cases import PER_PART, suggestion, table

    for key in keys:
        whole, _, part = key.rpartition(".")
        row = table().get(PER_PART.get(whole, {}).get(part, key))
        if row is None:
            hint = suggestion(part, whole)
            raise click.UsageError(f"--vary {key}: unknown key{hint}")
        if row.plausible is None:
            raise click.UsageError(
                f"--vary {key}: the table of keys has no plausible range of it: sweep it, as in "
                f"--set {key}=[...]"
            )


def say_job(study: "Study", job: int, which: str, how: str) -> None:
    """Report which job of a study is run and why, and how to choose another."""
    from compressor.cases import points

    point = ""
    if study.jobs > 1:
        at = next(itertools.islice(points(study), job, None))
        point = ", ".join(f"{key} = {value}" for key, value in at.items())
    another = f"; it has {point}: --set KEY=VALUE takes another" if point else ""
    say_wrapped(f"running {which} of {study.name}, {how}{another}")


def explain_models(
    studies: "list[Study]", folder: str, named: Sequence[str], overrides: Sequence[str],
    as_json: bool,
) -> int:  # fmt: skip
    """Print and store how far numbers in doubt and other models move a job of each study."""
    from compressor.store import writable_folder, write_dataset
    from compressor.studies.tradeoff.model_choices import choose_job
    from compressor.studies.tradeoff.model_choices import explain_models as run_models
    from compressor.studies.tradeoff.page import model_table, models_file, place_text

    writable_folder(folder)
    failed, found = False, []
    for study in studies:
        job, which = choose_job(study, folder)
        say_job(study, job, which, "with one thing otherwise at a time")
        with ProgressReporter(False, "variations") as progress:
            data = run_models(study, job, named, progress=progress)
        if data["status"].values[0] != "ok":
            failed = True
            say_wrapped(
                f"{study.name}: the job failed, {data['reason'].values[0]}: {data.attrs['detail']}"
            )
            continue
        path = models_file(folder, study.name, data.attrs["key"])
        write_dataset(path, data)
        table = model_table(data)
        found.append({"study": study.name, "file": str(path), **dataclasses.asdict(table)})
        if not as_json:
            place = place_text(study, data.attrs["key"]) + ", by" * bool(overrides)
            place += "".join(f" --set {text}" for text in overrides)
            print_text("\n".join(model_lines(place, table)))
            say(str(path))
    if as_json:
        print_text(json.dumps(jsonable(found), indent=1, ensure_ascii=False))
    return SOME_FAILED if failed else DONE


MOST_SHOWN = 5  # of what moves a metric
CELL = 12  # columns of a change


def model_lines(place: str, table: "ModelTable") -> Iterator[str]:
    """Yield for each metric what moves it most, what has no number, and a summary.

    Both ends of a number stand in one line. place: which job it is of.
    """
    from compressor.studies.tradeoff.page import headline

    yield from wrap_line(f"{place}:", 0)
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
        yield from wrap_line(f"nothing is seen to move: {'; '.join(still)}", 2)
    yield from unknown_lines(table)
    yield from wrap_line(headline(table), 0)


def change_lines(rows: "Sequence[ModelRow]", n: int) -> Iterator[str]:
    """Yield a line on each thing that moves a measure: both ends of a number, or another model."""
    for _, group in itertools.groupby(rows, key=lambda row: row.varied or row.name):
        each = [*group]
        first, varied = each[0].name, each[0].varied
        rest = [row.name.removeprefix(varied).strip() for row in each[1:]]
        cells = "".join(f"{row.cells[n]:>{CELL}}" for row in each)
        yield f"    {', '.join([first, *rest]):<{WIDTH - 4 - 2 * CELL}}{cells}"


def unknown_lines(table: "ModelTable") -> Iterator[str]:
    """Yield what the case itself has no number of, and what runs assume or have no number of."""
    from compressor.studies.tradeoff.page import NO_CHANGE

    if table.unknown:
        yield from wrap_line(
            "no change is given of what is not known, or not above 0, of the case itself: "
            + "; ".join(table.unknown),
            2,
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
        yield from wrap_line(text, 4)


def heading(word: str, text: str) -> str:
    """Return a text under a heading, in lines of the width."""
    return f"  {word:<{INDENT}}" + "\n".join(wrap_line(text, 2 + INDENT)).lstrip()


def lines(facts: "Explanation") -> Iterator[str]:
    """Yield an explanation as it is printed."""
    point = ", ".join(f"{key} = {value}" for key, value in facts.point.items())
    yield from wrap_line(
        f"{facts.study}: {plural(facts.jobs)}" + (f"; explained: {point}" if point else ""), 0
    )
    for number, text in enumerate(machine_lines(facts.machine.lines(), 2 + INDENT)):
        yield text if number else f"  {'machine':<{INDENT}}{text.lstrip()}"
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


def scale_lines(joint: "JointScales") -> Iterator[str]:
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


def cost_lines(facts: "Explanation") -> Iterator[str]:
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


def describe_advice(facts: "Explanation", number: int) -> str:
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
