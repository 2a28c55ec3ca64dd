"""What is said of judged machines is what their numbers are."""

import numpy as np
import pytest
import xarray as xr

from compressor.studies.claims.findings import (
    consistency,
    count_claims,
    flips,
    is_mass_plane,
    most_consistent,
    rank_assumptions,
    summary,
)

ROD, RECIPROCATING = "rod_mass_kg", "reciprocating_mass_kg"


@pytest.fixture
def plane():
    """Claim 8 holds from a rod mass of 4 kg on, by 0.1 a kg; all others hold, but 7 nowhere."""
    rods, masses = np.arange(2.0, 8.0), np.arange(10.0, 14.0)
    margin = np.full((rods.size, masses.size, 8), 0.5)
    margin[..., 7] = 0.1 * (rods[:, None] - 4.0)
    margin[..., 6] = -0.12
    shares = np.tile([0.1, 0.1, -0.12, -0.3], (rods.size, masses.size, 1))
    dims = (ROD, RECIPROCATING)
    return xr.Dataset(
        {
            "margin": ((*dims, "claim"), margin),
            "error": ((*dims, "claim"), np.full(margin.shape, 1e-6)),
            "held": ((*dims, "claim"), (margin >= 0.0).astype(np.int8)),
            "status": (dims, np.full((rods.size, masses.size), "ok", object)),
            "share_margin": ((*dims, "share"), shares),
        },
        {
            ROD: (ROD, rods, {"case_key": "machine.rod_mass_kg", "units": "kg"}),
            RECIPROCATING: (
                RECIPROCATING, masses, {"case_key": "machine.reciprocating_mass_kg", "units": "kg"}
            ),
            "claim": np.arange(1, 9),
            "share": ["apart", "hit", "energy_angle", "active"],
        },
    )  # fmt: skip


def test_machines_are_counted(plane):
    assert is_mass_plane(plane)
    assert count_claims(plane) == (24, {1: 24, 2: 24, 3: 24, 4: 24, 5: 24, 6: 24, 7: 0, 8: 16}, 0)
    said = [*summary(plane)]
    assert said[0].startswith("Of 24 machines each claim holds in so many: 1 in 24, 2 in 24")
    assert said[1] == "All eight claims hold in none of them."
    assert said[2] == (
        "All but claim 7 hold in 16, with rod mass from 4 to 7 kg, reciprocating mass from 10 to "
        "13 kg."
    )
    assert "the nearest one lacks 12 % of the revolution" in said[3]
    assert "flight and impact in 24, " in said[4]
    assert said[4].endswith("the time in vibration in 0.")


def test_a_failed_machine_is_no_verdict(plane):
    plane["status"][0, 0] = "failed"
    plane["margin"][0, 0] = np.nan
    plane["held"][0, 0] = -1
    assert count_claims(plane)[0] == 23
    _, said, *_ = summary(plane)
    assert "1 machine has no verdict" in said


def test_neighbours_that_differ_are_counted(plane):
    """Along the rod mass four pairs change sides, at a margin of 0, which is within the error."""
    found = flips(plane, 8)
    assert (found.pairs, found.flips, found.within) == (5 * 4 + 6 * 3, 4, 4)
    plane["margin"][..., 7] += 0.05
    found = flips(plane, 8)
    assert (found.flips, found.within) == (4, 0)
    assert found.jump == pytest.approx(0.1)
    assert flips(plane, 3).flips == 0


def test_the_most_consistent_machine_has_consistent_neighbours(plane):
    """Claim 8 grows with the rod's mass; a single machine with a greater margin is not taken."""
    plane["margin"][..., 2] = 0.3 - 0.02 * np.abs(plane[RECIPROCATING].values - 11.0)
    plane["margin"][1, 1, 7] = 9.0
    best = most_consistent(plane)
    assert (best.rod_mass, best.reciprocating_mass) == (6.0, 11.0)
    assert best.claims == (3, 4, 5, 6, 8)
    assert best.least == pytest.approx(0.1)
    assert consistency(plane) == (
        "The most consistent machine has rod mass 6 kg and reciprocating mass 11 kg: there and at "
        "all neighbours claims 3, 4, 5, 6, 8 hold by 10 % or more."
    )
    plane["margin"][..., 2] = -0.2
    plane["margin"][0, 0, 2] = 0.1
    plane["held"][0, 0, 2] = 1
    assert consistency(plane).startswith("Nowhere claims 3, 4, 5, 6, 8 hold at a machine and all")


def test_who_decides_is_said_with_rivals():
    names = [ROD, "static", "damping_N_s_per_mm"]
    values = np.array([[0.6, 0.5, 0.1], [np.nan] * 3])
    table = xr.Dataset(
        {
            "total_order": (("claim", "assumption"), values),
            "total_order_low": (("claim", "assumption"), values - 0.15),
            "total_order_high": (("claim", "assumption"), values + 0.15),
        },
        {"claim": [4, 1], "assumption": names},
    )
    assert [*rank_assumptions(table)] == [
        "Claim 4: most by rod mass, 0.60 [0.45, 0.75]; not distinguishable from static friction.",
        "Claim 1: its margin is the same at all machines.",
    ]
