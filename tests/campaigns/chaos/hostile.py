"""Malformed and hostile case files, and HDF5 and study files whose digests fit.

Case files are ours and the README's after mutation; they are planned, or run if that is cheap. The
files of a store are replaced by mutated and by purposely foreign ones under a name with the right
digest, so that nothing but their content tells, and are read by every command. Whatever they say:
no traceback, no crash, nothing over two seconds (of processor time, or twenty on the clock; tried
twice), no file outside the store, and no
control character on the screen.
"""

import dataclasses
import io
import json
import random
import re
import shutil
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

import compressor.sweep as door
from chaos.common import (
    Said,
    case_files,
    command,
    complete_store,
    forked,
    fresh,
    undrawn,
)
from chaos.tally import Tally
from compressor.cases.load import CaseFileError
from compressor.cases.study import Study
from compressor.store import hdf5
from compressor.store.reader import read_store
from compressor.store.rows import decode, encode, segment_name
from compressor.store.studies import read_study
from compressor.sweep.sweep import Summary

ROOT = Path(__file__).parents[3]
SECONDS = 2.0  # of processor time that a command may take
HANG = 20.0  # s on the clock
MAX_SAMPLES = 20_000  # of a valid case file that is run and not only read
SHARE_OF_CASES = 0.6  # of the trials
STORED = re.compile(
    r"store(/(rows|jobs|studies|shards)(/[A-Za-z0-9._-]+)*|/writer\.lock|/page(/[A-Za-z0-9._-]+)*)?"
)

TOKENS = (
    "&a ", "*a", "!!python/object/apply:os.system ['touch pwned'] ", "!!binary ", "<<: *a\n", "\0",
    "\x1b[31m", "\u202e", "\x85", "\u2028", "\ufeff", "'", '"', "{", "[", "]", "}", ": ", "- ",
    "? ", "| ", "> ", "\t", "---\n", "...\n", "%YAML 1.99999999999999999999\n", "%TAG ! x\n", "#",
    "1e999", ".inf", "-.nan", "0x" + "f" * 400, "9" * 5000, "1e-400", "-1", "0", "../../evil",
    "/etc/passwd", "<script>alert(1)</script>", "[red]x[/red]", "%s%n{0}{}", '"\\e[2J\\0\\x07"',
    '"\\ud800"', '"\\UFFFFFFFF"', "\r", "~", "null", "true", "é", "\U0001f4a3", "a" * 3000,
)  # fmt: skip
VALUES = (
    "{linspace: [0, 1, 1000000000]}", "{range: [0, 1e9, 1e-9]}", "{range: [0, 1, 0]}",
    "{range: [1, 0, 1]}", "{logspace: [-1, 0, 9]}", "{logspace: [1e-300, 1e300, 99]}",
    "{linspace: [0, 1, -3]}", "{linspace: [1e308, -1e308, 3]}", "{sobol: [0, 1]}",
    "{lhs: [1, 0]}", "{random: [nan, 1]}", "{sobol: [-1, 1], log: true}", "{linspace: [[1], 2, 3]}",
    "[]", "[[]]", "{}", "[1, [2, [3]]]", "[0.1, 0.1]", "{a: 1}", "1e308", "-0.0", "0x7fffffffffff",
    "1_000", "0o17", "1:30", "2001-01-01", '""', "[1, two, null]", "[" * 30 + "]" * 30,
)  # fmt: skip
LINES = (
    "name: ../../evil", "name: CON", "name: .hidden", "name: -rf", "name: a/b", "name: ''",
    'name: "\\e[31mred"', 'name: "a\\0b"', "name: " + "n" * 70, "name: [a, b]",
    "exclude: " + "(" * 2000, "exclude: " + "not " * 5000 + "a == 1", "exclude: a == " + "9" * 5000,
    "exclude: __import__('os').system('touch pwned')", "exclude: " + "load == none and " * 3000,
    "exclude: [load == none, '', '=', 'a b c', 'load == ']", "sample: {n: 1e9}", "sample: {n: -1}",
    "sample: {n: 16, seed: 1e99}", "zip: [[a, b]]", "zip: [[load, load]]", "zip: [[clearance_mm]]",
    "blocks: [{}, {}, {}]", "blocks: [" + "{}, " * 50_000 + "{}]", "blocks: [{blocks: [{}]}]",
    "blocks: {a: 1}", "blocks: []", "solve: {duration_rev: 1e5, output_step_deg: 1e-9}",
    "solve: {accuracy: {peak_acceleration: 1e-300}}", "solve: {accuracy: {evil: 1}}",
    "machine: {speed_rpm: {range: [1, 1e5, 1e-5]}}", "contact: {materials: [steel, steel, evil]}",
    "clearance_mm: {linspace: [0.1, 0.2, 99999]}",
)  # fmt: skip


