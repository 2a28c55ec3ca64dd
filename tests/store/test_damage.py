"""Disks that refuse or fill up, and files that are not what was written: whole, absent, or told."""

import errno
import json
import os
import random
import uuid

import pytest
import xarray as xr
from conftest import flip, write_batch
from made_jobs import batches, held, key, made, plan

from compressor.program import PROGRAM
from compressor.store.files import StoreError, StoreWarning, discard_leftovers, publish
from compressor.store.netcdf import DamagedFile, read_dataset, write_dataset
from compressor.store.reader import open_study, read_store
from compressor.store.status import verify

REFUSED = [
    (errno.ENOSPC, "free some space"),
    (errno.EDQUOT, "free some space"),
    (errno.EROFS, "get the permission"),
    (errno.EACCES, "get the permission"),
    (errno.EMFILE, "allow more open files"),
    (errno.EIO, "check the disk"),
]


def refusing(number):
    def refuse(*args, **more):
        raise OSError(number, os.strerror(number))

    return refuse


@pytest.mark.parametrize("call", ["fsync", "replace"])
@pytest.mark.parametrize(("number", "remedy"), REFUSED)
def test_what_the_disk_refuses_leaves_no_part_and_has_a_remedy(
    call, number, remedy, tmp_path, monkeypatch
):
    write_batch(tmp_path, [made(1)])
    before = held(read_store(tmp_path))
    monkeypatch.setattr(os, call, refusing(number))
    with pytest.raises(StoreError) as error:
        write_batch(tmp_path, [made(1, 5), made(2)])
    monkeypatch.undo()
    assert os.strerror(number) in str(error.value)
    assert remedy in error.value.remedy
    assert [*(tmp_path / "batches").iterdir()] == batches(tmp_path)
    assert held(read_store(tmp_path)) == before


def test_a_disk_that_fills_up_amid_a_file_leaves_what_was_there(tmp_path):
    path = tmp_path / "one.nc"
    publish(path, b"old")
    with open("/dev/full", "wb") as full, pytest.MonkeyPatch.context() as patch:
        patch.setattr("builtins.open", lambda *args: os.fdopen(os.dup(full.fileno()), "wb"))
        with pytest.raises(StoreError, match="No space left on device; free some space"):
            publish(path, bytes(10**6))
    assert [*tmp_path.iterdir()] == [path]
    assert path.read_bytes() == b"old"


def test_files_and_folders_are_synced(tmp_path, monkeypatch):
    synced, real = [], os.fsync
    monkeypatch.setattr(
        os, "fsync", lambda fd: (synced.append(os.readlink(f"/proc/self/fd/{fd}")), real(fd))
    )
    path = write_batch(tmp_path / "new", [made(1)])
    above, folder, file, named = synced  # the names of folders; the data, then the name
    assert [above, folder] == [str(tmp_path), str(tmp_path / "new")]
    assert file.startswith(f"{path.parent}/.")
    assert named == str(path.parent)


def test_old_leftovers_are_removed_and_young_ones_kept(tmp_path):
    write_batch(tmp_path, [made(1)])
    ending = f"{uuid.uuid4().hex}.tmp"
    names = ("batches/.old.h5", "follow/chains/.old.nc", "batches/.young.h5")
    old, chain, young = (tmp_path / f"{name}.{ending}" for name in names)
    other = tmp_path / "batches/.other.1.tmp"  # of another program
    chain.parent.mkdir(parents=True)
    for path in (old, chain, young, other):
        path.touch()
        if path != young:
            os.utime(path, (0, 0))
    (tmp_path / "elsewhere").mkdir()
    beyond = tmp_path / "elsewhere" / old.name
    beyond.touch()
    os.utime(beyond, (0, 0))
    (tmp_path / "store").mkdir()
    (tmp_path / "store/batches").symlink_to(tmp_path / "elsewhere")
    discard_leftovers(tmp_path / "store")
    assert beyond.exists()
    discard_leftovers(tmp_path)
    there = [path.exists() for path in (old, chain, beyond, young, other)]
    assert there == [False, False, False, True, True]
    assert read_store(tmp_path).keys() == {key(1)}


def test_a_folder_that_may_not_be_read_is_no_damage(tmp_path, monkeypatch):
    write_batch(tmp_path, [made(1)])
    for name in ("os.listdir", "compressor.store.stored.read_batch"):
        with monkeypatch.context() as patch:
            patch.setattr(name, refusing(errno.EACCES))
            with pytest.raises(StoreError, match="Permission denied; get the permission"):
                read_store(tmp_path)


def flipped(data, at, bit):
    found = bytearray(data)
    found[at] ^= 1 << bit
    return bytes(found)


