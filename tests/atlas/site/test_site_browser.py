"""The page used as people use it, in a real headless Chromium: browse, filter, open, save, move, paste, draw."""

import math
import time

import pytest

from graphsynth import MechanismGraph
from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.site import build_site
from graphsynth.formats.registry import read_text

from ...plain_svg import faults

by = pytest.importorskip("selenium.webdriver.common.by").By
keys = pytest.importorskip("selenium.webdriver.common.keys").Keys


def until(window, script, *arguments, seconds=15):
    """Wait for a script to return something true, and return it."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        found = window.execute_script(f"return {script}", *arguments)
        if found:
            return found
        time.sleep(0.03)
    raise AssertionError(f"never came true: {script}")


def css(window, selector):
    return window.find_element(by.CSS_SELECTOR, selector)


def put(window, selector, value):
    """Give a field of the question a value, as a person would."""
    window.execute_script(
        """const field = document.querySelector(arguments[0]);
           if (field.type === "checkbox" || field.type === "radio") field.click();
           else { field.value = arguments[1]; field.dispatchEvent(new Event("input", {bubbles: true})); }""",
        selector,
        value,
    )


def count(window):
    return window.execute_script("return document.querySelector('#count').textContent")


def labels(window):
    return window.execute_script("return [...document.querySelectorAll('#list b')].map(b => b.textContent)")


# --- browsing


@pytest.mark.long
def test_the_first_page_shows_all_chains_with_sketches(page):
    window = page()
    until(window, "document.querySelectorAll('#list .thumb svg').length === 19")
    assert count(window) == "19 chains"
    assert labels(window)[:3] == ["1.4.4.1", "1.6.4-2.1", "1.6.4-2.2"]


def test_filters_and_orders(page):
    window = page()
    until(window, "document.querySelectorAll('#list li').length")
    put(window, "input[name=links][value='8']", True)
    until(window, "document.querySelector('#count').textContent === '16 of 19 chains'")
    put(window, "select[name=assortment]", "4-4")
    until(window, "document.querySelector('#count').textContent === '9 of 19 chains'")
    assert window.current_url.endswith("#/?links=8&assortment=4-4")  # an address that can be kept
    put(window, "select[name=sort]", "symmetry")
    put(window, "input[name=down]", True)
    until(window, "location.hash.includes('down')")
    orders = window.execute_script(
        "return Atlas.choose({links: '8', assortment: '4-4', sort: 'symmetry', down: 'yes'}).map(r => r.symmetry)"
    )
    assert orders == sorted(orders, reverse=True) and len(orders) == 9
    assert labels(window) == window.execute_script(
        "return Atlas.choose({links: '8', assortment: '4-4', sort: 'symmetry', down: 'yes'}).map(r => r.label)"
    )
    css(window, "#question button[type=reset]").click()
    until(window, "document.querySelector('#count').textContent === '19 chains'")


def test_search_by_label_key_and_graph6(page):
    window = page()
    until(window, "document.querySelectorAll('#list li').length")
    stephenson = "1.6.4-2.2"
    for text in (stephenson, "1BgOB7A", MechanismGraph.from_key("1BgOB7A").relabelled([3, 1, 5, 0, 2, 4]).graph6()):
        put(window, "input[name=text]", text)
        until(window, "document.querySelectorAll('#list li').length === 1")
        assert labels(window) == [stephenson]
    put(window, "input[name=text]", "no such chain")
    until(window, "document.querySelector('#count').textContent === '0 of 19 chains'")


def test_the_list_is_walked_with_arrows_and_opened_with_enter(page):
    window = page()
    until(window, "document.querySelectorAll('#list li').length === 19")
    window.execute_script("document.querySelector('#list a').focus()")
    for key in (keys.ARROW_RIGHT, keys.ARROW_RIGHT, keys.ARROW_LEFT):
        window.switch_to.active_element.send_keys(key)
    assert window.switch_to.active_element.text.startswith("1.6.4-2.1")
    window.switch_to.active_element.send_keys(keys.END)
    assert window.switch_to.active_element.text.startswith("1.8.4-4.9")
    window.switch_to.active_element.send_keys(keys.ENTER)
    until(window, "document.querySelector('#entry h1')?.textContent === '1.8.4-4.9'")
    assert window.title.startswith("1.8.4-4.9")
    window.back()
    until(window, "!document.querySelector('#browse').hidden && document.querySelectorAll('#list li').length === 19")
    window.find_element(by.TAG_NAME, "body").send_keys("/")
    assert window.switch_to.active_element.get_attribute("name") == "text"


# --- the page of a chain


@pytest.mark.parametrize("name", ["1CAMBmSzA", "1.8.4-4.3"])
def test_a_chain_has_a_permanent_address_by_key_and_by_label(page, name):
    window = page(f"#/{name}")
    until(window, "document.querySelector('#entry h1')?.textContent === '1.8.4-4.3'")
    graph = MechanismGraph.from_key("1CAMBmSzA")
    drawn = window.execute_script(
        "return [...document.querySelectorAll('#sketch [data-joint]')].map(c => c.dataset.joint)"
    )
    assert drawn == [f"{a}-{b}" for a, b, _ in graph.joints]
    cells = window.execute_script(
        """return [...document.querySelectorAll('#entry .matrix')[0].tBodies[0].rows]
             .map(r => [...r.cells].slice(1).map(c => +c.textContent || 0))"""
    )
    assert cells == [[graph.neighbours[a] >> b & 1 for b in range(8)] for a in range(8)]


def test_frame_and_driver_are_chosen_and_kept_in_the_address(page):
    window = page("#/1CAMBmSzA?frame=4&driver=7")
    until(window, "document.querySelector('#groups ol')")
    assert "Mechanism of class III" in css(window, "#groups").text
    css(window, ".pick[data-frame='4'][data-drivers='1']").click()
    assert "Mechanism of class IV" in css(window, "#groups").text
    assert window.current_url.endswith("?frame=4&driver=1")
    put(window, "#drivers input[value='2']", True)
    assert window.current_url.endswith("?frame=4&driver=2")
    css(window, "#sketch [data-link='0']").click()
    assert window.execute_script("return document.querySelector('#frame').value") == "0"
    window.refresh()
    until(window, "document.querySelector('#frame')?.value === '0'")


def test_relatives_lead_to_one_another(page):
    window = page("#/1BgOB7A")
    until(window, "document.querySelectorAll('#relatives a').length")
    linked = window.execute_script(
        "return [...document.querySelectorAll('#relatives a')].map(a => a.getAttribute('href').slice(2))"
    )
    assert linked[0] == "1BAN4"  # take a dyad from a six-bar: the four-bar
    for key in linked[1:]:
        window.execute_script("location.hash = '#/' + arguments[0]", key)
        until(window, "document.querySelector('#entry .keyline code')?.textContent === arguments[0]", key)
        until(
            window, "[...document.querySelectorAll('#relatives a')].some(a => a.getAttribute('href') === '#/1BgOB7A')"
        )


def test_files_are_saved(page, downloads):
    window = page("#/1.8.4-4.3?frame=4&driver=7")
    until(window, "document.querySelectorAll('#files button').length === 9")
    for button in window.find_elements(by.CSS_SELECTOR, "#files button"):
        button.click()
        time.sleep(0.1)
    graph = MechanismGraph(8, MechanismGraph.from_key("1CAMBmSzA").joints, frame=4)
    names = ["graphml", "json", "dot", "edges", "adj", "inc", "sketch.svg", "levels.svg"]
    wanted = ["1.8.4-4.3.g6", *(f"1.8.4-4.3-frame4{'-' if 'svg' in name else '.'}{name}" for name in names)]
    end = time.monotonic() + 10
    while time.monotonic() < end and not all((downloads / name).is_file() for name in wanted):
        time.sleep(0.05)
    assert all((downloads / name).is_file() for name in wanted), sorted(path.name for path in downloads.iterdir())
    assert read_text((downloads / wanted[2]).read_text("utf-8"), "json") == [graph]
    from xml.etree import ElementTree

    svg = ElementTree.parse(downloads / wanted[7]).getroot()
    assert svg.tag.endswith("svg") and len(svg.findall(".//*[@data-joint]")) == 10
    for name in wanted[7:]:  # right in programs that read no style sheets
        assert faults((downloads / name).read_text("utf-8")) == []


def moving(window):
    """Go into the workbench of the chain's page, when something lies on it that turns."""
    frame = until(window, "document.querySelector('#entry iframe')")
    window.execute_script("arguments[0].scrollIntoView({block: 'center'})", frame)
    window.switch_to.frame(frame)
    until(window, "typeof Bench !== 'undefined' && Bench.app?.motion?.driven", seconds=40)


