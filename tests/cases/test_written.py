"""Cases as text (see also `test_load`)."""

from compressor.cases.case import Case, to_yaml


def test_what_is_written_stays_readable():
    assert to_yaml(Case()).startswith("name: case\nload: spring\njoint: none\nmachine:\n")