def damages(data, rng):
    """Bits of each byte of the superblock and some of all parts of the file, and early ends."""
    for at in range(48):  # the first twelve bytes say how the file is to be read
        yield from (flipped(data, at, bit) for bit in (range(8) if at < 12 else [at % 8]))
    for _ in range(200):
        yield flipped(data, rng.randrange(48, len(data)), rng.randrange(8))
    for size in range(0, len(data), len(data) // 10):
        yield data[:size]


def test_every_flipped_bit_of_a_batch_is_told_or_changes_nothing(tmp_path):
    jobs = [made(n, samples=15 * n, detail="µ") for n in range(3)]  # one without series
    path = write_batch(tmp_path, jobs)
    plan(tmp_path, 3)
    good, whole, told = path.read_bytes(), held(read_store(tmp_path)), 0
    for data in damages(good, random.Random(30)):
        path.write_bytes(data)
        try:
            stored = read_store(tmp_path)
            found = None if stored.damaged else held(stored)
        except DamagedFile:
            found = None
        assert found in (None, whole)
        if found is None:
            told += 1
            if told % 4 == 0:
                (damage,) = verify(tmp_path)
                assert (damage.path, [*damage.studies]) == (path, [key(0), key(1), key(2)])
                assert {*damage.studies[key(1)]} == {"made"}
    assert told > 240
    path.write_bytes(good)
    assert verify(tmp_path) == []


def test_every_flipped_bit_of_a_study_is_found(tmp_path):
    plan(tmp_path, 3)
    path = tmp_path / "studies/made.json"
    good, rng = path.read_bytes(), random.Random(1)
    for at in range(len(good)):
        path.write_bytes(flipped(good, at, rng.randrange(8)))
        (damage,) = verify(tmp_path)
        assert (damage.path, damage.studies) == (path, {})
        assert damage.remedy == "run its case file again"


def test_damage_to_a_machine_that_was_followed_is_told(tmp_path, compsim):
    kept = xr.Dataset(
        {
            "hours": ("stage", [0.0, 1.5, 3.0], {"units": "h"}),
            "reason": ("stage", ["", "worn", "µ"]),
            "load": (("stage", "joint"), [[1.0, 2.0]] * 3),
        },
        {"stage": [1, 2, 3]},
        {"key": "0123456789abcdef0123", "program": PROGRAM},
    )
    path = write_dataset(tmp_path / "follow/chains/0123456789abcdef0123.nc", kept)
    whole = read_dataset(path)
    assert whole.identical(kept)
    assert verify(tmp_path) == []
    good, told = path.read_bytes(), 0
    for data in damages(good, random.Random(2)):
        path.write_bytes(data)
        try:
            assert read_dataset(path).identical(whole)
        except DamagedFile:
            told += 1
            if told % 4 == 0:
                (damage,) = verify(tmp_path)
                assert damage.path == path
                assert "delete it" in damage.remedy
    assert "delete it" in compsim("verify", "-r", tmp_path, code=5).out


def test_jobs_in_a_damaged_batch_count_as_missing_with_a_warning(tmp_path, compsim):
    """Where it cannot be opened; where only its numbers are damaged, it is named."""
    parts = [[0], [1], [*range(2, 400)]]  # the values of the last have a checksum of their own
    paths = [write_batch(tmp_path, [made(n) for n in part]) for part in parts]
    plan(tmp_path, 400)
    paths[0].write_bytes(paths[0].read_bytes()[:-1])
    with pytest.warns(StoreWarning, match="is damaged.*count as missing") as told:
        found = open_study(tmp_path)
    assert [sum(path.name in str(one.message) for one in told) for path in paths] == [1, 0, 0]
    assert found.status.values[:3].tolist() == ["missing", "ok", "ok"]
    flip(paths[2], made(2).numbers["peak_contact_force_axis"])
    with (
        pytest.warns(StoreWarning, match=paths[0].name),
        pytest.raises(StoreError, match=f"{paths[2].name}: is damaged"),
    ):
        open_study(tmp_path)
    stored = read_store(tmp_path)
    assert [stored.intact(stored.position(key(n))) for n in (1, 2, 3)] == [True, False, False]
    told = json.loads(compsim("verify", "-r", tmp_path, "--json", code=5).out)
    lost = {one["path"]: [*one["studies"]] for one in told}
    assert lost == {str(paths[0]): [key(0)], str(paths[2]): [*map(key, range(2, 400))]}
    assert [path.exists() for path in paths] == [False, True, False]  # a run sees what is missing
    compsim("verify", "-r", tmp_path)
    paths[1].write_bytes(b"")  # of which nobody knows that it had one job
    assert "1 damaged file, up to 400 jobs lost" in compsim("verify", "-r", tmp_path, code=5).err
