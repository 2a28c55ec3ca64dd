"""The tally: quadrature, peaks between nodes, contact and energy of known steps."""

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.physics.kinematics import ideal
from compressor.physics.observe import ACCELERATION, COLUMNS, PENETRATION, Column
from compressor.physics.record import state_names
from compressor.physics.systems import observe_contact, start
from compressor.physics.tally import (
    FIELDS,
    IN_STEPS,
    add_flows,
    extreme_of,
    lobatto,
    new_tally,
    peak_of,
    tally_energy,
    tally_step,
)
from compressor.solve.si_record import record

NODES, WEIGHTS = lobatto(9)
APART = np.array([0.25, 0.75])  # shares of a step without contact
SIDES = np.array([0.5, 0.2, 30.0, 8.0])  # and with the rod load above and below zero; its peaks


@pytest.mark.parametrize("n", [3, 5, 9])
def test_lobatto_is_exact_for_polynomials(n):
    nodes, weights = lobatto(n)
    for degree in range(2 * n - 2):
        assert weights @ nodes**degree == pytest.approx(1 / (degree + 1), rel=1e-12)


def test_a_straight_line_has_no_extreme():
    assert np.isnan(extreme_of(-1.0, 1.0, 2.0, 3.0, 4.0)).all()
    assert extreme_of(-1.0, 1.0, 2.0, 3.0, 2.0) == (0.0, 3.0)


@pytest.mark.parametrize("middle", [0.1, 0.37, 0.5, 0.93])
@pytest.mark.parametrize(
    ("column", "bend", "top", "least", "before"),
    [(ACCELERATION, 3.0, 7.0, 0.0, 6.9),
     # a gap at both ends, larger than the depth; and one that stays
     (PENETRATION, -2e-4, 1e-5, -np.inf, 9.9e-6), (PENETRATION, -2e-4, 1e-5 - 1, -np.inf, -np.inf)],
)  # fmt: skip
def test_a_top_between_nodes_is_found(column, bend, top, least, before, middle):
    """Of the size of an acceleration, which may be negative, and of a depth as it is."""
    rows = np.zeros((NODES.size, COLUMNS))
    sign = -1.0 if column == ACCELERATION else 1.0
    rows[:, column] = sign * top + bend * (NODES - middle) ** 2
    assert peak_of(NODES, rows, 1, column, least) == pytest.approx(top, rel=1e-12)
    assert peak_of(NODES, rows, 1, column, before) == pytest.approx(top, rel=1e-12)
    assert peak_of(NODES, rows, 1, column, 50.0) == 50.0


def steady_rows(count):
    """Rows of a steady crank, with zeros elsewhere."""
    rows = np.zeros((count, COLUMNS))
    rows[:, Column.PACE] = 1.0
    return rows


def test_tally_of_a_known_step():
    p = record(Case.from_values({"joint": "big_end", "clearance_mm": 0.2}))
    rows = steady_rows(NODES.size)
    rows[:, Column.ACCELERATION] = 3.0
    rows[:, Column.NORMAL] = np.where(NODES > 0.5, 10.0, 0.0)
    rows[:, Column.PENETRATION] = NODES - 0.5
    tally = new_tally()
    tally_step(1e-4, NODES, WEIGHTS, rows, 1, APART, SIDES, True, tally, p)
    assert tally.seconds == pytest.approx(1e-4)
    assert tally.square.tolist() == [pytest.approx(9e-4), 0.0]
    assert (tally.impacts.tolist(), tally.releases.tolist()) == ([1, 0], [0, 0])
    assert tally.max_penetration[0] == pytest.approx(0.5)
    assert tally.loss_seconds.tolist() == [pytest.approx(0.25e-4), 0.0]
    assert (tally.touching[0], tally.flown[0]) == (1, 0)
    rows[:, Column.NORMAL], rows[:, Column.PENETRATION] = 0.0, -1.0
    tally_step(1e-4, NODES, WEIGHTS, rows, 1, APART, SIDES, True, tally, p)
    assert (tally.touching[0], tally.flown[0]) == (0, 1)


