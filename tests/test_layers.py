"""The house: which package may import which, one door a package, one door a library.

Imports count wherever they stand, inside functions and for types alone. Each rule is a function of
the sources that lists what breaks it, so that a planted fault shows that the rule bites.
"""

import ast
import tomllib
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
# package or root module -> what it may import of ours, beside the root module `program`
MAY_IMPORT = {
    # the public calls, found when they are first used, and the table of studies
    "": {"cases", "solve", "store", "studies"},
    "program": set(),
    "metrics": set(),
    "digits": set(),
    "units": set(),
    "reasons": set(),
    "outcome": {"metrics", "reasons"},
    "cases": {"metrics"},
    "physics": set(),
    "vibration": {"cases"},
    "solve": {"cases", "physics", "vibration", "outcome", "metrics", "reasons"},
    "store": {"cases", "vibration", "outcome", "metrics", "reasons", "digits", "units"},
    "sweep": {"cases", "solve", "store", "outcome", "reasons"},
    "analysis": {"cases", "physics", "solve", "vibration", "metrics", "units"},
    "report": {"analysis", "cases", "store", "outcome", "metrics", "reasons", "digits", "units"},
    "studies": {"analysis", "cases", "digits", "metrics", "outcome", "physics",
                "reasons", "report", "solve", "store", "sweep", "units", "vibration"},
    "compsim": {"analysis", "cases", "digits", "metrics", "outcome", "physics", "reasons", "report",
                "solve", "store", "studies", "sweep", "units"},
}  # fmt: skip
PACKAGES = (
    "cases", "physics", "vibration", "solve", "store", "sweep", "analysis", "report", "studies",
)  # fmt: skip
LIBRARIES = {  # library -> the modules that may import it
    "numba": {"compressor.physics._jit"},
    # designs, sparse systems, integrators, Student's t, splines, root finder and minimiser, spectra
    "scipy": {
        "compressor.analysis.orbit",
        "compressor.analysis.effects",
        "compressor.analysis.contacts",
        "compressor.cases.swept",
        "compressor.studies.search.find",
        "compressor.studies.calibrate.fit",
        "compressor.solve.bearing",
        "compressor.solve.measured_gas",
        "compressor.solve.scipy_driver",
        "compressor.solve.run_metrics",
        "compressor.vibration",
    },
    "yaml": {"compressor.cases.load", "compressor.cases.yaml_reader"},
    "pydantic": {"compressor.cases"},
    "joblib": {"compressor.sweep"},
    "distributed": {"compressor.sweep"},
    "h5py": {"compressor.store.netcdf"},
    "jinja2": {"compressor.report.page"},
    "matplotlib": {"compressor.report.figures"},
    "contourpy": {"compressor.report.figures.contours"},
    "click": {"compsim"},
    "rich": {"compsim.progress"},
    "pyarrow": {"compressor.studies.diagnosis"},
    "sklearn": {"compressor.store.caveats", "compressor.studies.diagnosis.identify"},
}  # fmt: skip

Sources = dict[str, str]  # module -> text; a package's door has the package's name


def read_sources() -> Sources:
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


def room(module: str) -> str:
    """The package or root module that a module belongs to; "" is the root's own door."""
    parts = module.split(".")
    if parts[0] == "compsim":
        return "compsim"
    return parts[1] if len(parts) > 1 else ""


