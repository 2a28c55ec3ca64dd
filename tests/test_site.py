"""The site's contents: every page of the tree is there once, and no link in it is dead.

`make docs` builds the site. This needs no Sphinx: it reads what conf.py lists, and the pages.
"""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "compressor/docs"))
import conf  # noqa: E402

CODE = re.compile(r"^ *```.*?^ *```|`[^`\n]*`", re.MULTILINE | re.DOTALL)
LINK = re.compile(
    r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(([^)\s]+)\)|<(?:img|a) [^>]*(?:src|href)=\"([^\"]+)\""
)
TRACKED = subprocess.run(
    ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md"],
    cwd=ROOT, capture_output=True, text=True, check=True,
).stdout.split()  # fmt: skip
TEXTS = {page: (ROOT / page).read_text(encoding="utf-8") for page in TRACKED}


def anchors(text):
    """The anchors of a page's headings: the second of the same name ends with -1."""
    found = []
    for head in re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), re.M):
        shown = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", head)
        found.append(re.sub(r"[^\w -]", "", shown.lower()).replace(" ", "-"))
    return {f"{one}-{n}" if (n := found[:at].count(one)) else one for at, one in enumerate(found)}


ANCHORS = {page: anchors(text) for page, text in TEXTS.items()}


def test_every_page_is_in_the_contents_once():
    listed = [page for pages in conf.CONTENTS.values() for page in pages]
    assert sorted([conf.FRONT, *listed]) == sorted(page.removesuffix(".md") for page in TRACKED)


@pytest.mark.parametrize("page", TRACKED)
def test_links_lead_to_files_and_headings_of_the_tree(page):
    dead = []
    for target in (one or other for one, other in LINK.findall(CODE.sub("", TEXTS[page]))):
        if re.match(r"\w+:", target):
            continue  # another site
        path, _, anchor = target.partition("#")
        place = (ROOT / page).parent / path if path else ROOT / page
        name = str(place.resolve().relative_to(ROOT))
        # a folder is a page on a code host alone
        if not place.is_file() or (anchor and anchor not in ANCHORS.get(name, ())):
            dead.append(target)
    assert dead == []
