"""Folders that hold no results: what is said of each, and the near ones that do."""

import pytest

from compressor.store.files import WrongName, holds_results, no_results, writable_folder


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A working directory with two folders of results and other things."""
    monkeypatch.chdir(tmp_path)
    for name in ("results/studies/a.json", "deep/wear/studies/b.json", "wear/studies/c.json"):
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).write_text("{}")
    (tmp_path / "chains/follow").mkdir(parents=True)
    (tmp_path / "chains/follow/rise-clearance_mm.nc").touch()
    (tmp_path / "plots").mkdir()
    (tmp_path / "case.yaml").touch()
    (tmp_path / "notes.txt").touch()
    return tmp_path


@pytest.mark.parametrize(
    ("folder", "told"),
    [
        ("case.yaml", "is a case file, where a folder of results is needed; compsim run case.yaml"),
        ("notes.txt", "is a file, where a folder of results is needed; there are results in"),
        ("resluts", "there is no such folder of results; did you mean results?"),
        (
            "elsewhere",
            "there is no such folder of results; there are results in chains, results, wear",
        ),
        ("results/studies", "did you mean results?"),
        ("results/rows", "did you mean results?"),
        ("deep", "holds no study; did you mean deep/wear?"),
        ("chains", "holds no study of jobs, only how machines move along a key; compsim "),
        ("plots", "holds no study; there are results in"),
        ("no/where", "there is no such folder of results; choose the folder of a sweep, or make"),
    ],
)
def test_what_is_said_of_a_folder_without_results(folder, told, place):
    error = no_results(folder)
    assert isinstance(error, WrongName)
    assert error.exit_code == 2
    text = str(error)
    assert text.startswith(f"{folder}: ")
    assert told in text
    assert "\n" not in text


def test_which_folders_hold_results(place):
    assert [p.name for p in sorted(place.iterdir()) if holds_results(p)] == [
        "chains", "results", "wear"
    ]  # fmt: skip


def test_a_folder_that_may_not_be_written_is_found_before(tmp_path, monkeypatch):
    made = tmp_path / "a" / "b"
    writable_folder(made)
    assert made.is_dir()
    monkeypatch.setattr("os.access", lambda path, mode: path != made)  # root may write anywhere
    with pytest.raises(WrongName, match=r"nothing may be written to .*get the permission"):
        writable_folder(made / "c" / "d")
    assert not (made / "c").exists()
    (tmp_path / "file").touch()
    with pytest.raises(WrongName, match="is a file, where a folder is needed; choose another"):
        writable_folder(tmp_path / "file" / "c")
