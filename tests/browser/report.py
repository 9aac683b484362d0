"""Drives Chromium through WebDriver (W3C), by the standard library alone: see tests/report_in_browser.sh."""

import base64
import json
import pathlib
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request

TAB, ENTER, END, LEFT, UP, RIGHT, DOWN = "\ue004", "\ue007", "\ue010", "\ue012", "\ue013", "\ue014", "\ue015"


class Browser:
    def __init__(self, dark):
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            port = s.getsockname()[1]
        self.base = f"http://127.0.0.1:{port}"
        quiet = subprocess.DEVNULL
        self.driver = subprocess.Popen(["chromedriver", f"--port={port}"], stdout=quiet, stderr=quiet)
        self.session = None
        args = ["--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1280,900"]
        if dark:
            args.append("--force-dark-mode")
        wanted = {"browserName": "chrome", "goog:chromeOptions": {"args": args},
                  "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"}}
        for _ in range(100):
            try:
                urllib.request.urlopen(self.base + "/status", timeout=5)
                break
            except OSError:
                time.sleep(0.1)
        made = self.ask("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
        self.session = f"/session/{made['sessionId']}"

    def ask(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.base + path, data, {"Content-Type": "application/json"}, method=method)
        try:
            with urllib.request.urlopen(request, timeout=60) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as e:
            raise RuntimeError(e.read().decode()) from e

    def post(self, path, body):
        return self.ask("POST", self.session + path, body)

    def js(self, script, *args):
        return self.post("/execute/sync", {"script": script, "args": list(args)})

    def keys(self, keys):
        """Presses keys as a person would, at whatever has the focus."""
        actions = [a for k in keys for a in ({"type": "keyDown", "value": k}, {"type": "keyUp", "value": k})]
        self.post("/actions", {"actions": [{"type": "key", "id": "keyboard", "actions": actions}]})

    def log(self, kind):
        return self.post("/se/log", {"type": kind})

    def screenshot(self, path):
        # As high as the page, so that all of it is seen.
        height = self.js("return document.documentElement.scrollHeight")
        self.post("/window/rect", {"width": 1280, "height": min(int(height) + 150, 4000)})
        shot = self.ask("GET", self.session + "/screenshot")
        pathlib.Path(path).write_bytes(base64.b64decode(shot))

    def close(self):
        if self.session:
            try:
                self.ask("DELETE", self.session)
            except (OSError, RuntimeError):
                pass
        self.driver.terminate()
        self.driver.wait(10)


def check(what, right):
    print(("ok      " if right else "WRONG   ") + what)
    if not right:
        sys.exit(1)


def plots(b, results):
    points = results["points"]
    drawn = [p for p in points if p["error"]["value"] > 0]
    for target, x_of in (("plot-samples", lambda p: p["spp"]), ("plot-time", lambda p: p["seconds"]["value"])):
        marks = b.js(
            "return [...document.querySelectorAll('#' + arguments[0] + ' .mark')].map(e => "
            "[Number(e.dataset.point), ...e.getAttribute('transform').match(/-?\\d[-\\d.e]*/g).map(Number)])", target)
        check(f"{target} has a mark for each of {len(drawn)} settings", len(marks) == len(drawn))
        # Where they stand: to the right for more, and higher (less y) for a larger error.
        for axis, value in ((1, x_of), (2, lambda p: -p["error"]["value"])):
            order = sorted(marks, key=lambda m: value(points[m[0]]))
            check(f"{target}: marks in the order of their values, axis {axis}",
                  all(a[axis] <= c[axis] + 1e-6 for a, c in zip(order, order[1:])))
    b.js("document.querySelector('#plot-samples .mark').focus()")
    first = b.js("return document.activeElement.dataset.point")
    tip = "return document.getElementById('tip').hidden ? '' : document.getElementById('tip').textContent"
    check("a mark with the focus shows its numbers", points[int(first)]["method"] in b.js(tip))
    if sum(p["method"] == points[int(first)]["method"] for p in drawn) > 1:
        b.keys(RIGHT)
        check("an arrow key goes to the next mark", b.js("return document.activeElement.dataset.point") != first)
    b.keys(ENTER)
    now = b.js("return document.activeElement.dataset.point")
    check("Enter shows a mark's pictures", b.js("return document.getElementById('left').value") == now)
    box = b.js("const r = document.querySelector('#plot-time .mark').getBoundingClientRect();"
               "document.activeElement.blur(); scrollTo(0, scrollY + r.top - 300);"
               "const s = document.querySelector('#plot-time .mark').getBoundingClientRect();"
               "return [s.x + s.width / 2, s.y + s.height / 2]")
    move = {"type": "pointerMove", "duration": 50, "x": int(box[0]), "y": int(box[1]), "origin": "viewport"}
    b.post("/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": [move]}]})
    check("hovering shows numbers", "spp" in b.js(tip))
    for measure in b.js("return [...document.getElementById('measure').options].map(o => o.value)"):
        b.js("const s = document.getElementById('measure'); s.value = arguments[0]; s.dispatchEvent(new Event('change'))", measure)
        bad = b.js("return [...document.querySelectorAll('.plot svg *')].some(e => [...e.attributes].some(a => /NaN|Infinity/.test(a.value)))")
        check(f"the plots of {measure} are drawn by numbers", not bad)
    b.js("const s = document.getElementById('measure'); s.value = 'error'; s.dispatchEvent(new Event('change'))")
    b.js("document.querySelector('#legend button').focus()")
    before = b.js("return document.querySelectorAll('.mark').length")
    b.keys(ENTER)
    check("the legend hides a method", b.js("return document.querySelectorAll('.mark').length") < before)
    b.keys(ENTER)
    check("and shows it again", b.js("return document.querySelectorAll('.mark').length") == before)