# ---- case files ---------------------------------------------------------------------------------


def sources() -> list[str]:
    """The case files that we ship, and those of the README."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    shipped = [path.read_text(encoding="utf-8") for path in sorted(ROOT.glob("configs/*.yaml"))]
    return shipped + re.findall(r"```yaml\n(.*?)```", readme, re.DOTALL)


def noise(text: str, rng: random.Random) -> bytes:
    """Bytes changed, put in and taken out."""
    data = bytearray(text.encode())
    for _ in range(rng.choice((1, 2, 5, 50))):
        at = rng.randrange(len(data))
        data[at : at + rng.randrange(3)] = rng.randbytes(rng.randrange(3))
    return bytes(data)


def spliced(text: str, rng: random.Random) -> bytes:
    """Hostile tokens put in anywhere."""
    for _ in range(rng.choice((1, 2, 4))):
        at = rng.randrange(len(text))
        text = text[:at] + rng.choice(TOKENS) + text[at:]
    return text.encode(errors="surrogatepass")


def revalued(text: str, rng: random.Random) -> bytes:
    """The value of a line replaced."""
    lines = text.splitlines()
    for _ in range(rng.choice((1, 1, 3))):
        at = rng.randrange(len(lines))
        key = lines[at].partition(":")[0]
        lines[at] = f"{key}: {rng.choice(VALUES + TOKENS)}"
    return "\n".join(lines).encode(errors="surrogatepass")


def relined(text: str, rng: random.Random) -> bytes:
    """Lines repeated, dropped, shuffled, and hostile ones added."""
    lines = [line for line in text.splitlines() if rng.random() < 0.9]
    lines += rng.sample(text.splitlines(), 1) if rng.random() < 0.3 else []
    lines += rng.sample(LINES, rng.choice((1, 1, 2)))
    if rng.random() < 0.2:
        rng.shuffle(lines)
    return "\n".join(lines).encode()


def bomb(text: str, rng: random.Random) -> bytes:
    """Deep, wide, long, or multiplying."""
    deep = rng.choice((25, 1000, 20_000))
    laughs = "\n".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 20))
    return rng.choice(
        (
            "[" * deep, "{a: " * deep, "- " * deep, "? " * deep, "a:\n " * 20,
            "\n".join(" " * n + "a:" for n in range(min(deep, 1000))),
            f"a0: &a0 [x]\n{laughs}\n", f"name: {'x' * 900_000}", "x: 1\n" * 150_000,
            "\n".join(f"k{n}: {n}" for n in range(60_000)), "#" * 2_000_000, "\0" * 1000, "",
            "clearance_mm: [" + "1, " * 200_000 + "1]", "\ufeff" + text, text.replace("\n", "\r\n"),
            "'" * 100_000, '"' * 99_999, "exclude: '" + "((((" * 50_000 + "'", "--- " * 10_000,
            "".join(f"{key}: {{linspace: [1, 2, 1000]}}\n" for key in "abcdefgh"),
        )
    ).encode()  # fmt: skip


MUTATIONS = (noise, spliced, revalued, relined, bomb)
FILE_NAMES = ("case.yaml", "case.yaml", "case.yaml", "a\x1b[31m.yaml", "<b>.yaml", "-x.yaml",
              "é.yaml", "..yaml", "a b.yaml", "\u202ecase.yaml", "$(touch pwned).yaml")  # fmt: skip
OPTIONS = ("--set", "--only")


def words_of_case(trial: Path, texts: list[str], rng: random.Random) -> tuple[str, list[object]]:
    """Write a hostile case file; what it is, and a command about it."""
    mutate = rng.choice(MUTATIONS)
    data = mutate(rng.choice(texts), rng)
    (trial / "case").mkdir()
    path = trial / "case" / rng.choice(FILE_NAMES)
    path.write_bytes(data)
    words: list[object] = [path, "-r", trial / "store", "--max-jobs", 30, "-j", 1]
    if rng.random() < 0.15:
        text = rng.choice((*TOKENS, *VALUES, *LINES)).replace("\0", "\\0")
        key = rng.choice(("solve.rtol", "name", "evil", "", "clearance_mm"))
        sign = rng.choice(("=", " == "))
        words += [rng.choice(OPTIONS), f"{key}{sign}{text}".encode(errors="replace").decode()]
    words += ["--set", "solve.max_steps=1000", "--set", "solve.timeout_s=0.2"]
    return mutate.__name__, words


def said_of_case(words: list[object]) -> Said:
    """What a run says of a case file; one that is valid, but much work, is read and no more."""
    run = door.sweep

    def cheap(studies: list[Study], *args: Any) -> Summary:
        if sum(case.steps for study in studies for case in study.cases) > MAX_SAMPLES:
            raise CaseFileError([])
        return run(studies, *args)

    door.sweep = cheap  # type: ignore[assignment]
    return command("run", *words)


# ---- files of a store ---------------------------------------------------------------------------


def mutated(data: bytes, rng: random.Random) -> bytes:
    """Bytes changed here and there."""
    new = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8, 64))):
        at = rng.randrange(len(new))
        new[at : at + 8] = rng.choice(
            (bytes([new[at] ^ 1 << rng.randrange(8)]) + new[at + 1 : at + 8], b"\xff" * 8, bytes(8),
             rng.randbytes(8), b"\xff" + new[at + 1 : at + 8])
        )  # fmt: skip
    return bytes(new[: len(data)])


def edited(change: Callable[[h5py.File], Any]) -> Callable[[bytes, random.Random], bytes]:
    """A change to what an HDF5 file holds."""

    def changed(data: bytes, rng: random.Random) -> bytes:
        image = io.BytesIO(data)
        with h5py.File(image, "a") as file:
            change(file)
        return image.getvalue()

    return changed


def replaced(name: str, **how: Any) -> Callable[[bytes, random.Random], bytes]:
    """A variable replaced by another."""

    def change(file: h5py.File) -> None:
        if name in file:
            del file[name]
        file.create_dataset(name, **how)

    return edited(change)


def filled(name: str, value: Any) -> Callable[[bytes, random.Random], bytes]:
    """A column of a segment that has one value in all rows."""

    def change(file: h5py.File) -> None:
        rows = file["key"].shape[0] if "key" in file else 1
        if name in file:
            del file[name]
        file.create_dataset(name, data=np.array([value] * rows))

    return edited(change)


def lines(name: str, line: bytes) -> Callable[[bytes, random.Random], bytes]:
    """A segment's lines of text, all of them the same."""

    def change(file: h5py.File) -> None:
        rows = file["key"].shape[0] if "key" in file else 1
        if name in file:
            del file[name]
        packed = zlib.compress(b"\n".join([line] * rows), 9)
        file.create_dataset(name, data=np.frombuffer(packed, np.uint8))

    return edited(change)


