"""The house: which package may import which, one door a package, one door a library.

The rules are the two tables of compressor/README.md. Imports count wherever they stand, inside
functions and for types alone; a planted fault shows that a rule bites.
"""

import ast
import re
import subprocess
import sys
import tomllib
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "compressor/README.md").read_text(encoding="utf-8")


def read_table(head):
    """Return the cells of a table of the page, a list a row; head: how its first row begins."""
    rows = PAGE.partition(f"\n| {head} ")[2].partition("\n\n")[0].split("\n")[2:]
    return [row.strip("| ").split(" | ") for row in rows]


def quoted(cell):
    """Return the dotted names of what a cell has in code."""
    names = [f"compressor/{name}" for name in re.findall(r"`([\w/]+)`", cell)]
    return [name.replace("compressor/cmd/", "").replace("/", ".") for name in names]


PACKAGES = {quoted(row[0])[0].partition(".")[2]: re.findall(r"\w+", row[2])
            for row in read_table("package")[1:]}  # fmt: skip
ROOT_MODULES = ("program", "metrics", "digits", "units", "reasons", "outcome")
EVERY = {*PACKAGES, *ROOT_MODULES}
# package or root module -> what it may import of ours, beside the root module `program`
MAY_IMPORT = dict.fromkeys(ROOT_MODULES, ()) | PACKAGES | {
    "": {"cases", "solve", "store"},  # the public calls, found when they are first used
    "outcome": {"metrics", "reasons"}, "studies": EVERY, "compsim": EVERY,
}  # fmt: skip
LIBRARIES = {  # library -> the modules that may import it
    library.partition(".")[2]: quoted(places)
    for libraries, places in read_table("library")
    for library in quoted(libraries)
}
MAX_NAMES = 10  # of ours that a study imports
OF_PHYSICS = {
    "numpy", "math", "enum", "typing", "types", "dataclasses", "collections", "functools",
    "compressor",
}  # fmt: skip


parse = cache(ast.parse)


