"""Case files to studies: what is swept multiplies, and all errors are reported at once.

A file becomes values by dotted key (`yaml_reader`, `keys`), blocks and overrides take their places,
and each value is checked alone against the table of parameters. The jobs are counted (`blocks`)
before any is made. Each job's case is built whole, for its key
and for what does not fit together, and again when it is used.
"""

import contextlib
import itertools
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from compressor.cases import blocks
from compressor.cases.case import Case
from compressor.cases.checks import REPORT, SHORTHANDS, row_of, value_of
from compressor.cases.combinations import Block, columns
from compressor.cases.comparison import NoComparison, Test, comparison, condition
from compressor.cases.conflicts import conditions, is_off, needs_of_given, problem_of
from compressor.cases.keys import (
    Leaves,
    leaves,
    merge_leaves,
    nest_values,
    override_leaves,
    read_overrides,
)
from compressor.cases.parameter import CaseError, Problem, quote_value
from compressor.cases.study import Axis, Cases, Study
from compressor.cases.swept import (
    SAMPLED,
    format_count,
    is_swept,
)
from compressor.cases.table import WORDS, table
from compressor.cases.yaml_reader import CaseFileError, FileProblem, Node, Place, read_file, shorten
from compressor.program import Progress, no_progress

Variants = Callable[[Any], Iterable[Any]]  # of a case: the cases that are run for it


def itself(case: Any) -> Iterable[Any]:
    """Return the cases that are run for a case: itself."""
    return (case,)


@dataclass
class KeysRead:
    """The keys that files give, by place, and which of them any job reads.

    A key that stands in a file once may be given for several blocks, and one of the command line
    for several files: it is enough that one job reads it.
    """

    variants: Variants = itself
    read: set[tuple[Place, str]] = field(default_factory=set)
    unread: dict[tuple[Place, str], FileProblem] = field(default_factory=dict)

    def note(self, cases: Cases) -> None:
        """Note which keys of its blocks the cases of a study read, unless they cannot be built."""
        with contextlib.suppress(CaseError):  # which is reported elsewhere
            for block in cases.parts:
                self._note(block)

    def _note(self, block: Block) -> None:
        needed, lacking = {}, {}  # conditions of each key; of those, which no case fulfils so far
        nodes = {}
        for key, node in block.leaves.values.items():
            group = key.partition(".")[0]
            where = node.key_place, group if group in SHORTHANDS else key
            known = row_of(key) or key in WORDS
            if where not in self.read and known and not is_off(key, node.value):
                one = is_swept(key, node)
                needed[where] = conditions(key) if one else needs_of_given(key, block.leaves.values)
                lacking[where], nodes[where] = needed[where], node
        for number in block.numbers:
            if not lacking:  # cases are built only until each key has a reader
                break
            for case in self.variants(block.case(number)):
                for where in lacking:
                    unmet = [one for one in needed[where] if not condition(one[1])(case)]
                    lacking[where] = [one for one in lacking[where] if one in unmet]
                    self.read |= set() if unmet else {where}
            lacking = {where: rest for where, rest in lacking.items() if where not in self.read}
        for where, rest in lacking.items():
            problem = problem_of(*[*rest, needed[where][-1]][0])
            place = _place_of(problem.key, nodes[where], block.leaves)
            found = FileProblem(place, problem.key, problem.message)
            self.unread.setdefault(where, found)
        for where in self.read & self.unread.keys():
            del self.unread[where]


def _place_of(key: str, node: Node, leaves: Leaves) -> Place:
    """Return the place of an unread key or group; of a group, that in the key's own file."""
    place = leaves.places.get(key, node.key_place)
    return place if place.file == node.key_place.file else node.key_place


MAX_JOBS = 10_000
NONE_SELECTED = "selects no job; compsim plan without it lists those that there are"
MANY_CASES = 20_000  # cases of a study that take seconds to be read
MAX_CONFLICTS = 20  # reported of one file; a sweep can have another in every job
IN_BLOCK = "cannot stand in a block: it belongs to the whole file"


@dataclass(frozen=True)
class _Draft:
    """A study that is being read; `name` is empty where the file gives no valid one."""

    path: str
    name: str
    leaves: Leaves
    changes: Mapping[str, Leaves]
    problems: list[FileProblem]
    report: Mapping[str, str] = field(default_factory=dict)


