"""Opens a report in the browsers that are installed, and tries what can be pressed: see tests/report_in_browser.sh."""

import pathlib
import sys

import drivers
from drivers import moved, pressed

TAB, ENTER, END, LEFT, UP, RIGHT, DOWN = "\ue004", "\ue007", "\ue010", "\ue012", "\ue013", "\ue014", "\ue015"


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
        b.act(pressed(RIGHT))
        check("an arrow key goes to the next mark", b.js("return document.activeElement.dataset.point") != first)
    b.act(pressed(ENTER))
    now = b.js("return document.activeElement.dataset.point")
    check("Enter shows a mark's pictures", b.js("return document.getElementById('left').value") == now)
    box = b.js("const r = document.querySelector('#plot-time .mark').getBoundingClientRect();"
               "document.activeElement.blur(); scrollTo(0, scrollY + r.top - 300);"
               "const s = document.querySelector('#plot-time .mark').getBoundingClientRect();"
               "return [s.x + s.width / 2, s.y + s.height / 2]")
    b.act(moved(*box))
    check("hovering shows numbers", "spp" in b.js(tip))
    for measure in b.js("return [...document.getElementById('measure').options].map(o => o.value)"):
        b.js("const s = document.getElementById('measure'); s.value = arguments[0]; s.dispatchEvent(new Event('change'))", measure)
        bad = b.js("return [...document.querySelectorAll('.plot svg *')].some(e => [...e.attributes].some(a => /NaN|Infinity/.test(a.value)))")
        check(f"the plots of {measure} are drawn by numbers", not bad)
    b.js("const s = document.getElementById('measure'); s.value = 'error'; s.dispatchEvent(new Event('change'))")
    b.js("document.querySelector('#legend button').focus()")
    before = b.js("return document.querySelectorAll('.mark').length")
    b.act(pressed(ENTER))
    check("the legend hides a method", b.js("return document.querySelectorAll('.mark').length") < before)
    b.act(pressed(ENTER))
    check("and shows it again", b.js("return document.querySelectorAll('.mark').length") == before)


def pictures(b):
    loaded = ("return [...document.images].every(i => i.complete && i.naturalWidth > 0 && i.src.startsWith('data:')) "
              "&& document.images.length")
    check("all pictures are loaded from the page itself", b.js(loaded) == 4)
    b.js("document.getElementById('slider').focus()")
    clip = "return getComputedStyle(document.getElementById('img-right')).clipPath"
    before = b.js(clip)
    b.act(pressed(LEFT * 5))
    check("the divider moves by keyboard", b.js("return document.getElementById('slider').value") == "45" and b.js(clip) != before)
    b.js("document.getElementById('zoom').focus()")
    width = b.js("return document.getElementById('pair').offsetWidth")
    b.act(pressed(END))
    check("the zoom works by keyboard", b.js("return document.getElementById('pair').offsetWidth") > width)
    b.js("const z = document.getElementById('zoom'); z.value = z.defaultValue; z.dispatchEvent(new Event('input'))")
    old = b.js("return document.getElementById('map-error').src")
    b.js("document.getElementById('map-point').focus()")
    b.act(pressed(DOWN))
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


def try_out(kind, report, shots):
    name, colours = kind.__name__, []
    for dark in (False, True):
        b = kind(dark)
        try:
            b.open(report.as_uri())
            results = b.js("return JSON.parse(document.getElementById('data').textContent).results")
            colours.append(b.js("return getComputedStyle(document.body).backgroundColor"))
            b.screenshot(shots / f"{name.lower()}-{'dark' if dark else 'light'}.png")
            plots(b, results)
            pictures(b)
            tables(b, results)
            wrong = b.complaints()
            check(f"the console is silent {wrong}", not wrong)
            asked = b.asked()
            elsewhere = [u for u in asked if not u.startswith(("data:", "file:"))]
            check(f"nothing is asked of the network {elsewhere}", asked and not elsewhere)
        finally:
            b.close()
    check(f"{name}: dark differs from light: {colours}", colours[0] != colours[1])


def main():
    report, shots = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
    shots.mkdir(parents=True, exist_ok=True)
    for kind in drivers.here():
        print(kind.__name__)
        try_out(kind, report, shots)


main()