def attribute(name: str, value: Any) -> Callable[[bytes, random.Random], bytes]:
    """An attribute replaced by another."""
    return edited(lambda file: file.attrs.__setitem__(name, value))


def virtual(file: h5py.File) -> None:
    """A variable that lies in another file."""
    layout = h5py.VirtualLayout((2,), "f8")
    layout[:] = h5py.VirtualSource("/etc/passwd", "x", (2,))
    file.create_virtual_dataset("virtual", layout)


STEER = "\x1b[31m\x07\u202e<script>"
SCHEMES: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    edited(lambda f: f.__setitem__("x", h5py.ExternalLink("/etc/passwd", "/"))),
    edited(lambda f: f.__setitem__("x", h5py.SoftLink("/x"))),
    edited(lambda f: f.__setitem__("y", h5py.SoftLink("/key"))),
    edited(lambda f: f.create_group("g").__setitem__("up", f["/"])),
    edited(lambda f: f.__setitem__("type", np.dtype("f8"))),
    edited(virtual),
    replaced("x", shape=(10**14,), dtype="f8"),
    replaced("x", shape=(10**9,), dtype="f8", chunks=(10**6,), compression="gzip"),
    replaced("x", data=np.arange(9.0), compression="lzf"),
    replaced("x", data=np.arange(9), chunks=(9,), scaleoffset=0),
    replaced("x", shape=(4,), dtype="f8", external=[("/etc/passwd", 0, 32)]),
    replaced("x", data=np.zeros(2, [("a", "f8"), ("b", "i4")])),
    replaced("x", data=np.array([b"cos\nsystem\n(S'touch pwned'\ntR."], h5py.opaque_dtype("V31"))),
    replaced("x", data=np.array(["a"], object), dtype=h5py.string_dtype()),
    replaced("x", shape=(3,), dtype=h5py.vlen_dtype("i4")),
    replaced("x", shape=(3,), dtype=h5py.ref_dtype),
    replaced(STEER, data=np.zeros(3)),
    replaced("a.b", data=np.zeros(3)),
    replaced("steps", data=np.zeros(3, "i4")),
    replaced("steps", data=np.zeros((3, 3))),
    filled("key", b"../../../evil0000000"),
    filled("key", STEER.encode()),
    filled("status", STEER.encode()),
    filled("reason", STEER.encode()),
    filled("reason", b"\xff\xfe"),
    filled("precision", STEER.encode()),
    filled("samples", 2**62),
    filled("samples", -1),
    filled("serial", -(2**63)),
    filled("end", np.nan),
    filled("digest", b"../../../../etc/pass"),
    filled("physics_key", b"\0" * 20),
    replaced("status", data=STEER, dtype=h5py.string_dtype()),
    replaced("reason", data=STEER, dtype=h5py.string_dtype()),
    *(
        lines(name, line)
        for name in ("attributes", "details")
        for line in (b"{", b"[" * 10**6, b"1", b"[]", b'"x"', b"{}", b"", b"\n", b'{"key": {}}',
                     json.dumps({"case": "[[", "detail": STEER, "method": STEER}).encode(),
                     json.dumps(STEER).encode(), b'{"case": 3, "key": [[], {}]}', bytes(10**8))
    ),
    replaced("attributes", data=np.frombuffer(b"no zlib", np.uint8)),
    replaced("details", data=np.frombuffer(zlib.compress(b"{}")[:5], np.uint8)),
    replaced("time", data=np.full(29, np.nan)),
    replaced("time", data=np.zeros((2, 2))),
    replaced("acceleration", data=np.zeros(5)),
    replaced("velocity", data=np.array([b"text"] * 3)),
    attribute("key", "../../evil"),
    attribute("key", np.bytes_(STEER.encode())),
    attribute("case", np.bytes_(b"[[[[")),
    attribute("case", np.bytes_(b'{"load": "\x1b[31m"}')),
    attribute("physics_key", 3.0),
    attribute("x", np.zeros(2, [("a", "f8")])),
    attribute("x", h5py.Empty("f8")),
    attribute(STEER, 1.0),
    lambda data, rng: b"",
    lambda data, rng: data[:512],
    lambda data, rng: b"\x89HDF\r\n\x1a\n" + rng.randbytes(500),
    lambda data, rng: data + rng.randbytes(1000),
    lambda data, rng: b"\x80\x04\x95cos\nsystem\n(S'touch pwned'\ntR.",
    lambda data, rng: b"CDF\x01" + rng.randbytes(100),
)  # fmt: skip
STUDY_CHANGES: tuple[dict[str, Any], ...] = (
    {"name": "../../evil"}, {"name": STEER}, {"name": 3}, {"name": ""}, {"case_file": STEER},
    {"case_file": 7}, {"keys": ()}, {"keys": ("../../../evil",) * 2}, {"keys": (STEER, STEER)},
    {"keys": (1, 2)}, {"keys": ({}, [])}, {"fixed": []}, {"fixed": None}, {"command": STEER},
    {"command": 5}, {"versions": 3}, {"versions": {STEER: STEER}}, {"written": STEER},
    {"written": None}, {"is_grid": False}, {"axes": ()},
)  # fmt: skip
AXIS_CHANGES: tuple[dict[str, Any], ...] = (
    {"key": "../../evil"}, {"key": STEER}, {"key": 3}, {"key": "key"}, {"key": "time"},
    {"key": ""}, {"values": (STEER, STEER)}, {"values": ("a", 1)}, {"values": (None, None)},
    {"values": ((1, 2), 3)}, {"values": (float("nan"), float("inf"))}, {"values": (1e308, -1e308)},
    {"values": ({}, {})}, {"units": STEER}, {"units": 3}, {"key": "status"}, {"key": "joint"},
)  # fmt: skip
READERS = ("status", "status --json", "show", "show --json", "verify", "verify --json", "report",
           "run", "plan")  # fmt: skip