def load_cases(*paths: str | os.PathLike[str]) -> list[Case]:
    """Return the cases of YAML case files, in the order of the files and of their axes.

    A list of values in a file is an axis, and axes multiply; `configs/README.md` lists every key.
    Raises CaseFileError with everything that is wrong in all files, each with its place.

    >>> import compressor
    >>> wear = '''
    ... joint: big_end
    ... clearance_mm: [0.1, 0.2, 0.3]
    ... solve: {duration_rev: 2, accuracy: draft}
    ... '''
    >>> with open("wear.yaml", "w") as file:
    ...     print(wear, file=file)
    >>> cases = compressor.load_cases("wear.yaml")
    >>> [case.clearance_mm.big_end for case in cases]
    [0.1, 0.2, 0.3]
    """
    return [case for study in load_studies(*paths) for case in study.cases]


def load_studies(
    *paths: str | os.PathLike[str],
    overrides: Sequence[str] = (),
    max_jobs: int = MAX_JOBS,
    only: str = "",
    progress: Progress = no_progress,
    variants: Variants = itself,
) -> list[Study]:
    """Return the studies of YAML case files.

    Each override, `key=value`, replaces a value in all of them. A file with more than `max_jobs`
    jobs is refused before any is made; `only`, a comparison, selects the jobs to be run.
    `progress` is called with how many of how many cases are read. `variants` gives the cases that
    the caller runs for one; a key that none of them reads is refused. Raises CaseFileError with
    everything that is wrong in all files, overrides and the comparison.
    """
    problems: list[FileProblem] = []
    changes = read_overrides(overrides, problems)
    test = _read_only(only, problems) if only else None
    drafts = [_draft(_path_of(path), changes, problems) for path in paths]
    _refuse_shared_names(drafts)
    keys = KeysRead(variants)
    studies = [_study(draft, max_jobs, test, progress, keys) for draft in drafts]
    problems += _unread(drafts, keys)
    problems += [problem for draft in drafts for problem in draft.problems]
    if not problems and not any(study.selected for study in studies):
        problems.append(FileProblem(Place(f"--only {shorten(only)}"), "", NONE_SELECTED))
    if problems:
        raise CaseFileError(problems)
    return studies


def _path_of(path: Any) -> str:
    """Return a path as text. Raises CaseFileError for what is none."""
    try:
        return os.fsdecode(path)
    except TypeError as error:
        message = f"needs the path of a case file, not {quote_value(path)}"
        raise CaseFileError([FileProblem(Place("load_cases"), "", message)]) from error


def _read_only(text: str, problems: list[FileProblem]) -> Test | None:
    """Return the comparison of the command line."""
    try:
        return comparison(text)
    except NoComparison as error:
        problems.append(FileProblem(Place(f"--only {shorten(text)}"), "", str(error)))
        return None


def _draft(path: str, changes: Mapping[str, Leaves], earlier: Sequence[FileProblem]) -> _Draft:
    problems = list(earlier)
    root = read_file(path, problems)
    file = Leaves({}, {})
    if root and isinstance(root.value, dict):
        file = leaves(root, problems)
    elif root and root.value is not None:
        message = "needs keys at the top, such as `joint: big_end`, with a space after the colon"
        problems.append(FileProblem(root.place, "", message))
    whole = override_leaves(file, changes)
    name = _study_name(path, whole, problems) if root else ""
    if "blocks" in changes:
        file = override_leaves(file, {"blocks": changes["blocks"]})
    report = _read_report(whole, problems)
    excluded = ("blocks", "report")
    rest = {key: change for key, change in changes.items() if key.partition(".")[0] not in excluded}
    values = {k: node for k, node in file.values.items() if k.partition(".")[0] != "report"}
    return _Draft(path, name, Leaves(values, file.places), rest, problems, report)


def _read_report(found: Leaves, problems: list[FileProblem]) -> dict[str, str]:
    """Return the title and the notes that a file gives for the page of the report."""
    texts = {}
    for name, most in REPORT.items():
        node = found.values.get(f"report.{name}")
        if node is None:
            continue
        text = node.value.strip() if isinstance(node.value, str) else ""
        lines = text.split("\n") if name == "notes" else [text]
        if text and len(text) <= most and all(line.isprintable() for line in lines):
            texts[name] = text
        else:
            what = "lines of text" if name == "notes" else "a line of text"
            message = f"needs {what} of up to {most} letters, not {quote_value(node.plain())}"
            problems.append(FileProblem(node.place, f"report.{name}", message))
    return texts


