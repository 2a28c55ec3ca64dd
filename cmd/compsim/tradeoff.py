"""`compsim tradeoff`: speed against accuracy, by method and tolerance."""

import shlex
from pathlib import Path

import click

from compsim import options, screen
from compsim.progress import ProgressReporter


@click.command()
@options.configs
@options.results
@options.set_keys
@options.quiet
def tradeoff(configs, folder, overrides, quiet) -> int:
    """Measure speed against accuracy, by method and tolerance.

    \b
    compsim tradeoff machine.yaml
    compsim tradeoff machine.yaml --set 'solve.method=[auto, RODAS]'

    Runs each job of the case files by each solve.method at several solve.rtol, which takes minutes,
    and stores them as a study. --set gives other lists, and another solve.timeout_s than 4 s.
    Errors are against the tightest job of another method. Prints the fastest method for each error;
    writes numbers and figure into tradeoff/ of the folder of results.
    """
    from compressor.report import write_figure
    from compressor.store import write_dataset
    from compressor.studies.tradeoff.work_precision import (
        draw_work_precision,
        list_fastest,
        load_methods,
        work_precision,
    )
    from compressor.sweep import sweep

    for config in configs:
        study, texts = load_methods(config, overrides, folder)
        with ProgressReporter(quiet, folder=folder) as progress:
            command = shlex.join(["compsim", "tradeoff", config, "-r", folder])
            sweep([study], folder, 1, progress, command, texts)  # jobs are timed
        found = work_precision(folder, study)
        screen.print_text(*list_fastest(found))
        path = Path(folder, "tradeoff", study.name)
        figure = draw_work_precision(found)
        picture = write_figure(path.with_suffix(".png"), figure)
        screen.print_text(str(picture), str(write_dataset(path.with_suffix(".nc"), found)))
    return screen.DONE
