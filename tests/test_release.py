"""Versions: each has one source, the changes name it, and a lock has what CI installs."""

import fnmatch
import re
import tomllib
from pathlib import Path

import oldest
import release

from compressor.cases import MODEL_VERSION
from compressor.program import VERSION

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
CHANGELOG = (ROOT / "compressor/CHANGELOG.md").read_text(encoding="utf-8")


def test_the_changes_name_the_versions_of_today():
    first = re.search(r"^## (.*)$", CHANGELOG, re.MULTILINE)
    assert f"Program {VERSION}, model {MODEL_VERSION}" in first[1]


def test_the_lock_has_what_is_installed_for_tests_and_site():
    text = (ROOT / ".ci/requirements.lock").read_text(encoding="utf-8")
    locked = {name.lower().replace("_", "-") for name in re.findall(r"^([\w.-]+)==", text, re.M)}
    more = PROJECT["project"]["optional-dependencies"]
    asked = PROJECT["project"]["dependencies"] + more["dev"] + more["docs"]
    assert {re.match(r"[\w.-]+", one)[0].lower() for one in asked} <= locked


def test_the_oldest_libraries_come_with_what_tests_of_extras_need():
    more = PROJECT["project"]["optional-dependencies"]
    extras = [one for name in ("learn", "dask") for one in more[name]]
    assert {one.partition(">=")[0] for one in extras} <= {*oldest.TOOLS}


def test_data_files_that_a_wheel_must_hold():
    """Each matches a pattern of its package in pyproject.toml, from the package's folder on."""
    found, patterns = {*release.data_files()}, PROJECT["tool"]["setuptools"]["package-data"]
    assert "compressor/py.typed" in found
    assert "compressor/cases/examples/paper.yaml" in found
    assert "compressor/report/templates/page.html" in found
    installed = [f"{of.replace('.', '/')}/{name}" for of in patterns for name in patterns[of]]
    beside = [name for name in found if not name.endswith(".py")]
    assert [n for n in beside if not any(fnmatch.fnmatch(n, one) for one in installed)] == []