@pytest.mark.parametrize("key", ["1BAN4", "1CAMBmSzA"])
def test_a_chain_moves_with_the_frame_and_driver_that_are_chosen(page, key):
    window = page(f"#/{key}?frame=1&driver=2")
    try:
        moving(window)
        told = """const s = Bench.app.sheet, ids = Object.keys(s.links), d = Bench.written(s);
                  return [Bench.chainKey(Bench.app.labels, d), Bench.app.motion.sweep().full, d.graph]"""
        found, full, graph = window.execute_script(told)
        assert found == key and full
        assert " f1" in graph
        before = window.execute_script("return Bench.app.motion.input")
        window.execute_script("Bench.app.motion.play()")
        until(window, "Math.abs(Bench.app.motion.input - arguments[0]) > 0.1", before)
    finally:
        window.switch_to.default_content()
    window = page("#/1CgNABqFAPEg")  # ten links: not in the catalogue
    until(window, "document.querySelector('#entry h1')")
    assert "Not in this atlas" in css(window, "#entry").text


def test_names_and_uses_are_found(page):
    window = page()
    for words, wanted in (("klann", ["1.6.4-2.2"]), ("walking", ["1.4.4.1", "1.6.4-2.2", "1.8.4-4.7"])):
        put(window, "[name=text]", words)
        until(window, "document.querySelectorAll('#list b').length === arguments[0]", len(wanted))
        assert labels(window) == wanted
    window = page("#/1BgOB7A")
    until(window, "document.querySelector('#entry .named')")
    text = css(window, "#entry .named").text
    assert "Klann" in text and "patent" in text
    # from any page to the search, and what fits nothing is told where to ask
    window.find_element(by.TAG_NAME, "body").send_keys("/")
    until(window, "document.activeElement.name === 'text'")
    put(window, "[name=text]", "no such thing")
    assert count(window) == "0 of 19 chains"
    assert css(window, "#chosen a").get_attribute("href").endswith("#/find")


