"""The ideal cycle by closed form: against quadrature, textbook numbers, and runs."""

import math

import numpy as np
import pytest
from cylinder_made import DOUBLE, MACHINE

from compressor.analysis.cylinder import card_works, end_states, ideal_cycles
from compressor.cases.case import Case
from compressor.physics import static_load
from compressor.solve import measure, record, simulate

SINGLE = {"action": "single", "rod_diameter_mm": None, "clearance_percent": 12}
CYLINDERS = {
    "double": {"valve_loss_percent": None},
    "losses": {},
    "single": SINGLE,
    "crank end": {"action": "crank_end", "clearance_percent": 14},
    "head unloaded": {"unloaded": "head"},
    "crank unloaded": {"unloaded": "crank"},
    "isothermal": {"exponent": 1},
    "all idle": {**SINGLE, "unloaded": "head", "valve_loss_percent": None},
}


def cylinder(gas, **more):
    values = {key: value for key, value in (DOUBLE | gas).items() if value is not None}
    return Case.from_values({"load": "gas", "machine": MACHINE, "gas": values, **more})


@pytest.mark.parametrize("name", CYLINDERS)
def test_the_work_is_the_area_of_the_card_and_of_an_ideal_run(name):
    """By quadrature of the card: polytropics between the pressures inside."""
    case = cylinder(CYLINDERS[name], solve={"duration_rev": 2, "settle_rev": 1})
    inlet, outlet = (1e6 * pressure for pressure in case.gas.open_pressures)
    for cycle in ideal_cycles(case).values():
        pressure = np.linspace(inlet, outlet, 20001)
        c, n = cycle.clearance_volume, case.gas.exponent
        compressed = (c + cycle.swept_volume) * (inlet / pressure) ** (1 / n)
        expanded = c * (outlet / pressure) ** (1 / n)
        area = np.trapezoid(compressed - expanded, pressure)
        assert cycle.indicated_work == pytest.approx(area, rel=1e-8)
    # two revolutions, both ends; the crank gives what the gas takes, and back pressure nothing
    work = 2 * sum(cycle.indicated_work for cycle in ideal_cycles(case).values())
    numbers = measure(case).numbers
    assert numbers["load_work"] == pytest.approx(-work, rel=1e-12, abs=1e-8)
    assert numbers["crank_work"] == pytest.approx(work, rel=1e-9, abs=1e-6)


def stroke_work(face, full, empty, before, case):
    """Work (J) that an end's gas takes between its dead centres, by its spaces (m) there.

    full: at the begin of compression; empty: at the end of discharge; before: at the end of the
    discharge whose rest is expanded.
    """
    inlet, outlet = (1e6 * pressure for pressure in case.gas.open_pressures)
    n = case.gas.exponent
    opened, closed = full * (inlet / outlet) ** (1 / n), before * (outlet / inlet) ** (1 / n)
    compressed = (outlet * opened - inlet * full) / (n - 1) + outlet * (opened - empty)
    return face * (compressed - (outlet * before - inlet * closed) / (n - 1)), face * inlet * closed


def test_a_worn_machine_takes_the_work_of_the_spaces_at_its_dead_centres():
    """By the closed form of each stroke; the net force at dead centres shortens the stroke."""
    case = cylinder(
        {}, joint="both", clearance_mm=0.2,
        solve={"duration_rev": 3, "settle_rev": 1, "accuracy": "fine"},
    )  # fmt: skip
    run = simulate(case)
    turns = run.crank_angle.values / math.tau
    at = [run.displacement.values[np.abs(turns - k / 2).argmin()] for k in range(7)]
    head = [case.machine.rod_length_mm / 1e3 + 0.09 + 0.0216 - x for x in at]
    crank = [x - case.machine.rod_length_mm / 1e3 + 0.09 + 0.0252 for x in at]
    faces, inlet = (math.pi * 0.11**2, math.pi * (0.11**2 - 0.03**2)), 0.2e6 * 0.96
    work = 0.0
    for k in (0, 2, 4):
        taken, drawn = stroke_work(faces[0], head[k + 1], head[k + 2], head[k], case)
        work += taken + drawn - faces[0] * inlet * head[k + 1]
        taken, drawn = stroke_work(faces[1], crank[k], crank[k + 1], crank[k + 1], case)
        work += taken + drawn - faces[1] * inlet * crank[k + 2]
    back = 1e6 * case.gas.back_pressure_MPa * (faces[0] - faces[1]) * (at[6] - at[0])
    assert float(run.load_work) == pytest.approx(back - work, rel=1e-5)
    ideal = 3 * sum(cycle.indicated_work for cycle in ideal_cycles(case).values())
    assert 0.98 * ideal < work < 0.99 * ideal
    assert float(run.energy_residual) < 1e-5


