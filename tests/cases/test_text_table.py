"""Tables of numbers as instruments write them: what is found, what is told, what is refused."""

import pytest

from compressor.cases.text_table import TextTableError, open_text_table

GERMAN = "Time [ms];Acc [g];Keyphasor [V]\n0,0;1,5;2\n0,1;-2;3\n0,2;2,5e0;3\n"
COLUMNS = [[0.0, 0.1, 0.2], [1.5, -2.0, 2.5], [2.0, 3.0, 3.0]]
NAMES = ("Time [ms]", "Acc [g]", "Keyphasor [V]")
ABOVE = "Analyser: PRO-4000\nSerial;12\nRate;25600\nSamples;3\n\n"
POINTS = GERMAN.replace(",", ".")


@pytest.fixture
def table(tmp_path):
    """Writes a text, and opens it."""

    def open_text(data):
        path = tmp_path / "x.csv"
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
        return open_text_table(path)

    return open_text


@pytest.mark.parametrize(
    ("data", "layout"),
    [
        (GERMAN, "separator semicolon, decimal comma, header in line 1, 3 columns"),
        (ABOVE + GERMAN, "separator semicolon, decimal comma, header in line 6, 3 columns"),
        (POINTS, "separator semicolon, decimal point, header in line 1, 3 columns"),
        (GERMAN.replace(";", "\t"), "separator tab, decimal comma, header in line 1, 3 columns"),
        (POINTS.replace(";", ","), "separator comma, decimal point, header in line 1, 3 columns"),
        (POINTS.replace(";", ", "), "separator comma, decimal point, header in line 1, 3 columns"),
        (GERMAN.replace("\n", ";\r\n"), "semicolon, decimal comma, header in line 1, 3 columns"),
        (
            GERMAN.replace("Time [ms];Acc [g];Keyphasor [V]", "Time;Acc;Keyphasor\nms;g;V"),
            "semicolon, decimal comma, header in line 2, 3 columns",
        ),
        (
            "\n".join('"' + line.replace(";", '","') + '"' for line in GERMAN.split("\n")[:-1]),
            "separator comma, decimal comma, header in line 1, 3 columns",
        ),
    ],
)
def test_what_analysers_write_is_found(data, layout, table):
    found = table(data)
    assert found.layout.endswith(layout)
    assert tuple(name.strip() for name in found.names[:3]) == NAMES
    lines, columns = found.read_columns([0, 1, 2])
    assert columns == COLUMNS
    first = found.header_line + 1
    assert lines == [first, first + 1, first + 2]


def test_latin_1_is_read_where_it_is_no_utf_8(table):
    found = table("Zeit [ms];Beschl. [m/s²]\n0;1\n1;2\n".encode("latin-1"))
    assert found.names[1] == "Beschl. [m/s²]"


def test_columns_apart_by_blanks_and_without_a_header_are_read(table):
    for text, names in (("# time acc\n0.1 0.2\n 0.3  0.4\n", ("time", "acc")),
                        ("0.1 0.2\n 0.3  0.4\n", ("1", "2"))):  # fmt: skip
        found = table(text)
        assert found.names == names
        assert found.read_columns([1, 0])[1] == [[0.2, 0.4], [0.1, 0.3]]


def test_words_beside_the_numbers_stay_words(table):
    found = table("Date;t;a\n2026-01-01 12:00:00;0,5;1,2\n2026-01-01 12:00:00;0,6;1,2\n")
    assert found.numeric == (False, True, True)
    assert found.read_columns([1])[1] == [[0.5, 0.6]]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("t,a\n0,1\n1,1_0\n2,3\n", "x.csv:3:2: a: '1_0' is no number; write numbers wi"),
        ("t,a\n0,1_0\n1,1\n2,3\n", "x.csv:2:2: a: '1_0' is no number"),  # no second header
        ("t;a\n0,0;600\n0,5;750\n1,0;1.800\n1,5;900\n", "x.csv:4:2: a: '1.800' is no number; write "
         "numbers with a decimal comma, without signs of thousands"),
        ("t,a\n0,1\n1,\n2,3\n", "x.csv:3:2: a: '' is no number"),
        ("t,a\n0,1\n1,1e999\n2,3\n", "x.csv:3:2: a: '1e999' is not finite"),
        ("t,a\n0,1\n,\n2,3\n", "x.csv:3: the cells are empty, and the table goes on below"),
        ("t,a\n0,1,0,2\n0,3,0,4\n", "x.csv:2: 4 cells below a header of 2: commas separate cel"),
        ("hello\nworld\n", "holds no rows of numbers (its first line: 'hello'; separators tr"),
        (b"\xff\xfe\x00", "is no text in UTF-16"),
        (b"abc\x01\x02", "is no text file"),
    ],
)  # fmt: skip
def test_what_is_no_table_is_refused_with_its_place(text, told, table):
    with pytest.raises(TextTableError) as found:
        table(text).read_columns([0, 1])
    assert told in str(found.value)
