"""`compsim explain`: terms, scales and cost of a case, and what moves its metrics."""

import dataclasses
import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from compsim import options, screen
from compsim.progress import ProgressReporter, read_cases

if TYPE_CHECKING:
    from compressor.cases import Study


@click.command()
@options.configs
@options.jobs("Estimate the sweep's cost with this many worker processes.")
@click.option("--models", is_flag=True, help="Measure what moves each metric, numbers or models.")
@click.option(
    "--vary", multiple=True, metavar="KEY", help="With --models: vary this number of the file, too."
)
@options.results
@options.set_keys
@options.max_jobs
@options.as_json
def explain(configs, jobs, models, vary, folder, as_json, **how) -> int:
    """Estimate the cost, scales and droppable features of a case.

    \b
    compsim explain machine.yaml
    compsim explain machine.yaml --models

    Runs the first job of each case file, and again without each feature that costs time.

    With --models it runs the job with the greatest contact force that is stored, or the one with
    the greatest clearance where none is, and again with one thing otherwise at a time: each number
    that the file does not give, or that a plant can only guess, at both ends of its plausible range
    (the table of keys has them), and other laws of contact and friction, oil, an elastic rod and
    play in the guide, or without where the case has them. It says what moves each metric most. The
    table is kept in models/ of the folder of results, and its report shows it.

    --set clearance_mm=0.3 chooses another job. Exit code 3 where such a job fails.
    """
    if vary and not models:
        raise click.UsageError("--vary names what --models varies: add --models")
    check_varied(vary)
    studies = read_cases(configs, **how)
    screen.caution(studies)
    if models:
        return explain_models(studies, folder, vary, how["overrides"], as_json)
    from compressor.studies.tradeoff.explain import explain as explained
    from compressor.studies.tradeoff.words import list_explanation
    from compressor.sweep import cores

    found = []
    for study in studies:
        which = f"the first of {study.jobs} jobs" if study.jobs > 1 else "the job"
        say_job(study, 0, which, "with and without each of its features")
        with ProgressReporter(False, "features") as progress:
            found.append(explained(study, jobs or cores(), progress=progress))
        if not as_json:
            screen.print_lines(list_explanation(found[-1]))
    if as_json:
        screen.print_json(found)
    return screen.SOME_FAILED if any(one.reason for one in found) else screen.DONE


def check_varied(keys: Sequence[str]) -> None:
    """Raise UsageError for a key that has no plausible range."""
    from compressor.cases import row_of, suggestion

    for key in keys:
        whole, _, part = key.rpartition(".")
        row = row_of(key)
        if row is None:
            raise click.UsageError(f"--vary {key}: unknown key{suggestion(part, whole)}")
        if row.plausible is None:
            missing = "the table of keys has no plausible range of it"
            raise click.UsageError(f"--vary {key}: {missing}: sweep it, as in --set {key}=[...]")


def say_job(study: "Study", job: int, which: str, how: str) -> None:
    """Report which job of a study is run and why, and how to choose another."""
    from compressor.cases import points

    another = ""
    if study.jobs > 1:
        at = next(itertools.islice(points(study), job, None))
        point = ", ".join(f"{key} = {value}" for key, value in at.items())
        another = f"; it has {point}: --set KEY=VALUE takes another"
    screen.say_wrapped(f"running {which} of {study.name}, {how}{another}")


def explain_models(
    studies: "list[Study]", folder: str, vary: Sequence[str], overrides: Sequence[str], json: bool
) -> int:
    """Print and store how far numbers in doubt and other models move a job of each study."""
    from compressor.store import writable_folder, write_dataset
    from compressor.studies.tradeoff.model_choices import choose_job
    from compressor.studies.tradeoff.model_choices import explain_models as run_models
    from compressor.studies.tradeoff.page import model_table, models_file, place_text
    from compressor.studies.tradeoff.words import list_changes

    writable_folder(folder)
    code, found = screen.DONE, []
    for study in studies:
        job, which = choose_job(study, folder)
        say_job(study, job, which, "with one thing otherwise at a time")
        with ProgressReporter(False, "variations") as progress:
            data = run_models(study, job, vary, progress=progress)
        if data["status"].values[0] != "ok":
            why = f"{data['reason'].values[0]}: {data.attrs['detail']}"
            screen.say_wrapped(f"{study.name}: the job failed, {why}")
            code = screen.SOME_FAILED
            continue
        path = models_file(folder, study.name, data.attrs["key"])
        write_dataset(path, data)
        table = model_table(data)
        found.append({"study": study.name, "file": str(path), **dataclasses.asdict(table)})
        if not json:
            sets = "".join(f" --set {text}" for text in overrides)
            place = place_text(study, data.attrs["key"]) + (f", by{sets}" if sets else "")
            screen.print_lines(list_changes(place, table))
            screen.say(str(path))
    if json:
        screen.print_json(found)
    return code
