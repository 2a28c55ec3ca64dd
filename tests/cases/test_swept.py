"""The grammar of sweeps: how values are made, joined and left out, and what is refused."""

import os
import tracemalloc

import numpy as np
import pytest
from conftest import refused
from hypothesis import given
from hypothesis import strategies as st

from compressor.cases import load
from compressor.cases.checks import value_of
from compressor.cases.study import Block, points
from compressor.cases.swept import design, design_size, sweep_of

ONE = "joint: big_end\n"


def rows(study):
    """The swept values of each job, in the order of the axes, which are those of its case."""
    found = [*points(study)]
    for point, case in zip(found, study.cases, strict=True):
        assert point == {key: value_of(case, key) for key in point}
    return [tuple(point.values()) for point in found]


# ---- one axis -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("axis", "values"),
    [
        ("{linspace: [0.1, 0.3, 5]}", (0.1, 0.15, 0.2, 0.25, 0.3)),
        ("{linspace: [0.3, 0.1, 3]}", (0.3, 0.2, 0.1)),
        ("{logspace: [0.001, 10, 5]}", (0.001, 0.01, 0.1, 1.0, 10.0)),
        ("{range: [0.1, 0.5, 0.1]}", (0.1, 0.2, 0.3, 0.4, 0.5)),
        ("{range: [0.1, 0.55, 0.1]}", (0.1, 0.2, 0.3, 0.4, 0.5)),
        ("{range: [0.5, 0.1, -0.2]}", (0.5, 0.3, 0.1)),
        ("{range: [1, 1, 5]}", (1.0,)),
    ],
)
def test_made_values_are_those_that_one_would_write(read, axis, values):
    study = read(ONE + f"clearance_mm: {axis}\n")
    assert [(a.key, a.values) for a in study.axes] == [("clearance_mm", values)]
    assert study.is_grid
    written = read(ONE + f"clearance_mm: {list(values)}\n")
    assert [c.key for c in study.cases] == [c.key for c in written.cases]


def test_whole_numbers_stay_whole(read):
    (message,) = refused(read, "solve: {max_steps: {linspace: [10, 20, 1000]}}")
    assert "needs a whole number in [1, 1e+12], not 10.01" in message
    assert rows(read("solve: {max_steps: {range: [10, 30, 10]}}")) == [(10,), (20,), (30,)]


@given(st.decimals(-500, 500, places=3), st.decimals("0.001", 5, places=3), st.integers(1, 60))
def test_a_range_is_that_of_decimal_numbers(first, step, count):
    last = first + (count - 1) * step
    sweep = sweep_of(("x",), {"range": [float(first), float(last), float(step)]})
    assert sweep.count == count
    assert sweep.make() == [float(first + i * step) for i in range(count)]


# ---- too many -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "where", "count"),
    [
        ("machine: {speed_rpm: {linspace: [1, 2, 1e15]}}", "1:22: machine.speed_rpm: ", 10**15),
        ("machine: {speed_rpm: {range: [1, 1e5, 1e-9]}}", "1:22: machine.speed_rpm: ",
         99_999 * 10**9 + 1),
        (ONE + "clearance_mm: {logspace: [1, 2, 101]}\nmachine: {speed_rpm: "
         "{linspace: [1, 2, 100]}}", "2:15: clearance_mm: ", 10_100),
        (ONE + "clearance_mm: {sobol: [1, 2]}\nsample: {n: 1000000000000}", "2:15: clearance_mm: ",
         10**12),
        ("load: [none, spring]\nblocks: [{joint: none}, {machine: {speed_rpm: "
         "{range: [1, 10000, 1]}}}]", "2:47: machine.speed_rpm: ", 20_002),
    ],
)  # fmt: skip
def test_a_bomb_is_counted_not_made(read, text, where, count):
    tracemalloc.start()
    (message,) = refused(read, text)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert message.startswith(f"case.yaml:{where}{count} jobs are more than 10000: ask for")
    assert peak < 4e6


# ---- together -----------------------------------------------------------------------------------