def plant_rows(store: Path, rng: random.Random) -> str:
    """Replace a segment by a hostile one."""
    path = rng.choice(sorted((store / "rows").iterdir()))
    number, how = int(path.name.partition("-")[0]), rng.randrange(-20, len(SCHEMES))
    data = (mutated if how < 0 else SCHEMES[how])(path.read_bytes(), rng)
    path.unlink()
    (store / "rows" / segment_name(number, data)).write_bytes(data)
    return f"rows, {how}"


def plant_series(store: Path, rng: random.Random) -> str:
    """Replace a job's file by a hostile one, and have its row tell of it."""
    path = rng.choice(sorted((store / "jobs").iterdir()))
    how = rng.randrange(-20, len(SCHEMES))
    data = (mutated if how < 0 else SCHEMES[how])(path.read_bytes(), rng)
    key, old = path.stem.split("-")
    path.unlink()
    (store / "jobs" / f"{key}-{hdf5.digest(data)}.h5").write_bytes(data)
    for rows in sorted((store / "rows").iterdir()):
        segment = decode(rows.read_bytes(), rows)
        column = segment.columns["digest"].copy()
        column[column == old.encode()] = hdf5.digest(data).encode()
        columns = segment.columns | {"digest": column}
        new = encode(dataclasses.replace(segment, columns=columns))
        number = int(rows.name.partition("-")[0])
        rows.unlink()
        (store / "rows" / segment_name(number, new)).write_bytes(new)
    return f"series, {how}"


