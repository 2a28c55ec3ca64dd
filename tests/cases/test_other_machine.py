"""The trial's machine, which is not the paper's: what a newcomer writes is read or answered."""

import html
from dataclasses import replace

from compsim import cli

from compressor.cases.materials import paper_notes

# single throw, stroke 180 mm, rod 450 mm, 740 rpm, bore 220 mm, 2 to 7 bar
MACHINE = """
joint: small_end
clearance_mm: 0.2
machine:
  stroke_mm: 180
  rod_length_mm: 450
  speed_rpm: 740
  reciprocating_mass_kg: 85
  rod_mass_kg: 62
  pin_radius_mm: {big_end: 60, small_end: 35}
gas:
  bore_mm: 220
  suction_MPa: 0.2
  discharge_MPa: 0.7
  switching: exact
"""


def test_its_contact_is_told_to_be_of_another_pin(read, tmp_path, capsys, in_process):
    """On its page, by status and show."""
    (case,) = read("load: gas" + MACHINE).cases
    given = replace(case, contact=replace(case.contact, stiffness_N_per_mm15=5e6))
    assert paper_notes(given) == {}
    (tmp_path / "nl.yaml").write_text("load: gas" + MACHINE + "solve: {duration_rev: 2}\n")
    for words in (["run", "nl.yaml", "-j", "1"], ["report"], ["status"]):
        assert cli.main(words) == 0
    note = paper_notes(case)["contact.stiffness_N_per_mm15"]
    assert note.startswith("336000 N/mm^1.5 is the paper's, of a pin of 10 mm radius: give contact")
    assert note in html.unescape((tmp_path / "report/index.html").read_text())
    assert note in " ".join(capsys.readouterr().out.split())
    assert cli.main(["show", "nl"]) == 0
    assert note in " ".join(capsys.readouterr().out.split())
