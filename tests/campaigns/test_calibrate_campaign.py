"""The kept measurement of fitted machines."""

import page_tables

KEPT = page_tables.kept("calibrate.json")


def test_intervals_hold_where_the_model_is_right():
    """As often as 95 % intervals allow; beside it, machines with friction, which hardly matters."""
    for other, most in (("nothing", 0.1), ("pins that rub", 0.25)):
        row = KEPT["others"][other]
        inside = sum(one["inside"] for one in row["keys"].values())
        assert inside >= 0.9 * row["machines"] * len(row["keys"])
        assert row["said_not_to_fit"] <= most * row["machines"]


def test_the_words_about_fitted_machines_follow_from_the_table():
    page = (page_tables.ROOT / "tests/results/calibrate.md").read_text(encoding="utf-8")
    words = " ".join(page.split())
    right, gas = KEPT["others"]["nothing"], KEPT["others"]["a gas with exponent 1.25"]
    keys = {key: one for key, one in right["keys"].items() if key != "body.damping_ratio"}
    inside, machines = sum(one["inside"] for one in keys.values()), right["machines"]
    assert f"in {inside} of {len(keys) * machines} cases, of four keys of {machines}" in words
    assert right["keys"]["body.damping_ratio"]["width"] > 0.98
    counts = [gas["keys"][key]["inside"] for key in keys]
    assert f"contain it in {min(counts)} to {max(counts)} of {gas['machines']}" in words
    assert f"reported for {gas['said_not_to_fit']} of {gas['machines']} machines" in words
    for key in ("machine.rod_mass_kg", "body.frequency_y_Hz"):
        assert abs(right["keys"][key]["width"] - 0.75) < 0.03
