"""Browsers without a window, driven by the standard library alone: Chromium through WebDriver (W3C), Firefox through
Marionette, which it has built in and which knows WebDriver's commands too. Both have the same methods."""

import base64
import json
import os
import pathlib
import shutil
import socket
import subprocess
import tempfile
import time
import urllib.error
import urllib.request


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def pressed(keys):
    actions = [a for k in keys for a in ({"type": "keyDown", "value": k}, {"type": "keyUp", "value": k})]
    return [{"type": "key", "id": "keyboard", "actions": actions}]


def moved(x, y):
    move = {"type": "pointerMove", "duration": 50, "x": int(x), "y": int(y), "origin": "viewport"}
    return [{"type": "pointer", "id": "mouse", "actions": [move]}]


def ended(process):
    process.terminate()
    try:
        process.wait(10)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait(10)


class Chromium:
    programs = ["chromium", "chromedriver"]

    def __init__(self, dark):
        port = free_port()
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

    def open(self, url):
        self.post("/url", {"url": url})

    def js(self, script, *args):
        return self.post("/execute/sync", {"script": script, "args": list(args)})

    def act(self, actions):
        self.post("/actions", {"actions": actions})

    def size(self, width, height):
        self.post("/window/rect", {"width": width, "height": height})

    def complaints(self):
        log = self.post("/se/log", {"type": "browser"})
        return [e["message"] for e in log if e["level"] in ("SEVERE", "WARNING")]

    def asked(self):
        """Addresses of all that was loaded."""
        log = [json.loads(e["message"])["message"] for e in self.post("/se/log", {"type": "performance"})]
        return [m["params"]["request"]["url"] for m in log if m["method"] == "Network.requestWillBeSent"]

    def screenshot(self, path):
        # As high as the page, so that all of it is seen.
        height = self.js("return document.documentElement.scrollHeight")
        self.size(1280, min(int(height) + 150, 4000))
        shot = self.ask("GET", self.session + "/screenshot")
        pathlib.Path(path).write_bytes(base64.b64decode(shot))
        self.size(1280, 900)

    def close(self):
        if self.session:
            try:
                self.ask("DELETE", self.session)
            except (OSError, RuntimeError):
                pass
        ended(self.driver)


class Firefox:
    programs = ["firefox-esr"]

    def __init__(self, dark):
        self.profile = tempfile.mkdtemp()
        port = free_port()
        prefs = {"marionette.port": port, "layout.css.prefers-color-scheme.content-override": 0 if dark else 1,
                 "browser.shell.checkDefaultBrowser": False, "datareporting.policy.dataSubmissionEnabled": False,
                 "app.update.enabled": False, "browser.aboutConfig.showWarning": False}
        lines = [f"user_pref({json.dumps(k)}, {json.dumps(v)});" for k, v in prefs.items()]
        pathlib.Path(self.profile, "user.js").write_text("\n".join(lines) + "\n")
        quiet = subprocess.DEVNULL
        args = ["firefox-esr", "--headless", "--marionette", "--remote-allow-system-access", "--no-remote",
                "--profile", self.profile]
        home = dict(os.environ, HOME=self.profile, MOZ_DISABLE_AUTO_SAFE_MODE="1")
        self.browser = subprocess.Popen(args, stdout=quiet, stderr=quiet, env=home)
        self.count = 0
        for _ in range(600):
            try:
                self.socket = socket.create_connection(("127.0.0.1", port), timeout=120)
                break
            except OSError:
                if self.browser.poll() is not None:
                    raise RuntimeError("Firefox does not start")
                time.sleep(0.1)
        else:
            raise RuntimeError("Firefox does not listen")
        self.message()
        self.ask("WebDriver:NewSession", {})
        self.size(1280, 900)

    def message(self):
        """Of the form LENGTH:JSON."""
        digits = b""
        while not digits.endswith(b":"):
            digits += self.socket.recv(1)
        left, parts = int(digits[:-1]), []
        while left:
            parts.append(self.socket.recv(min(left, 1 << 16)))
            left -= len(parts[-1])
        return json.loads(b"".join(parts))

    def ask(self, name, parameters):
        self.count += 1
        text = json.dumps([0, self.count, name, parameters]).encode()
        self.socket.sendall(str(len(text)).encode() + b":" + text)
        _, _, error, result = self.message()
        if error:
            raise RuntimeError(f"{name}: {error}")
        return result

    def open(self, url):
        self.ask("WebDriver:Navigate", {"url": url})

    def js(self, script, *args):
        # Its functions see the page's own constants only through the page.
        return self.ask("WebDriver:ExecuteScript", {"script": script, "args": list(args), "sandbox": None})["value"]

    def act(self, actions):
        self.ask("WebDriver:PerformActions", {"actions": actions})

    def size(self, width, height):
        self.ask("WebDriver:SetWindowRect", {"width": width, "height": height})

    def complaints(self):
        self.ask("Marionette:SetContext", {"value": "chrome"})
        script = "return Services.console.getMessageArray().map(m => String(m))"
        said = self.ask("WebDriver:ExecuteScript", {"script": script, "args": []})["value"]
        self.ask("Marionette:SetContext", {"value": "content"})
        # The browser talks of its own affairs too.
        return [m for m in said if "report" in m and ".html" in m]

    def asked(self):
        return [self.js("return location.href")] + self.js("return performance.getEntriesByType('resource').map(e => e.name)")

    def screenshot(self, path):
        shot = self.ask("WebDriver:TakeScreenshot", {"full": True})["value"]
        pathlib.Path(path).write_bytes(base64.b64decode(shot))

    def close(self):
        try:
            self.ask("Marionette:Quit", {"flags": ["eForceQuit"]})
        except (OSError, RuntimeError, ValueError):
            pass
        self.socket.close()
        ended(self.browser)
        shutil.rmtree(self.profile, ignore_errors=True)


def here():
    """Those of them that are installed."""
    return [b for b in (Chromium, Firefox) if all(shutil.which(p) for p in b.programs)]
