"""The error of case files that cannot be read."""

from collections.abc import Sequence

from compressor.cases.yaml_reader import FileProblem
from compressor.program import CompsimError


class CaseFileError(CompsimError, ValueError):
    """Case files that cannot be read; raised by `load_cases`. Also a ValueError.

    `problems` lists everything wrong in all files, each with its `place` (file, line, column), its
    dotted `key` and a `message`. The error's text has a line for each:

    >>> import compressor
    >>> with open("typo.yaml", "w") as file:
    ...     print("joint: top\\nclearance: 0.2", file=file)
    >>> try:
    ...     compressor.load_cases("typo.yaml")
    ... except compressor.CaseFileError as error:
    ...     print(error)
    typo.yaml:1:8: joint: needs none, big_end, small_end or both, not 'top'
    typo.yaml:2:1: clearance: unknown key; did you mean clearance_mm?
    """

    exit_code = 2
    prefix = ""  # each line begins with the file that it is about

    def __init__(self, problems: Sequence[FileProblem]):
        self.problems = sorted(set(problems))
        super().__init__(self.problems)

    def __str__(self) -> str:
        return "\n".join(map(str, self.problems))
