"""The page of ten lines for a notebook, run as it stands."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[1] / "compressor/docs/notebook.md"


def test_ten_lines_of_a_notebook_work(paper_store, tmp_path, monkeypatch, capsys):
    text = PAGE.read_text(encoding="utf-8")
    (code,) = re.findall(r"```py\n(.*?)```", text, re.DOTALL)
    (printed,) = re.findall(r"```text\n(.*?)```", text, re.DOTALL)
    assert len([line for line in code.splitlines() if line]) == 10
    (tmp_path / "results").symlink_to(paper_store)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    names = {}
    exec(code, names)
    number, *table = capsys.readouterr().out.splitlines()
    assert [round(float(one), 2) for one in re.findall(r"\d+\.\d+", number)] == [
        round(float(one), 2) for one in re.findall(r"\d+\.\d+", printed)
    ]
    assert number.split(",")[1:] == printed.strip().split(",")[1:]
    assert table[0].split()[:3] == ["peak_acceleration", "speed_rpm", "rod_mass_kg"]
    assert [row.split()[2:4] for row in table[2:]] == [["500.0", "4.7"]] * 3
