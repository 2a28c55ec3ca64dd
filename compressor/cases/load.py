"""Case files to studies: what is swept multiplies, and all errors are reported at once.

A file becomes nested values with their places (`yaml_reader`), blocks and overrides stand over them
(`keys`), and the jobs are counted (`study`) before any is made. Each job's case is then built
whole, for its key and for what is wrong with its values, and again when it is used.
"""

import itertools
import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import partial
from typing import Any

from compressor.cases.case import Case
from compressor.cases.checks import DOUBLES, expand_synonyms, key_of, row_of, stands_for, value_of
from compressor.cases.comparison import NoComparison, Test, comparison, condition
from compressor.cases.conflicts import conditions, is_off, needs_of_given, problem_of
from compressor.cases.keys import (
    covers,
    merge_block,
    override,
    path_of,
    place_cards,
    read_overrides,
)
from compressor.cases.parameter import CaseError, choice, make_group
from compressor.cases.study import Axis, Block, Cases, Located, Study, plan_block, read_own, reader
from compressor.cases.table import WORDS, outside_identity, table
from compressor.cases.yaml_reader import (
    START,
    CaseFileError,
    Place,
    Problem,
    Tree,
    read_file,
    shorten,
)
from compressor.program import Progress, no_progress, work_beside

MAX_JOBS = 10_000
NONE_SELECTED = "selects no job; compsim plan without it lists those that there are"
MANY_CASES = 20_000  # cases of a study that take seconds to be read
MAX_CONFLICTS = 20  # reported of one file; a sweep can have another in every job
IN_BLOCK = "cannot stand in a block: it belongs to the whole file"
WHOLE_FILE = ("name", "blocks", "report")
AT_TOP = "needs keys at the top, such as `joint: big_end`, with a space after the colon"
IDLE = "leaves out no job: mend the condition, or leave it out"
NO_BLOCKS = "needs a list of mappings, such as [{load: none}, {joint: both}]"
NO_CHANGES, NOWHERE = Tree({}, {}), Place("")
NO_DRAWS = "samples nothing: give a key {random: [least, greatest]}, lhs, sobol or saltelli"


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
) -> list[Study]:
    """Return the studies of YAML case files.

    Each override, `key=value`, replaces a value in all of them. A file with more than `max_jobs`
    jobs is refused before any is made; `only`, a comparison, selects the jobs to be run. `progress`
    is called with how many of how many cases are read. A key that no case reads is refused. Raises
    CaseFileError with everything that is wrong in all files, overrides and the comparison.
    """
    changes, problems = read_overrides(overrides)
    test = None
    selection = Place(f"--only {shorten(only or '')}")
    if only:
        try:
            test = comparison(only)
        except NoComparison as error:
            problems.append(Problem("", str(error), selection))
    if not paths:
        problems.append(Problem("", f"needs the path of a case file; {START}", NOWHERE))
    mistaken = bool(problems)
    files = [_read(os.fsdecode(path), NO_CHANGES if mistaken else changes) for path in paths]
    problems += [problem for file in files for problem in file.problems]
    problems += _find_shared_names(files)
    studies, blocks = [], []
    for file in files if not mistaken else ():
        try:
            study, found = _study(file, max_jobs, test, progress)
        except CaseFileError as error:
            problems += error.problems
        else:
            studies.append(study)
            blocks += found
    unused = _find_unused(blocks)
    if changes.values and any(place.line for place, _ in unused):
        # what the command line takes the use from is the file's, and no mistake of it
        alone = {(one.place, one.key) for one in _find_problems(paths, max_jobs)}
        unused = {
            at: one for at, one in unused.items() if not at[0].line or (one.place, one.key) in alone
        }
    problems += unused.values()
    if not problems and not any(study.selected for study in studies):
        problems.append(Problem("", NONE_SELECTED, selection))
    if problems:
        raise CaseFileError(problems)
    return studies


@make_group
class Report:
    """What the page of the report says of a machine; `report`."""

    title: str | None = choice(None, (), "title of the page", kind="lines", high=100)
    notes: str | None = choice(None, (), "notes on it", kind="lines", high=2000)
    figures: str | None = choice(None, ("paper",), "whose figures are drawn of it")


