"""Numbers that have changed within one version of the model, for the cases that they changed for.

A job's key holds the version of the model, which stays while most results do. Where the equations
of a feature are mended, its line in `CHANGES` tells stored results of before from those of now.
"""

import re
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

MODEL_VERSION = "2"  # part of a job's key: see `compressor.cases.case`
REVISION = 1
MODEL = f"{MODEL_VERSION}.{REVISION}"  # which results are stored with
# what the text of a case holds if it may be one of `CHANGES`: quick to search a store for
SUSPECT = re.compile(rb'"(drive|lubricant|rod|guide|body)\\?": |lugre|"signals\\?": true')


class Change(NamedTuple):
    """What a revision has changed, and for which cases, by their nested values."""

    revision: int
    what: str
    affects: Callable[[Mapping[str, Any]], bool]


def _rubs_on_the_pin(values: Mapping[str, Any]) -> bool:
    """Return whether friction puts a couple on the crosshead pin that an ideal guide bears."""
    friction = values.get("friction")
    if not friction or (values.get("guide") or {}).get("clearance_mm"):
        return False
    return values["joint"] in ("small_end", "both") or bool(friction.get("ideal_joints"))


def _restitutes(values: Mapping[str, Any]) -> bool:
    play = (values.get("guide") or {}).get("clearance_mm")
    return bool(play and values["contact"].get("restitution"))


def _has_no_lugre_friction(values: Mapping[str, Any]) -> bool:
    friction = values.get("friction") or {}
    return friction.get("law") == "lugre" and not (friction["static"] and friction["dynamic"])


CHANGES = (
    Change(1, "times, torques and forces of a drive", lambda values: "drive" in values),
    Change(1, "oil film", lambda values: "lubricant" in values and values["joint"] != "none"),
    Change(1, "losses of an elastic rod", lambda values: "rod" in values),
    Change(1, "damping of the crosshead in its guide", _restitutes),
    Change(1, "LuGre friction without a coefficient", _has_no_lugre_friction),
    Change(
        1, "moment on the guide",
        lambda values: ("body" in values or bool(values["output"].get("signals")))
        and _rubs_on_the_pin(values),
    ),
)  # fmt: skip


def changes_since(model: str, values: Mapping[str, Any]) -> list[str]:
    """Return what has changed for a case since a model that computed it.

    model: the attribute `model_version` of a result, such as "2" or "2.1"; values: of the case,
    nested as by `Case.values`.
    """
    revision = int(model.partition(".")[2] or 0)
    return [one.what for one in CHANGES if revision < one.revision and one.affects(values)]


def model_of(values: Mapping[str, Any]) -> str:
    """Return the version and the last revision of the model that changed the numbers of a case.

    The version alone where none did.
    """
    last = max((one.revision for one in CHANGES if one.affects(values)), default=0)
    return f"{MODEL_VERSION}.{last}" if last else MODEL_VERSION