def plant_study(store: Path, rng: random.Random) -> str:
    """Replace a study's file by a hostile one."""
    path = store / "studies" / f"{rng.choice(('series', 'metrics'))}.json"
    plain = vars(read_study(path)) | {"axes": [vars(a) for a in read_study(path).axes]}
    if rng.random() < 0.5:
        change = rng.choice(STUDY_CHANGES)
        plain |= change
    else:
        change = rng.choice(AXIS_CHANGES)
        plain["axes"][0] = plain["axes"][0] | change
    if rng.random() < 0.1:
        (store / "studies" / "deep.json").write_text("[" * 100_000)
    if plain["is_grid"]:  # as `encode` has it
        del plain["is_grid"]
    head = json.dumps(plain, indent=1).removesuffix("\n}").encode()
    path.write_bytes(head + f',\n "digest": "{hdf5.digest(head)}"\n}}\n'.encode())
    return f"study, {change}"


PLANTS = (plant_rows, plant_series, plant_series, plant_study)


def said_of_store(reader: str, key: str, cases: list[Path], store: Path) -> Said:
    """What a command says of a store."""
    undrawn()
    words: list[object] = [*reader.split()]
    if words[0] in ("run", "plan"):
        return command(*words, *cases, "-r", store, "-j", 1)
    if words[0] == "show":
        words.insert(1, key)
    if words[0] == "report":
        words += ["-o", store / "page"]
    return command(*words, "-r", store)