def test_zipped_keys_advance_together(read):
    study = read(ONE + "load: [none, spring]\nclearance_mm: [0.1, 0.2, 0.1]\n"
                 "machine: {speed_rpm: {range: [300, 500, 100]}}\n"
                 "zip: [[machine.speed_rpm, clearance_mm]]\n")  # fmt: skip
    assert [axis.key for axis in study.axes] == ["load", "clearance_mm", "machine.speed_rpm"]
    pairs = [(0.1, 300.0), (0.2, 400.0), (0.1, 500.0)]
    assert rows(study) == [(load, *pair) for load in ("none", "spring") for pair in pairs]
    assert (study.is_grid, study.is_curve) == (False, False)
    file = "load: [none, spring]\nclearance_mm: [0.1, 0.2]\nzip: [[load, clearance_mm]]\n"
    assert read(ONE + file).is_curve


SAMPLED = """\
joint: big_end
clearance_mm: {%s: [0.01, 1], log: true}
machine: {speed_rpm: {%s: [300, 900]}}
load: [none, spring]
sample: {n: 8, seed: 5}
"""


@pytest.mark.parametrize("kind", ["random", "lhs", "sobol"])
def test_a_design_draws_its_keys_together(read, kind):
    study = read(SAMPLED % (kind, kind))
    drawn = design(kind, 8, 2, 5)
    found = rows(study)
    assert len(found) == 16
    for point, (clearance, speed, _) in zip(drawn, found[::2], strict=True):
        assert clearance == pytest.approx(0.01 * 100 ** point[0], rel=1e-11)
        assert speed == pytest.approx(300 + 600 * point[1], rel=1e-11)
    assert found[::2] == [(c, s, "none") for c, s, _ in found[1::2]]
    assert rows(read(SAMPLED % (kind, kind))) == found
    assert rows(read(SAMPLED % (kind, kind), overrides=["sample.seed=6"])) != found


def test_of_what_is_drawn_some_may_be_excluded(read):
    every, slow = (rows(read(SAMPLED % ("lhs", "lhs") + more))
                   for more in ("", "exclude: machine.speed_rpm > 700"))  # fmt: skip
    assert slow == [row for row in every if row[1] <= 700]
    assert rows(read(SAMPLED % ("lhs", "lhs") + "exclude: machine.speed_rpm > 899.99")) == every


@pytest.mark.parametrize("kind", ["random", "lhs", "sobol"])
def test_whole_numbers_are_drawn_as_such(read, kind):
    text = f"{ONE}clearance_mm: 0.2\nbody: true\nsensor: {{seed: {{{kind}: [1, 900]}}}}\n"
    study = read(text + "solve: {duration_rev: 4, settle_rev: 1}\nsample: {n: 8, seed: 5}\n")
    drawn = [round(1 + 899 * share) for (share,) in design(kind, 8, 1, 5)]
    assert [case.sensor.seed for case in study.cases] == drawn
    assert len({*drawn}) > 4
    assert all(isinstance(case.sensor.seed, int) for case in study.cases)


def test_saltelli_exchanges_one_key_after_another(read):
    """Eight points A, eight B, then A with the first key of B, then A with the second one."""
    found = np.array([row[:2] for row in rows(read(SAMPLED % ("saltelli", "saltelli")))[::2]])
    a, b, first, second = found.reshape(4, 8, 2)
    assert (a != b).all()
    assert (first == np.stack([b[:, 0], a[:, 1]], axis=1)).all()
    assert (second == np.stack([a[:, 0], b[:, 1]], axis=1)).all()
    assert design_size("saltelli", 8, 2) == 32 == len(design("saltelli", 8, 2, 1))


# ---- left out, and put together -----------------------------------------------------------------


def test_what_does_not_fit_may_be_excluded(read):
    text = "machine: {crank_radius_mm: [100, 700], rod_length_mm: [600, 800]}\nload: none\n"
    assert len(refused(read, text)) == 1
    study = read(text + "exclude: machine.crank_radius_mm == 700 and machine.rod_length_mm < 700\n")
    assert len(study.cases) == 3


OWN = "load: gas\nmachine: {rod_mass_kg: [4, 6]}\ngas: {discharge_MPa: [0.393, 0.5]}\n"
LOADS = ONE + "clearance_mm: {big_end: 0.2}\nload: [none, spring]\n"