def _study_name(path: str, found: Leaves, problems: list[FileProblem]) -> str:
    """Return the study's name: the file's value, else the file's stem; "" for a wrong one.

    What is wrong with the value is reported later, with all others.
    """
    if "name" in found.values:
        name = found.values["name"].value
        return "" if table()["name"].check(name) else name
    name = Path(path).stem
    message = table()["name"].check(name)
    if message:
        message = f"the file's name gives none: {message}; set name"
        problems.append(FileProblem(Place(path, 1, 1), "name", message))
    return "" if message else name


def _refuse_shared_names(drafts: Sequence[_Draft]) -> None:
    """Refuse studies that would be stored under one name; on some disks `A` and `a` are one."""
    first: dict[str, _Draft] = {}
    for draft in drafts:
        other = first.setdefault(draft.name.casefold(), draft)
        if draft.name and other is not draft:
            given = override_leaves(draft.leaves, draft.changes).values.get("name")
            place = given.place if given else Place(draft.path, 1, 1)
            message = f"{other.path} and {draft.path} would be stored under one name, {draft.name}"
            draft.problems.append(FileProblem(place, "name", message))


def _unread(drafts: Sequence[_Draft], keys: KeysRead) -> Iterator[FileProblem]:
    """Yield the keys of all files that no job reads.

    A key that a file's own jobs read stands there rightly, whatever the command line changes.
    """
    for draft in drafts:
        if draft.changes and any(place.file == draft.path for place, _ in keys.unread):
            own = replace(draft, changes={}, problems=[])
            _note_read(own, _cases(own, MAX_JOBS)[1], keys)
    yield from keys.unread.values()


def _note_read(draft: _Draft, cases: Cases | None, keys: KeysRead) -> None:
    """Note which keys the jobs of a draft read."""
    if not draft.problems and cases is not None:
        keys.note(cases)


def _cases(draft: _Draft, max_jobs: int) -> tuple[list[blocks.Draft], Cases | None]:
    """Return the blocks of a draft, and their cases; None where they are too many to be made."""
    drafts = [blocks.draft(leaves, draft.problems) for leaves in _blocks(draft, max_jobs)]
    if not _fits_limit(drafts, draft, max_jobs):
        return drafts, None
    return drafts, Cases([one.block(draft.name) for one in drafts])


def _study(
    draft: _Draft, max_jobs: int, only: Test | None, progress: Progress, read: KeysRead
) -> Study:
    """Return the study of a draft; without cases if the draft has problems, its own among them."""
    drafts, cases = _cases(draft, max_jobs)
    if cases is None:
        return Study(draft.name, draft.path, (), ())
    found = cases.parts
    _note_read(draft, cases, read)
    if not draft.problems and not draft.changes:
        _refuse_idle_sample(drafts, draft)
    is_grid = len(found) == 1 and found[0].is_grid
    swept = [] if is_grid else columns(found)
    keys, values = _check_cases(draft, cases, swept, progress)
    if draft.problems:
        return Study(draft.name, draft.path, (), ())
    cases.keys = keys
    if is_grid:
        axes = [Axis(k[0], tuple(n.value for (n,) in rows)) for k, rows in found[0].factors]
    else:
        spreads = {
            key: sweep.spread for one in drafts for key, sweep in one.sweeps.items()
            if sweep.kind in SAMPLED and sweep.has_ends
        }  # fmt: skip
        axes = [Axis(key, tuple(values[key]), spreads.get(key)) for key in swept]
    selected = range(len(cases)) if only is None else cases.where(only)
    return Study(
        draft.name, draft.path, tuple(axes), cases, keys, is_grid, selected,
        tuple(nest_values(block.fixed) for block in found), **draft.report,
    )  # fmt: skip


