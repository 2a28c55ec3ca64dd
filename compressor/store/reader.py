"""Stored jobs and studies as Datasets."""

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

from compressor.store.files import Folder, StoreWarning
from compressor.store.stored import Stored, read_store
from compressor.store.studies import StoredStudy, find_study, read_studies, whole_key

if TYPE_CHECKING:
    import xarray as xr

WHOLE_KEY = 20  # digits
BOTH_JOINTS = (
    "`fault` is the swept joint, and `joint` the one that a number belongs to: select both, as in "
    "study.sel(fault='big_end', joint='big_end')"
)


def read_job(folder: Folder, key: str) -> "xr.Dataset":
    """Return a stored job's Dataset: what `simulate` gives of its case, with series if stored.

    folder: of results; key: 20 hexadecimal digits, as `Case.key` and the coordinate `key` of a
    study have them, or the beginning of one. Raises StoreError where there is no such job, or a
    damaged one.

    After `compsim run wear.yaml` with the file of `load_cases`:

    >>> import compressor
    >>> study = compressor.open_study("results", "wear")
    >>> run = compressor.read_job("results", study.key.sel(clearance_mm=0.2).item())
    >>> run.acceleration.dims, compressor.Case.from_attribute(run.attrs["case"]).joint
    (('time',), 'big_end')
    """
    stored = read_store(folder)
    if len(key) < WHOLE_KEY:
        key = whole_key(folder, key, read_studies(folder), stored.keys())
    return stored.job(key)


def open_study(folder: Folder, name: str | None = None) -> "xr.Dataset":
    """Return a study as one Dataset, labelled by its axes; series are read when they are used.

    folder: of results; name: of the study, all studies without. Variables and SI units are those
    of `simulate`.

    One study (that of `name`, or the only one) has its axes as dimensions: the last part of each
    swept key, such as `clearance_mm`, in the case file's unit; a swept `joint` is called `fault`.
    Several studies, and one that is no grid (zip, samples, exclude, blocks), have a `job` dimension
    with coordinates `study`, `fault`, `load` and each swept key. `key` names every job (see
    `read_job`), `status` is ok, failed or missing, and metrics are nan where a job did not reach
    its end. Numbers of the machine that are not swept, such as `rod_mass_kg`, are variables, too,
    so that `to_dataframe` has a column of each. Of a study that sweeps `joint` a StoreWarning says
    that `joint` alone does not select a fault.

    Series have the dimension `time`. If the jobs have different output grids (a swept speed),
    they have `sample` instead, nan beyond a job's end, with `time` a coordinate of every job.

    Raises StoreError for a folder without results and for a study that it does not hold: a
    WrongName, which says what was probably meant. Of damaged files a StoreWarning is given, and
    their jobs count as missing; where numbers alone are damaged, a StoreError names the file.

    After `compsim run wear.yaml` with the file of `load_cases`:

    >>> import compressor
    >>> study = compressor.open_study("results", "wear")
    >>> one = study.sel(clearance_mm=0.2)
    >>> print(f"{one.peak_acceleration:.0f} ± {one.peak_acceleration_error:.1f} m/s2")
    647 ± 0.2 m/s2
    >>> surely_below = study.peak_acceleration + study.peak_acceleration_error < 700
    >>> study.clearance_mm.where(surely_below, drop=True).values.tolist()
    [0.1, 0.2]
    >>> study.acceleration.sel(clearance_mm=0.3).dims
    ('time',)
    """
    studies = read_studies(folder)
    if name is not None:
        studies = [find_study(folder, name, studies)]
    dataset = label_studies(read_store(folder, warn=True), studies)
    if "fault" in dataset.dims and "joint" in dataset.dims:
        warnings.warn(BOTH_JOINTS, StoreWarning, stacklevel=2)
    return dataset


def label_studies(stored: Stored, studies: Sequence[StoredStudy]) -> "xr.Dataset":
    """Return studies of a store as one Dataset, as `open_study` does."""
    from compressor.store import dataset as datasets  # loads xarray: half a second

    layout = datasets.lay_out(studies)
    found = datasets.label_jobs(layout, stored, with_series=True)
    return found.assign(datasets.machine_constants(studies, layout))