@pytest.mark.long
def test_evaluations_are_shown_and_what_lacks_is_not_computed(window, tmp_path):
    with Catalogue.build(tmp_path / "own.sqlite", links=[4, 6]) as own:
        own.evaluate(links=[4])
        ((angle, frame, driver),) = own.connection.execute(
            "SELECT value, frame, driver FROM evaluations WHERE kind = 'transmission'"
        ).fetchall()
        folder = tmp_path / "Átlas № 1, ход"
        folder.mkdir()
        report = build_site(own, folder / "page")
    window.get("about:blank")
    window.get(report.page.as_uri() + "#/1BAN4")
    until(window, "document.querySelector('#evaluations table')")
    rows = window.execute_script(
        "return [...document.querySelectorAll('#evaluations tbody tr')].map(r => [...r.cells].map(c => c.textContent))"
    )
    assert rows[0][:4] == [str(frame), str(driver), "dimensions", "found"]
    assert rows[1] == ["", "", "transmission", "found", f"{float(f'{math.degrees(angle):.4g}'):g}°", "estimated"]
    assert rows[2] == ["", "", "jamming", "not computed", "", ""]
    assert until(window, "document.querySelector('#entry iframe')?.src.includes('#m=')")
    window.get(report.page.as_uri() + "#/1BgOB7A")
    until(window, "document.querySelector('#entry h1')?.textContent === '1.6.4-2.2'")
    time.sleep(0.3)
    assert "jamming: not computed in this catalogue" in css(window, "#evaluations").text


