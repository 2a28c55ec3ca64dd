"""The page in a real browser, opened from disk without a network (`make page` runs these, too)."""

import re

import pytest
from browsing import axe_script, browser, lacking, live, show, wait_for
from conftest import store_cases

from compressor.report.report import write_report

pytestmark = [
    pytest.mark.skipif(bool(lacking()), reason=lacking() or "a browser is there"),
    pytest.mark.slow,
]
EVIL = "<script>window.broken = 1</script><img src=x onerror='window.broken=1'>"
WORN = {"joint": ["big_end", "small_end"], "clearance_mm": [0.1, 0.2, 0.3],
        "machine": {"speed_rpm": [300, 500]}, "solve": {"accuracy": "draft"}}  # fmt: skip


@pytest.fixture(scope="module")
def page(once, paper_store):
    """The page of the paper's eleven cases."""
    return once("full-report", lambda folder: write_report(paper_store, folder, EVIL))


@pytest.fixture(scope="module")
def own(once):
    """The page of a sweep of one's own, of twelve jobs."""

    def made(folder):
        store_cases(folder, worn=WORN)
        write_report(folder / "results", folder, EVIL)

    return once("own-report", made)


@pytest.fixture(scope="module")
def started(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("profile")) as driver:
        yield driver


@pytest.fixture
def driver(started):
    """A browser that shows a wide, light page."""
    show(started)
    return started


def opened(driver, folder):
    driver.get(f"file://{folder}/index.html")
    wait_for(driver, "return document.readyState === 'complete'")


def problems(driver):
    return [entry for entry in driver.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]


def test_the_page_opens_from_disk_and_nothing_breaks(driver, page):
    opened(driver, page)
    names = driver.execute_script("return [...document.querySelectorAll('figure')].map(f => f.id)")
    for name in names:
        live(driver, name)
    assert not problems(driver)
    assert not driver.execute_script("return document.querySelectorAll('.told').length")
    assert driver.execute_script("return window.broken") is None
    outside = driver.execute_script(
        "return performance.getEntriesByType('resource').map(r => r.name)"
        ".filter(name => !name.startsWith('file:'))"
    )
    assert outside == []


def test_tables_sort(driver, own):
    opened(driver, own)
    place = "document.querySelector('#jobs-worn table')"
    column = driver.execute_script(
        f"return [...{place}.tHead.rows[0].cells].findIndex(c => /^peak acc/.test(c.textContent))"
    )
    button = driver.find_elements("css selector", "#jobs-worn th button")[column]
    cells = f"[...{place}.tBodies[0].rows].map(r => r.cells[{column}])"
    values = f"return {cells}.map(cell => Number(cell.dataset.value))"
    button.click()
    up = driver.execute_script(values)
    assert len(up) == 12
    assert up == sorted(up)
    button.click()
    assert driver.execute_script(values) == sorted(up, reverse=True)
    head = driver.find_elements("css selector", "#jobs-worn th")[column]
    assert head.get_attribute("aria-sort") == "descending"


def test_a_click_on_a_job_tells_of_it(driver, own):
    opened(driver, own)
    driver.find_element("css selector", "tr[data-job] button.job").click()
    box = driver.find_element("css selector", "#job")
    wait_for(driver, "return document.querySelector('#job figure.live') !== null")
    shown = driver.execute_script(
        "return document.querySelector('#job .plot').data.map(trace => trace.name)"
    )
    assert shown == ["acceleration", "big end", "small end"]
    key = driver.execute_script("return document.querySelector('tr[data-job]').dataset.job")
    assert key[:10] in box.text
    assert "compsim show" in box.text
    assert "speed_rpm\n300" in box.text
    box.find_element("css selector", "a").click()
    assert driver.execute_script("return document.querySelector('tr:target').dataset.job") == key


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [1400, 800, 360])
def test_no_width_needs_to_scroll_sideways(driver, page, width, dark):
    show(driver, width, 900, dark)
    opened(driver, page)
    live(driver, "figure-08")
    assert driver.execute_script("return document.documentElement.scrollWidth") <= width
    ground = driver.execute_script("return getComputedStyle(document.body).backgroundColor")
    assert (sum(map(int, re.findall(r"\d+", ground)[:3])) < 200) == dark


CUT = """
return [...document.querySelectorAll(".plot")].flatMap(plot => {
  const room = plot.getBoundingClientRect();
  const words = ".ytick text, .xtick text, .annotation-text, .ytitle, .xtitle";
  return [...plot.querySelectorAll(words)].filter(text => {
    const one = text.getBoundingClientRect();
    return one.left < room.left - 1 || one.right > room.right + 1 ||
      one.top < room.top - 1 || one.bottom > room.bottom + 1;
  }).map(text => plot.closest("figure").id + ": " + text.textContent);
});
"""
COVERED = """
return [...document.querySelectorAll(".plot")].flatMap(plot => {
  const bar = plot.querySelector(".modebar").getBoundingClientRect();
  return [...plot.querySelectorAll(".legendtext")].filter(text => {
    const one = text.getBoundingClientRect();
    return one.right > bar.left && one.left < bar.right && one.top < bar.bottom;
  }).map(text => plot.closest("figure").id + ": " + text.textContent);
});
"""


@pytest.mark.parametrize("width", [1400, 800, 360])
def test_no_word_in_a_figure_is_cut_or_covered(driver, page, own, width):
    show(driver, width, 900)
    for folder in (own, page):
        opened(driver, folder)
        names = "return [...document.querySelectorAll('figure')].map(f => f.id)"
        for name in driver.execute_script(names):
            live(driver, name)
        assert driver.execute_script("return document.querySelectorAll('.ytick').length") > 10
        assert not (cut := driver.execute_script(CUT)), "\n".join(cut)
        assert not (covered := driver.execute_script(COVERED)), "\n".join(covered)


@pytest.mark.parametrize("dark", [False, True])
def test_axe_finds_no_serious_violation(driver, page, own, dark):
    axe = axe_script()
    if not axe:
        pytest.skip("axe-core is not installed (PyPI: axe-playwright-python)")
    show(driver, dark=dark)
    for folder in (page, own):
        opened(driver, folder)
        live(driver, driver.execute_script("return document.querySelector('figure').id"))
        driver.execute_script(axe)
        found = driver.execute_async_script(
            "const done = arguments[0]; axe.run().then(r => done(r.violations))"
        )
        serious = {
            one["id"]: [node["html"][:120] for node in one["nodes"][:3]]
            for one in found
            if one["impact"] in ("serious", "critical")
        }
        assert serious == {}


def test_what_is_printed_are_the_pictures(driver, page):
    opened(driver, page)
    live(driver, "figure-08")
    shown = (
        "const seen = q => getComputedStyle(document.querySelector('#figure-08 ' + q)).display;"
        "return [seen('img'), seen('.plot')]"
    )
    assert driver.execute_script(shown)[0] == "none"
    theme = {"name": "prefers-color-scheme", "value": "dark"}
    printed = {"media": "print", "features": [theme]}
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", printed)
    assert driver.execute_script(shown) == ["block", "none"]
    paper = driver.execute_script("return getComputedStyle(document.body).backgroundColor")
    assert paper == "rgb(255, 255, 255)"  # of a dark page, too


def test_without_scripts_there_are_pictures(driver, page):
    driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        driver.get(f"file://{page}/index.html")
        sizes = [image.size["width"] for image in driver.find_elements("css selector", "img")]
    finally:
        driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    assert len(sizes) >= 13
    assert min(sizes) > 500
