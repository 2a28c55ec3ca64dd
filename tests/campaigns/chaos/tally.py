"""What every campaign counts and gives back."""

import time
from collections import Counter
from typing import Any


class Tally:
    """What a campaign counts: trials, and short texts of those that failed."""

    def __init__(self, what: str, seed: int, names: tuple[str, ...] = ()):
        self.what, self.seed, self.began = what, seed, time.monotonic()
        self.trials = 0
        self.counts = Counter(dict.fromkeys(names, 0))
        self.failures: list[str] = []

    def fail(self, trial: str, problem: str) -> None:
        """Note a failure of a trial, with what repeats it."""
        self.failures.append(f"seed {self.seed}, {trial}: {problem[-1500:]}")

    def result(self) -> dict[str, Any]:
        """The campaign's result; a trial that failed in two ways counts once."""
        failed = len({text.partition(": ")[0] for text in self.failures})
        return {
            "what": self.what,
            "trials": self.trials,
            "failed": failed,
            "counts": dict(self.counts),
            "seconds": round(time.monotonic() - self.began, 1),
            "failures": self.failures,
        }
