"""Files that are synced in threads, beside what a worker goes on with."""

import errno
import os
import pickle
import threading

import pytest

from compressor.store.files import StoreError, pending_path, publish, sync_later
from compressor.sweep.worker import HERE, NOTE, JobResult, Workers, do_batch


@pytest.fixture
def synced(monkeypatch):
    """The paths that were synced, in order."""
    found, real = [], os.fsync

    def fsync(descriptor):
        real(descriptor)
        found.append(os.readlink(f"/proc/self/fd/{descriptor}"))

    monkeypatch.setattr(os, "fsync", fsync)
    return found


def refuse_second(monkeypatch):
    """Let the disk refuse to sync the second file."""
    count, real, lock = iter(range(10**6)), os.fsync, threading.Lock()

    def fsync(descriptor):
        with lock:
            if next(count) == 1:
                raise OSError(errno.EIO, os.strerror(errno.EIO))
        real(descriptor)

    monkeypatch.setattr(os, "fsync", fsync)


def write_files(folder, count, then=lambda: None):
    """Write some files that are synced later, and do something then."""
    with sync_later():
        for number in range(count):
            publish(folder / f"{number}.h5", b"data", pending=True)
        then()


def test_files_are_on_disk_when_the_block_has_ended(tmp_path, synced):
    paths = [tmp_path / f"{number}.h5" for number in range(40)]
    with sync_later():
        for path in paths:
            publish(path, b"data", pending=True)
    assert {*synced} == {str(pending_path(path)) for path in paths}
    assert len(synced) == 40
    assert all(pending_path(path).read_bytes() == b"data" for path in paths)
    synced.clear()
    publish(paths[0], b"other", pending=True)  # after it, each by itself again
    assert synced == [str(pending_path(paths[0]))]


def test_the_block_goes_on_while_the_disk_is_at_work(tmp_path, monkeypatch):
    may_go, real = threading.Event(), os.fsync
    monkeypatch.setattr(os, "fsync", lambda fd: (may_go.wait(30), real(fd)))
    write_files(tmp_path, 8, then=may_go.set)  # or the block would wait for ever
    assert len([*tmp_path.iterdir()]) == 8


def test_files_with_a_name_are_not_put_off(tmp_path, synced):
    with sync_later():
        publish(tmp_path / "study.json", b"data")
        assert str(tmp_path) in synced
    assert (tmp_path / "study.json").read_bytes() == b"data"


def test_a_file_that_the_disk_refuses_is_removed_and_told(tmp_path, monkeypatch):
    refuse_second(monkeypatch)
    open_before = len(os.listdir("/proc/self/fd"))
    with pytest.raises(StoreError, match="Input/output error"):
        write_files(tmp_path, 5)
    assert len([*tmp_path.iterdir()]) == 4
    assert len(os.listdir("/proc/self/fd")) == open_before


def test_an_error_of_the_block_comes_through(tmp_path, synced):
    with pytest.raises(IsADirectoryError):
        write_files(tmp_path, 1, then=lambda: tmp_path.read_bytes())
    assert len(synced) == 1


def run_batch(folder, monkeypatch):
    """Do a batch of five jobs that write a file each, in this process; returns how they ended."""

    def work(number):
        publish(folder / f"{number}.h5", b"data", pending=True)
        return number

    for name, value in {"work": work, "rules": Workers(), "prepared": True}.items():
        monkeypatch.setitem(HERE, name, value)
    shared = folder / "batch"
    shared.write_bytes(bytes(NOTE.size))
    payloads = pickle.dumps([*range(5)])
    assert do_batch(str(shared), payloads, 5) == ""
    data = shared.read_bytes()
    pid, _, since = NOTE.unpack(data[: NOTE.size])
    assert (pid, since < 0) == (os.getpid(), True)  # nobody is at work
    return pickle.loads(data[NOTE.size :])


def test_a_batch_ends_once_its_files_are_on_disk(tmp_path, synced, monkeypatch):
    found = run_batch(tmp_path, monkeypatch)
    assert [pickle.loads(end.result) for end in found] == [*range(5)]
    assert len(synced) == 5


def test_a_batch_whose_files_the_disk_refuses_has_an_error_and_no_results(tmp_path, monkeypatch):
    refuse_second(monkeypatch)
    (found,) = run_batch(tmp_path, monkeypatch)
    assert isinstance(found, JobResult)
    error = pickle.loads(found.result)
    assert isinstance(error, StoreError)
    assert "Input/output error" in str(error)