def test_definitions_open_in_place_and_close_with_escape(page):
    window = page("#/1BAN4")
    term = until(window, "document.querySelector('#entry [data-term=mobility]')")
    height = window.execute_script("return document.documentElement.scrollHeight")
    term.click()
    assert "Freedoms left" in css(window, ".definition").text
    assert term.get_attribute("aria-expanded") == "true"
    assert window.execute_script("return document.documentElement.scrollHeight") == height  # nothing is pushed aside
    term.send_keys(keys.ESCAPE)
    assert not window.find_elements(by.CSS_SELECTOR, ".definition")
    assert window.switch_to.active_element == term


# --- find my mechanism


def found(window):
    return until(window, "document.querySelector('#answer .found')?.getAttribute('href')")


def test_a_pasted_matrix_leads_to_its_entry_and_inversion(page):
    window = page("#/find")
    field = until(window, "document.querySelector('#pasted')")
    field.send_keys("1 2\n2 3\n3 4\n4 1\n3 5\n5 6\n6 4")
    assert found(window) == "#/1BgMw8g"
    field.clear()
    field.send_keys("# frame 1\n0-1, 1-2, 2-3, 3-0")
    assert until(window, "document.querySelector('#answer .found')?.getAttribute('href').includes('frame')")
    css(window, "#answer .found").click()
    until(window, "document.querySelector('#entry h1')?.textContent === '1.4.4.1'")


REFUSED = {
    "0-1, 1-2, 0-2": "mobility is 0",
    "0-1, 1-2, 2-3": "only one joint",
    "0-1, 1-2, 2-0, 3-4, 4-5, 5-3": "not connected",
    "0-1, 1-2, 2-3, 3-4, 4-0": "does not reach chains of mobility 2",
    "0-1, 1-2, 0-2, 2-3, 3-4, 4-5, 0-5": "cannot move against each other",
    "0-1, 1": "make no pairs",
    "0-1 <b>": "not graph6",
}


def test_what_is_not_in_the_atlas_is_told_why(page):
    window = page("#/find")
    field = until(window, "document.querySelector('#pasted')")
    for text, why in REFUSED.items():
        field.clear()
        field.send_keys(text)
        until(window, "document.querySelector('#answer').textContent.includes(arguments[0])", why)
        assert not window.find_elements(by.CSS_SELECTOR, "#answer b")


def test_sentences_name_links_as_they_were_pasted(page):
    window = page("#/find")
    field = until(window, "document.querySelector('#pasted')")
    field.send_keys("11-12, 12-13, 13-14")
    until(window, "document.querySelector('#answer').textContent.includes('Link 11 has only one joint')")


def test_a_long_paste_is_turned_down_before_it_is_laid_out(page):
    window = page("#/find")
    until(window, "document.querySelector('#pasted')")
    kept = window.execute_script(
        """const data = new DataTransfer(), field = document.querySelector("#pasted");
           data.setData("text", "0 1 ".repeat(2500000));
           return field.dispatchEvent(new ClipboardEvent("paste", {clipboardData: data, cancelable: true}));"""
    )
    assert not kept  # the browser is told not to put it in
    assert css(window, "#answer").text == "10000000 characters: at most 20000 are read."


def test_nothing_plays_by_itself_where_motion_is_unwanted(page):
    window = page("#/1BAN4")
    still = [{"name": "prefers-reduced-motion", "value": "reduce"}]
    window.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": still})
    try:
        window.refresh()
        moving(window)
        assert window.execute_script("return Bench.app.motion.playing") is False
    finally:
        window.switch_to.default_content()
        window.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_seven_thousand_rows_are_chosen_and_sorted_at_once(page):
    window = page()
    until(window, "document.querySelectorAll('#list li').length")
    spent = window.execute_script(
        """const own = Atlas.rows; const many = [];
           while (many.length < 6856) many.push(...own.map(row => ({...row, id: many.length})));
           Atlas.rows = many.slice(0, 6856);
           const begin = performance.now();
           const found = Atlas.choose({links: "8", planar: "yes", text: "1.8", sort: "symmetry", down: "yes"});
           const spent = performance.now() - begin;
           Atlas.rows = own;
           return [found.length, spent];"""
    )
    assert spent[0] > 5000
    assert spent[1] < 100


