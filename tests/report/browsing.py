"""A real browser without a network, for the tests of the page and for `make page`.

Debian's packages chromium and chromium-driver; from PyPI selenium, and axe-core inside
axe-playwright-python.
"""

import importlib.util
import shutil
from contextlib import contextmanager
from pathlib import Path

FLAGS = [
    *["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"],
    *["--disable-background-networking", "--disable-component-update", "--disable-sync"],
    "--force-device-scale-factor=1",
    "--host-resolver-rules=MAP * ~NOTFOUND",
]
AXE = "axe_playwright_python"


def lacking():
    """What a browser test lacks on this machine, in words; "" where all is there."""
    programs = {"chromium": "chromium", "chromedriver": "chromium-driver"}
    for program, package in programs.items():
        if not shutil.which(program):
            return f"{program} is not installed (Debian: {package})"
    return "" if importlib.util.find_spec("selenium") else "selenium is not installed (PyPI)"


def axe_script():
    """The text of axe-core; "" where it is not installed."""
    found = importlib.util.find_spec(AXE)
    (place,) = found.submodule_search_locations if found else [""]
    path = Path(place) / "axe.min.js"
    return path.read_text(encoding="utf-8") if found and path.exists() else ""


@contextmanager
def browser(profile, width=1400, height=1000, dark=False):
    """A driven chromium that can reach no host; profile: an empty folder for its files."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    for flag in [*FLAGS, f"--user-data-dir={profile}", f"--window-size={width},{height}"]:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    service = webdriver.ChromeService(shutil.which("chromedriver"))
    driver = webdriver.Chrome(options=options, service=service)
    try:
        show(driver, width, height, dark)
        yield driver
    finally:
        driver.quit()


def show(driver, width=1400, height=1000, dark=False):
    """Have the browser show a page of this size, light or dark."""
    theme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": [theme]})
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)


def wait_for(driver, script, seconds=20):
    """The value of a script as soon as it is true."""
    from selenium.webdriver.support.ui import WebDriverWait

    return WebDriverWait(driver, seconds, 0.05).until(lambda d: d.execute_script(script))


def live(driver, name):
    """Scroll to a figure and wait until it is interactive."""
    driver.execute_script(f"document.getElementById('{name}').scrollIntoView()")
    wait_for(driver, f"return document.querySelector('#{name}.live') !== null")
