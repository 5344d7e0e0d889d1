"""A headless browser, and the pages that it shall look at."""

import os
import shutil
from pathlib import Path

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.support.ui import WebDriverWait


def pages():
    """The pages named in FLEXURE_REPORTS, separated by the system's path separator."""
    named = os.environ.get("FLEXURE_REPORTS", "")
    return [Path(name).resolve() for name in named.split(os.pathsep) if name]


def program(variable, *names):
    """The program that the environment variable names, or the first of the names on the path."""
    found = os.environ.get(variable) or next(filter(None, map(shutil.which, names)), None)
    if not found:
        pytest.fail(f"{names[0]} is not installed, and {variable} does not name it")
    return found


def pytest_generate_tests(metafunc):
    if "page" in metafunc.fixturenames:
        found = pages()
        if not found:
            pytest.fail("name the pages to test in FLEXURE_REPORTS, or as arguments of test_report.py")
        metafunc.parametrize("page", found, ids=[path.stem for path in found], scope="session")


@pytest.fixture(scope="session")
def browser():
    options = webdriver.ChromeOptions()
    options.binary_location = program("CHROMIUM", "chromium", "chromium-browser", "google-chrome")
    # Inside a container Chromium can neither have its sandbox nor a large shared memory.
    for argument in ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--hide-scrollbars"]:
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(program("CHROMEDRIVER", "chromedriver")))
    yield driver
    driver.quit()


class Report:
    """A page in the browser."""

    def __init__(self, driver, path):
        self.driver = driver
        self.path = path

    def open(self, width=1280, height=900, dark=False):
        """Loads the page afresh at the given size and colour scheme."""
        driver = self.driver
        driver.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600},
        )
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [scheme]})
        driver.get_log("browser")
        driver.get_log("performance")
        driver.get(self.path.as_uri())
        self.wait("document.documentElement.dataset.ready === 'true'", "the page's script never finished")
        self.settle()
        return self

    def js(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def settle(self):
        """Waits until what has been asked for is drawn: two frames."""
        self.driver.execute_async_script(
            "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => done()))"
        )

    def wait(self, condition, complaint, seconds=15):
        waiting = WebDriverWait(self.driver, seconds, poll_frequency=0.05)
        waiting.until(lambda driver: driver.execute_script(f"return {condition}"), complaint)

    def window(self, plot):
        """The part of the abscissa that a plot shows."""
        read = "const d = document.getElementById(arguments[0]).dataset; return [Number(d.xMin), Number(d.xMax)]"
        return self.js(read, plot)

    def has(self, selector):
        return self.js("return document.querySelector(arguments[0]) !== null", selector)

    def click(self, selector):
        self.js("document.querySelector(arguments[0]).scrollIntoView({block: 'center', behavior: 'instant'})", selector)
        self.driver.find_element("css selector", selector).click()
        self.settle()


@pytest.fixture
def report(browser, page):
    return Report(browser, page).open()


@pytest.fixture
def app(browser, tmp_path):
    from app_page import App

    started = []

    def start(*options):
        started.append(App(browser, tmp_path / "project", *options))
        return started[-1]

    yield start
    for one in started:
        one.process.terminate()
        one.process.wait(10)