def test_a_chain_is_drawn_by_mouse(page):
    from selenium.webdriver import ActionChains

    window = page("#/find")
    sheet = until(window, "document.querySelector('.sheet')")
    window.execute_script("arguments[0].scrollIntoView({block: 'center'})", sheet)
    corners = [(-100, 60), (-60, -60), (80, -60), (100, 60)]
    for k in range(4):
        for x, y in (
            corners[k],
            corners[(k + 1) % 4],
            corners[(k + 1) % 4],
        ):  # the second click on a pivot ends the link
            ActionChains(window, duration=0).move_to_element_with_offset(sheet, x, y).click().perform()
    assert found(window) == "#/1BAN4"
    assert css(window, "[name=letters]").get_attribute("value") == "AB BC CD DA"
    css(window, ".drawn input[value='0']").click()
    until(window, "document.querySelector('#answer .found').getAttribute('href').includes('frame')")


def test_a_chain_is_drawn_by_keyboard(page):
    window = page("#/find")
    sheet = until(window, "document.querySelector('.sheet')")
    window.execute_script("arguments[0].focus()", sheet)
    right, left, up, down = ([key] * 3 for key in (keys.ARROW_RIGHT, keys.ARROW_LEFT, keys.ARROW_UP, keys.ARROW_DOWN))
    for way in (right, up, left, down):
        sheet.send_keys(keys.ENTER, *way, keys.ENTER, "e")
    assert found(window) == "#/1BAN4"
    sheet.send_keys(keys.DELETE)  # the pivot under the cross: two bars lose an end
    until(window, "document.querySelectorAll('.drawn li').length === 2")
    sheet.send_keys(keys.CONTROL, "z")
    until(window, "document.querySelectorAll('.drawn li').length === 4")


def test_a_chain_is_given_by_letters(page):
    window = page("#/find")
    field = until(window, "document.querySelector('[name=letters]')")
    field.send_keys("ABE BC CD DAF EG GF")  # A: links 0 and 3, and so on
    joints = [(0, 3), (0, 1), (1, 2), (2, 3), (0, 4), (3, 5), (4, 5)]
    assert found(window) == f"#/{MechanismGraph(6, joints).key}"
    field.clear()
    field.send_keys("AB AC AD")
    until(window, "document.querySelector('#answer').textContent.includes('3 links meet in pivot A')")


# --- colours, small screens, size


def test_light_and_dark_by_the_system_and_by_choice(page):
    window = page()
    paper = "getComputedStyle(document.body).backgroundColor"
    light = window.execute_script(f"return {paper}")
    window.execute_cdp_cmd(
        "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": "dark"}]}
    )
    try:
        dark = window.execute_script(f"return {paper}")
        assert dark != light
        put(window, "#theme", "light")
        window.execute_script("document.querySelector('#theme').dispatchEvent(new Event('change'))")
        assert window.execute_script(f"return {paper}") == light
    finally:
        window.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
        put(window, "#theme", "auto")
        window.execute_script("document.querySelector('#theme').dispatchEvent(new Event('change'))")


def test_paper_is_white_whatever_the_screen(page):
    window = page("#/1BAN4")
    until(window, "document.querySelector('#entry h1')")
    dark = [{"name": "prefers-color-scheme", "value": "dark"}]
    window.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print", "features": dark})
    try:
        for theme in ("auto", "dark"):
            window.execute_script("document.documentElement.dataset.theme = arguments[0]", theme)
            colours = window.execute_script(
                "const s = getComputedStyle(document.body); return [s.backgroundColor, s.color]"
            )
            assert colours == ["rgb(255, 255, 255)", "rgb(32, 38, 43)"]
        assert not css(window, ".top").is_displayed()
        assert css(window, "#sketch").is_displayed()
    finally:
        window.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})
        window.execute_script("document.documentElement.dataset.theme = 'auto'")


