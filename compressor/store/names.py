"""What studies and jobs are called: the nearest ones are told where a name is not there.

A job is named by the beginning of its key, or by its study and values of the study's axes, such as
`wear clearance_mm=0.2`.
"""

import bisect
import itertools
import math
from collections.abc import Sequence
from typing import Any

from compressor.cases import points, row_of
from compressor.program import did_you_mean
from compressor.store.files import Folder, WrongName
from compressor.store.folders import listed
from compressor.store.studies import StoredStudy, coordinate_names, in_words, read_studies

MOST_LIKE = 5  # keys, or values of an axis, that are offered
CLOSE = 1e-9  # relative; the decimal fractions of a case file are not meant to the last bit


def find_study(
    folder: Folder, name: str | None = None, known: Sequence[StoredStudy] | None = None
) -> StoredStudy:
    """Return the study of a name, or the only one; `known`: the folder's studies, where they were
    read.

    Raises WrongName with the nearest names where there is none, or without a name several.
    """
    if known is None:
        known = read_studies(folder, former=name is not None)
    studies = {one.name: one for one in known}
    if name is None and len(studies) == 1:
        return next(iter(studies.values()))
    if name is None:
        raise WrongName(folder, "holds several studies", f"name one: {listed([*studies])}")
    if name not in studies:
        holds = f"it holds {listed([*studies]) or 'none'}"
        near = did_you_mean(name, studies) or holds
        raise WrongName(folder, f"holds no study {name!r}", near)
    return studies[name]


def find_job(
    folder: Folder, words: Sequence[str], studies: Sequence[StoredStudy], stored: set[str]
) -> str:
    """Return the key of the job that words name; stored: the keys of the jobs that are stored.

    words: the beginning of a key; or a study, and `axis=value` until one job is left. Raises
    WrongName with what is near.
    """
    first, *values = words
    if any(study.name == first for study in studies) or values:
        return _job_at(folder, find_study(folder, first, studies), values)
    return whole_key(folder, first, studies, stored)


def whole_key(
    folder: Folder, beginning: str, studies: Sequence[StoredStudy], stored: set[str]
) -> str:
    """Return the one key, of a stored or a planned job, that begins so; WrongName where that is
    none.
    """
    known = sorted(stored.union(*(study.keys for study in studies)))
    like = [key for key in known if key.startswith(beginning)]
    if len(like) == 1:
        return like[0]
    if like:
        problem = f"{len(like)} jobs' keys begin with {beginning!r}: {listed(like)}"
        raise WrongName(folder, problem, "give more of the key")
    near = did_you_mean(beginning, [study.name for study in studies]) or _near_keys(
        beginning, known
    )
    problem = f"no job's key begins with {beginning!r}, and no study is called so"
    remedy = near or "compsim status tells the studies, and a job is named by STUDY AXIS=VALUE, too"
    raise WrongName(folder, problem, remedy)


def _near_keys(beginning: str, known: Sequence[str]) -> str:
    """Return the sorted keys that have most of a beginning in common; "" where that is not its
    half.
    """
    at = bisect.bisect(known, beginning)
    shared = {key: _in_common(key, beginning) for key in known[max(at - 1, 0) : at + 1]}
    most = max(shared.values(), default=0)
    near = [key for key, count in shared.items() if count == most]
    return f"the nearest is {' or '.join(near)}" if 2 * most >= max(len(beginning), 4) else ""


def _in_common(one: str, other: str) -> int:
    """With how many equal characters two texts begin."""
    pairs = zip(one, other, strict=False)
    return sum(1 for _ in itertools.takewhile(lambda pair: pair[0] == pair[1], pairs))


def _job_at(folder: Folder, study: StoredStudy, words: Sequence[str]) -> str:
    """Return the one job of a study at some values of its axes."""
    wanted = dict(_value_at(folder, study, word) for word in words)
    jobs = [
        (key, point)
        for key, point in zip(study.keys, points(study), strict=True)
        if all(key in point and point[key] == value for key, value in wanted.items())
    ]
    found = {key for key, _ in jobs}
    if len(found) == 1:
        return found.pop()
    told = " and ".join(f"{key}={in_words(value)}" for key, value in wanted.items())
    if not found:
        raise WrongName(folder, f"no job of {study.name} has {told}", _axes(study))
    problem = (
        f"{len(found)} jobs of {study.name} have {told}"
        if told
        else (f"{study.name} is a study of {len(found)} jobs")
    )
    left = _varied([point for _, point in jobs])
    more = "; ".join(f"{key}=… of {_some(values)}" for key, values in left.items())
    raise WrongName(folder, problem, f"choose one by {more}" if more else "give a job's key")


def _value_at(folder: Folder, study: StoredStudy, word: str) -> tuple[str, Any]:
    """Return the axis and the value that `axis=value` means."""
    name, equals, text = word.partition("=")
    if not equals or not text:
        raise WrongName(folder, f"{word!r} is no AXIS=VALUE of {study.name}", _axes(study))
    short = coordinate_names([axis.key for axis in study.axes])
    found = [
        axis
        for axis in study.axes
        if name in (axis.key, short[axis.key]) or axis.key.endswith(f".{name}")
    ]
    if len(found) != 1:
        problem = f"has no axis {name!r}" if not found else f"has {len(found)} axes {name!r}"
        near = did_you_mean(name, [*short, *short.values()])
        raise WrongName(folder, f"{study.name} {problem}", near or _axes(study))
    (axis,) = found
    row = row_of(axis.key)
    text = row.choice_of(text) if row else text
    for value in axis.values:
        if text == in_words(value) or _equal(text, value):
            return axis.key, value
    problem = f"no job of {study.name} has {axis.key}={text}"
    raise WrongName(folder, problem, f"there are {_some(axis.values, text)}")


def _equal(text: str, value: Any) -> bool:
    """Return whether a text is the number of an axis."""
    number = _number(text)
    return (
        not isinstance(value, str | tuple | bool | None)
        and number is not None
        and math.isclose(number, value, rel_tol=CLOSE)
    )


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _axes(study: StoredStudy) -> str:
    """Return what a study's jobs are told apart by."""
    axes = [f"{axis.key}={in_words(axis.values[0])}" for axis in study.axes]
    return (
        f"its axes are {listed([axis.key for axis in study.axes])}, as in {axes[0]}"
        if axes
        else ("it is one job: leave the values out")
    )


def _varied(jobs: Sequence[dict[str, Any]]) -> dict[str, list[Any]]:
    """Return the axes in which jobs differ, and their values."""
    keys = dict.fromkeys(key for point in jobs for key in point)
    values = {key: [*dict.fromkeys(point.get(key) for point in jobs)] for key in keys}
    return {key: found for key, found in values.items() if len(found) > 1}


def _some(values: Sequence[Any], near: str = "") -> str:
    """Return a few values of an axis, those next to a number where one is given."""
    found = [value for value in dict.fromkeys(values) if value is not None]
    number = _number(near)
    numeric = all(isinstance(value, int | float) for value in found)
    if number is not None and numeric and len(found) > MOST_LIKE:
        found = sorted(sorted(found, key=lambda value: abs(value - number))[:MOST_LIKE])
        return f"{', '.join(map(in_words, found))} next to it"
    return listed([*map(in_words, found)])
