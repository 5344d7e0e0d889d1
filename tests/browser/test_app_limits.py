"""`flexure app` and what it must not do: take too much, answer pages of elsewhere, leave its folder."""

import http.server
import json
import random
import threading
import urllib.parse

from app_page import untidy

MEGABYTE = 1 << 20


def test_a_file_of_200_megabytes_is_taken_and_one_beyond_the_limit_is_not(app, tmp_path):
    large = tmp_path / "large.csv"
    rng = random.Random(3)
    block = "".join(f"{rng.random():.14f},{rng.random():.13f}\n" for _ in range(MEGABYTE // 32))
    with open(large, "w") as file:
        file.write("u,y\n")
        for _ in range(200):
            file.write(block)
    page = app("--largest-file", "250MiB").open()
    page.upload(large)
    page.wait("document.querySelector('[aria-label=\"Download large.csv\"]') !== null", 120)
    assert (tmp_path / "project" / "large.csv").stat().st_size > 199 * MEGABYTE
    page.ended(1, seconds=300)
    page.wait("!document.querySelector('#columns').hidden")
    with open(large, "ab") as file:
        file.write(bytes(60 * MEGABYTE))
    page.upload(large)
    page.wait("document.querySelector('#problem').textContent !== ''", 120)
    assert "too large" in page.problem() or "not taken" in page.problem()
    assert not (tmp_path / "project" / "large-2.csv").exists()


def test_a_page_of_another_origin_gets_nothing(app, browser, tmp_path):
    page = app().open()
    browser.set_script_timeout(120)  # The browser waits long where the machine is busy.
    target = page.address
    seen = []

    class Other(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html><title>elsewhere</title>")

        def log_message(self, *_):
            seen.append(1)

    server = http.server.HTTPServer(("127.0.0.1", 0), Other)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        browser.get(f"http://127.0.0.1:{server.server_address[1]}/")
        script = """
            const done = arguments[arguments.length - 1], target = arguments[0];
            const tried = [fetch(target + 'project'), fetch(target + 'project', { mode: 'no-cors' }).then((r) => { if (r.type === 'opaque') throw 1; }),
                fetch(target + 'files/evil.csv', { method: 'PUT', body: 'u,y\\n1,2\\n' }),
                fetch(target + 'jobs', { method: 'POST', mode: 'no-cors', body: '{"command":"look","files":[]}' }).then((r) => { if (r.type === 'opaque') throw 1; })];
            Promise.allSettled(tried).then((all) => done(all.map((one) => one.status)));"""
        assert browser.execute_async_script(script, target) == ["rejected"] * 4
        framed = """
            const done = arguments[arguments.length - 1];
            const frame = document.createElement('iframe');
            frame.onload = () => { let text = null; try { text = frame.contentDocument.body.textContent; } catch (e) { text = null; } done(text); };
            frame.src = arguments[0];
            document.body.append(frame);"""
        assert browser.execute_async_script(framed, target) in (None, "")
    finally:
        server.shutdown()
    assert list((tmp_path / "project").iterdir()) == []
    assert seen


def test_only_the_own_page_is_answered(app, tmp_path):
    page = app()
    host = urllib.parse.urlsplit(page.address).netloc
    assert page.asked("GET", page.prefix + "project")[0] == 200
    for path in ["/", "/project", f"/{'0' * 32}/project", page.prefix[:-2] + "/project"]:
        assert page.asked("GET", path) == (403, b""), path
    for headers in [
        {"Host": "localhost.evil.example:80"},
        {"Host": host, "Origin": "http://evil.example"},
        {"Host": host, "Origin": "null"},
        {"Host": host, "Sec-Fetch-Site": "cross-site"},
    ]:
        assert page.asked("GET", page.prefix + "project", headers=headers) == (403, b""), headers
    assert page.asked("GET", page.prefix + "project", headers={"Host": host, "Origin": f"http://{host}"})[0] == 200


def test_nothing_outside_of_the_folder_is_read_written_or_run(app, tmp_path):
    page = app()
    (tmp_path / "secret.csv").write_text("u,y\n1,2\n")
    (tmp_path / "project" / "link.csv").symlink_to(tmp_path / "secret.csv")
    for name in ["..%2Fsecret.csv", "%2Fetc%2Fpasswd", "link.csv", ".hidden", "-o"]:
        assert page.asked("GET", page.prefix + f"files/{name}")[0] == 404, name
    for name in ["..%2Fnew.csv", ".new.csv", "-new.csv", "a%00b", ""]:
        assert page.asked("PUT", page.prefix + f"files/{name}", body="x")[0] in (400, 404), name
    untidy(tmp_path / "project" / "m.csv")
    good = {"command": "look", "files": ["m.csv"]}
    for change in [
        {"command": "simulate"},
        {"command": "app"},
        {"files": ["../secret.csv"]},
        {"files": ["link.csv"]},
        {"files": ["--version"]},
        {"options": {"resume": "x"}},
        {"outputs": {"report": "../x.html"}},
        {"outputs": {"resume": "x.html"}},
        {"outputs": {"json": "../x.json"}},
        {"more": 1},
    ]:
        status, answer = page.asked("POST", page.prefix + "jobs", body=json.dumps({**good, **change}))
        assert status == 400 and json.loads(answer)["problem"], change
    assert page.asked("POST", page.prefix + "jobs", body=json.dumps(good))[0] == 200