def read_sources():
    """The text of each module; a package's door has the package's name."""
    found = {}
    for top in ("compressor", "cmd/compsim"):
        for path in sorted((ROOT / top).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            if parts[1] == "docs":
                continue  # the settings of the site are no part of the program
            parts = parts[parts[0] == "cmd" :]
            found[".".join(part for part in parts if part != "__init__")] = path.read_text("utf-8")
    return found


SOURCES = read_sources()


def room(module):
    """The package or root module that a module belongs to; "" is the root's own door."""
    parts = module.split(".")
    return "compsim" if parts[0] == "compsim" else parts[1] if len(parts) > 1 else ""


def study(module):
    """The study that a module is part of; "" of the frame, and elsewhere."""
    _, _, name = module.partition("compressor.studies.")
    return name.partition(".")[0].replace("frame", "")


@cache
def imports(text):
    """(module, name) of each import; the name is "" where the whole module is imported."""
    found = []
    for node in ast.walk(parse(text)):
        if isinstance(node, ast.Import):
            found += [(alias.name, "") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "a relative import"
            found += [(node.module, alias.name) for alias in node.names]
    return found


def is_within(module, package):
    """Whether a module is one of a package's; the folders of studies are packages of their own."""
    inside = module.startswith(f"{package}.") and package != "compressor.studies"
    return inside or fnmatch(module, package)


def faults(module, text):
    """Imports of a module that break a rule."""
    here = room(module)
    for source, name in imports(text):
        top, inner = source.partition(".")[0], f"{source}.{name}"
        doors = LIBRARIES.get(top)
        if doors and not any(is_within(module, door) for door in doors):
            yield f"{module} imports {top}, which {doors} may"
        if here == "physics" and top not in OF_PHYSICS and module != "compressor.physics._jit":
            yield f"{module} imports {source}: physics needs numpy alone"
        if top not in ("compressor", "compsim"):
            continue
        handed_on = name in {one for _, one in imports(SOURCES.get(source, ""))}
        if inner in SOURCES and not handed_on:  # a package or a module by its name
            source = inner
        there = room(source)
        if there not in {"program", here, *MAY_IMPORT[here]}:
            yield f"{module} imports {source}"
        past = there in PACKAGES and there != here and (source.count(".") > 1 or not name)
        if past and module != "compressor" and (here, there) != ("compsim", "studies"):
            yield f"{module} imports {source} past its door"
        if study(source) not in {"", study(module)} and here != "compsim":
            yield f"{module} imports the study {source}"
    packages = {name for source, name in imports(text) if source == "compressor"} & {*PACKAGES}
    doors = {name: {one for _, one in imports(SOURCES[f"compressor.{name}"])} for name in packages}
    for node in ast.walk(parse(text)) if doors else ():
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            package = node.value.id
            if node.attr not in doors.get(package, {node.attr}):
                yield f"{module} takes {package}.{node.attr}, which its door does not have"


def circles(sources):
    """Modules that import each other in a ring."""
    wanted = {
        module: {
            inner if (inner := ".".join(pair)) in sources else pair[0] for pair in imports(text)
        }
        for module, text in sources.items()
        if room(module) and module != f"compressor.{room(module)}"
    }
    while leaves := [module for module, below in wanted.items() if not below & wanted.keys()]:
        for module in leaves:
            del wanted[module]
    return [f"{module} is in a circle" for module in sorted(wanted)]


def test_the_house_keeps_its_rules():
    assert [one for module in SOURCES.items() for one in faults(*module)] == []
    assert circles(SOURCES) == []


@pytest.mark.parametrize(
    ("module", "planted"),
    [
        ("compressor.physics.contact", "from compressor.cases import Case"),
        ("compressor.physics.contact", "import scipy"),
        ("compressor.cases.study", "def late():\n    import compressor.store"),
        ("compressor.sweep.sweep", "from compressor.store import netcdf"),
        ("compressor.sweep.sweep", "from compressor.store.netcdf import write_dataset"),
        ("compressor.sweep.sweep", "import compressor.store"),
        ("compressor.sweep.sweep", "from compressor import store\nstore.netcdf"),
        ("compressor.physics.kinematics", "import compressor.physics.motion"),
        ("compressor.solve.simulate", "import h5py"),
        ("compressor.report.report", "import compressor.studies.wear"),
        ("compressor.studies.wear", "import compsim.screen"),
    ],
)
def test_a_planted_fault_breaks_a_rule(module, planted):
    text = f"{SOURCES[module]}\n{planted}\n"
    assert [*faults(module, text)] or circles(SOURCES | {module: text})


def test_a_study_imports_few_names():
    own = {
        module: {name or source for source, name in imports(text) if source.startswith("comp")}
        for module, text in SOURCES.items() if room(module) == "studies"
    }  # fmt: skip
    assert {module: names for module, names in own.items() if len(names) > MAX_NAMES} == {}


def test_every_package_is_installed():
    """An editable install does not tell: a wheel without a package fails at the user's."""
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    doors = [*(ROOT / "compressor").rglob("__init__.py"), ROOT / "cmd" / "compsim" / "__init__.py"]
    parts = (door.parent.relative_to(ROOT).parts for door in doors)
    assert sorted(listed) == sorted(".".join(p[p[0] == "cmd" :]) for p in parts)


LOADED = (  # what is imported, one after the other; what it does not load
    ("compsim.cli", "numpy xarray scipy numba h5py joblib matplotlib yaml"),
    ("compressor.cases.load", "numpy scipy numba"),
    ("compressor.analysis", "xarray scipy numba"),
    ("compressor.solve", "xarray pandas scipy numba"),  # in each worker
    ("compressor.report.figures", "matplotlib.pyplot"),
)
LOOK = """
import sys
from importlib import import_module
for module, heavy in {LOADED}:
    made = import_module(module)
    if module == "compressor.analysis":  # before each run: numba and xarray took it 0.8 s
        from compressor.cases import load_studies, templates
        study = load_studies(templates()["machine"].path)[0]
        made.cautions(study), made.describe_machine(study)
    print(module, {*heavy.split()} & {*sys.modules})
"""


def test_nothing_heavy_is_loaded_before_it_is_needed():
    run = [sys.executable, "-c", LOOK.replace("{LOADED}", repr(LOADED))]
    told = subprocess.run(run, capture_output=True, text=True, check=True).stdout
    assert told.splitlines() == [f"{module} set()" for module, _ in LOADED]
