"""The page's templates: they escape every text, lack nothing, and are where all markup stands."""

import html
import html.parser
import json
import re

from jinja2 import PackageLoader

from compressor.analysis.claims import Claim
from compressor.analysis.margins import Margin
from compressor.cases.case import Case
from compressor.report.answer import FirstScreen, MetricChange, StudyLine
from compressor.report.figures.drawing import make_grid
from compressor.report.figures.table import DrawnFigure
from compressor.report.page import (
    Cell,
    JobFacts,
    JobsToOpen,
    PageTable,
    Section,
    SectionContent,
    StudyNote,
    TableRow,
    document,
)
from compressor.report.side_by_side import HealthyAndWorn
from compressor.report.study_section import StudyContent
from compressor.store.studies import StoredStudy

KINDS = ("word", "number", "code")
PROVENANCE = ("program", "libraries", "platform", "results", "command", "written")


class Hostile:
    """Texts that would break out of an element or an attribute; `planted` has all of them."""

    def __init__(self):
        self.planted = []

    def __call__(self):
        text = f"\"'><script>alert({len(self.planted)})</script>&amp;"
        self.planted.append(text)
        return text


def drawn(evil):
    drawing, _ = make_grid(1, 1, 1.0)
    return DrawnFigure(drawing.figure(), evil(), name="drawn", title=evil())


def table(evil):
    marks = ("", "failed", "missing")
    rows = [TableRow([Cell(evil(), kind, 1.0) for kind in KINDS], mark, evil()) for mark in marks]
    return PageTable([evil() for _ in KINDS], rows)


def contents(evil):
    """What every template is given, each text of it hostile; by the template's name."""
    margins = ([Margin(0.1, 0.0)], [Margin(-0.1, 0.0)], [])
    claims = [Claim(n, evil(), evil(), [(evil(), evil())], evil(), found)
              for n, found in enumerate(margins)]  # fmt: skip
    found = MetricChange(*(evil() for _ in range(6)), 1.0)
    answer = FirstScreen(
        [StudyLine(evil(), evil(), evil(), bad) for bad in (True, False)],
        [(evil(), [found]), (evil(), [found])],
        claims,
        [evil()],
    )
    study = StoredStudy(evil(), evil(), (), ("k",), {}, evil(), {evil(): evil()}, evil(),
                        title=evil(), notes=evil(), overrides=(evil(),))  # fmt: skip
    return {
        "answer.html": answer,
        "assumptions.html": {"claims": True, "machine": Case().machine},
        "claims.html": claims,
        "provenance.html": {**{name: evil() for name in PROVENANCE}, "studies": [study]},
        "section.html": SectionContent(table(evil), [evil()], [evil()],
                                       [drawn(evil) for _ in range(4)]),
        "study.html": StudyContent(study, evil(), [evil()], [evil()], [evil()], [drawn(evil)],
                                   evil(), [StudyNote(evil(), evil(), evil())],
                                   HealthyAndWorn(evil(), table(evil)),
                                   [(evil(), [(evil(), evil())])]),
    }  # fmt: skip


def test_every_template_escapes_every_text():
    evil = Hostile()
    given = contents(evil)
    words = "</script><script>alert(1)</script>"
    jobs = JobsToOpen(words, [JobFacts([words], {"key": [words]})], ["key"])
    sections = [Section(evil(), evil(), content, name) for name, content in given.items()]
    text = document(sections, jobs, title=evil())
    own = {"page.html", "pieces.html", "style.css", "report.js"}
    assert {*PackageLoader("compressor.report").list_templates()} - {*given} == own
    scripts = re.findall("<script(.*?)>(.*?)</script>", text, re.DOTALL)
    assert [kind for kind, _ in scripts] == ["", ' type="application/json" id="jobs"']
    assert json.loads(scripts[1][1]) == {
        "results": words, "studies": [{"names": [words], "jobs": {"key": [words]}}],
        "series": ["key"],
    }  # fmt: skip
    text = re.sub("<script.*?</script>", "", text, flags=re.DOTALL)
    assert "<script" not in text
    assert {*re.findall(r"<(\w+)", text)} <= {
        "html", "head", "meta", "title", "style", "body", "h1", "h2", "h3", "p", "nav", "ul", "li",
        "a", "section", "figure", "figcaption", "img", "strong", "div", "table", "thead", "tbody",
        "tr", "th", "td", "code", "span", "br", "small", "dl", "dt", "dd", "header",
        "main", "button", "dialog",
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
    named = drawn(lambda: evil)._replace(name=evil)
    content = {**contents(lambda: evil), "section.html": SectionContent(figures=[named])}
    text = document([Section(evil, evil, given, name) for name, given in content.items()])
    assert Attributes(text).names == {
        "alt", "aria-label", "charset", "class", "content", "href", "id", "lang", "name", "role",
        "scope", "src", "tabindex", "data-job", "data-title",
        "data-value", "decoding", "download", "height", "hidden", "type", "width",
    }  # fmt: skip