def test_no_text_is_too_faint(page):
    # WCAG 2: 4.5 to 1 for text; colours of text on the paper and on cards, light and dark
    window = page()
    for theme in ("light", "dark"):
        ratios = window.execute_script(
            """document.documentElement.dataset.theme = arguments[0];
               const style = getComputedStyle(document.documentElement);
               const light = name => {
                 const hex = style.getPropertyValue(name).trim().replace(/^#(.)(.)(.)$/, "#$1$1$2$2$3$3");
                 const [r, g, b] = [1, 3, 5].map(k => parseInt(hex.slice(k, k + 2), 16) / 255)
                   .map(v => (v <= .03928 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4));
                 return .2126 * r + .7152 * g + .0722 * b;
               };
               const inks = ["--ink", "--note", "--mark", "--g1", "--g2", "--g3", "--g4", "--drive"];
               return ["--paper", "--card"].flatMap(back => inks.map(name => {
                 const [p, q] = [light(back), light(name)].sort((x, y) => y - x);
                 return [back + " " + name, (p + .05) / (q + .05)];
               }));""",
            theme,
        )
        window.execute_script("document.documentElement.dataset.theme = 'auto'")
        assert {name: ratio for name, ratio in ratios if ratio < 4.5} == {}, theme


def test_nothing_is_wider_than_a_phone(page):
    window = page()
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    window.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        for address in ("", "#/1.8.4-4.3", "#/1.4.4.1", "#/find", "#/about"):
            page(address)
            until(window, "document.querySelector('main > section:not([hidden])')?.offsetHeight > 200")
            time.sleep(0.2)
            assert window.execute_script("return document.documentElement.scrollWidth") <= 390, address
            assert window.execute_script("return innerWidth") == 390
    finally:
        size = {"width": 1280, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        window.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)


def test_controls_have_names(page):
    for address in ("", "#/1BAN4", "#/find", "#/about"):
        window = page(address)
        until(window, "document.querySelector('main > section:not([hidden])')?.offsetHeight > 200")
        nameless = window.execute_script(
            """const all = "button, input, select, textarea, a, iframe, svg[role]";
               const named = one => one.textContent.trim() || one.getAttribute("aria-label") || one.title ||
                 (one.labels && [...one.labels].some(label => label.textContent.trim()));
               const hidden = one => one.closest("[hidden]") || one.type === "hidden" || one.ariaHidden === "true";
               return [...document.querySelectorAll(all)].filter(one => !hidden(one) && !named(one))
                 .map(one => one.outerHTML.slice(0, 120))"""
        )
        assert nameless == []
        assert len(window.find_elements(by.CSS_SELECTOR, "main")) == 1


def test_nothing_jumps(page):
    for address in ("", "#/1BAN4", "#/1CAMBmSzA", "#/find"):
        window = page(address)
        until(window, "document.querySelector('main > section:not([hidden])')?.offsetHeight > 200")
        time.sleep(0.4)
        shift = window.execute_async_script(
            """const done = arguments[0]; let sum = 0;
               new PerformanceObserver(list => { for (const one of list.getEntries()) sum += one.value; })
                 .observe({type: "layout-shift", buffered: true});
               setTimeout(() => done(sum), 100);"""
        )
        assert shift < 0.02, address


def test_the_way_past_the_header_and_broken_addresses(page):
    window = page("#/1BAN4")
    until(window, "document.querySelector('#entry h1')?.textContent === '1.4.4.1'")
    window.execute_script("document.querySelector('.skip').click()")
    assert window.switch_to.active_element.get_attribute("id") == "page"
    assert window.current_url.endswith("#/1BAN4")
    for broken in ("#/%E0%A4%A", "#/<img src=x onerror=alert(1)>", "#/1.4.4.2", "#/1BAN4?frame=77&driver=x"):
        page(broken)
        until(window, "document.querySelector('#entry h1')")
        assert not window.find_elements(by.CSS_SELECTOR, "#entry img")


def test_the_page_asks_no_network(page):
    window = page("#/1BAN4")
    until(window, "document.querySelector('#entry iframe')")
    asked = window.execute_script("return performance.getEntriesByType('resource').map(entry => entry.name)")
    assert all(name.startswith("file:") for name in asked)