@pytest.mark.parametrize(
    ("text", "condition", "jobs"),
    [
        (OWN, "machine.rod_inertia_kg_m2 > 0.15", [2, 3]),
        (ONE + "clearance_mm: [0.16666666666666666, 0.3]\n", "clearance_mm == 0.166667", [0]),
        (OWN, "machine.rod_centre_mm == 300 and machine.rod_mass_kg < 5", [0, 1]),
        (OWN, "machine.rod_inertia_kg_m2 == 0.12 and gas.switching == exact", [0, 1]),
        (OWN, "gas.switching == exact", [0, 1, 2, 3]),
        (ONE + "clearance_mm: [0.1, 0.2]\nwear: true\n", "wear.limit_mm < 0.3", [0]),
        (ONE + "clearance_mm: [0.1, 0.2]\n", "machine.pin_radius_mm == 10", [0, 1]),
        (ONE + "clearance_mm: [0.1, 0.2]\n", "wear.limit_mm < 0.3 or solve.rtol > 0", []),
        (LOADS, "clearance_mm == 0.2 and load == none", [0]),
        (LOADS, "machine.speed_rpm == 500 and load == none", [0]),
        (LOADS, "clearance_mm.small_end > 0", []),
        (LOADS, "lubricant.viscosity_mPa_s > 20", []),  # which a dry joint has not
    ],
)  # fmt: skip
def test_a_comparison_sees_what_a_case_fills_in(read, text, condition, jobs):
    """And what is not swept: selected are the very jobs that are left out by the same text."""
    every = read(text)
    keys = [every.keys[number] for number in range(every.jobs) if number not in jobs]
    if jobs:
        assert [*read(text, only=condition).selected] == jobs
    else:
        assert "selects no job" in refused(read, text, only=condition)[0]
    without = f"{text}exclude: {condition}\n"
    if keys and jobs:
        assert [*read(without).keys] == keys
    else:
        assert ("leaves no job" if jobs else "leaves out no job") in refused(read, without)[0]


def test_a_block_without_a_cylinder_of_its_own_has_the_corners_of_the_paper(read):
    text = "load: gas\nblocks: [{}, {gas: {unloaded: head}}]\n"
    assert [*read(text, only="gas.switching == paper").selected] == [0]
    with_a_cylinder = "gas.switching == exact and gas.valve_loss_percent == 0"
    assert [*read(text, only=with_a_cylinder).selected] == [1]


def test_what_has_no_case_is_not_left_out_by_what_a_case_would_fill_in(read):
    text = "machine: {crank_radius_mm: [100, 700]}\nload: none\n"
    (message,) = refused(read, text + "exclude: machine.rod_inertia_kg_m2 > 1\n")
    assert "must be shorter than the rod" in message


def test_a_misspelt_key_of_a_later_block_is_told(read):
    text = ONE + "clearance_mm: 0.1\nblocks: [{}, {machine: {rod_mas_kg: [1, 2]}}]\n"
    assert "did you mean machine.rod_mass_kg?" in refused(read, text)[0]


def test_blocks_stand_one_after_the_other(read):
    study = read("""\
load: none
blocks:
  - {joint: big_end, clearance_mm: [0.1, 0.2]}
  - {joint: both, clearance_mm: {big_end: 0.1, small_end: 0.3}, friction: false}
  - {load: [spring, gas]}
""")
    assert [axis.key for axis in study.axes] == [
        "clearance_mm", "load", "joint", "clearance_mm.big_end", "clearance_mm.small_end",
        "friction",
    ]  # fmt: skip
    assert rows(study) == [
        (0.1, "none", "big_end", 0.1, 0.0, True),
        (0.2, "none", "big_end", 0.2, 0.0, True),
        ("none", "both", 0.1, 0.3, False),
        ("spring", "none", 0.0, 0.0, True),
        ("gas", "none", 0.0, 0.0, True),
    ]
    assert [case.friction is None for case in study.cases] == [False, False, True, False, False]


OWN_VALUES = {"machine.counterweight_kg_mm": (0, 500, 0), "clearance_mm": (0.1, 0.1, 0.2)}


