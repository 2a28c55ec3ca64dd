"""`compsim init`: case files to start from."""

from pathlib import Path

import pytest

from compressor.cases.examples import STARTS, templates


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_list_has_questions_jobs_and_times(compsim):
    out, err = compsim("init")
    lines = out.splitlines()
    assert [line.split()[0] for line in lines if line[0] != " "] == [*templates()]
    assert max(map(len, lines)) <= 80
    assert "wear         How much wear may a joint have?" in out
    assert "14 jobs" in out
    assert err == "next: compsim init wear\n"
    assert not [*Path().iterdir()]


@pytest.mark.parametrize("name", STARTS)
def test_a_file_is_written_and_the_next_command_named(name, compsim):
    assert compsim("init", name) == (f"{name}.yaml\n", f"next: compsim run {name}.yaml\n")
    assert Path(f"{name}.yaml").read_text() == templates()[name].path.read_text()


def test_files_and_folders_may_be_chosen(compsim):
    err = compsim("init", "wear", "-o", "deep/er/mine.yaml").err
    assert err == "next: compsim run deep/er/mine.yaml\n"
    assert compsim("init", "paper", "-o", "deep").out == "deep/paper.yaml\n"
    assert Path("deep/er/mine.yaml").read_text().splitlines()[2].startswith(
        "# next: compsim run deep/er/mine.yaml;"
    )  # fmt: skip
