"""Which folders hold results, and what is said of one that does not."""

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from compressor.program import did_you_mean
from compressor.store.files import Folder, WrongName

# folders in a store
PARTS = ("rows", "jobs", "studies", "shards", "regimes", "features", "wear", "models")
HELD = ("studies/*.json", "regimes/*/*.json", "wear/*.nc")  # of which each is a result
MOST_LOOKED_AT = 1000  # entries of a folder in which results are sought
MOST_NAMES = 5  # that are listed
MAKE = "make one: compsim run CONFIG..."


def holds_results(folder: Folder) -> bool:
    """Return whether a folder holds a study, of jobs or of regimes, or a machine's wear."""
    place = Path(folder)
    try:
        return any(any(place.glob(one)) for one in HELD)
    except OSError:
        return False


def no_results(folder: Folder) -> WrongName:
    """Return the error about a folder that holds no study of jobs, with what was probably meant."""
    place = Path(folder)
    if place.is_file():
        if place.suffix in (".yaml", ".yml"):
            remedy = f"compsim run {folder} makes one, in results"
            return WrongName(folder, "is a case file, where a folder of results is needed", remedy)
        return WrongName(
            folder, "is a file, where a folder of results is needed", remedy_for(place)
        )
    if not place.exists():
        return WrongName(folder, "there is no such folder of results", remedy_for(place))
    followed = listed(sorted(path.parent.name for path in place.glob("regimes/*/*.json")))
    if followed:
        problem = f"holds no study of jobs, only machines that were followed: {followed}"
        return WrongName(folder, problem, "compsim plot STUDY draws one")
    if any(place.glob(HELD[-1])):
        problem = "holds no study of jobs, only how machines have worn"
        return WrongName(folder, problem, "compsim wear CONFIG... tells of them")
    return WrongName(folder, "holds no study", remedy_for(place))


def remedy_for(place: Path) -> str:
    """Return what to do instead of naming this folder: name one near by that holds results, or
    run.
    """
    above = place.absolute().parent
    if place.name in PARTS and holds_results(above):
        return f"did you mean {place.parent}?"
    inside = [*found_in(place)]
    if inside:
        return f"did you mean {' or '.join(str(one) for one in inside[:MOST_NAMES])}?"
    beside = {
        one.name: place.parent / one.name for one in found_in(above) if one.name != place.name
    }
    near = did_you_mean(place.name, beside, beside)
    if near:
        return near
    if beside:
        return f"there are results in {listed([*map(str, beside.values())])}; or {MAKE}"
    return f"choose the folder of a sweep, or {MAKE}"


def found_in(folder: Path) -> Iterator[Path]:
    """Yield the folders in a folder that hold results, in their order."""
    try:
        entries = sorted(islice(folder.iterdir(), MOST_LOOKED_AT))
    except OSError:
        return
    yield from (one for one in entries if one.is_dir() and holds_results(one))


def models_file(folder: Folder, study: str) -> Path:
    """Return where the choices of the model of a study's job are stored, or would be."""
    return Path(folder) / "models" / f"{study}.nc"


def listed(names: list[str]) -> str:
    """Return a few names, and whether there are more."""
    return ", ".join(names[:MOST_NAMES]) + (", …" if len(names) > MOST_NAMES else "")