@dataclass(frozen=True)
class CaseFile:
    """A case file that was read, and what the command line changes of it.

    `name` is empty where it gives no valid one; a file that cannot be read has no tree.
    """

    path: str
    problems: list[Problem]
    tree: Tree | None = None
    changes: Tree = NO_CHANGES
    name: str = ""
    name_place: Place = NOWHERE
    report: Report = field(default_factory=Report)


def _read(path: str, changes: Tree) -> CaseFile:
    """Return a case file, and what is wrong with it as far as no job is made."""
    tree, problems = read_file(path)
    if tree is None or not isinstance(tree.values, dict):
        return CaseFile(path, problems + ([tree.problem((), AT_TOP)] if tree else []))
    place_cards(tree)
    whole = override(tree, changes)
    name, stem = whole.values.get("name"), os.path.splitext(os.path.basename(path))[0]
    place = whole.at("name")[1] if "name" in whole.values else Place(path, 1, 1)
    message = table()["name"].check(stem if name is None else name)
    if message and name is None:
        message = f"the file's name gives none: {message}; set name"
        problems.append(Problem("name", message, place))
    report, wrong = read_own(Report, "report", whole)
    name = "" if message else name or stem
    return CaseFile(path, problems + wrong, tree, changes, name, place, report)


def _find_shared_names(files: Sequence[CaseFile]) -> list[Problem]:
    """Return studies that would be stored under one name; on some disks `A` and `a` are one."""
    first: dict[str, CaseFile] = {}
    problems = []
    for file in files:
        other = first.setdefault(file.name.casefold(), file)
        if file.name and other is not file:
            message = f"{other.path} and {file.path} would be stored under one name, {file.name}"
            problems.append(Problem("name", message, file.name_place))
    return problems


def _study(
    file: CaseFile, max_jobs: int, only: Test | None, progress: Progress
) -> tuple[Study, list[Block]]:
    """Return the study of a file with its blocks. Raises CaseFileError."""
    blocks = _blocks(file, max_jobs)
    is_grid = len(blocks) == 1 and blocks[0].is_grid
    cases = Cases(blocks)
    columns = [*blocks[0].columns] if is_grid else _columns(blocks)
    swept = [] if is_grid else columns
    keys, values, selected = _check_cases(file, cases, swept, only, progress)
    cases.keys = keys
    values = dict(blocks[0].columns) if is_grid else values
    for key, sweep in blocks[0].sweeps.items() if is_grid else ():
        if key_of(sweep.path) in DOUBLES:
            values[key] = [value / 2 for value in values[key]]
    axes = tuple(Axis(key, tuple(values[key])) for key in columns)
    fixed = tuple(expand_synonyms(block.fixed)[0] for block in blocks)
    told = {name: text or "" for name, text in vars(file.report).items()}
    is_curve = len(blocks) == 1 and len(blocks[0].factors) == 1 and not draws(blocks[0])
    study = Study(
        file.name, file.path, axes, cases, keys, is_grid, selected, fixed, **told, is_curve=is_curve
    )
    return study, blocks


def draws(block: Block) -> bool:
    """Return whether a block draws values of any key."""
    return any(sweep.is_drawn for sweep in block.sweeps.values())


def _blocks(file: CaseFile, max_jobs: int) -> list[Block]:
    """Return the blocks of a file.

    Raises CaseFileError with what is wrong with the file, its blocks and any single value.
    """
    if not file.tree:
        raise CaseFileError(file.problems)
    trees, problems = _block_trees(file.tree, file.changes, max_jobs)
    plans = [plan_block(tree, file.name) for tree in trees]
    blocks = [block for block, _ in plans]
    problems += [problem for _, wrong in plans for problem in wrong]
    if too_many := _find_too_many(blocks, max_jobs):
        raise CaseFileError([*problems, too_many])
    told = {one.key for one in file.problems}
    for block in blocks:
        repeated = [one for one in block.find_repeated() if one.key not in told]
        problems += repeated
        if block.combinations and not (repeated or block.numbers):
            problems.append(block.tree.problem(("exclude",), "leaves no job"))
    if not problems and not file.problems:
        return blocks
    found: Located = {}  # what is wrong with single values is told in the same run
    for block in blocks:
        for rows in block.each_value():
            try:
                Case.resolve(block.values_at(rows))
            except CaseError as error:
                found |= {} if error.is_misfit else block.locate(error, rows)
    told |= {one.key for one in problems}  # from which more may follow
    left = [one for one in found.values() if not any(covers(one.key, key) for key in told)]
    raise CaseFileError(problems + left)


