"""Times that are told follow from known pieces of work, timed here by clocks that are given."""

import threading

import pytest

from compressor.sweep import speed, warm_up


class Clock:
    """A clock that goes on by so many seconds with each piece of work."""

    def __init__(self, seconds):
        self.seconds, self.now, self.lock = seconds, 0.0, threading.Lock()

    def __call__(self):
        return self.now

    def work(self):
        with self.lock:
            self.now += self.seconds


def test_slowness_is_the_wall_time_of_a_known_piece():
    clock = Clock(3.0 * speed.REFERENCE_SECONDS)
    assert speed.slowness(clock.work, clock) == pytest.approx(3.0)


@pytest.mark.parametrize("workers", [1, 2, 50])
def test_workers_that_share_one_half_of_a_core_are_worth_that(workers):
    """A piece takes 1 ms of processor time, and 2 ms pass before the next one is done."""
    wall, own = Clock(0.002), Clock(0.001)

    def piece():
        wall.work()
        own.work()

    assert speed.cores_at_work(workers, piece, wall, own) == pytest.approx(0.5)


def test_compiling_is_told_by_how_slow_this_machine_is(tmp_path, monkeypatch):
    monkeypatch.setattr(warm_up, "machine_code_folder", lambda: tmp_path)
    needs, told = warm_up.Needs(("auto", "Radau"), plain=True, laws=True), []
    for slow in (1.0, 3.0):
        monkeypatch.setattr(warm_up, "slowness", lambda slow=slow: slow)
        told.append(warm_up.compile_seconds(needs))
    assert told[1] == 3 * told[0] > 100


def test_a_set_switch_against_compiling_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(warm_up, "machine_code_folder", lambda: tmp_path)
    warm_up.marker("auto").touch()
    told = []
    for value in ("0", "1"):
        monkeypatch.setenv("NUMBA_DISABLE_JIT", value)
        warm_up.compile_once(warm_up.Needs(("auto",), plain=True), told.append)
    (text,) = told
    assert text.startswith("NUMBA_DISABLE_JIT is set: nothing is compiled")
