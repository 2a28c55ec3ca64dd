"""`compsim show`: what is known of one job."""

import dataclasses
import json
import math
import os
from typing import TYPE_CHECKING, Any

import click

from compsim.screen import DONE, as_json, results, run_commands, say

if TYPE_CHECKING:
    from compressor.store import JobReport

SPREAD = "_standard_error"


@click.command()
@click.argument("job")
@click.option(
    "--reversal",
    default="15,3",
    show_default=True,
    metavar="DEG,PERCENT",
    help="Least reversal of the rod load: degrees, and its smaller side's share.",
)
@results
@as_json
def show(job: str, reversal: str, folder: str, as_json: bool) -> int:
    """Tell what is known of a job, named by its key or the beginning of it.

    Which studies it belongs to and where in them, how it ended and why, its numbers with their
    error bars, in SI, and what it was run with. Of one that stopped, where, in which state, driven
    by which number of it, and its last steps. Of a job with signals, whether the rod load at the
    crosshead pin changes its side as API 618 asks: 15 degrees and 3 percent, or as a maker does.
    """
    from compressor.cases import printable
    from compressor.reasons import remedy
    from compressor.store import report_job

    limits = reversal_limits(reversal)
    found = report_job(folder, job)
    if as_json:
        click.echo(json.dumps(sayable(dataclasses.asdict(found)), indent=1))
        return DONE
    click.echo(f"job {found.key}: {printable(ending(found))}")
    for study, point in found.studies.items():
        values = "".join(f" {key}={value}" for key, value in point.items())
        click.echo(f"  in {study}{printable(values)}")
    if found.status == "failed":
        click.echo(f"  what to do: {remedy(found.reason)}")
    for line in (
        *stop(found),
        *numbers(found),
        *reversal_verdict(found, *limits),
        *cautions(found),
        *facts(found),
    ):
        click.echo(f"  {printable(line)}")
    if found.status == "missing":
        for command in run_commands(found.again, folder):
            say(f"next: {command}")
    return DONE


def ending(found: "JobReport") -> str:
    """How a job ended, in a line."""
    if found.status == "missing":
        return "not run yet"
    return "ok" if found.status == "ok" else f"failed: {found.reason}: {found.detail}"


def stop(found: "JobReport") -> list[str]:
    """Where a job's run stopped, and how its last steps went, a line each; none that ended."""
    told = found.attributes
    if "stop_history_words" not in told:
        return []
    angle = math.degrees(told["stop_crank_angle"]) % 360
    lines = [f"{'stopped':<28} at {told['stop_time']:.9g} s, {angle:.5g} degrees of crank angle"]
    if told["stop_dominant"]:
        lines.append(f"{'driven by':<28} {told['stop_dominant']}")
    names = told["stop_state_names"].split("; ")
    for name, value in zip(names, told["stop_state"], strict=False):
        lines.append(f"{name:<28} {value:.6g}")
    steps = zip(
        *(told[f"stop_history_{name}"] for name in ("time", "step", "error")),
        told["stop_history_words"].split("; "),
        strict=False,
    )
    for time, step, error, words in steps:
        known = "" if math.isnan(error) else f", error {error:.3g} of the tolerance"
        lines.append(f"{'step':<28} {time:.12g} s + {step:.4g} s, {words}{known}")
    return lines


def numbers(found: "JobReport") -> list[str]:
    """A job's numbers, a line each, to the digits that their errors allow."""
    from compressor.metrics import METRICS, NUMBERS, ROD_LOAD

    lines = []
    barred = METRICS | ROD_LOAD
    for name, value in found.numbers.items():
        beside = name.endswith(SPREAD) or name.removesuffix("_error") in {*barred} - {name}
        if beside or (blank(value) and name not in METRICS):
            continue
        unit = "" if NUMBERS[name][1] == "1" else NUMBERS[name][1]
        relative, error, said = True, found.numbers.get(name + SPREAD), "(standard error)"
        if name in barred:
            relative, error, said = barred[name].bar.relative, found.numbers[f"{name}_error"], ""
        if error is None or blank(error):
            text, said = plain(value), ""
        else:
            text = measured(value, error, relative)
        lines.append(" ".join(filter(None, (f"{name:<28} {text}", unit, said))))
    return lines


