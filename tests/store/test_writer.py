"""Rows: what is acknowledged stays, the last one counts, damage is found, one writer at a time."""

import contextlib
import dataclasses
import errno
import fcntl
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from compressor.metrics import NUMBERS
from compressor.outcome import ROW, Outcome, SeriesFile
from compressor.solve.simulate import simulate
from compressor.store import hdf5, writer
from compressor.store import reader as store
from compressor.store import rows as segments
from compressor.store.files import StoreError
from compressor.store.rows import merge
from compressor.store.series_file import intact, read_values, write_series
from compressor.store.status import verify
from compressor.store.studies import StoredAxis, StoredStudy, encode
from compressor.store.writer import Writer


def key(number):
    return f"{number:020x}"


def outcome(number, value=None, reason="", **attributes):
    """A made-up outcome; `value` is its peak acceleration (default: its number)."""
    numbers = np.zeros(1, ROW)[0]
    numbers["peak_acceleration"] = number if value is None else value
    numbers["peak_contact_force_axis"] = [[number, 2], [3, 4]]
    attributes = {"key": key(number), "case": '{"solve": {"timeout_s": 1}}', **attributes}
    return Outcome("failed" if reason else "ok", reason, numbers, attributes)


def put(folder, *outcomes, **options):
    """Store outcomes in one segment."""
    with Writer(folder, **options) as open_writer:
        open_writer.flushed = time.monotonic()
        for item in outcomes:
            open_writer.add(item)


def peaks(folder):
    rows = store.read_store(folder).rows
    found = zip(rows.columns["key"].tolist(), rows.numbers["peak_acceleration"], strict=True)
    return {int(name, 16): value for name, value in found}


def plan(folder, *axes, count, keys=()):
    """Store a study of the made-up jobs, or of jobs with other keys."""
    keys = keys or tuple(key(number) for number in range(count))
    study = StoredStudy("made", "made.yaml", axes, keys, {}, "", {}, "")
    (folder / "studies").mkdir(parents=True, exist_ok=True)
    (folder / "studies" / "made.json").write_bytes(encode(study))


# ---- rows ---------------------------------------------------------------------------------------


def test_outcomes_come_back_in_every_part(tmp_path):
    state = np.array([1.5, -0.0, np.nan])
    given = outcome(7, reason="non_finite", detail="µ \0 \udc80", stop_state=state, complete=0)
    put(tmp_path, given, outcome(3))
    found = store.read_store(tmp_path)
    back = found.outcome(found.position(key(7)))
    assert (back.status, back.reason, back.key) == ("failed", "non_finite", key(7))
    assert back.numbers.tobytes() == given.numbers.tobytes()
    assert back.attributes.keys() == given.attributes.keys()
    assert back.attributes["stop_state"].tobytes() == state.tobytes()
    assert (back.attributes["detail"], back.attributes["complete"]) == ("µ \0 \udc80", 0)
    assert found.position(key(8)) is None


def test_the_last_row_of_a_job_counts(tmp_path):
    put(tmp_path, outcome(1, 10), outcome(2, 20))
    put(tmp_path, outcome(1, 11))
    put(tmp_path, outcome(3, 30), outcome(3, 31))
    assert peaks(tmp_path) == {1: 11, 2: 20, 3: 31}


def kept_as(precision):
    """An outcome whose time series are told of, but are nowhere."""
    series = SeriesFile(5, 1.0, precision, f"{'':d>20}")
    return dataclasses.replace(outcome(1), series=series)


@pytest.mark.parametrize(
    ("better", "worse"),
    [
        (outcome(1), outcome(1, reason="worker_died")),
        (kept_as("single"), outcome(1)),
        (kept_as("double"), kept_as("single")),
        (kept_as("single"), outcome(1, reason="worker_died")),
    ],
)
@pytest.mark.parametrize("shard", ["", "a"])
def test_a_better_row_stays_whoever_writes_last(better, worse, shard, tmp_path, monkeypatch):
    monkeypatch.setattr(store, "_has_files", lambda segment: np.ones(len(segment), bool))
    monkeypatch.setattr(writer, "name_pending", list)
    (tmp_path / "jobs").mkdir()
    (tmp_path / "shards/a/jobs").mkdir(parents=True)
    put(tmp_path, better)
    put(tmp_path, worse, shard=shard)
    rows = store.read_store(tmp_path).rows
    expected = segments.of_outcomes([better], 1)
    for name in ("status", "samples", "precision"):
        assert rows.columns[name].tolist() == expected.columns[name].tolist()
    assert len(merge(store.read_store(tmp_path).segments)) == 1


