"""The folder of results, as an argument or by -i, and what is named in it: studies and jobs.

A shell completes these names. For that only names of files and the small files of studies are read,
and no library is loaded.
"""

import json
import os
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from compressor.studies import find_drawn

MAX_BYTES = 5_000_000  # of the files of studies that are read for keys and axes
HEXADECIMAL = re.compile("[0-9a-f]{2,20}")
ONE_JOB = "JOB | STUDY [AXIS=VALUE]..."  # what `show` and `plot` take

Items = list["CompletionItem[Any]"]  # a generic class from click 8.4.2 on
Complete = Callable[[click.Context, click.Parameter, str], Items]


def results_folder(
    words: Sequence[str], option: str | None, named: bool = True
) -> tuple[str, tuple[str, ...]]:
    """Return the folder of results, by the first of some words or by -i, and the other words.

    option: what -i says, None without it; named: whether words name studies and jobs, too. A first
    word that is a folder is the folder of results, unless -i is given and holds a study of its
    name. Raises UsageError where two folders are given, or a name means both.
    """
    if not words or (named and not (words[0].endswith(os.sep) or os.path.isdir(words[0]))):
        return option or "results", tuple(words)
    place, rest = words[0], tuple(words[1:])
    if rest and not named:
        listed = ", ".join(map(repr, words))
        raise click.UsageError(f"takes one folder of results, not {len(words)}: {listed}")
    if option is None and named and is_study(place, "results") and not place.endswith(os.sep):
        raise click.UsageError(
            f"{place!r} is a folder, and a study in results: write {place}{os.sep} for the folder, "
            "or -i results for the study"
        )
    if option is not None and named and is_study(place, option):
        return option, tuple(words)
    if option is not None and os.path.abspath(option) != os.path.abspath(place):
        raise click.UsageError(
            f"two folders of results are given, {place!r} and -i {option!r}: leave one out"
        )
    return place, rest


def is_study(name: str, folder: str) -> bool:
    """Return whether a folder of results has a study of this name, a former one or one drawn."""
    paths = (Path(folder, part, f"{name}.json") for part in ("studies", "former"))
    return name in find_drawn(folder) or any(path.exists() for path in paths)


def one_word(words: Sequence[str], name: str) -> str:
    """Return the one word that is left beside the folder of results. Raises UsageError."""
    if not words:
        raise click.UsageError(f"Missing argument '{name}'")
    if len(words) > 1:
        raise click.UsageError(f"takes one {name}, not {len(words)}: {', '.join(words)}")
    return words[0]


def some_words(words: tuple[str, ...]) -> tuple[str, ...]:
    """Return the words that name a job, or a study. Raises UsageError where there are none."""
    if not words:
        raise click.UsageError(f"Missing argument '{ONE_JOB}'")
    return words


def files(_: click.Context, __: click.Parameter, word: str) -> Items:
    """Return what lets the shell complete a file."""
    return [CompletionItem(word, type="file")]


def folders(_: click.Context, __: click.Parameter, word: str) -> Items:
    """Return what lets the shell complete a folder."""
    return [CompletionItem(word, type="dir")]


def studies(context: click.Context, _: click.Parameter, word: str) -> Items:
    """Return the names of the stored studies."""
    folder, _rest = read_so_far(context)
    return [CompletionItem(name) for name in sorted(study_files(folder)) if name.startswith(word)]


def jobs(context: click.Context, _: click.Parameter, word: str) -> Items:
    """Return the names of studies and keys of jobs; after a study's name values of its axes."""
    folder, words = read_so_far(context)
    known = study_files(folder)
    if words and words[0] in known:
        return [CompletionItem(text) for text in values(known[words[0]]) if text.startswith(word)]
    names = [*known, *find_drawn(folder)]
    found = [CompletionItem(name) for name in sorted(names) if name.startswith(word)]
    if not (
        context.params.get("given") or context.params.get("folder")
    ):  # the folder of results may stand first
        found.append(CompletionItem(word, type="dir"))
    if HEXADECIMAL.fullmatch(word):
        found += [CompletionItem(key) for key in keys(folder, known) if key.startswith(word)]
    return found


def read_so_far(context: click.Context) -> tuple[str, tuple[str, ...]]:
    """Return the folder of results that is meant, and the words before the one to be completed."""
    words = tuple(context.params.get("given") or ())
    option = context.params.get("folder")
    try:
        return results_folder(words, option)
    except click.UsageError:
        return option or "results", words


def study_files(folder: str) -> dict[str, Path]:
    """Return the files of a folder's studies by name."""
    return {path.stem: path for path in Path(folder).glob("studies/*.json")}


def read_study_file(path: Path) -> dict[str, Any]:
    """Return a study's file; nothing where it is large, or damaged."""
    try:
        if path.stat().st_size > MAX_BYTES:
            return {}
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def keys(folder: str, known: dict[str, Path]) -> list[str]:
    """Return the keys of jobs with time series, and of all where the studies' files are small."""
    found = {path.name[:20] for path in Path(folder).glob("jobs/*.h5")}
    if sum(path.stat().st_size for path in known.values()) <= MAX_BYTES:
        found.update(
            key for path in known.values() for key in read_study_file(path).get("keys", ())
        )
    return sorted(found)


def values(path: Path) -> Iterator[str]:
    """Yield `axis=value` of all values of a study's axes."""
    for axis in read_study_file(path).get("axes", ()):
        for value in dict.fromkeys(map(str, axis["values"])):
            yield f"{axis['key']}={value.lower() if value in ('True', 'False') else value}"


def of_results(metavar: str = "", complete: Complete = folders) -> Callable[..., Any]:
    """Return the decorator that gives a command `given`, words with a folder first, and -i."""

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        option = click.option(
            "-i", "--input", "folder", metavar="FOLDER", show_default="results",
            shell_complete=folders, help="Read this folder of results; it may come as first word.",
        )  # fmt: skip
        whole = f"[FOLDER] {metavar}".rstrip()
        argument = click.argument("given", nargs=-1, metavar=whole, shell_complete=complete)
        return argument(option(command))

    return decorate
