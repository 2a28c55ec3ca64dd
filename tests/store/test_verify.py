"""Files of machines that were followed, over values or hours: every damage to them is found."""

import h5py
import numpy as np
import pytest
import xarray as xr
from compsim import cli

from compressor.store.hdf5 import SEAL, DamagedJob
from compressor.store.series_file import image_of, read_dataset, write_dataset
from compressor.store.status import verify

PLACES = ("wear/0123456789abcdef0123.nc", "follow/chains/0123456789abcdef0123.nc",
          "follow/some-clearance_mm.nc")  # fmt: skip
KEPT = xr.Dataset(
    {
        "hours": ("stage", np.arange(4.0), {"units": "h"}),
        "reason": ("stage", np.array([""] * 4, object)),
    },
    attrs={"key": "0123456789abcdef0123", "model_version": 2},
)


@pytest.mark.parametrize("place", PLACES)
def test_every_flipped_bit_is_found_and_told(place, tmp_path, capsys):
    path = write_dataset(tmp_path / place, KEPT)
    assert verify(tmp_path) == []
    whole = path.read_bytes()
    rng = np.random.default_rng(5)
    for at in (0, len(whole) - 1, *rng.integers(0, len(whole), 60)):
        changed = bytearray(whole)
        changed[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(changed)
        if len(whole) - 20 - len(SEAL) <= at < len(whole) - 20:  # a seal that is none
            assert read_dataset(path).identical(
                read_dataset(write_dataset(tmp_path / "o.nc", KEPT))
            )
            continue
        (damage,) = verify(tmp_path)
        assert damage.path == path
        assert "damaged" in damage.problem
        assert "delete it" in damage.remedy
        with pytest.raises(DamagedJob, match="delete it"):
            read_dataset(path, "delete it")
    for kept in (len(whole) - 9, len(whole) // 2, 0):
        path.write_bytes(whole[:kept])
        assert len(verify(tmp_path)) == 1
    assert cli.main(["verify", "-r", str(tmp_path)]) == 5
    assert "delete it" in capsys.readouterr().out


def test_what_is_sealed_is_what_was_written_and_opens_elsewhere(tmp_path):
    path = write_dataset(tmp_path / "one.nc", KEPT)
    found = read_dataset(path)
    assert found["hours"].identical(KEPT["hours"])
    assert found.attrs == KEPT.attrs
    with h5py.File(path) as file:
        assert file["hours"][:].tolist() == KEPT["hours"].values.tolist()
    with xr.open_dataset(path, engine="h5netcdf") as opened:
        assert opened["hours"].values.tolist() == KEPT["hours"].values.tolist()


def test_files_of_before_have_no_seal_and_are_read(tmp_path):
    path = tmp_path / "old.nc"
    path.write_bytes(image_of(KEPT))
    assert read_dataset(path).identical(read_dataset(write_dataset(tmp_path / "new.nc", KEPT)))


def test_a_folder_of_worn_machines_alone_is_told(tmp_path, capsys):
    write_dataset(tmp_path / PLACES[0], KEPT)
    assert cli.main(["verify", "-r", str(tmp_path)]) == 0
    assert cli.main(["status", "-r", str(tmp_path)]) == 2
    told = capsys.readouterr().err
    assert "only how machines have worn" in told
    assert "compsim wear" in told
