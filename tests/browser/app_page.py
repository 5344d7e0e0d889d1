"""The app and its page, for the tests that use it."""

import http.client
import math
import random
import subprocess
import urllib.parse

from conftest import program
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait


def flexure():
    return program("FLEXURE_BINARY", "flexure")


def untidy(path, samples=900, seed=1):
    """A record as instruments write it: remarks, semicolons, decimal commas, a spike, a gap; a dead zone before a lag."""
    rng = random.Random(seed)
    lines = ["# logged by hand", "Time [s];Command (V);Speed [rad/s]"]
    state = held = 0.0
    for k in range(samples):
        if k % 4 == 0:
            held = rng.uniform(-2, 2)
        effective = math.copysign(max(abs(held) - 0.5, 0), held)
        state = 0.8 * state + 0.2 * effective
        speed = state + rng.gauss(0, 0.002)
        text = "" if k == 200 else f"{50 if k == 300 else speed:.6f}"
        lines.append(f"{0.01 * k:.3f};{held:.6f};{text}".replace(".", ","))
    path.write_text("\n".join(lines) + "\n")
    return path


class App:
    """The app, and its page in the browser."""

    def __init__(self, driver, folder, *options):
        self.driver = driver
        self.folder = folder
        command = [flexure(), "app", str(folder), "--no-open", *options]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.address = self.process.stdout.readline().strip()
        assert self.address.startswith("http://127.0.0.1:"), self.address

    def open(self):
        self.driver.get(self.address)
        self.wait("document.documentElement.dataset.ready === 'true'", 20)
        return self

    def js(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def wait(self, condition, seconds=60):
        WebDriverWait(self.driver, seconds, poll_frequency=0.1).until(lambda d: d.execute_script(f"return {condition}"), condition)

    def find(self, selector):
        return self.driver.find_element("css selector", selector)

    def press(self, selector):
        """With the keyboard alone."""
        element = self.find(selector)
        self.js("arguments[0].focus()", element)
        assert self.js("return document.activeElement === arguments[0]", element), f"{selector} takes no focus"
        element.send_keys(Keys.ENTER)

    def upload(self, path):
        self.find("#upload").send_keys(str(path))

    def drop(self, path):
        """Lets go of a file over the page."""
        script = """
            const data = new DataTransfer();
            data.items.add(new File([arguments[1]], arguments[0]));
            for (const kind of ['dragover', 'drop']) {
              document.querySelector('#drop').dispatchEvent(new DragEvent(kind, { bubbles: true, cancelable: true, dataTransfer: data }));
            }"""
        self.js(script, path.name, path.read_text())

    def ended(self, count, state="done", seconds=120):
        """Waits until this number of runs has ended, the last one in this state."""
        self.wait(f"document.querySelectorAll('[data-job][data-state]').length >= {count}", seconds)
        item = self.find("#run-list > li")
        assert item.get_attribute("data-state") == state, item.text
        return item

    def problem(self):
        return self.find("#problem").text

    def asked(self, method, path, body=None, headers=None):
        """The status and answer of a request that is no browser's."""
        parts = urllib.parse.urlsplit(self.address)
        connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=60)
        connection.request(method, path, body=body, headers=headers or {})
        answer = connection.getresponse()
        return answer.status, answer.read()

    @property
    def prefix(self):
        return urllib.parse.urlsplit(self.address).path
