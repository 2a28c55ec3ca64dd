"""The tutorial: each command is run, each output compared, and each number of its words.

Its notebook is that page, cell by cell; nbclient runs the first ones.
"""

import contextlib
import io
import re

import numpy as np
import pytest
import tutorial

import compressor

TEXT = tutorial.PAGE.read_text(encoding="utf-8")
PIECES = tutorial.pieces(TEXT)
WORDS = " ".join(TEXT.split())
CELLS = [one for one in PIECES if one.kind != "markdown"]


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The folder in which the tutorial was run, and what each block printed."""
    folder, printed, names = tmp_path_factory.mktemp("tutorial"), [], {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MPLBACKEND", "agg")
        for one in CELLS:
            if one.kind == "console":
                lines = one.source.splitlines()
                printed.append("".join(tutorial.run_command(folder, line) for line in lines))
            else:
                with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.chdir(folder):
                    exec(one.source, names)
                printed.append(out.getvalue())
    return folder, printed


def opened(ran, name):
    """A study of the folder, at the big end."""
    return compressor.open_study(ran[0] / "results", name).sel(joint="big_end")


def printed_by(ran, words):
    """What the cell that holds some words prints."""
    return next(out for one, out in zip(CELLS, ran[1], strict=True) if words in one.source)


@pytest.mark.slow
def test_each_command_prints_what_the_page_says(ran):
    for one, out in zip(CELLS, ran[1], strict=True):
        assert tutorial.missing(one.output, out) == "", (one.source, out)


@pytest.mark.slow
def test_the_words_about_one_machine_follow_from_the_runs(ran):
    """Sections 4 to 6, and the answer."""
    wear = opened(ran, "wear").sel(speed_rpm=700)
    force, bar = wear.peak_contact_force / 1e3, wear.peak_contact_force_error / 1e3
    (told,) = re.findall(r"At 0.2 mm the force is ([\d.]+) kN: more than", WORDS)
    assert f"{force.sel(clearance_mm=0.2).item():.1f}" == told
    assert "It is about half a newton here" in WORDS
    assert 2.5e-4 < bar.sel(clearance_mm=0.2) < 1e-3
    assert "The force rises with the clearance all the way" in WORDS
    assert (force.diff("clearance_mm") > 0).all()
    assert "It passes 15 kN between 0.15 and 0.2 mm" in WORDS
    assert force.sel(clearance_mm=0.15) < 15 < force.sel(clearance_mm=0.2)

    found = opened(ran, "wear-find-clearance_mm")
    force, bar = found.peak_contact_force / 1e3, found.peak_contact_force_error / 1e3
    safe = found.clearance_mm.where(force + 5 * bar < 15).max().item()
    unsafe = found.clearance_mm.where(force - 5 * bar > 15).min().item()
    ((low, high),) = re.findall(
        r"At ([\d.]+) mm the limit is surely kept, and at ([\d.]+) mm", WORDS
    )
    assert safe - 1e-3 < float(low) <= safe
    assert unsafe <= float(high) < unsafe + 1e-3
    assert re.findall(r"may have a clearance up to ([\d.]+) mm at 700 rpm", WORDS) == [low]
    assert WORDS.count("below a thousandth of the force") == 2
    assert (bar / force < 1e-3).all()


@pytest.mark.slow
def test_the_words_about_what_is_not_known_follow_from_the_runs(ran):
    """Section 7, and the answer."""
    drawn = opened(ran, "sampling")
    count, over = drawn.sizes["job"], drawn.peak_contact_force > 15e3
    assert (drawn.peak_contact_force_error / drawn.peak_contact_force < 1e-3).all()
    for name, middle in (("rod_mass_kg", 4.7), ("reciprocating_mass_kg", 14)):
        assert abs(drawn[name] / middle - 1).max() == pytest.approx(0.2, abs=0.01)
    (below,) = re.findall(r"No drawn machine with less than ([\d.]+) mm exceeds 15 kN", WORDS)
    assert not over.where(drawn.clearance_mm < float(below), False).any()
    assert (drawn.clearance_mm < float(below)).any()
    (above,) = re.findall(r"every one with more than ([\d.]+) mm does", WORDS)
    assert over.where(drawn.clearance_mm > float(above), True).all()
    told = re.findall(r"most machines may have ([\d.]+) mm: of (\d+) drawn ones", WORDS)
    assert told == [(below, str(count))]
    assert f"This file draws {count} machines" in WORDS

    pairs = re.findall(r"^(\w+) +([-+][\d.]+)$", printed_by(ran, "xr.corr"), re.MULTILINE)
    ranked = sorted(dict(pairs), key=lambda name: -abs(float(dict(pairs)[name])))
    assert ranked[:2] == ["clearance_mm", "reciprocating_mass_kg"]
    assert "after the clearance, the reciprocating mass matters most" in WORDS

    lines = printed_by(ran, "itertools.product").splitlines()[1:]
    corners = [[float(n) for n in line.split()] for line in lines]
    exceed = [row for row in corners if row[-1] > 15]
    assert (len(corners), len(exceed), {row[1] for row in exceed}) == (8, 2, {16.8})
    assert "Two corners exceed 15 kN at 0.1 mm already, both with the heavy crosshead" in WORDS
    assert "two of the eight corners exceed it at 0.1 mm" in WORDS


@pytest.mark.slow
def test_the_words_about_the_nameplate_s_machine_follow_from_the_runs(ran):
    """Sections 8 to 10."""
    machine = compressor.open_study(ran[0] / "results", "machine")
    pin = machine.peak_contact_force.sel(joint="small_end").values / 1e3
    (told,) = re.findall(
        r"with (\d+) kN on it. At 0.24 mm it begins to strike, with (\d+) kN, and at 0.4 mm it "
        r"hammers, with (\d+) kN", WORDS
    )  # fmt: skip
    assert tuple(f"{force:.0f}" for force in pin) == told
    assert "where the force is a fifth greater" in WORDS
    assert pin[1] / pin[0] == pytest.approx(1.2, abs=0.03)
    knock = machine.knock.sel(joint="small_end").values
    assert knock[0] < 0.25 < knock[1] < knock[2]
    assert "The rod load reverses over some 150 degrees at every clearance" in WORDS
    assert (abs(np.degrees(machine.rod_load_reversal_angle) - 150) < 5).all()
    (told,) = re.findall(r"moves (\d) mm/s when sound and ([\d.]+) mm/s when worn", WORDS)
    body = 1e3 * machine.body_velocity_rms.sel(axis="x").values
    assert (f"{body[0]:.0f}", f"{body.max():.1f}") == told
    (told,) = re.findall(
        r"rms rises from ([\d.]+) to ([\d.]+) m/s² at 0.24 .* to (\d+) m/s²", WORDS
    )
    sensor = machine.sensor_rms.values
    assert (f"{sensor[0]:.1f}", f"{sensor[1]:.1f}", f"{sensor[2]:.0f}") == told
    (told,) = re.findall(r"The force is (\d+) kN instead of (\d+): four percent", WORDS)
    thick = compressor.open_study(ran[0] / "results", "thick")
    other = thick.peak_contact_force.sel(joint="small_end").item() / 1e3
    assert (f"{other:.0f}", f"{pin[2]:.0f}") == told
    assert abs(1 - other / pin[2]) == pytest.approx(0.04, abs=0.005)


def test_the_notebook_is_made_from_the_page():
    written = tutorial.NOTEBOOK.read_text(encoding="utf-8")
    assert written == tutorial.notebook(TEXT), "stale: run make pages"


@pytest.mark.parametrize(
    ("expected", "printed", "told"),
    [
        (["a 1.000 b"], "a 1.001 b\n", ""),
        (["a 1.000 b"], "a 1.01 b\n", "a 1.000 b"),
        (["a 1.000 b"], "a 1.000 c\n", "a 1.000 b"),
        (["a", "…", "c 2"], "a\nb\nb\nc 2\n", ""),
        (["a", "…", "c 2"], "a\nb\nb\nc 3\n", "c 2"),
        (["a"], "a\nb\n", "more is printed: b"),
        (["a", "…"], "a\nb\n", ""),
        (["took … s"], "took 12.3 s", ""),
        (["5.00 ± 0.02 kN"], "5.001 ± 0.03 kN", ""),
        (["5.00 ± 0.02 kN"], "5.2 ± 0.02 kN", "5.00 ± 0.02 kN"),
        (["x ≤ 1e-07 %"], "x ≤ 3e-08 %", ""),
        (["clearance_mm=0.2"], "clearance_mm=0.3", "clearance_mm=0.2"),
    ],
)
def test_how_outputs_are_compared(expected, printed, told):
    assert tutorial.missing(tuple(expected), printed) == told