def _blocks(draft: _Draft, max_jobs: int) -> Iterator[Leaves]:
    """Yield the leaves of each block over those of the file; the file's alone without blocks."""
    node = draft.leaves.values.get("blocks")
    own = {key: item for key, item in draft.leaves.values.items() if key != "blocks"}
    file = Leaves(own, draft.leaves.places)
    if node is None:
        yield override_leaves(file, draft.changes)
        return
    items = node.value if isinstance(node.value, list) else []
    if not items or not all(isinstance(item.value, dict) for item in items):
        message = "needs a list of mappings, such as [{load: none}, {joint: both}]"
        draft.problems.append(FileProblem(node.place, "blocks", message))
    elif len(items) > max_jobs:
        message = f"{len(items)} blocks are more jobs than {max_jobs}; raise --max-jobs"
        draft.problems.append(FileProblem(node.place, "blocks", message))
    else:
        for item in items:
            yield override_leaves(merge_leaves(file, _block_leaves(item, draft)), draft.changes)


def _refuse_idle_sample(drafts: Sequence[blocks.Draft], draft: _Draft) -> None:
    """Refuse a `sample` where no key is sampled: a mistake."""
    place = draft.leaves.places.get("sample")
    if place and not any(one.samples and one.is_sampled for one in drafts):
        message = "samples nothing: give a key {random: [least, greatest]}, lhs, sobol or saltelli"
        draft.problems.append(FileProblem(place, "sample", message))


def _block_leaves(item: Node, draft: _Draft) -> Leaves:
    """Return the leaves of a block; keys that only a file can have are problems."""
    found = leaves(item, draft.problems)
    whole = ("name", "blocks", "report")
    for key in [key for key in found.values if key.partition(".")[0] in whole]:
        group, message = key.partition(".")[0], IN_BLOCK
        draft.problems.append(FileProblem(found.places[group], group, message))
        del found.values[key]
    found.places[""] = item.place
    return found


def _fits_limit(drafts: Sequence[blocks.Draft], draft: _Draft, max_jobs: int) -> bool:
    """Return whether there are few enough jobs to make their values; too many are a problem."""
    sizes = [one.sizes() for one in drafts]
    total = sum(math.prod(one.values()) for one in sizes)
    if total <= max_jobs:
        return True
    largest = max(drafts, key=lambda one: math.prod(one.sizes().values()))
    keys = max(largest.factors, key=lambda keys: largest.size(keys[0]))
    counts = [" x ".join(f"{name} ({format_count(n)})" for name, n in one.items()) for one in sizes]
    message = (
        f"{format_count(total)} jobs are more than {max_jobs}: {shorten(' + '.join(counts), 300)}; "
        "ask for fewer, or raise --max-jobs"
    )
    place = largest.sweeps[keys[0]].node.place
    draft.problems.append(FileProblem(place, keys[0], message))
    return False


def _check_cases(
    draft: _Draft, cases: Cases, swept: Sequence[str], progress: Progress
) -> tuple[tuple[str, ...], dict[str, list[Any]]]:
    """Return the key of each case, and its value of each swept key.

    Values that are good alone and do not fit each other are problems, each once.
    """
    found: dict[Problem, FileProblem] = {}
    keys: list[str] = []
    values: dict[str, list[Any]] = {key: [] for key in swept}
    total = len(cases)
    progress = progress if total >= MANY_CASES else no_progress
    for number, (block, place) in enumerate(cases.combinations):
        if number % 1000 == 0:
            progress(number, total, "" if number else f"{draft.name}: {total} jobs")
        try:
            case = block.case(place)
        except CaseError as error:
            chosen = block.chosen(place)
            for problem in error.problems:
                found.setdefault(problem, _locate_problem(problem, chosen, block, draft.path))
            continue
        if not found:
            keys.append(case.key)
            for key in swept:
                values[key].append(value_of(case, key))
    progress(total, total, "")
    draft.problems.extend(itertools.islice(found.values(), MAX_CONFLICTS))
    if len(found) > MAX_CONFLICTS:
        message = f"{len(found)} conflicts between swept values; the first {MAX_CONFLICTS} are"
        draft.problems.append(FileProblem(Place(draft.path), "", message))
    return tuple(keys), values


def _locate_problem(
    problem: Problem, chosen: Mapping[str, Node], block: Block, path: str
) -> FileProblem:
    """Return a case's problem at the value it is about, or at the nearest key, group or block."""
    group = problem.key.partition(".")[0]
    for key in (problem.key, group):
        if key in chosen:
            return FileProblem(chosen[key].place, key, problem.message)
    for key in (problem.key, group):
        if key in block.leaves.places:
            return FileProblem(block.leaves.places[key], problem.key, problem.message)
    place = block.leaves.places.get("", Place(path, 1, 1))
    return FileProblem(place, problem.key, problem.message)
