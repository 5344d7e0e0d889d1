"""Makes docs/app.png: the app in headless Chromium after an identification.

    FLEXURE_BINARY=target/release/flexure python docs/examples/app.py [desktop|dark|phone] [FILE]

Needs the packages of tests/browser/requirements.txt and NumPy, and Chromium with its driver.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from selenium import webdriver
from selenium.webdriver.chrome.service import Service

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/browser"), str(ROOT / "docs/examples")]

import systems
from conftest import program
from test_app import App

SIZES = {"desktop": (1200, False), "dark": (1200, True), "phone": (390, False)}


def main(kind="desktop", file=ROOT / "docs/app.png"):
    width, dark = SIZES[kind]
    options = webdriver.ChromeOptions()
    options.binary_location = program("CHROMIUM", "chromium", "chromium-browser", "google-chrome")
    for argument in ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--hide-scrollbars"]:
        options.add_argument(argument)
    driver = webdriver.Chrome(options=options, service=Service(program("CHROMEDRIVER", "chromedriver")))
    size = lambda height: driver.execute_cdp_cmd(  # noqa: E731
        "Emulation.setDeviceMetricsOverride", {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
    )
    scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
    with tempfile.TemporaryDirectory() as folder:
        project = Path(folder) / "project"
        project.mkdir()
        columns = systems.motor()
        table = np.column_stack(list(columns.values()))
        np.savetxt(project / "motor.csv", table, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
        app = App(driver, project)
        try:
            size(900)
            driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [scheme]})
            app.open()
            app.press("[aria-label='Open motor.csv']")
            app.ended(1)
            app.wait("!document.querySelector('#columns').hidden")
            app.press("#identify button")
            app.ended(2)
            # The folder is called by a name of its own on every machine.
            app.js("document.querySelector('#folder').textContent = '/home/robot/project'; scrollTo(0, 0)")
            size(min(app.js("return document.documentElement.scrollHeight"), 2400))
            app.wait("document.querySelector('#frame iframe') !== null")
            app.js("document.activeElement.blur()")
            driver.execute_async_script("setTimeout(arguments[0], 1500)")
            driver.save_screenshot(str(file))
        finally:
            app.process.terminate()
            driver.quit()


main(*sys.argv[1:])