# ---- trials -------------------------------------------------------------------------------------


def problem_of(said: Said | None, death: str, good: tuple[int, ...]) -> str:
    """What is wrong with how a command ended, or ""."""
    if said is None:
        return death
    odd = sorted({c for c in said.out + said.err if not c.isprintable() and c != "\n"})
    if "Traceback" in said.err or "internal error" in said.err or said.code not in good:
        return f"exit code {said.code}: {said.err}"
    return f"characters {odd} on the screen: {said}" if odd else ""


class Campaign:
    """The trials of `campaign`: texts to be mutated, and a store."""

    def __init__(self, tally: Tally, folder: Path):
        self.tally, self.folder = tally, folder
        self.texts = sources()
        self.complete = complete_store(folder)
        self.cases = case_files(folder / "cases")
        self.keys = sorted(read_store(self.complete).keys())

    def trial(self, number: int) -> None:
        """A hostile file, and a command that reads it."""
        rng = random.Random(f"{self.tally.seed} {number}")
        attempt = self.case if rng.random() < SHARE_OF_CASES else self.stored
        state = rng.getstate()
        label, problem, seconds = attempt(rng)
        if seconds > SECONDS and not problem:  # perhaps another process was in the way
            rng.setstate(state)
            label, problem, seconds = attempt(rng)
            problem = problem or (f"takes {seconds:.1f} s" if seconds > SECONDS else "")
        self.tally.trials += 1
        if problem:
            self.tally.fail(f"trial {number}, {label}", problem)

    def case(self, rng: random.Random) -> tuple[str, str, float]:
        """A hostile case file: what it is, what is wrong, seconds."""
        with fresh(self.folder, "trial") as trial:
            kind, words = words_of_case(trial, self.texts, rng)
            before = set(trial.rglob("*"))
            ended = forked(lambda: said_of_case(words), HANG)
            self.tally.counts[f"case files, {kind}"] += 1
            problem = problem_of(ended.result, ended.death, (0, 2, 3))
            problem = problem or self.strayed(trial, before)
        return f"{kind} {words}", problem, ended.seconds

    def stored(self, rng: random.Random) -> tuple[str, str, float]:
        """A hostile file in a store: what it is, what is wrong, seconds."""
        with fresh(self.folder, "trial") as trial:
            store = trial / "store"
            shutil.copytree(self.complete, store)
            plant = rng.choice(PLANTS)
            what = plant(store, rng)
            before = set(trial.rglob("*"))
            reader, key = rng.choice(READERS), rng.choice(self.keys)
            ended = forked(lambda: said_of_store(reader, key, self.cases, store), HANG)
            self.tally.counts[f"files of a store, {what.partition(',')[0]}"] += 1
            problem = problem_of(ended.result, ended.death, (0, 3, 5))
            problem = problem or self.strayed(trial, before)
        return f"{what}, {reader}", problem, ended.seconds

    def strayed(self, trial: Path, before: set[Path]) -> str:
        """Files that have appeared where none belong, or ""."""
        new = set(trial.rglob("*")) - before
        names = [path.relative_to(trial).as_posix() for path in new]
        odd = [name for name in names if not STORED.fullmatch(name)]
        beside = {path.name for path in self.folder.iterdir()}
        odd += sorted(beside - {"trial", "cases", "complete", "new"})
        return f"files outside the store: {odd}" if odd else ""


def campaign(trials: int, seed: int, folder: Path) -> dict[str, Any]:
    """Give as many hostile files, one a trial."""
    what = "malformed and hostile case files and stored files"
    tally = Tally(what, seed)
    tried = Campaign(tally, folder)
    for number in range(trials):
        tried.trial(number)
    return tally.result()