def test_xarray_reads_a_segment(tmp_path):
    put(tmp_path, *(outcome(number) for number in range(5)))
    (path,) = tmp_path.glob("rows/*.h5")
    with xr.open_dataset(path, engine="h5netcdf") as found:
        assert found.peak_contact_force_axis.dims == ("row", "joint", "axis")
        assert found.peak_acceleration.values.tolist() == [0, 1, 2, 3, 4]
        assert found.peak_acceleration.attrs["units"] == "m/s2"
        assert found.attrs["comment"] == "SI units"
        assert "Conventions" not in found.attrs  # which names a convention of CF's list, not units
        assert set(NUMBERS) <= set(found)


def test_a_segment_of_an_older_version_lacks_a_number(tmp_path, monkeypatch):
    older = {name: row for name, row in NUMBERS.items() if name != "crank_work"}
    monkeypatch.setattr(segments, "NUMBERS", older)
    put(tmp_path, outcome(1))
    monkeypatch.undo()
    put(tmp_path, outcome(2))
    rows = store.read_store(tmp_path).rows
    assert np.isnan(rows.numbers["crank_work"]).tolist() == [True, False]
    assert peaks(tmp_path) == {1: 1, 2: 2}


def test_small_segments_are_merged_and_nothing_else_changes(tmp_path, monkeypatch):
    for name, number in {"MAX_AGE": 0, "MAX_SMALL": 6, "MAX_SMALL_AT_END": 3}.items():
        monkeypatch.setattr(writer, name, number)
    with Writer(tmp_path) as open_writer:
        for number in range(16):
            kept = outcome(number % 12, number, detail=f"the {number}th")
            assert open_writer.add(kept) == [kept.key]
    assert len(list(tmp_path.glob("rows/*.h5"))) <= 3
    assert peaks(tmp_path) == {n: n + 12 if n < 4 else n for n in range(12)}
    found = store.read_store(tmp_path)
    details = {k: found.outcome(found.position(k)).detail for k in found.keys()}  # noqa: SIM118
    assert details[key(3)] == "the 15th"
    assert details[key(11)] == "the 11th"


def test_merging_does_not_make_an_old_row_new(tmp_path, monkeypatch):
    put(tmp_path, outcome(1, 10), shard="a")
    put(tmp_path, outcome(1, 11))
    monkeypatch.setattr(writer, "MAX_SMALL_AT_END", 1)
    put(tmp_path, outcome(2), shard="a")
    assert len(list(tmp_path.glob("shards/a/rows/*.h5"))) == 1
    assert peaks(tmp_path) == {1: 11, 2: 2}


def test_a_reader_that_loses_the_race_with_a_merge_reads_again(tmp_path, monkeypatch):
    put(tmp_path, outcome(1))
    put(tmp_path, outcome(2))
    real, gone = segments.read_segment, []

    def merged_meanwhile(path):
        if not gone:
            gone.append(path)
            monkeypatch.setattr(writer, "MAX_SMALL_AT_END", 1)
            put(tmp_path, outcome(3))
        return real(path)

    monkeypatch.setattr(store, "read_segment", merged_meanwhile)
    assert peaks(tmp_path) == {1: 1, 2: 2, 3: 3}
    assert not gone[0].exists()


def test_twenty_thousand_rows_open_as_a_grid(tmp_path):
    with Writer(tmp_path) as open_writer:
        for number in range(20_000):
            if number != 7:
                open_writer.add(outcome(number))
    axes = (
        StoredAxis("machine.speed_rpm", tuple(range(200)), "rpm"),
        StoredAxis("machine.rod_mass_kg", tuple(range(100)), "kg"),
    )
    plan(tmp_path, *axes, count=20_000)
    found = store.open_study(tmp_path)
    expected = np.arange(20_000.0).reshape(200, 100)
    expected[0, 7] = np.nan
    np.testing.assert_array_equal(found.peak_acceleration.values, expected)
    assert found.peak_contact_force_axis.dims == ("speed_rpm", "rod_mass_kg", "joint", "axis")
    assert found.status.values[0, 6:8].tolist() == ["ok", "missing"]
    assert len(list(tmp_path.glob("rows/*"))) < 20


# ---- shards and the lock ------------------------------------------------------------------------


