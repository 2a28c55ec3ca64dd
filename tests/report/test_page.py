"""The page's templates: they escape every text, lack nothing, and are where all markup stands."""

import ast
import fnmatch
import html
import html.parser
import re
import tomllib
from pathlib import Path

import pytest
from jinja2 import UndefinedError

from compressor.analysis.claims import Claim
from compressor.report import page
from compressor.report.diagnosis_section import DiagnosisContent
from compressor.report.machines_section import Part
from compressor.report.page import Plate, Section, document, templates
from compressor.report.paper_sections import MissingFigures
from compressor.report.provenance import Provenance
from compressor.report.second_sets import Pair, SecondSetContent
from compressor.report.study_section import StudyContent
from compressor.report.tables import Cell, Row, Table
from compressor.store.studies import StoredStudy

ROOT = Path(__file__).parents[2]
HOME = Path(page.__file__).parent
MODULES = ("page", "tables", "provenance", "paper_runs", "paper_sections", "study_section",
           "diagnosis_section", "plots", "report")  # fmt: skip
SOURCES = [*(HOME / f"{name}.py" for name in MODULES), *(HOME / "figures").glob("*.py")]
KINDS = ("word", "number", "code")


def strings(source):
    """The texts of a module, docstrings too; what an f-string puts in is a brace."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            parts = (n.value if isinstance(n, ast.Constant) else "{" for n in node.values)
            yield "".join(parts)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def markup(source):
    """The texts of a module that hold a tag or an entity."""
    return [text for text in strings(source) if re.search(r"<[/!]|<[A-Za-z{]|&#?\w+;", text)]


class Hostile:
    """Texts that would break out of an element or an attribute; `planted` has all of them."""

    def __init__(self):
        self.planted = []

    def __call__(self):
        text = f"\"'><script>alert({len(self.planted)})</script>&amp;"
        self.planted.append(text)
        return text


def plate(evil):
    return Plate("drawn", evil(), evil(), b"png", b"svg")


def table(evil):
    rows = [Row([Cell(evil(), kind) for kind in KINDS], mark) for mark in ("", "failed", "missing")]
    return Table([evil(), evil()], rows)


def contents(evil):
    """What every template is given, each text of it hostile; by the template's name."""
    claims = [Claim(n, evil(), evil(), held, [(evil(), evil())], evil())
              for n, held in enumerate((True, False, None))]  # fmt: skip
    first = Plate("drawn", evil(), "its caption stands in the first set", b"png", b"svg")
    study = StoredStudy(evil(), evil(), (), (evil(), evil()), {}, evil(), {evil(): evil()}, evil())
    return {
        "assumptions.html": None,
        "cases.html": table(evil),
        "claims.html": claims,
        "diagnosis.html": DiagnosisContent(12, table(evil), [plate(evil)]),
        "figures.html": [plate(evil), plate(evil)],
        "machines.html": [Part(evil(), [evil()], plate(evil))],
        "missing.html": MissingFigures([evil()], [evil()], evil()),
        "printed.html": table(evil),
        "provenance.html": Provenance(*(evil() for _ in range(6)), [study]),
        "second_set.html": SecondSetContent(
            evil(), evil(), [evil()], [evil()], [Pair(first, plate(evil))], claims
        ),
        "study.html": StudyContent(evil(), evil(), 3, [evil()], [evil()], 9, table(evil),
                                   [plate(evil)], evil()),
    }  # fmt: skip


def test_every_template_escapes_every_text():
    evil = Hostile()
    given = contents(evil)
    text = document([Section(evil(), evil(), name, content) for name, content in given.items()])
    assert {*templates().list_templates()} - {*given} == {"page.html", "pieces.html", "style.css"}
    assert "<script" not in text
    assert {*re.findall(r"<(\w+)", text)} <= {
        "html", "head", "meta", "title", "style", "body", "h1", "h2", "h3", "p", "nav", "ul", "li",
        "a", "section", "figure", "figcaption", "img", "strong", "div", "table", "thead", "tbody",
        "tr", "th", "td", "code", "span", "br", "small", "pre", "dl", "dt", "dd", "details",
        "summary",
    }  # fmt: skip
    shown = html.unescape(text)
    assert len(evil.planted) > 70
    assert not [one for one in evil.planted if one not in shown]


class Attributes(html.parser.HTMLParser):
    """The names of all attributes of a page."""

    def __init__(self, text):
        super().__init__()
        self.names = set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.names |= {name for name, _ in attrs}


def test_an_attribute_ends_where_its_text_ends():
    evil = "a b=c d=\"e\" f='g' \"h='"
    content = {**contents(lambda: evil), "figures.html": [Plate(evil, evil, evil, b"png", b"")]}
    text = document([Section(evil, evil, name, given) for name, given in content.items()])
    assert Attributes(text).names == {
        "alt", "aria-label", "charset", "class", "content", "href", "id", "lang", "name", "role",
        "scope", "src", "tabindex",
    }  # fmt: skip


def test_rows_are_marked_and_cells_have_their_class():
    long = "x" * 37
    rows = [Row([Cell("1", "number"), Cell(long[1:]), Cell(long), Cell(long, "code")], "failed"),
            Row([Cell("", "word"), Cell("k", "code")])]  # fmt: skip
    text = document([Section("a", "A", "cases.html", Table(["head"], rows))])
    assert re.findall("<tr.*?</tr>", text, re.DOTALL)[1:] == [
        f'<tr class="failed"><td class="number">1</td><td>{long[1:]}</td>'
        f'<td class="prose">{long}</td><td class="prose"><code>{long}</code></td></tr>',
        "<tr><td></td><td><code>k</code></td></tr>",
    ]


def test_a_verdict_has_its_class():
    claims = [Claim(n, "", "", held) for n, held in enumerate((True, False, None))]
    text = document([Section("a", "A", "claims.html", claims)])
    assert re.findall(r"<span.*?</span>", text) == [
        '<span class="held">held</span>',
        '<span class="not-held">not held</span>',
        '<span class="not-measured">not measured</span>',
    ]


def test_a_template_that_lacks_a_value_is_an_error():
    with pytest.raises(UndefinedError, match="case_file"):
        document([Section("a", "A", "study.html", object())])


def test_templates_are_installed_with_their_package():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    patterns = project["tool"]["setuptools"]["package-data"][page.__name__.rpartition(".")[0]]
    files = [f"templates/{path.name}" for path in (HOME / "templates").iterdir()]
    assert len(files) == len(templates().list_templates())
    assert not [f for f in files if not any(fnmatch.fnmatch(f, p) for p in patterns)]


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_no_markup_in_python(path):
    assert not markup(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    "planted",
    ['x = "<p>"', 'x = f"<{tag}>"', 'x = f"</{tag}>"', "x = '''\n<td class=\"a\">'''",
     'x = "a&nbsp;b"', 'x = "&#39;"', 'x = "<!DOCTYPE html>"', 'x = "</" + tag', 'f(y="<br>")'],
)  # fmt: skip
def test_markup_in_python_would_be_seen(planted):
    assert markup(planted)


@pytest.mark.parametrize("fine", ['x = "<"', 'x = "a < b"', "x = a<b", 'x = f"{a} < {b}"'])
def test_comparisons_are_no_markup(fine):
    assert not markup(fine)