def test_the_work_of_a_card(tmp_path):
    """A disc of pressure over volume: p = p0 + q sin(theta) in x = R cos(theta) of a long rod."""
    degrees = np.arange(0, 360, 2)
    pressure = 0.5 - 0.2 * np.sin(np.radians(degrees))
    lines = [f"{a},{p!r}\n" for a, p in zip(degrees, pressure.tolist(), strict=True)]
    (tmp_path / "head.csv").write_text("crank_angle_deg,pressure_MPa\n" + "".join(lines))
    case = Case.from_values({
        "load": "gas", "machine": {"crank_radius_mm": 90, "rod_length_mm": 9e5},
        "gas": {"bore_mm": 220, "indicator": str(tmp_path / "head.csv")},
    })  # fmt: skip
    work = 0.2e6 * math.pi * 0.09 * math.pi * 0.11**2
    assert card_works(case) == pytest.approx({"head": work}, rel=1e-4)


@pytest.mark.parametrize(
    "name", ["losses", "single", "crank end", "head unloaded", "plain", "card"]
)
def test_the_pressures_of_a_run_are_those_that_press(tmp_path, name):
    """The piston force of a worn machine, from the pressures on its faces; work by their areas."""
    worn = {"joint": "both", "clearance_mm": 0.2, "solve": {"duration_rev": 2, "settle_rev": 1}}
    if name == "plain":
        case = Case.from_values({"load": "gas", "gas": {"back_pressure_MPa": 0.1}, **worn})
    elif name == "card":
        rows = [f"{a},{0.5 - 0.2 * math.sin(math.radians(a))!r}" for a in range(0, 360, 5)]
        (tmp_path / "card.csv").write_text("\n".join(["crank_angle_deg,pressure_MPa", *rows]))
        gas = {"back_pressure_MPa": 0.1, "bore_mm": 220, "indicator": str(tmp_path / "card.csv")}
        case = Case.from_values({"load": "gas", "gas": gas, **worn})
    else:
        case = cylinder(CYLINDERS[name], **worn)
    run = simulate(case)
    found = end_states(run)
    head = math.pi * (case.gas.piston_radius_mm / 1e3) ** 2
    faces = {"head": head, "crank": math.pi * ((case.gas.rod_diameter_mm or 0) / 2e3) ** 2 - head}
    force = sum(1e6 * faces[end] * (one.pressure - 0.1) for end, one in found.items())
    exact = 1e-9 if name != "card" else 2e-5  # of a card straight lines between nodes
    most = np.abs(run.piston_force.values).max()
    assert force == pytest.approx(run.piston_force.values, abs=exact * most)
    assert sum(one.work for one in found.values()) == pytest.approx(-float(run.load_work), rel=5e-3)


def test_another_program_s_double_acting_machine():
    """OpenPulse's: power of its p-V files, angles of valves, static rod loads by formula."""
    case = Case.from_values({
        "load": "gas", "machine": {"stroke_mm": 330, "rod_length_mm": 1250, "speed_rpm": 360},
        "gas": {"action": "double", "bore_mm": 780, "rod_diameter_mm": 135, "suction_MPa": 1.965,
                "discharge_MPa": 1.965 * 1.9079, "exponent": 1.4, "back_pressure_MPa": 0,
                "clearance_percent": {"head": 15.8, "crank": 18.39}},
    })  # fmt: skip
    cycles = ideal_cycles(case).values()
    assert 6e-3 * sum(one.indicated_work for one in cycles) == pytest.approx(2338.25, abs=0.05)
    assert 360 * 60 * sum(one.capacity for one in cycles) == pytest.approx(6038, abs=1)
    p = record(case)
    degrees = np.degrees([p.corners[0], p.corners[2], *p.crank_corners])
    assert degrees == pytest.approx([33.4, 265.5, 79.1, 220.9], abs=0.05)
    assert static_load(p) == pytest.approx(880587, rel=2e-5)
    assert p.crank_discharge_force - p.suction_force == pytest.approx(798797, rel=2e-5)


def test_a_text_book_s_compressor():
    """200 x 300 mm, 500 rpm, 97 to 550 kPa, n = 1.3, 5 % clearance: 13.98 kW, 243.2 m3/h."""
    case = Case.from_values({
        "load": "gas", "machine": {"stroke_mm": 300, "speed_rpm": 500},
        "gas": {"bore_mm": 200, "suction_MPa": 0.097, "discharge_MPa": 0.55, "exponent": 1.3,
                "clearance_percent": 5},
    })  # fmt: skip
    (cycle,) = ideal_cycles(case).values()
    assert cycle.indicated_work * 500 / 60e3 == pytest.approx(13.98, abs=0.005)
    assert cycle.capacity * 500 * 60 == pytest.approx(243.2, abs=0.05)