def test_readers_merge_shards(tmp_path):
    jobs = [simulate(case) for case in short_cases()]
    for number, (name, job) in enumerate(zip(("", "1-of-2", "2-of-2"), jobs, strict=True)):
        with Writer(tmp_path, shard=name) as open_writer:
            series = write_series(open_writer.place, job, short_cases()[number].output)
            attributes = dict(job.attrs)
            open_writer.add(Outcome("ok", "", np.zeros(1, ROW)[0], attributes, series))
    found = store.read_store(tmp_path)
    assert len(found.keys()) == 3
    for job in jobs:
        xr.testing.assert_identical(found.job(job.attrs["key"]), job)
    assert len(list(tmp_path.glob("shards/1-of-2/jobs/*.h5"))) == 1
    (gone,) = verify(tmp_path)  # the study
    assert gone.path == tmp_path / "studies/case.json"


def short_cases():
    from compressor.cases.case import Case

    solve = {"duration_rev": 0.1, "settle_rev": 0, "output_step_deg": 1}
    return [Case.from_values({"load": load, "solve": solve}) for load in ("none", "spring")] + [
        Case.from_values({"load": "gas", "solve": solve})
    ]


@pytest.mark.parametrize("name", ["../up", "a/b", ".hidden", "x" * 65])
def test_a_shard_stays_in_its_folder(name, tmp_path):
    with pytest.raises(StoreError, match="is no shard's name"):
        Writer(tmp_path, shard=name)


def test_one_writer_at_a_time(tmp_path):
    with Writer(tmp_path, command="the first"):
        with pytest.raises(StoreError, match=rf"process {os.getpid()} on .*: the first; wait"):
            Writer(tmp_path).__enter__()
        put(tmp_path, outcome(1), shard="a")  # has a lock of its own
    put(tmp_path, outcome(2))
    assert peaks(tmp_path) == {1: 1, 2: 2}


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_file_system_without_locks_is_told(number, tmp_path, monkeypatch):
    def refuse(*arguments):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(fcntl, "flock", refuse)
    with pytest.raises(StoreError, match="choose a folder on a file system with locks"):
        Writer(tmp_path).__enter__()