def _block_trees(tree: Tree, changes: Tree, max_jobs: int) -> tuple[list[Tree], list[Problem]]:
    """Return the values of each block over those of the file; the file's alone without blocks."""
    if ("blocks",) in changes.values:
        tree = override(tree, Tree({("blocks",): changes.values["blocks",]}, changes.places))
        values = {path: value for path, value in changes.values.items() if path != ("blocks",)}
        changes = Tree(values, changes.places)
    if "blocks" not in tree.values:
        return [override(tree, changes)], []
    items = tree.values["blocks"]
    if not isinstance(items, list) or not items or not all(isinstance(i, dict) for i in items):
        return [], [tree.problem(("blocks",), NO_BLOCKS)]
    if len(items) > max_jobs:
        message = f"{len(items)} blocks are more jobs than {max_jobs}; raise --max-jobs"
        return [], [tree.problem(("blocks",), message)]
    whole = Tree({key: v for key, v in tree.values.items() if key != "blocks"}, tree.places)
    within: list[dict[Any, tuple[Place, Place]]] = [{} for _ in items]
    for path, spots in tree.places.items():
        if path[:1] == ("blocks",) and path[1:]:
            within[int(path[1])][path[2:]] = spots
    found, problems = [], []
    for item, own in zip(items, within, strict=True):
        block = Tree({key: v for key, v in item.items() if key not in WHOLE_FILE}, own)
        problems += [block.problem((key,), IN_BLOCK, True) for key in WHOLE_FILE if key in item]
        found.append(override(merge_block(whole, block), changes))
    return found, problems


def _find_too_many(blocks: Sequence[Block], max_jobs: int) -> Problem | None:
    """Return the problem of more jobs than may be made."""
    total = sum(block.combinations for block in blocks)
    if total <= max_jobs:
        return None
    largest = max(blocks, key=lambda block: block.combinations)
    key = max(largest.factors, key=largest.size)[0]
    many = Decimal(total)  # which may be beyond any float
    message = f"{many:.20g} jobs are more than {max_jobs}: ask for fewer, or raise --max-jobs"
    return Problem(key, message, largest.tree.at(*largest.sweeps[key].path)[1])


def _columns(blocks: Sequence[Block]) -> list[str]:
    """Return the keys by which the jobs of blocks differ: swept in one, or not the same in all."""
    swept = dict.fromkeys(key for block in blocks for keys in block.factors for key in keys)
    given = dict.fromkeys(key for block in blocks for key in block.given)
    differing = dict.fromkeys(
        key
        for key in given
        if key not in outside_identity()
        and len({repr(block.given.get(key)) for block in blocks}) > 1
    )
    found = swept | differing
    whole = {key for key in found if key not in swept and any(p in found for p in stands_for(key))}
    parts = (part for key in found for part in (stands_for(key) if key in whole else (key,)))
    return [*dict.fromkeys(parts)]


