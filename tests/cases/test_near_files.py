"""Paths that are no case files: what is said of each."""

import pytest

from compressor.cases.load import CaseFileError, load_studies


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("configs/both.yaml", "configs/big-end.yaml", "mine/wear.yaml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("load: none\n")
    (tmp_path / "results").mkdir()
    (tmp_path / "empty.yaml").touch()
    (tmp_path / "job.nc").write_bytes(b"\x89HDF\r\n\x1a\n\xff")
    (tmp_path / "photo.jpg").write_bytes(b"\xff\xd8\xff")
    return tmp_path


@pytest.mark.parametrize(
    ("path", "told"),
    [
        (
            "botch.yaml",
            "cannot be read: No such file or directory; did you mean configs/both.yaml?",
        ),
        (
            "big_end",
            "cannot be read: No such file or directory; did you mean configs/big-end.yaml?",
        ),
        ("mine/waer.yaml", "did you mean mine/wear.yaml?"),
        ("mine/quite.yaml", "there are configs/big-end.yaml, configs/both.yaml, mine/wear.yaml"),
        ("*.yml", "no file has such a name; compsim init writes a case file to start from"),
        ("mine", "Is a directory; it holds case files: compsim run mine/*.yaml"),
        ("results", "Is a directory; give a case file"),
        ("empty.yaml", "is empty; compsim init writes a case file to start from"),
        ("job.nc", "is a file of results (netCDF or HDF5); a case file is YAML text"),
        ("photo.jpg", "is not UTF-8 text"),
        ("a\0b", "embedded null byte"),
        ("/dev/zero", "larger than 1 MiB"),
    ],
)
def test_what_is_said_of_a_path(path, told, place):
    with pytest.raises(CaseFileError) as error:
        load_studies(path)
    (problem,) = error.value.problems
    assert told in problem.message
    assert "\n" not in str(error.value)


def test_where_no_file_is_near_a_template_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(CaseFileError, match="No such file or directory; compsim init writes"):
        load_studies("wear.yaml")