def test_a_lock_that_was_just_taken_is_soon_named(tmp_path, monkeypatch):
    monkeypatch.setattr(writer, "LOCK_SECONDS", 60.0)
    with Writer(tmp_path, command="the first"):
        pass
    assert (tmp_path / writer.LOCK_NAME).read_text() == ""
    with open(tmp_path / writer.LOCK_NAME, "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        named = threading.Timer(0.3, lambda: os.write(lock.fileno(), b"the second"))
        named.start()
        with pytest.raises(StoreError, match="in use by the second; wait"):
            Writer(tmp_path).__enter__()
        named.join()
        monkeypatch.setattr(writer, "LOCK_SECONDS", 0.0)
        lock.truncate(0)
        with pytest.raises(StoreError, match="in use by another process; wait"):
            Writer(tmp_path).__enter__()


WAITING = """
    import sys
    from compressor.store.writer import Writer
    print("asks", flush=True)
    with Writer(sys.argv[1], wait=True):
        print("has it")
"""


def test_a_second_writer_can_wait(tmp_path):
    with Writer(tmp_path) as first:
        call = [sys.executable, "-c", textwrap.dedent(WAITING), str(tmp_path)]
        second = subprocess.Popen(call, stdout=subprocess.PIPE, text=True)
        assert second.stdout is not None
        assert second.stdout.readline() == "asks\n"
        with pytest.raises(subprocess.TimeoutExpired):
            second.wait(0.5)
        first.add(outcome(1))
    assert second.communicate(timeout=600) == ("has it\n", None)


# ---- crashes ------------------------------------------------------------------------------------


def write_until_killed(folder, begin, channel):
    """In a forked process: store outcomes, and tell over a pipe which are acknowledged."""
    writer.MAX_AGE, writer.MAX_SMALL = 0.002, 4
    with Writer(folder) as open_writer, open(channel, "w", buffering=1) as told:
        for number in range(begin, begin + 10**6):
            for name in open_writer.add(outcome(number)):
                print(int(name, 16), file=told)


@pytest.mark.slow
def test_what_was_acknowledged_survives_sigkill(tmp_path):
    wait, acknowledged = np.random.default_rng(1), set()
    for attempt in range(5):
        reader, channel = os.pipe()
        driver = os.fork()
        if not driver:
            try:
                write_until_killed(tmp_path, attempt * 10**6, channel)
            finally:
                os._exit(1)
        os.close(channel)
        with open(reader) as told:
            for _ in range(wait.integers(11, 40)):
                acknowledged.add(int(told.readline()))
            time.sleep(wait.uniform(0, 0.05))
            os.kill(driver, signal.SIGKILL)
            acknowledged |= {int(line) for line in told if line.endswith("\n")}
        assert os.waitstatus_to_exitcode(os.waitpid(driver, 0)[1]) == -signal.SIGKILL
        stored = peaks(tmp_path)
        assert acknowledged <= stored.keys()
        assert all(value == number for number, value in stored.items())
        assert verify(tmp_path) == []
    assert len(acknowledged) > 50


def test_a_crash_before_the_row_leaves_the_old_result(tmp_path):
    case = short_cases()[0]
    job = simulate(case)
    with Writer(tmp_path) as open_writer:
        series = write_series(tmp_path, job, case.output)
        kept = Outcome("ok", "", np.zeros(1, ROW)[0], dict(job.attrs), series)
        open_writer.add(kept)
    write_series(tmp_path, job.assign_attrs(detail="again"), case.output)  # then: SIGKILL
    assert len(list(tmp_path.glob("jobs/*.h5"))) == 1
    with Writer(tmp_path):
        pass
    assert len(list(tmp_path.glob("jobs/*.h5"))) == 1
    xr.testing.assert_identical(store.read_job(tmp_path, case.key), job)


def test_a_crash_after_the_row_leaves_the_new_result(tmp_path, monkeypatch):
    """Its file waits for its name, which readers know, until the next run."""
    case = short_cases()[0]
    job = simulate(case)
    monkeypatch.setattr(writer, "name_pending", list)  # SIGKILL in its place
    with Writer(tmp_path) as open_writer:
        series = write_series(tmp_path, job, case.output)
        open_writer.add(Outcome("ok", "", np.zeros(1, ROW)[0], {**job.attrs, "name": ""}, series))
    monkeypatch.undo()
    assert list(tmp_path.glob("jobs/*.h5")) == []
    for _ in range(2):
        xr.testing.assert_identical(store.read_job(tmp_path, case.key), job)
        assert read_values(store.read_store(tmp_path).rows.path(0), ["time"])["time"].size
        assert verify(tmp_path) == []
        (waiting,) = tmp_path.glob("jobs/*")
        os.utime(waiting, (0, 0))  # as old as a file that nobody needs
        with Writer(tmp_path):
            pass
    assert len(list(tmp_path.glob("jobs/*.h5"))) == 1


def test_half_a_file_that_a_copy_left_does_not_replace_a_whole_one(tmp_path):
    case = short_cases()[0]
    job = simulate(case)
    with Writer(tmp_path) as open_writer:
        series = write_series(tmp_path, job, case.output)
        open_writer.add(Outcome("ok", "", np.zeros(1, ROW)[0], {**job.attrs, "name": ""}, series))
    (path,) = tmp_path.glob("jobs/*.h5")
    path.with_name(f".{path.name}.tmp").write_bytes(path.read_bytes()[:100])
    with Writer(tmp_path):
        pass
    xr.testing.assert_identical(store.read_job(tmp_path, case.key), job)
    assert verify(tmp_path) == []


def test_a_full_disk_is_an_error_with_a_name_and_rows_wait(tmp_path, monkeypatch):
    def full(*arguments):
        raise OSError(28, os.strerror(28))

    put(tmp_path, outcome(1))
    real = os.fsync
    with Writer(tmp_path) as open_writer:
        monkeypatch.setattr(os, "fsync", full)
        with pytest.raises(StoreError, match="No space left on device; free some space"):
            open_writer.add(outcome(2))
        monkeypatch.setattr(os, "fsync", real)
        assert open_writer.flush() == [key(2)]
    assert peaks(tmp_path) == {1: 1, 2: 2}


def test_an_interrupt_keeps_what_was_added(tmp_path):
    def interrupted():
        with Writer(tmp_path) as open_writer:
            open_writer.add(outcome(1))
            assert open_writer.add(outcome(2)) == []
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert peaks(tmp_path) == {1: 1, 2: 2}


# ---- damage -------------------------------------------------------------------------------------


def damaged(path, data):
    path.write_bytes(data)
    return verify(path.parent.parent)


def test_every_flipped_bit_of_a_segment_is_found_and_its_jobs_named(tmp_path):
    put(tmp_path, *(outcome(number) for number in range(3)))
    plan(tmp_path, StoredAxis("machine.speed_rpm", (1, 2, 3), "rpm"), count=3)
    (path,) = tmp_path.glob("rows/*.h5")
    good = path.read_bytes()
    places = {*range(0, len(good), 389)}
    for name in store.read_store(tmp_path).keys():  # noqa: SIM118
        begin = good.index(name.encode())
        places |= {*range(begin, begin + 20)}
    for place in sorted(places):
        flipped = good[:place] + bytes([good[place] ^ (1 << place % 8)]) + good[place + 1 :]
        (damage,) = damaged(path, flipped)
        assert damage.path == path
        assert damage.keys == (key(0), key(1), key(2))
    for size in range(0, len(good), 839):
        (damage,) = damaged(path, good[:size])
        assert {key(0), key(1), key(2)} <= {*damage.keys}
    assert damaged(path, good) == []


def test_every_flipped_bit_of_a_job_or_study_is_found(tmp_path):
    case = short_cases()[1]
    job = simulate(case)
    with Writer(tmp_path) as open_writer:
        series = write_series(tmp_path, job, case.output)
        attributes = {**job.attrs, "name": "made"}
        open_writer.add(Outcome("ok", "", np.zeros(1, ROW)[0], attributes, series))
    plan(tmp_path, count=1, keys=(case.key,))
    for pattern, keys, step in (("jobs/*.h5", (case.key,), 1511), ("studies/*.json", (), 29)):
        (path,) = tmp_path.glob(pattern)
        good = path.read_bytes()
        for place in range(0, len(good), step):
            flipped = good[:place] + bytes([good[place] ^ (1 << place % 8)]) + good[place + 1 :]
            (damage,) = damaged(path, flipped)
            assert (damage.path, damage.keys) == (path, keys)
        for size in range(0, len(good), 3 * step):
            (damage,) = damaged(path, good[:size])
            assert (damage.path, damage.keys) == (path, keys)
        assert damaged(path, good) == []


def test_readers_pass_a_damaged_segment_by_and_say_so(tmp_path):
    put(tmp_path, outcome(0))
    put(tmp_path, outcome(1))
    plan(tmp_path, StoredAxis("machine.speed_rpm", (1, 2), "rpm"), count=2)
    first = sorted(tmp_path.glob("rows/*.h5"))[0]
    first.write_bytes(first.read_bytes()[:-1])
    with pytest.warns(UserWarning, match=rf"{first.name}: is damaged.*count as missing") as told:
        found = store.open_study(tmp_path)
    assert len(told) == 1
    assert found.status.values.tolist() == ["missing", "ok"]
    with Writer(tmp_path):
        pass
    assert (tmp_path / "rows" / f"{first.name}.damaged").exists()
    (gone,) = verify(tmp_path)
    assert gone.keys == (key(0),)
    assert gone.problem == "no row knows 1 of its 2 jobs: not run yet, or gone"
    assert peaks(tmp_path) == {1: 1}


def test_a_writer_leaves_damage_to_shards_that_are_at_work(tmp_path):
    for name in ("1-of-2", "2-of-2"):
        put(tmp_path, outcome(1), shard=name)
    paths = sorted(tmp_path.glob("shards/*/rows/*.h5"))
    with Writer(tmp_path, shard="1-of-2"):
        for path in paths:
            path.write_bytes(path.read_bytes()[:-1])
        put(tmp_path, outcome(2))  # may see to the second shard alone
        assert [path.exists() for path in paths] == [True, False]
    with Writer(tmp_path, shard="2-of-2"):
        pass  # sees to itself alone
    assert paths[0].exists()
    put(tmp_path, shard="1-of-2")
    assert [f"{path}.damaged" for path in paths] == sorted(
        map(str, tmp_path.glob("shards/*/rows/*.damaged"))
    )
    assert peaks(tmp_path) == {2: 2}


def test_a_writer_leaves_the_unfinished_files_of_others(tmp_path):
    put(tmp_path, outcome(1), shard="1-of-2")
    put(tmp_path, outcome(2))
    old = [tmp_path / place / "rows" / ".old.tmp" for place in ("", "shards/1-of-2")]
    for path in old:
        path.touch()
        os.utime(path, (0, 0))
    put(tmp_path)
    assert [path.exists() for path in old] == [False, True]
    put(tmp_path, shard="1-of-2")
    assert not old[1].exists()


SCHEMA = {
    "text for numbers": lambda file: (
        file.__delitem__("steps"),
        file.__setitem__("steps", ["many"] * 2),
    ),
    "other length": lambda file: (
        file.__delitem__("status"),
        file.__setitem__("status", np.array([b"ok"] * 3)),
    ),
    "no keys": lambda file: file.__delitem__("key"),
    "keys of another form": lambda file: file["key"].__setitem__(..., b"../../../evil0000000"),
    "a reason that steers": lambda file: (
        file.__delitem__("reason"),
        file.__setitem__("reason", np.array([b"\x1b[31mred"] * 2)),
    ),
    "link": lambda file: file.__setitem__("x", h5py.ExternalLink("/etc/passwd", "/")),
}


@pytest.mark.parametrize("change", list(SCHEMA))
def test_a_segment_with_another_schema_is_refused_and_left_alone(change, tmp_path):
    put(tmp_path, outcome(1), outcome(2))
    (path,) = tmp_path.glob("rows/*.h5")
    with h5py.File(path, "a") as file:
        SCHEMA[change](file)
    planted = path.with_name(segments.segment_name(1, path.read_bytes()))
    path.rename(planted)
    for read in (store.read_store, lambda folder: Writer(folder).__enter__()):
        with pytest.raises(hdf5.DamagedJob, match="move it away"):
            read(tmp_path)
    assert [damage.path for damage in verify(tmp_path)] == [planted]


@pytest.mark.parametrize(
    "line",
    [b"{", b"[" * 10**5, b"1", b'{"a": [[], {}]}', b"{}\n{}", bytes(2 << 20), None],
    ids=["broken", "deep", "a number", "ragged", "too many", "too long", "no zlib"],
)
def test_lines_that_nobody_wrote_are_refused(line, tmp_path):
    put(tmp_path, outcome(1, reason="non_finite"), outcome(2, reason="non_finite"))
    (path,) = tmp_path.glob("rows/*.h5")
    texts = b"none" if line is None else zlib.compress(b"\n".join([line] * 2))
    foreign = dataclasses.replace(segments.read_segment(path), texts=texts, notes=texts)
    data = segments.encode(foreign)
    path.rename(path.with_name(segments.segment_name(1, data)))
    (path,) = tmp_path.glob("rows/*.h5")
    path.write_bytes(data)
    rows = store.read_store(tmp_path).rows
    for read in (rows.attributes, rows.detail):
        with pytest.raises(hdf5.DamagedJob, match=rf"{path.name}: is no file of compsim's"):
            read(0)


def test_a_row_of_a_pickled_object_cannot_be_stored(tmp_path):
    bad = dataclasses.replace(outcome(1), attributes={"key": key(1), "case": "{}", "x": object()})
    with pytest.raises(AttributeError), Writer(tmp_path) as open_writer:
        open_writer.add(bad)


@pytest.mark.parametrize("name", ["glob", "rename", "unlink", "read_bytes"])
def test_what_a_disk_refuses_a_writer_has_a_name(name, tmp_path, monkeypatch):
    monkeypatch.setattr(writer, "MAX_SMALL_AT_END", 0)
    put(tmp_path, outcome(0))
    (tmp_path / "jobs").mkdir()
    (tmp_path / "jobs" / f"{key(1)}-{key(2)}.h5").write_bytes(b"of no row")
    if name == "rename":
        (path,) = tmp_path.glob("rows/*.h5")
        path.write_bytes(b"damaged")

    def refused(*args, **more):
        raise OSError(errno.EIO, os.strerror(errno.EIO), str(args[0]))

    owner = os if name in ("rename", "unlink") else Path
    if name == "read_bytes":  # of what is merged
        monkeypatch.setattr(writer, "read_segment", refused)
    else:
        monkeypatch.setattr(owner, name, refused)
    with pytest.raises(StoreError, match="Input/output error; check the disk"):
        put(tmp_path, outcome(1))
    monkeypatch.undo()
    put(tmp_path, outcome(1))
    assert peaks(tmp_path)[1] == 1


def test_a_job_that_may_not_be_read_is_not_damaged(tmp_path, monkeypatch):
    path = tmp_path / f"{key(1)}-{hdf5.digest(b'job')}.h5"
    path.write_bytes(b"job")
    assert intact(path)
    for number, raised in ((errno.EIO, False), (errno.ENOENT, False), (errno.EACCES, True)):

        def refused(self, number=number):
            raise OSError(number, os.strerror(number), str(self))

        monkeypatch.setattr(Path, "read_bytes", refused)
        with pytest.raises(StoreError, match=path.name):
            read_values(path, ["time"])
        with pytest.raises(StoreError) if raised else contextlib.nullcontext():
            assert not intact(path)