def _check_cases(
    file: CaseFile, cases: Cases, columns: Sequence[str], only: Test | None, progress: Progress
) -> tuple[tuple[str, ...], dict[str, Sequence[Any]], list[int]]:
    """Return the key of each case, its value of each swept key, and the numbers of those selected.

    Of many cases a copy of this process checks one half. Raises CaseFileError.
    """
    total, check = len(cases), partial(_check_some, cases, columns, only)
    half = total // 2
    if total < MANY_CASES:
        parts = [check(range(total), no_progress)]
    else:
        with work_beside(lambda: check(range(half, total), no_progress)) as others:
            progress(0, total, f"{file.name}: {total} jobs")  # after which a thread may draw it
            parts = [check(range(half), lambda done, *_: progress(2 * done, total, "")), others()]
        progress(total, total, "")
    keys, rows, selected, found = zip(*parts, strict=True)
    # in the order of jobs, and where a value is wrong in both halves, as in the first
    chain, wrong = itertools.chain.from_iterable, found[0] | found[-1] | found[0]
    problems = [*itertools.islice(wrong.values(), MAX_CONFLICTS)]
    if len(wrong) > MAX_CONFLICTS:
        message = f"{len(wrong)} problems of swept values; the first {MAX_CONFLICTS} are"
        problems.append(Problem("", message, Place(file.path)))
    if problems:
        raise CaseFileError(problems)
    values: dict[str, Sequence[Any]] = dict(
        zip(columns, zip(*chain(rows), strict=True), strict=True)
    )
    return (*chain(keys),), values, [*chain(selected)]


def _check_some(
    cases: Cases, columns: Sequence[str], only: Test | None, numbers: range, progress: Progress
) -> tuple[list[str], list[tuple[Any, ...]], list[int], Located]:
    """Return keys and swept values of cases of some numbers, those selected, and what is wrong.

    Where anything is wrong, the first three lack cases.
    """
    keys, rows, selected = [], [], []
    wrong: Located = {}
    for number in numbers:
        if number % 1000 == 0:
            progress(number - numbers.start, len(numbers), "")
        block, place = cases.place_of(number)
        try:
            case = block.case(place)
        except CaseError as error:
            for where, problem in block.locate(error, block.rows_of(place)).items():
                wrong.setdefault(where, problem)
            continue
        keys.append(case.key)
        rows.append(tuple(value_of(case, key) for key in columns))
        if only is None or only(reader(block.given_of(place), lambda: case)):  # noqa: B023
            selected.append(number)
    return keys, rows, selected, wrong


def _find_problems(paths: Sequence[str | os.PathLike[str]], max_jobs: int) -> list[Problem]:
    """Return what is wrong with files without the command line."""
    try:
        load_studies(*paths, max_jobs=max_jobs)
    except CaseFileError as error:
        return error.problems
    return []


def _find_unused(blocks: Sequence[Block]) -> Located:
    """Return what is of no use in any job that it is given for.

    Such are keys that none reads, conditions that leave out none, and a `sample` of nothing. Cases
    are built only until each key has a reader.
    """
    used: set[tuple[Place, str]] = set()
    unused: Located = {}
    for block in blocks:
        tree, wanted, is_drawn = block.tree, {}, draws(block)
        for number in range(len(block.exclusions)):
            where = tree.at("exclude", number)[1], "exclude"
            unused[where] = Problem("exclude", IDLE, where[0])
            if is_drawn or number not in block.left_and_idle[1]:  # where drawn, it is by chance
                used.add(where)
        if "sample" in tree.values:
            where = tree.at("sample")[0], "sample"
            unused[where] = Problem("sample", NO_DRAWS, where[0])
            used |= {where} if is_drawn else set()
        for key, value in block.given.items():
            path = path_of(key)
            while path not in tree.places:  # of a part, the key that gives all of them
                path = path[:-1]
            where = tree.at(*path)[0], key_of(path)
            if where not in used and (row_of(key) or key in WORDS) and not is_off(key, value):
                is_swept = key in block.sweeps
                wanted[where] = conditions(key) if is_swept else needs_of_given(key, block.given)
        for number in block.numbers if wanted else ():
            case = block.case(number)
            for where, needs in [*wanted.items()]:
                unmet = next((one for one in needs if not condition(one[1])(case)), None)
                if unmet is None:
                    used.add(where)
                    del wanted[where]
                elif where not in unused:
                    problem = problem_of(*unmet)
                    at = tree.at(*path_of(problem.key))[0]
                    place = at if at.file == where[0].file else where[0]
                    unused[where] = replace(problem, place=place)
            if not wanted:
                break
    return {where: problem for where, problem in unused.items() if where not in used}
