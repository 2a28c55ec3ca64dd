"""`compsim explain`: terms, scales and cost of a case, and what moves its metrics."""

import dataclasses
import itertools

import click

from compsim import options, screen
from compsim.progress import ProgressReporter, read_cases


@click.command()
@options.configs
@options.jobs("Estimate the sweep's cost with this many worker processes.")
@click.option("--models", is_flag=True, help="Measure what moves each metric, numbers or models.")
@click.option(
    "--all", "every", is_flag=True, help="With --models: toggle every other feature, too."
)
@options.results
@options.set_keys
@options.max_jobs
@options.as_json
def explain(configs, jobs, models, every, folder, as_json, **how) -> int:
    """Estimate the cost, scales and droppable features of a case.

    \b
    compsim explain machine.yaml
    compsim explain machine.yaml --models

    Runs the job with the greatest stored contact force, or else the greatest clearance, of each
    case file. Then runs it again without each feature that costs time.

    With --models it runs that job again with one change at a time: each number that the file does
    not give, or that a plant can only guess, at both ends of its plausible range; other laws of
    contact and friction; oil, an elastic rod and play in the guide added or removed. It ranks what
    changes each metric most. The report shows this table, from models/ in the folder of results.

    --set clearance_mm=0.3 chooses another job. Exit code 3 if such a job fails.
    """
    if every and not models:
        raise click.UsageError("--all says what --models varies: add --models")
    if jobs and models:
        text = "-j is for the estimate of a sweep, which --models does not make: leave out -j"
        raise click.UsageError(text)
    from compressor.cases import points
    from compressor.store import writable_folder, write_dataset
    from compressor.studies.tradeoff.explain import explain as explain_job
    from compressor.studies.tradeoff.explain import list_explanation
    from compressor.studies.tradeoff.page import list_changes, model_table, models_file, place_text
    from compressor.studies.tradeoff.variants import choose_job, explain_models
    from compressor.sweep import cores

    studies = read_cases(configs, **how)
    screen.caution(studies)
    if models:
        writable_folder(folder)
    found, code = [], screen.DONE
    for study in studies:
        job, which = choose_job(study, folder)
        at = next(itertools.islice(points(study), job, None))
        place = "".join(f", {key} = {value}" for key, value in at.items())
        screen.say_wrapped(f"running {which} of {study.name}{place}, and with one change at a time")
        with ProgressReporter(False, "variants") as progress:
            if models:
                data = explain_models(study, job, every, progress)
            else:
                found.append(explain_job(study, job, jobs or cores(), progress))
        if not models:
            code = screen.SOME_FAILED if found[-1]["reason"] else code
            if not as_json:
                screen.print_lines(list_explanation(found[-1]))
        elif data["status"].values[0] != "ok":
            why = f"{data['reason'].values[0]}: {data.attrs['detail']}"
            screen.say_wrapped(f"{study.name}: the job failed, {why}")
            code = screen.SOME_FAILED
        else:
            path, table = models_file(folder, study.name, data.attrs["key"]), model_table(data)
            write_dataset(path, data)
            found.append({"study": study.name, "file": path, **dataclasses.asdict(table)})
            if not as_json:
                sets = "".join(f" --set {text}" for text in how["overrides"])
                screen.print_lines(list_changes(place_text(study, data.attrs["key"]) + sets, table))
                screen.say(str(path))
    if as_json:
        screen.print_json(found)
    return code
