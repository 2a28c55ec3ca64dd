"""Batches of a folder: which row of a job counts, merges beside readers, stores that are copied."""

import shutil

import numpy as np
import pytest
import xarray as xr
from conftest import flip, write_batch
from made_jobs import batches, forget, held, key, made, peaks, plan

from compressor.store import batch, merge, reader
from compressor.store.batch import read_batch
from compressor.store.files import StoreError
from compressor.store.merge import merge_batches
from compressor.store.reader import open_study, read_store


def merge_all(folder):
    """Merge as many batches as can be, and forget what was read of them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(merge, "MAX_SMALL", 0)
        merge_batches(folder)
    forget()


@pytest.fixture
def mixed(tmp_path):
    """A study of 12 jobs of three lengths, one failed and one missing, in batches of one or two."""
    plan(tmp_path, 12)
    for number in range(0, 10, 2):
        write_batch(tmp_path, [made(n, samples=n % 3 * 5) for n in (number, number + 1)])
    write_batch(tmp_path, [made(10, reason="non_finite", detail="µ \0")])
    return tmp_path


def barred(number, **more):
    found = made(number, **more)
    found.numbers["peak_acceleration_error"] = 0.1
    return found


@pytest.mark.parametrize(
    ("better", "worse"),
    [
        (made(1), made(1, reason="worker_died")),
        (made(1, samples=3, precision="single"), made(1)),
        (made(1, samples=3), made(1, samples=3, precision="single")),
        (made(1, samples=3, precision="single"), made(1, reason="worker_died", samples=3)),
        (barred(1), made(1)),
        (made(1, signals="all"), made(1)),
        (made(1, samples=3, precision="single"), barred(1, signals="all")),
    ],
)
@pytest.mark.parametrize("merged", [False, True])
def test_a_more_complete_row_counts_whoever_writes_last(better, worse, merged, tmp_path):
    write_batch(tmp_path / "alone", [better])
    for outcome in (worse, better, worse):
        write_batch(tmp_path / "both", [outcome])
    if merged:
        merge_all(tmp_path / "both")
        assert len(batches(tmp_path / "both")) == 1
    assert held(read_store(tmp_path / "both")) == held(read_store(tmp_path / "alone"))


def test_a_number_of_another_version_is_left_aside(tmp_path, monkeypatch):
    """It has a metric that this one does not know."""
    write_batch(tmp_path, [made(1), made(2)])
    labels = batch.VALUES
    with monkeypatch.context() as patch:
        rename = {"peak_contact_force_axis.big_end.x": "peak_velocity"}
        patch.setattr(batch, "VALUES", {rename.get(n, n): at for n, at in labels.items()})
        patch.setitem(batch.NUMBERS, "peak_velocity", batch.NUMBERS["peak_acceleration"])
        write_batch(tmp_path, [made(3)])
    merge_all(tmp_path)  # into none that lacks the number
    assert len(batches(tmp_path)) == 2
    assert peaks(tmp_path) == {1: 1, 2: 2, 3: 3}
    one, other = read_store(tmp_path).numbers(np.array([1, 2]))["peak_contact_force_axis"]
    assert one.tolist() == [[2, 2], [3, 4]]
    assert np.isnan(other[0, 0])
    assert other.ravel().tolist()[1:] == [2, 3, 4]


def test_a_merge_changes_nothing_but_the_number_of_files(mixed):
    before, jobs = open_study(mixed).load(), held(read_store(mixed))
    merge_all(mixed)
    assert len(batches(mixed)) == 3  # by the lengths that are in them
    xr.testing.assert_identical(open_study(mixed).load(), before)
    assert held(read_store(mixed)) == jobs
    merge_all(mixed)
    assert held(read_store(mixed)) == jobs


def test_a_merge_does_not_make_an_old_row_new(tmp_path, monkeypatch):
    """Of other lengths, so that two merged batches hold the job; or where it is written amid."""
    write_batch(tmp_path, [made(1, reason="old"), made(2, samples=5)])
    write_batch(tmp_path, [made(1, reason="new"), made(3, samples=6)])
    write_batch(tmp_path, [made(4, samples=5)])
    write_batch(tmp_path, [made(5, samples=6)])
    real = merge.encode_batch

    def write_amid(*args):
        monkeypatch.undo()
        write_batch(tmp_path, [made(4, 44, samples=5)])
        return real(*args)

    monkeypatch.setattr(merge, "encode_batch", write_amid)
    merge_all(tmp_path)
    assert len(batches(tmp_path)) == 3
    assert read_store(tmp_path).status(key(1)).reason == "new"
    assert peaks(tmp_path)[4] == 44


def test_of_equal_rows_the_later_counts_others_go_and_damaged_batches_are_set_aside(tmp_path):
    write_batch(tmp_path, [made(1), made(2)])
    write_batch(tmp_path, [made(1, 11)])
    write_batch(tmp_path, [made(2, 11), made(2, 12)])
    write_batch(tmp_path, [made(3)]).write_bytes(b"torn")
    assert merge_batches(tmp_path) == {key(1), key(2)}
    assert [len(read_batch(path)[0]["job"]) for path in batches(tmp_path)] == [1, 2]
    assert peaks(tmp_path) == {1: 11, 2: 12}
    (aside,) = (tmp_path / "batches").glob("*.damaged")
    assert aside.read_bytes() == b"torn"


def test_a_batch_whose_values_are_damaged_stays_while_its_rows_count(mixed):
    path = max(batches(mixed), key=lambda one: one.stat().st_size)
    flip(path, made(5, samples=10).series["contact_force"].values)
    merge_all(mixed)
    assert path.exists()
    assert read_store(mixed).position(key(5)) is not None


def test_a_merge_that_another_was_faster_at_writes_nothing(mixed, monkeypatch):
    jobs, real = held(read_store(mixed)), merge._merge_alike

    def late(*args):
        monkeypatch.undo()
        merge_all(mixed)
        real(*args)

    monkeypatch.setattr(merge, "_merge_alike", late)
    merge_all(mixed)
    assert (len(batches(mixed)), held(read_store(mixed))) == (3, jobs)


def test_a_reader_that_loses_the_race_with_a_merge_reads_again(mixed, monkeypatch):
    jobs = held(read_store(mixed))

    def merged_meanwhile(path):
        monkeypatch.undo()
        merge_all(mixed)
        return read_batch(path)

    monkeypatch.setattr("compressor.store.stored.read_batch", merged_meanwhile)
    assert held(read_store(mixed)) == jobs


def test_numbers_and_series_of_batches_that_were_merged_since_are_found(mixed, monkeypatch):
    expected, jobs = open_study(mixed).load(), held(read_store(mixed))
    stored, lazy = read_store(mixed), open_study(mixed)

    def merged_after(folder, warn):
        found = read_store(folder, warn)
        merge_all(mixed)
        return found

    monkeypatch.setattr(reader, "read_store", merged_after)
    xr.testing.assert_identical(open_study(mixed).load(), expected)
    monkeypatch.undo()
    assert held(stored) == jobs
    assert all(stored.intact(position) for position in range(len(stored)))
    xr.testing.assert_identical(lazy.load(), expected)


def test_a_job_that_is_gone_amid_reading_is_told(mixed):
    lazy, stored = open_study(mixed), read_store(mixed)
    shutil.rmtree(mixed / "batches")
    forget()
    for read in (lazy.load, lambda: stored.attributes(0)):
        with pytest.raises(StoreError, match="has lost jobs meanwhile; try again"):
            read()