@pytest.mark.parametrize(
    ("text", "axes"),
    [
        # also of 0, which a case writes as no counterweight
        ("clearance_mm: [0.1, 0.2]\nmachine: {counterweight_kg_mm: [0, 500]}\n"
         "exclude: clearance_mm == 0.2 and machine.counterweight_kg_mm == 500\n", OWN_VALUES),
        ("machine: {counterweight_kg_mm: [0, 500, 0]}\nclearance_mm: [0.1, 0.1, 0.2]\n"
         "zip: [[clearance_mm, machine.counterweight_kg_mm]]\n", OWN_VALUES),
        ("blocks: [{machine: {counterweight_kg_mm: [0, 500]}, clearance_mm: 0.1}, "
         "{machine: {counterweight_kg_mm: 0}, clearance_mm: 0.2}]\n", OWN_VALUES),
        # words that a case writes as none
        ("clearance_mm: 0.2\nfriction: {law: [adams, lugre], ideal_joints: [false, true]}\n"
         "exclude: friction.law == lugre and friction.ideal_joints == true",
         {"friction.law": ("adams", "adams", "lugre"),
          "friction.ideal_joints": (False, True, False)}),
        # the law of a job reads no coefficient of restitution, another one does
        ("clearance_mm: 0.2\ncontact: {law: [hertz, flores], restitution: [0.5, 0.9], "
         "materials: [steel, steel], geometry: [external, internal]}\n"
         "exclude: contact.law == hertz and contact.restitution == 0.9",
         {"contact.restitution": (None, None, 0.5, 0.5, 0.9, 0.9),
          "contact.geometry": ("external", "internal") * 3}),
    ],
)  # fmt: skip
def test_an_axis_of_no_grid_has_the_values_that_the_file_gives_and_a_job_has(read, text, axes):
    found = {axis.key: axis.values for axis in read(ONE + text).axes}
    assert {key: found[key] for key in axes} == axes


def test_a_block_takes_the_place_of_the_files_keys_and_an_override_of_both(read):
    text = ONE + "clearance_mm: [0.1, 0.2]\nblocks: [{clearance_mm: 0.3}, {load: none}]\n"
    assert rows(read(text)) == [(0.3, "spring"), (0.1, "none"), (0.2, "none")]
    assert rows(read(text, overrides=["load=gas"])) == [(0.3,), (0.1,), (0.2,)]
    assert rows(read(text, overrides=["blocks=[{load: none}]"])) == [(0.1,), (0.2,)]
    assert rows(read(text, overrides=["clearance_mm=0.4"])) == [("spring",), ("none",)]


# ---- selected -----------------------------------------------------------------------------------


def test_only_some_jobs_are_selected_and_all_are_in_the_study(read):
    study = read(LOADS, only="load == none")
    assert (len(study.cases), [*study.selected]) == (2, [0])
    assert [*read(LOADS).selected] == [0, 1]
    assert refused(read, "laod: none", only="clearance > 1") == [
        "--only clearance > 1: unknown key 'clearance'; did you mean clearance_mm?"
    ]


def test_a_sample_that_samples_nothing_is_refused_whatever_else_is_set(read):
    """Without anything set: mistakes.json."""
    plain = "joint: both\nclearance_mm: 0.1\nsample: {n: 4}"
    assert "samples nothing" in refused(read, plain, "machine.speed_rpm=300")[0]
    drawn = "joint: both\nclearance_mm: {random: [0.1, 0.2]}\nsample: {n: 4}"
    assert read(drawn, "clearance_mm=0.1").jobs == 1


def test_of_many_cases_a_copy_of_the_process_checks_half(read, two_cores, monkeypatch, tmp_path):
    text, told, build = SAMPLED % ("lhs", "lhs"), [], Block.case

    def ask():
        study = read(text, only="machine.speed_rpm > 500", progress=lambda *at: told.append(at))
        wrong = refused(read, text, "spring.stroke_mm=[100, 300]", "clearance_mm=20")
        return study.keys, study.axes, study.selected, wrong

    alone = ask()
    monkeypatch.setattr(load, "MANY_CASES", 16)
    counted = lambda *at: (tmp_path / f"{os.getpid()}.pid").touch() or build(*at)  # noqa: E731
    monkeypatch.setattr(Block, "case", counted)
    assert ask() == alone
    assert told == [(0, 16, "case: 16 jobs"), (0, 16, ""), (16, 16, "")]
    assert len([*tmp_path.glob("*.pid")]) == 3  # one copy for each time that cases were read
