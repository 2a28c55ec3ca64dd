"""The house: imports only point down, and every library has one door."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
# from the ground up: a module imports only what stands before it
FLOORS = [
    "physics.machine_code",
    "physics._jit",
    "physics.parameters",
    "physics.materials",
    "physics.kinematics",
    "physics.loads",
    "physics.contact",
    "physics.motion",
    "physics.observe",
    "physics.tally",
    "physics.cam",
    "physics.runge_kutta",
    "physics.rosenbrock",
    "physics.onset",
    "physics.control",
    "physics.march",
    "physics.twin",
    "parameter",
    "quantities",
    "reasons",
    "accuracy",
    "conflicts",
    "case",
    "scales",
    "record",
    "schema",
    "retrace",
    "integrate",
    "horizon",
    "parting",
    "bars",
    "audit",
    "simulation",
    "warm_up",
    "reading",
    "sampling",
    "axes",
    "leaves",
    "overrides",
    "comparisons",
    "blocks",
    "case_schema",
    "study",
    "domain",
    "plan",
    "durable",
    "hdf5",
    "manifest",
    "jobfiles",
    "run_job",
    "segments",
    "labels",
    "store",
    "verification",
    "inquiry",
    "export",
    "writer",
    "analysis",
    "worker",
    "batches",
    "execution",
    "bench",
    "modelling",
    "explain",
    "sweep",
    "versions",
    "shared_folder",
    "remote",
    "cluster",
    "forecast",
    "extremes",
    "judge",
    "stress",
    "figures.style",
    "figures.curves",
    "figures.response",
    "figures.forces",
    "figures.relation",
    "figures.machine",
    "figures.sweep_metric",
    "figures.work_precision",
    "figures.ladders",
    "figures.outcomes",
    "figures",
    "page",
    "report",
]
DOORS = {
    "numba": {"physics._jit"},
    "scipy": {"integrate", "analysis", "sampling"},
    "yaml": {"plan", "reading"},
    "joblib": {"batches", "execution", "cluster"},
    "distributed": {"cluster", "remote"},
    "h5py": {"hdf5"},
    "matplotlib": {"figures"},
    "click": set(),
}


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT / "compressor").with_suffix("").parts
    return ".".join(part for part in parts if part != "__init__")


SOURCES = {module_name(p): p for p in (ROOT / "compressor").rglob("*.py")}
SOURCES.pop("")


def imported(path: Path):
    """Dotted names that a file imports when it runs, wherever in it (types alone do not run)."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def own_module(name: str) -> str | None:
    """The module of ours that a dotted import name lies in."""
    parts = name.split(".")[1:]
    for size in range(len(parts), 0, -1):
        if ".".join(parts[:size]) in SOURCES:
            return ".".join(parts[:size])
    return None


@pytest.mark.parametrize("module", sorted(SOURCES))
def test_imports_only_point_down(module):
    if module == "physics":
        return
    rank = FLOORS.index(module)
    for name in imported(SOURCES[module]):
        below = own_module(name) if name.startswith("compressor.") else None
        if below and below != "physics":
            assert FLOORS.index(below) < rank, f"{module} imports {below}, which stands above it"


@pytest.mark.parametrize("module", sorted(SOURCES))
def test_one_door_per_library(module):
    libraries = {name.split(".")[0] for name in imported(SOURCES[module])}
    for library, doors in DOORS.items():
        if library in libraries:
            assert module in doors or module.split(".")[0] in doors, f"{module} imports {library}"


@pytest.mark.parametrize("module", [m for m in sorted(SOURCES) if m.startswith("physics")])
def test_physics_needs_numpy_alone(module):
    outside = {name.split(".")[0] for name in imported(SOURCES[module])}
    allowed = {"numpy", "math", "enum", "typing", "dataclasses", "collections", "compressor"}
    doors = {
        "physics._jit": {"numba", "os"},
        "physics.machine_code": {"os", "hashlib", "shutil", "pathlib"},
    }
    assert outside - allowed <= doors.get(module, set())


def test_top_level_holds_only_what_was_agreed():
    agreed = {"pyproject.toml", "cmd", "compressor", "configs", "tests", "Makefile", "README.md"}
    import subprocess

    tracked = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.split("\n")
    top = {name.split("/")[0] for name in tracked if name}
    assert {name for name in top if not name.startswith(".")} - {"LICENSE"} <= agreed


def test_cmd_is_no_package():
    assert not (ROOT / "cmd" / "__init__.py").exists()


@pytest.mark.parametrize("path", sorted((ROOT / "compressor").rglob("*.py")), ids=str)
def test_no_function_over_sixty_lines(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            assert node.end_lineno - node.lineno < 60, f"{path.name}: {node.name}"