def reversal_limits(text: str) -> tuple[float, float]:
    """Least angle (degrees) and share (percent) of a reversal, from the option's text."""
    try:
        degrees, percent = (float(part) for part in text.split(","))
    except ValueError:
        degrees = percent = math.nan
    if not (0.0 <= degrees <= 180.0 and 0.0 <= percent <= 100.0):
        raise click.BadParameter(f"{text!r}: give degrees and percent, such as 30,25",
                                 param_hint="--reversal")  # fmt: skip
    return degrees, percent


def reversal_verdict(found: "JobReport", degrees: float, percent: float) -> list[str]:
    """Whether the rod load changes its side for long and far enough; none without signals."""
    from compressor.digits import by_bar

    worst, told = math.inf, []
    for name, unit, least in (("angle", math.degrees(1.0), degrees), ("share", 100.0, percent)):
        value = unit * found.numbers.get(f"rod_load_reversal_{name}", math.nan)
        bar = unit * found.numbers.get(f"rod_load_reversal_{name}_error", math.nan)
        if math.isnan(value):
            return []
        if math.isinf(bar):
            return [f"{'rod load':<28} its reversal is not known well enough to be judged"]
        bar = 0.0 if math.isnan(bar) else bar
        told.append(by_bar(value, bar) if bar else f"{value:.4g}")
        clear = value - least
        worst = min(worst, clear / abs(clear) if abs(clear) >= bar and clear else 0.0)
    word = {1.0: "passes", 0.0: "cannot be told apart from", -1.0: "fails"}[worst]
    kind = "API 618's" if (degrees, percent) == (15.0, 3.0) else "the maker's"
    return [f"{'rod load':<28} reversal of {told[0]} degrees and {told[1]} %: {word} {kind} "
            f"{degrees:g} degrees and {percent:g} %"]  # fmt: skip


def cautions(found: "JobReport") -> list[str]:
    """How far the numbers may be trusted, where their errors do not say it."""
    if found.attributes.get("regime") == "undecided":
        return ["errors are as large as numbers, and chaos could not be ruled out in the time that "
                "was spent: ask by solve.horizon: true"]  # fmt: skip
    if found.attributes.get("regime") != "chaotic":
        return []
    lines = ["the motion is chaotic: averages may be trusted, single peaks may not"]
    wanted = found.numbers.get("revolutions_to_one_percent", math.nan)
    if math.isfinite(wanted):
        lines.append(f"{wanted:.0f} settled revolutions would bring the standard error of "
                     "rms_acceleration to 1 %")  # fmt: skip
    return lines


def facts(found: "JobReport") -> list[str]:
    """What a job was run with, a line each."""
    shown = ("promise", "regime", "method", "rtol", "case", "program", "libraries")
    lines = [f"{name:<28} {found.attributes[name]}" for name in shown if name in found.attributes]
    return [*lines, f"{'file':<28} {os.path.relpath(found.file)}"] if found.file else lines


def sayable(value: Any) -> Any:
    """A value as JSON can say it: null for nan, "inf" for an unknown error."""
    if isinstance(value, dict):
        return {key: sayable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [*map(sayable, value)]
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value


def measured(value: Any, error: Any, relative: bool) -> str:
    """A number, or numbers of joints and axes, with their errors."""
    from compressor.digits import by_bar

    if isinstance(value, list):
        pairs = zip(value, error, strict=True)
        return f"[{', '.join(measured(*pair, relative) for pair in pairs)}]"
    return by_bar(value, error, relative)


def plain(value: Any) -> str:
    """A number, or numbers of joints and axes, to six digits."""
    if isinstance(value, list):
        return f"[{', '.join(map(plain, value))}]"
    return f"{value:.6g}"


def blank(value: Any) -> bool:
    """Whether all numbers are nan."""
    return all(map(blank, value)) if isinstance(value, list) else math.isnan(value)
