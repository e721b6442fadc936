"""A person at the workbench: what they do with mouse, fingers and keys, in places of the drawing."""

from __future__ import annotations

import base64
import json
import time
from pathlib import Path

from graphsynth import Mechanism


class Person:
    """Someone in front of a page; places are those of the drawing, y up."""

    def __init__(self, window, page, size=(1280, 800), mobile=False):
        self.window, self.page, self.mobile = window, page, mobile
        metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": mobile}
        window.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        window.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": mobile})

    def open(self, fragment="", language="en", page=None):
        """Open the page anew, with nothing kept from before."""
        address = (page or self.page).as_uri()
        self.window.get("about:blank")
        self.window.get(address)
        self.script(f"localStorage.clear(); localStorage.setItem('workbench-language', {json.dumps(language)})")
        self.window.get("about:blank")
        self.window.get(address + fragment)
        self.until("return document.body.dataset.ready !== undefined")
        return self

    def script(self, text, *arguments):
        return self.window.execute_script(text, *arguments)

    def until(self, text, *arguments, seconds=20):
        end = time.monotonic() + seconds
        while not self.script(text, *arguments):
            assert time.monotonic() < end, f"never true: {text}; the page says {self.said()!r}"
            time.sleep(0.02)

    def said(self):
        return self.script("return document.getElementById('said').textContent")

    def look(self):
        """Wait until the page has drawn what was done last, as a person does."""
        self.script("return new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def pixels(self, x, y):
        """Where a place of the drawing is in the window."""
        self.look()
        return self.script(
            "const b = document.getElementById('sheet').getBoundingClientRect(), p = Bench.app.view.px(arguments[0]);"
            "return [b.left + p[0], b.top + p[1]]",
            [x, y],
        )

    def look_at(self, x, y, scale):
        self.script(
            "Object.assign(Bench.app.view.camera, arguments[0]); Bench.app.changed('view')",
            {"x": x, "y": y, "scale": scale},
        )

    def mouse(self, kind, x, y, buttons=1, modifiers=0, clicks=1):
        self.window.execute_cdp_cmd(
            "Input.dispatchMouseEvent",
            {
                "type": kind,
                "x": x,
                "y": y,
                "button": "left" if buttons else "none",
                "buttons": buttons,
                "clickCount": clicks,
                "modifiers": modifiers,
            },
        )

    def touch(self, kind, *points):
        places = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)]
        self.window.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": places})

    def drag(self, start, end, steps=8, modifiers=0):
        """Press at one place of the drawing, move to another, release there."""
        (x, y), (u, v) = self.pixels(*start), self.pixels(*end)
        way = [(x + (u - x) * k / steps, y + (v - y) * k / steps) for k in range(steps + 1)]
        if self.mobile:
            self.touch("touchStart", way[0])
            for place in way[1:]:
                self.touch("touchMove", place)
            self.touch("touchEnd")
        else:
            self.mouse("mouseMoved", x, y, 0)
            self.mouse("mousePressed", x, y, modifiers=modifiers)
            for place in way[1:]:
                self.mouse("mouseMoved", *place, modifiers=modifiers)
            self.mouse("mouseReleased", u, v, modifiers=modifiers)
        self.look()

    def click(self, x, y, modifiers=0):
        px = self.pixels(x, y)
        if self.mobile:
            self.touch("touchStart", px)
            self.touch("touchEnd")
            return
        self.mouse("mouseMoved", *px, 0)
        self.mouse("mousePressed", *px, modifiers=modifiers)
        self.mouse("mouseReleased", *px, modifiers=modifiers)

    def tool(self, name):
        self.press(f"[data-tool={name}]")

    def press(self, selector):
        """Click a button, wherever it is: in a menu, the menu is opened first."""
        self.script(
            "const e = document.querySelector(arguments[0]), m = e.closest('details.menu');"
            "if (m && !m.open) m.open = true; e.click()",
            selector,
        )

    def key(self, text, *, control=False, shift=False, code=""):
        """Press a key, as the keyboard sends it; ``code`` is its place, of letters in other alphabets."""
        named = {
            "Enter": 13,
            "Escape": 27,
            "Delete": 46,
            "Tab": 9,
            "ArrowLeft": 37,
            "ArrowUp": 38,
            "ArrowRight": 39,
            "ArrowDown": 40,
            " ": 32,
        }
        number = named.get(text, ord(text.upper()) if len(text) == 1 else 0)
        event = {"key": text, "code": code, "windowsVirtualKeyCode": number, "modifiers": 2 * control + 8 * shift}
        if (len(text) == 1 or text == "Enter") and not control:
            event["text"] = "\r" if text == "Enter" else text
        self.window.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": "keyDown", **event})
        self.window.execute_cdp_cmd(
            "Input.dispatchKeyEvent", {"type": "keyUp", "key": text, "windowsVirtualKeyCode": number}
        )

    def drawn(self):
        """The mechanism on the table, in the form of files."""
        return self.script("return Bench.written(Bench.app.posed())")

    def picture(self, path):
        data = self.window.execute_cdp_cmd("Page.captureScreenshot", {"format": "png"})["data"]
        Path(path).write_bytes(base64.b64decode(data))

    def complaints(self):
        return [e["message"] for e in self.window.get_log("browser") if e["level"] in ("SEVERE", "WARNING")]


def mechanism(person):
    """Return what is drawn as the library reads it."""
    return Mechanism.from_json(json.dumps(person.drawn()))


def text(person, place):
    """Return what a part of the page says."""
    person.look()
    return person.script("return document.getElementById(arguments[0]).innerText", place)


def four_bar(person):
    """Draw a crank-rocker of 0-1-2-3 with mouse or fingers: the crank turns fully."""
    person.look_at(0, 40, 2.2 if person.mobile else 4)
    person.tool("link")
    person.drag((-40, 0), (-40, 20))
    person.tool("plate")
    for place in ((-40, 20), (30, 60), (-10, 80)):
        person.click(*place)
    person.key("Enter")
    person.tool("link")
    person.drag((30, 60), (40, 0))
    person.tool("ground")
    person.click(-40, 0)
    person.click(40, 0)
    person.tool("driver")
    person.click(-40, 0)
