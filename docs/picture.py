"""Makes docs/demo.png, the README's picture: the estimated nonlinearity on the demo's page.

    cargo run --release -- demo
    python docs/picture.py flexure-demo/report.html docs/demo.png

Needs Chromium with its driver, and the packages of tests/browser/requirements.txt.
"""

import shutil
import sys
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By

page, picture = (Path(name).resolve() for name in sys.argv[1:3])
options = webdriver.ChromeOptions()
for argument in ["--headless=new", "--no-sandbox", "--window-size=1100,900", "--force-device-scale-factor=1.5", "--hide-scrollbars"]:
    options.add_argument(argument)
options.binary_location = shutil.which("chromium")
with webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver"))) as browser:
    browser.get(page.as_uri())
    figure = browser.find_element(By.CSS_SELECTOR, "#nonlinearity .card")
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", figure)
    figure.screenshot(str(picture))