def pictures(b):
    loaded = ("return [...document.images].every(i => i.complete && i.naturalWidth > 0 && i.src.startsWith('data:')) "
              "&& document.images.length")
    check("all pictures are loaded from the page itself", b.js(loaded) == 4)
    b.js("document.getElementById('slider').focus()")
    clip = "return getComputedStyle(document.getElementById('img-right')).clipPath"
    before = b.js(clip)
    b.keys(LEFT * 5)
    check("the divider moves by keyboard", b.js("return document.getElementById('slider').value") == "45" and b.js(clip) != before)
    b.js("document.getElementById('zoom').focus()")
    width = b.js("return document.getElementById('pair').offsetWidth")
    b.keys(END)
    check("the zoom works by keyboard", b.js("return document.getElementById('pair').offsetWidth") > width)
    b.js("const z = document.getElementById('zoom'); z.value = z.defaultValue; z.dispatchEvent(new Event('input'))")
    old = b.js("return document.getElementById('map-error').src")
    b.js("document.getElementById('map-point').focus()")
    b.keys(DOWN)
    check("another map can be chosen by keyboard", b.js("return document.getElementById('map-error').src") != old)


def tables(b, results):
    check("the table has all settings", b.js("return document.querySelectorAll('#table tbody tr').length") == len(results["points"]))
    text = b.js("return tableText()")
    check("its copy has a line each", len(text.splitlines()) == len(results["points"]) + 1 and "NaN" not in text)
    shown = b.js("return document.body.innerText")
    check("no NaN is shown", "NaN" not in shown and "undefined" not in shown and "null" not in shown)
    check("the command is there", results["command"] in shown)
    wide = b.js("return document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    check("the page does not scroll sideways", wide)


def main():
    report, shots = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
    shots.mkdir(parents=True, exist_ok=True)
    colours = []
    for dark in (False, True):
        b = Browser(dark)
        try:
            b.post("/url", {"url": report.as_uri()})
            results = b.js("return DATA.results")
            colours.append(b.js("return getComputedStyle(document.body).backgroundColor"))
            b.screenshot(shots / ("dark.png" if dark else "light.png"))
            b.post("/window/rect", {"width": 1280, "height": 900})
            plots(b, results)
            pictures(b)
            tables(b, results)
            wrong = [e for e in b.log("browser") if e["level"] in ("SEVERE", "WARNING")]
            check(f"the console is silent {wrong}", not wrong)
            asked = [json.loads(e["message"])["message"] for e in b.log("performance")]
            urls = [m["params"]["request"]["url"] for m in asked if m["method"] == "Network.requestWillBeSent"]
            elsewhere = [u for u in urls if not u.startswith(("data:", "file:"))]
            check(f"nothing is asked of the network {elsewhere}", urls and not elsewhere)
        finally:
            b.close()
    check(f"dark differs from light: {colours}", colours[0] != colours[1])


main()