@pytest.mark.parametrize(
    ("penetration", "impacts", "releases"),
    [((1, -1, -1, 1, 1), 1, 0), ((1, 1, 1, 1, 1), 0, 1), ((-1, 1, 1, 1, 1), 0, 1)],
)
def test_contact_begins_after_flight_or_inside_the_penetration(penetration, impacts, releases):
    """F_N goes to 0 and comes back; a gap that lies before an earlier contact does not count."""
    p = record(Case.from_values({"joint": "big_end", "clearance_mm": 0.2}))
    nodes, weights = lobatto(5)
    rows = steady_rows(5)
    rows[:, Column.NORMAL] = [10.0, 10.0, 0.0, 10.0, 10.0]
    rows[:, Column.PENETRATION] = 1e-6 * np.array(penetration)
    tally = new_tally()
    tally_step(1e-4, nodes, weights, rows, 1, APART, SIDES, True, tally, p)
    assert (tally.impacts[0], tally.releases[0]) == (impacts, releases)
    assert not tally.flown.any()


def test_the_rod_load_is_tallied_by_its_sides():
    p, rows = record(Case.from_values({})), steady_rows(NODES.size)
    plain, tally = new_tally(), new_tally(True)
    for sides in (SIDES, np.array([0.08, 0.3, 2.0, 1.0])):
        for one in (plain, tally):
            tally_step(1e-4, NODES, WEIGHTS, rows, 1, APART, sides, True, one, p)
    assert tally.side_seconds == pytest.approx([0.58e-4, 0.5e-4])
    assert tally.side_peak.tolist() == [30.0, 8.0]
    assert not plain.side_peak.any()
    assert not plain.side_seconds.any()


MECHANISM = {"guide": {"clearance_mm": 0.1}, "drive": {"flywheel_kg_m2": 1}}


@pytest.mark.parametrize("features", [{}, {"lubricant": True}, MECHANISM])
def test_the_nodes_of_a_step_have_what_is_tallied_and_no_more(features):
    """A column that nobody writes would be read as 0, by the march alone: as nan here."""
    values = {"joint": "both", "clearance_mm": 0.2, **features}
    p, nodes = record(Case.from_values(values)), lobatto(5)
    y, rows = np.zeros(len(state_names(p))), np.full((5, COLUMNS), np.nan)
    start(np.zeros((2, 2)), y, p)
    for row in rows:
        observe_contact(ideal(0.01, p), y, 0, p, row)
    assert {*np.flatnonzero(np.isfinite(rows[0])).tolist()} == {*IN_STEPS}
    tally = new_tally(True)
    tally_step(1e-4, *nodes, rows, 1, APART, SIDES, True, tally, p)
    for field in FIELDS:
        assert np.isfinite(tally[field.name]).all(), field.name


def test_energy_ledger_of_a_known_step():
    rows = np.zeros((NODES.size, COLUMNS))
    rows[:, Column.CRANK_POWER] = 50 * NODES
    rows[:, Column.CONTACT_POWER] = 10.0
    rows[:, Column.KINETIC] = 100 + 15 * NODES
    tally, flows = new_tally(), np.zeros(4)
    tally_energy(rows[0], flows, tally)
    add_flows(rows, WEIGHTS, 1.0, flows)
    assert flows == pytest.approx([25, 0, 10, 0])
    tally_energy(rows[-1], flows, tally)
    assert tally.worst_imbalance == pytest.approx(0, abs=1e-12)
    rows[-1, Column.KINETIC] += 0.5
    tally_energy(rows[-1], flows, tally)
    assert tally.worst_imbalance == pytest.approx(0.5)
    rows[-1, Column.KINETIC] = np.nan
    tally_energy(rows[-1], flows, tally)
    assert np.isnan(tally.worst_imbalance)