@cache
def imports(text: str) -> list[tuple[str, str]]:
    """(module, name) of each import; the name is "" where the whole module is imported."""
    found = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found += [(alias.name, "") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "a relative import"
            found += [(str(node.module), alias.name) for alias in node.names]
    return found


def ours(sources: Sources, module: str):
    """(module, name) of what a module imports of ours; a module that is imported by name, too."""
    for source, name in imports(sources[module]):
        if source.partition(".")[0] in ("compressor", "compsim"):
            inner = f"{source}.{name}"
            yield (inner, "") if inner in sources and source not in exports(sources, inner) else (
                source, name
            )  # fmt: skip


def exports(sources: Sources, module: str) -> set[str]:
    """The doors of ours that hand on a name like a module's own: the name then is no module."""
    door, _, name = module.rpartition(".")
    handed = {n for source, n in imports(sources.get(door, "")) if source == module}
    return {door} if name in handed else set()


def forbidden_imports(sources: Sources) -> list[str]:
    """Imports that the table does not allow."""
    return [
        f"{module} imports {source}"
        for module in sources
        for source, _ in ours(sources, module)
        if room(source) not in {"program", room(module), *MAY_IMPORT[room(module)]}
    ]


def imports_past_doors(sources: Sources) -> list[str]:
    """Imports from inside another package instead of its door."""
    return [
        f"{module} imports {source}.{name}"
        for module in sources
        for source, name in ours(sources, module)
        if room(source) in PACKAGES
        and room(source) != room(module)
        and module != "compressor"
        and (source != f"compressor.{room(source)}" or not name)
        and (room(module), room(source)) != ("compsim", "studies")
    ]


def imports_of_own_door(sources: Sources) -> list[str]:
    """Imports of a package's own door from inside it."""
    return [
        f"{module} imports its own door"
        for module in sources
        for source, name in ours(sources, module)
        if room(module) in PACKAGES and source == f"compressor.{room(module)}" and name
    ]


def circles(sources: Sources) -> list[str]:
    """Modules that import each other in a ring."""
    wanted = {
        module: {source for source, _ in ours(sources, module) if source in sources}
        for module in sources
        if room(module) not in ("",) and module != f"compressor.{room(module)}"
    }
    while leaves := [module for module, below in wanted.items() if not below & wanted.keys()]:
        for module in leaves:
            del wanted[module]
    return sorted(wanted)


def faults_of_doors(sources: Sources) -> list[str]:
    """Doors that do more than hand on names, or names that nobody outside takes."""
    taken = {
        (source, name)
        for module in sources
        for source, name in ours(sources, module)
        if room(source) != room(module)
    }
    found = []
    for package in PACKAGES:
        door = f"compressor.{package}"
        if package == "studies":  # a table
            continue
        tree = ast.parse(sources[door])
        if len((ast.get_docstring(tree) or "").splitlines()) != 1:
            found.append(f"{door} needs one line of purpose")
        if not all(isinstance(node, ast.ImportFrom) for node in tree.body[1:]):
            found.append(f"{door} does more than hand on names")
        for _, name in imports(sources[door]):
            if (door, name) not in taken:
                found.append(f"{door}.{name} is imported by nobody outside")
    return found


def libraries_without_door(sources: Sources) -> list[str]:
    """Imports of a library from elsewhere than the modules that may."""
    return [
        f"{module} imports {library}"
        for module in sources
        for library, doors in LIBRARIES.items()
        for source, _ in imports(sources[module])
        if source.partition(".")[0] == library
        and not any(fnmatch(module, door) or is_within(module, door) for door in doors)
    ]


def is_within(module: str, package: str) -> bool:
    """Whether a module lies in a package; the folders of studies are packages of their own."""
    inside = module.startswith(f"{package}.")
    return inside and package != "compressor.studies"


def study(module: str) -> str:
    """The folder of the study that a module is part of; "" of the table, and elsewhere."""
    return module.split(".")[2] if module.startswith("compressor.studies.") else ""


def studies_that_know_others(sources: Sources) -> list[str]:
    """Imports of a study from another one, or from elsewhere than the command line.

    The frame is no study, but what all share.
    """
    return [
        f"{module} imports {source}"
        for module in sources
        for source, _ in ours(sources, module)
        if study(source) not in {"", "frame", study(module)}
        if room(module) != "compsim"
    ]


def imports_of_the_command_line(sources: Sources) -> list[str]:
    """Imports of the command line from below it."""
    return [
        f"{module} imports {source}"
        for module in sources
        for source, _ in ours(sources, module)
        if room(source) == "compsim" != room(module)
    ]


RULES = (
    forbidden_imports, imports_past_doors, imports_of_own_door, circles, faults_of_doors,
    libraries_without_door, studies_that_know_others, imports_of_the_command_line,
)  # fmt: skip


@pytest.mark.parametrize("rule", RULES)
def test_the_house_keeps_its_rules(rule):
    assert rule(SOURCES) == []


@pytest.mark.parametrize(
    ("rule", "module", "planted"),
    [
        (forbidden_imports, "compressor.physics.contact", "from compressor.cases import Case"),
        (forbidden_imports, "compressor.cases.study", "def late():\n    import compressor.store"),
        (imports_past_doors, "compressor.sweep.sweep", "from compressor.store import netcdf"),
        (imports_of_own_door, "compressor.cases.case", "from compressor.cases import table"),
        (circles, "compressor.physics.kinematics", "import compressor.physics.motion"),
        (faults_of_doors, "compressor.store", "HANDY = 1"),
        (libraries_without_door, "compressor.solve.simulate", "import h5py"),
        (
            studies_that_know_others,
            "compressor.report.report",
            "import compressor.studies.wear",
        ),
        (imports_of_the_command_line, "compressor.studies.wear", "import compsim.screen"),
    ],
)
def test_a_planted_fault_breaks_its_rule(rule, module, planted):
    assert rule(SOURCES | {module: f"{SOURCES[module]}\n{planted}\n"})


@pytest.mark.parametrize("module", [m for m in SOURCES if room(m) == "physics"])
def test_physics_needs_numpy_alone(module):
    outside = {source.partition(".")[0] for source, _ in imports(SOURCES[module])}
    allowed = {
        "numpy",
        "math",
        "enum",
        "typing",
        "types",
        "dataclasses",
        "collections",
        "functools",
    }
    allowed |= {"compressor"}
    door = {"numba", "gc", "os", "shutil", "pathlib", "threading"}
    assert outside - allowed <= (door if module == "compressor.physics._jit" else set())


def test_every_package_is_installed():
    """An editable install does not tell: a wheel without a package fails at the user's."""
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    doors = [*(ROOT / "compressor").rglob("__init__.py"), ROOT / "cmd" / "compsim" / "__init__.py"]
    parts = (door.parent.relative_to(ROOT).parts for door in doors)
    assert sorted(listed) == sorted(".".join(p[p[0] == "cmd" :]) for p in parts)
