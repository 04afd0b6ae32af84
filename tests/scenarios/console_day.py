#!/usr/bin/python3
"""console_day.py LINK PICTURES: an operator's short day in the browser, from the link to STOP.

Each step waits for what the page shows, never for a time. Pictures of every screen at three sizes land in PICTURES.
"""
import os
import shutil
import subprocess
import sys
import time

from selenium import webdriver
from selenium.common.exceptions import NoSuchElementException, StaleElementReferenceException
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.actions.pointer_input import PointerInput
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select, WebDriverWait

SIZES = {"desk": (1280, 800), "wide": (1920, 1080), "phone": (390, 844)}
PATIENCE_S = 120
FIRST_VIEW_BYTES = 500_000
TARGET_PX = 45  # 12 mm at 96 px an inch


class Day:
    unread = False  # by axe-core, and that was told

    def __init__(self, link, pictures, *arguments):
        options = webdriver.ChromeOptions()
        for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", *arguments):
            options.add_argument(argument)
        options.binary_location = "/usr/bin/chromium"
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.browser = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
        # What the page asks for is noted, and its stream of events can be spoken into.
        self.browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": """
            window.asked = [], window.sockets = [];
            const plain = window.fetch;
            window.fetch = (path, ...more) => { window.asked.push(String(path)); return plain(path, ...more); };
            window.WebSocket = class extends WebSocket { constructor(...how) { super(...how); window.sockets.push(this); } };"""})
        self.browser.set_script_timeout(PATIENCE_S)
        self.pictures = pictures
        self.size("desk")
        self.browser.get(link)

    # ---- what an operator sees and does

    def find(self, css):
        return self.browser.find_element(By.CSS_SELECTOR, css)

    def text(self, css="body"):
        # The page may draw anew between finding and reading.
        return self.browser.execute_script(
            "const found = document.querySelector(arguments[0]); return found ? found.innerText : ''", css)

    def until(self, what, shown):
        # The page may draw anew between finding and asking.
        drawn_anew = (NoSuchElementException, StaleElementReferenceException)
        try:
            WebDriverWait(self.browser, PATIENCE_S, 0.05, drawn_anew).until(lambda _: shown())
        except Exception as fault:
            self.picture("failed", "desk")
            raise SystemExit(f"{what} did not come: {fault}\nThe page says:\n{self.text()}") from fault

    def until_says(self, css, words):
        self.until(f"“{words}” in {css}", lambda: words in self.text(css))

    def go(self, screen):
        self.find(f'#nav a[href$="#{screen}"]').click()
        self.until(screen, lambda: self.find(f'#nav a[href$="#{screen}"]').get_attribute("aria-current") == "page")

    def press(self, css):
        self.until(f"{css} to be allowed", lambda: self.browser.execute_script(
            "const found = document.querySelector(arguments[0]);"
            "if (!found || found.disabled) return false; found.click(); return true", css))

    def hands(self, *arguments):
        subprocess.run([os.environ["VENEERCTL"], "sim", *arguments], check=True, stdout=subprocess.DEVNULL)

    def keep_back(self, part):
        """What the page asks for at a path with this in it is answered only after let_go()."""
        self.browser.execute_script("""
            const fetch = window.fetch, part = arguments[0];
            const gone = new Promise((go) => { window.letGo = () => { window.fetch = fetch; go(); }; });
            window.fetch = async (path, ...more) => { if (String(path).includes(part)) await gone; return fetch(path, ...more); };""", part)

    def let_go(self):
        self.browser.execute_script("window.letGo()")

    def lose(self, part):
        """What the page asks for at a path with this in it is lost, and counted, until let_go()."""
        self.browser.execute_script("""
            const fetch = window.fetch, part = arguments[0];
            window.lost = 0;
            window.letGo = () => { window.fetch = fetch; };
            window.fetch = (path, ...more) => String(path).includes(part) ? (++window.lost, Promise.reject(new TypeError("lost"))) : fetch(path, ...more);""", part)

    # ---- what is looked at later

    def size(self, name):
        width, height = SIZES[name]
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})

    def picture(self, name, size):
        self.browser.save_screenshot(os.path.join(self.pictures, f"{name}-{size}.png"))

    def show(self, name):
        for size in SIZES:
            self.size(size)
            self.check_frame(f"{name} at {size}")
            self.picture(name, size)
        self.size("desk")
        self.check_accessible(name)

    def check_accessible(self, where):
        """Nothing serious by axe-core, where somebody has it: AXE_CORE names its axe.min.js. Debian has no package of it."""
        axe = os.environ.get("AXE_CORE")
        if not axe:
            if not self.unread:
                print("skipped: no screen is read by axe-core, since AXE_CORE names none")
            self.unread = True
            return
        with open(axe, encoding="utf-8") as file:
            self.browser.execute_script(file.read())
        found = self.browser.execute_async_script("""
            const done = arguments[0];
            axe.run(document, {resultTypes: ['violations']}).then(({violations}) => done(violations.filter(({impact}) => ['serious', 'critical'].includes(impact))
              .map(({id, nodes}) => [id, nodes.slice(0, 3).map(({html}) => html)])), (fault) => done([String(fault)]));""")
        assert not found, f"{where}: {found}"

    def check_frame(self, where):
        """STOP is on the screen and large, nothing runs out of its side, and every target is 12 mm high."""
        seen = self.browser.execute_script("""
            const box = document.querySelector('#stop button').getBoundingClientRect();
            const small = [...document.querySelectorAll('button, select, nav a, .go, a[href^="#"]:not(.skip), input[type=text], input[type=number], label:has(input)')]
                .filter((one) => one.offsetParent && one.getBoundingClientRect().height < arguments[0] - 1)
                .map((one) => one.innerText || one.id);
            return {stop: [box.left >= 0 && box.right <= innerWidth && box.top >= 0 && box.bottom <= innerHeight, box.height],
                    wide: document.documentElement.scrollWidth - innerWidth, small};""", TARGET_PX)
        assert seen["stop"][0] and seen["stop"][1] >= TARGET_PX, f"{where}: STOP is not on the screen"
        assert seen["wide"] <= 0, f"{where}: {seen['wide']} px run out of the side"
        assert not seen["small"], f"{where}: smaller than 12 mm: {seen['small']}"

    def check_console(self):
        """No script failed, and the page's policy stood in nobody's way. A picture that is not there yet is a 404, a
        glance at the bed while the camera is at work a 409, and one that a busy machine does not take in time a 503."""
        errors = [entry["message"] for entry in self.browser.get_log("browser")
                  if entry["level"] == "SEVERE" and "404" not in entry["message"]
                  and not ("glance.jpg" in entry["message"] and any(told in entry["message"] for told in ("409", "503")))]
        assert not errors, errors

    # ---- the day

    def morning(self):
        self.until_says("#role", "you operate")
        self.until_says("#next", "Job 1 “control” has 16 pieces to cut: Reset homes the laser first")
        self.weigh("English")
        # Who reads German for the first time has nothing of it from before.
        self.browser.execute_cdp_cmd("Network.enable", {})
        self.browser.execute_cdp_cmd("Network.setCacheDisabled", {"cacheDisabled": True})
        self.press("#language")
        self.until_says("#nav", "Platten")
        self.until_says("#next", "Als Nächstes:")
        self.weigh("German")
        self.browser.execute_cdp_cmd("Network.setCacheDisabled", {"cacheDisabled": False})
        self.press("#language")
        self.until_says("#nav", "Panels")
        self.until_says("#next", "Job 1 “control” has 16 pieces to cut: Reset homes the laser first")
        self.show("cell")

    def weigh(self, language):
        taken, unpacked = self.browser.execute_script(
            "const all = performance.getEntriesByType('resource').concat(performance.getEntriesByType('navigation'));"
            "return ['transferSize', 'decodedBodySize'].map((size) => all.reduce((sum, entry) => sum + entry[size], 0))")
        assert 0 < taken <= FIRST_VIEW_BYTES, f"the first view in {language} took {taken} bytes"
        assert taken < unpacked, f"the first view in {language} comes unpacked: {unpacked} bytes"
        print(f"first view in {language}: {taken} bytes over the wire, {unpacked} unpacked")

    def look_at_the_wood(self):
        self.go("panels")
        self.lose("/panels/P-0001/ledger")
        self.press('.panel[href="#panels/P-0001"]')
        self.until_says("main", "The cell does not answer")
        self.let_go()  # it is asked again
        self.until("the map", lambda: self.browser.execute_script(
            "const scan = document.querySelector('.map img.leaflet-image-layer'); return scan && scan.naturalWidth > 0"))
        self.look_closely()
        self.press("details[data-key=pieces] summary")
        self.press("details[data-key=pieces] .chips button")
        self.until_says("main", "PIECE A1-1")
        self.until_says("main", "to be cut")
        self.show("panel")

    def look_closely(self):
        """The scan comes in tiles, and only those that are looked at: the first of them does not lie where they are."""
        tiles = "const tiles = [...document.querySelectorAll('.leaflet-tiles-pane img')];"
        assert not self.browser.execute_script(tiles + "return tiles.length"), "the small picture would do"
        # The map takes no step while it takes one.
        self.until("the scan in tiles, as it was scanned", lambda: self.browser.execute_script(
            tiles + "if (tiles.length > 0 && window.asked.some((path) => path.includes('/map-tile.jpg?level=0')))"
            " return tiles.every((tile) => tile.naturalWidth === 512);"
            "document.querySelector('.leaflet-control-zoom-in').click(); return false"))
        self.picture("panel_close", "desk")
        self.go("panels")  # and back, as near as at first
        self.press('.panel[href="#panels/P-0001"]')
        self.until("the small picture alone", lambda: self.browser.execute_script(
            tiles + "return tiles.length === 0 && document.querySelector('.map img.leaflet-image-layer')"))

    def asked_for(self, part):
        return self.browser.execute_script("return window.asked.filter((path) => path.includes(arguments[0])).length", part)

    def settled(self, css):
        """Where it lies in the window, whole, once nothing moves it any more: pictures and sketches are there, and frames are alike."""
        lies, what = None, "nothing"
        def still():
            nonlocal lies, what
            seen, what = self.browser.execute_async_script("""
                const [css, done] = arguments, found = document.querySelector(css);
                if (!found) { done([null, 'it is not there']); return; }
                const lie = () => { const box = found.getBoundingClientRect(); return [box.left, box.top, box.width, box.height]; };
                const [left, top, width, height] = lie();
                if (left < 0 || top < 0 || left + width > innerWidth || top + height > innerHeight) {
                  found.scrollIntoView({block: 'center'});  // not under what stays at the top
                  done([null, `it lies at ${lie()} of ${innerWidth} x ${innerHeight}`]);
                } else if (document.querySelector('[aria-busy=true]')) {
                  done([null, 'a sketch is on its way']);
                } else if ([...document.images].some((one) => !one.complete)) {
                  done([null, `pictures are on their way: ${[...document.images].filter((one) => !one.complete).map((one) => one.src)}`]);
                } else {
                  requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(() =>
                    done(document.querySelector(css) === found && lie().join() === [left, top, width, height].join() ? [lie(), ''] : [null, 'it moves']))));
                }""", css)
            lies = seen
            return seen is not None
        try:
            self.until(f"{css} to lie still", still)
        except SystemExit as fault:
            raise SystemExit(f"{css}: {what}; {fault}") from fault
        return lies

    def draw_over(self, css, *shares):
        """As a finger does, from place to place, each as shares of what is drawn over."""
        left, top, width, height = self.settled(css)
        hand = ActionBuilder(self.browser, mouse=PointerInput("touch", "finger"))
        for number, (x, y) in enumerate(shares):
            hand.pointer_action.move_to_location(int(left + x * width), int(top + y * height))
            if number == 0:
                hand.pointer_action.pointer_down()
        hand.pointer_action.pointer_up()
        hand.perform()

    def keys(self, css, *keys):
        """As somebody who came here with the tabulator; Shift is held until it comes again, or to the end."""
        self.browser.execute_script("document.querySelector(arguments[0]).focus({focusVisible: true})", css)
        assert self.browser.execute_script("return getComputedStyle(document.activeElement).outlineStyle") == "solid", f"{css} has no focus to be seen"
        self.find(css).send_keys(*keys)

    def strokes_and_hearts_hold(self):
        """What no finger shows: a stroke with fewer points withholds all that it did, a heart lies in its piece whole."""
        fault = self.browser.execute_async_script("""
            const done = arguments[0];
            Promise.all([import('/console/strokes.js'), import('/console/outlines.js')]).then(([{kept, edits}, {heartOf, holds}]) => {
              const away = ([x, y], line) => Math.min(...line.map(([bx, by], i) => {
                const [ax, ay] = line[Math.max(0, i - 1)], [dx, dy] = [bx - ax, by - ay], long2 = dx * dx + dy * dy;
                const at = long2 ? Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / long2)) : 0;
                return Math.hypot(x - ax - at * dx, y - ay - at * dy);
              }));
              for (const width of [1, 8, 30]) for (const give of [false, true]) {
                const points = Array.from({length: 900}, (_, i) => [i / 9, 5 * Math.sin(i / 40) + .3 * Math.sin(i)]);
                const stroke = kept({give, width_mm: width, points_mm: points}), off = Math.max(...points.map((p) => away(p, stroke.points_mm)));
                if (stroke.points_mm.length > 800) return done('no point was left out');
                if (give ? stroke.width_mm > width - 2 * off : stroke.width_mm < width + 2 * off) return done(`${width} mm ${give}: ${stroke.width_mm} mm, ${off} off`);
              }
              const one = {give: false, width_mm: 4, points_mm: Array.from({length: 12}, (_, i) => [i, 0])}, other = {...one, give: true, points_mm: [[0, 9]]};
              const parts = edits([other, one, one], 5), line = parts.filter((part) => !part.give).flatMap((part) => part.strokes);
              if (parts.some((part) => part.strokes.flat().length > 5) || parts.reduce((sum, part) => sum + part.ended, 0) !== 3) return done(JSON.stringify(parts));
              for (let i = 0; i < 11; ++i)  // every side of it is in one part
                if (!line.some((part) => part.some(([x], k) => x === i && k + 1 < part.length && part[k + 1][0] === i + 1))) return done(`side ${i} is lost`);
              const bent = [[0, 0], [20, 0], [20, 3], [3, 3], [3, 17], [20, 17], [20, 20], [0, 20]], turned = bent.map(([x, y]) => [.8 * x - .6 * y, .6 * x + .8 * y]);
              for (const ring of [bent, turned, [...turned].reverse()]) {
                const {x, y, half} = heartOf(ring);
                for (let i = -1; i <= 1; i += .1) for (let j = -1; j <= 1; j += .1)
                  if (!holds(ring, x + .99 * i * half, y + .99 * j * half)) return done(`a heart of ${half} mm at ${x}, ${y} is not all in its piece`);
                if (half < .9) return done(`a heart of ${half} mm`);
              }
              if (heartOf([[0, 0], [10, 0], [20, 0]])) return done('a line has no heart');
              done('');
            }).catch((fault) => done(String(fault)));""")
        assert not fault, fault

    def paint_on_the_mask(self):
        """Strokes are of the panel and version they were painted on; what is saved is a version, and can be taken back."""
        self.strokes_and_hearts_hold()
        self.press("#brush")
        self.until("a finger that paints, and scrolls nothing", lambda: self.browser.execute_script(
            "return getComputedStyle(document.querySelector('.map.painting')).touchAction === 'none'"))
        for middle in (.4, .6):
            self.draw_over(".map", (.45, middle), (.5, middle + .03), (.55, middle))
        self.until_says("#brush-save", "Save 2 strokes")
        self.press("#brush-undo")
        self.until_says("#brush-save", "Save 1 stroke")
        self.paint_on_the_mask_by_keyboard()
        self.show("brush")
        self.keep_strokes_while_away()
        self.paint_while_another_hand_does()
        self.save_while_looking_elsewhere()
        self.show("painted")
        for left in (2, 1, 0):
            self.press("[data-edit] button")
            self.until(f"{left} edits", lambda: len(self.browser.find_elements(By.CSS_SELECTOR, "[data-edit]")) == left)

    def draw_a_strip(self):
        """Tapped corner by corner on the panel's map: what lies in it is a strip of its own."""
        self.press("#outline")
        for number, corner in enumerate(((.4, .4), (.6, .4), (.6, .6), (.5, .5)), 1):
            self.draw_over(".map", corner)
            self.until_says("#outline-said", "1 corner is set" if number == 1 else f"{number} corners are set")
        self.press("#outline-undo")
        self.until_says("#outline-said", "3 corners are set")
        self.show("outline")
        before = self.browser.execute_script("return document.querySelectorAll('#outline-zone option').length")
        self.press("#outline-keep")
        self.until_says("#outline-kept", "is now what lies in the outline")
        self.until("a strip more", lambda: self.browser.execute_script("return document.querySelectorAll('#outline-zone option').length") == before + 1)
        self.press("#outline")

    def paint_on_the_mask_by_keyboard(self):
        """Shift draws one stroke on its way; the map stays where it is."""
        self.keys(".map", Keys.ARROW_LEFT)
        self.until("where the crosshair stands", lambda: self.text("#brush-said").startswith("At "))  # not what a finger painted
        height = self.text("#brush-said").split("from the left")[1]  # what is said before the arrow's step is as high
        self.until("a crosshair", lambda: self.find(".map .crosshair"))
        self.keys(".map", Keys.SHIFT, Keys.ARROW_UP, Keys.ARROW_UP, Keys.SHIFT)
        self.until_says("#brush-save", "Save 2 strokes")
        self.until_says("#brush-said", "Painted: Withhold wood, 8 mm wide")
        self.press("#brush-undo")
        self.until_says("#brush-save", "Save 1 stroke")
        self.keys(".map", Keys.ARROW_DOWN, Keys.ARROW_DOWN)
        self.until("the height where it began", lambda: self.text("#brush-said").endswith(height))

    def keep_strokes_while_away(self):
        self.go("panels")
        self.until_says('.panel[href="#panels/P-0001"]', "1 stroke on its mask is not saved")
        assert self.browser.execute_script("return !dispatchEvent(new Event('beforeunload', {cancelable: true}))"), \
            "the page would be left with what is not saved"
        self.press('.panel[href="#panels/P-0001"]')
        self.until_says("#brush-save", "Save 1 stroke")

    def paint_while_another_hand_does(self):
        """What it was painted on counts no more: nothing is saved before somebody has looked."""
        subprocess.run([os.environ["VENEERCTL"], "panel", "mask", "P-0001", "--withhold", "1,1 4,1 4,4"], check=True, stdout=subprocess.DEVNULL)
        self.until_says("main", "The mask was changed since you painted")
        assert not self.browser.find_elements(By.CSS_SELECTOR, "#brush-save")
        self.show("brush-moved")
        self.press("#brush-fits")
        self.until_says("#brush-save", "Save 1 stroke")

    def save_while_looking_elsewhere(self):
        """Two edits, the second of them begun when another panel is shown; there is none, and it gets no strokes."""
        self.press("#brush")
        self.press("#brush-give")
        self.draw_over(".map", (.45, .5), (.55, .5))
        self.until_says("#brush-save", "Save 2 strokes")
        self.keep_back("/mask-edits")
        asked = self.asked_for("/panels/P-0001/mask-edits")
        self.press("#brush-save")
        self.browser.execute_script("location.hash = '#panels/P-0009'")
        self.until_says("main", "P-0009")
        self.let_go()
        self.until("both edits to be saved", lambda: self.asked_for("/panels/P-0001/mask-edits") >= asked + 2)
        self.browser.execute_script("location.hash = '#panels/P-0001'")
        self.until_says("main", "PAINTED BY HAND")
        self.until("three edits", lambda: len(self.browser.find_elements(By.CSS_SELECTOR, "[data-edit]")) == 3)
        self.until("nothing left to save", lambda: not self.browser.find_elements(By.CSS_SELECTOR, "#brush-save"))

    def painted(self, brush):
        """How many cells of the picture's mask are painted, as it is shown; None before it is."""
        return self.browser.execute_script(
            "const canvas = document.querySelector(`canvas[data-brush=${arguments[0]}]`); return canvas && canvas.dataset.painted", brush)

    def paint_over_the_picture(self):
        """What is painted belongs to the picture: another part, layout or file takes nothing of it."""
        layout = lambda wanted: Select(self.find("#picture-layout")).select_by_value(wanted)
        layout("morph")
        self.press("#edges summary")
        self.until("the picture to paint on", lambda: self.painted("edges") == "0")
        self.draw_over("canvas[data-brush=edges]", (.2, .3), (.8, .6))
        self.until("a veil", lambda: self.painted("edges") not in (None, "0"))
        veil = self.painted("edges")
        self.show("edges")
        self.press("#part summary")
        self.find("#slide-closer").send_keys(Keys.END)
        self.until("the veil on the closer part", lambda: self.painted("edges") not in (None, "0", veil))
        self.press("#take-whole")
        self.until("the same veil again", lambda: self.painted("edges") == veil)
        self.find("#slide-closer").send_keys(*5 * [Keys.ARROW_RIGHT], *5 * [Keys.ARROW_LEFT])
        self.until("all of the picture again", lambda: not self.browser.find_elements(By.CSS_SELECTOR, "#take-whole"))
        self.press("#part summary")
        layout("grid")
        self.until_says("#edges-idle", "They are kept")
        layout("morph")
        self.until("the veil", lambda: self.painted("edges") == veil)
        other = os.path.join(os.path.dirname(os.environ["PICTURE"]), "another.png")
        shutil.copy(os.environ["PICTURE"], other)
        self.find("#picture-file").send_keys(other)
        self.until("nothing on another picture", lambda: self.painted("edges") == "0")
        self.press("#edges summary")
        self.until_says("#edges", "stays with it. This is another picture")
        self.find("#picture-file").send_keys(os.environ["PICTURE"])
        self.until("the veil on the first one", lambda: self.painted("edges") == veil)
        self.press("#edges-undo")
        self.until("no veil", lambda: self.painted("edges") == "0")
        self.press("#matters summary")
        layout("grid")
        self.until("edges are not followed any more", lambda: self.painted("edges") is None)
        assert self.find("#matters").get_attribute("open"), "what was unfolded stays so, whatever comes or goes beside it"
        self.until("the picture to paint on", lambda: self.painted("matters") == "0")
        self.draw_over("canvas[data-brush=matters]", (.4, .4), (.6, .5))
        self.until("what matters", lambda: self.painted("matters") not in (None, "0"))
        self.until("a sketch of it", lambda: self.asked_for("importance=") > 0)
        self.show("matters")
        self.press("#matters-undo")
        self.until("all alike", lambda: self.painted("matters") == "0")
        self.keys("canvas[data-brush=matters]", Keys.SPACE)
        self.until_says("#matters-said", "Painted at 50 % from the left, 50 % from the top: + detail")
        self.until("what matters, by keyboard", lambda: self.painted("matters") not in (None, "0"))
        self.press("#matters-undo")
        self.until("all alike again", lambda: self.painted("matters") == "0")
        self.press("#matters summary")

    def lines(self, what):
        """What the lines over the picture say of themselves: grid, fine or pinned; None while others are on their way."""
        return self.browser.execute_script(
            "const canvas = document.querySelector('canvas.lines'); return canvas && canvas.dataset.grid ? canvas.dataset[arguments[0]] : null", what)

    def pin_where_lines_meet(self):
        """By finger and by keyboard; the lines follow, and the plan that is made next has what is pinned."""
        Select(self.find("#picture-layout")).select_by_value("morph")
        self.until("the lines of four pieces", lambda: self.lines("grid") == "2x2")
        self.draw_over("canvas.lines", (.5, .5), (.52, .5), (.6, .42))
        self.until_says("#lines-said", "Row 2, column 2: pinned")
        self.until("the lines through it, as the plan has them", lambda: self.lines("pinned") == "1" and self.lines("fine") == "true")
        assert self.asked_for("&pinned_vertices=1%2C1%2C") >= 2, "about where it was at first, and then as the plan has it"
        self.keys("canvas.lines", Keys.ARROW_UP)
        self.until_says("#lines-said", "Row 1, column 2: ")
        self.keys("canvas.lines", Keys.SHIFT, Keys.ARROW_LEFT)
        self.until_says("#lines-free", "Free all 2 pinned crossings")
        self.keys("canvas.lines", Keys.DELETE)
        self.until_says("#lines-said", "not pinned")
        self.until("the lines through the first alone", lambda: self.lines("pinned") == "1" and self.lines("fine") == "true")
        self.show("lines")
        left, top, width, height = self.settled("canvas.lines")
        hand = ActionBuilder(self.browser, mouse=PointerInput("mouse", "hand"))
        hand.pointer_action.move_to_location(int(left + .6 * width), int(top + .42 * height)).double_click()
        hand.perform()
        self.until("nothing pinned", lambda: self.lines("pinned") == "0")
        self.draw_over("canvas.lines", (.5, .5), (.52, .5), (.6, .42))
        self.until("a pinned crossing", lambda: self.lines("pinned") == "1")

    def lie_along_a_curve(self):
        """The cells of a mosaic come for what is drawn and painted, rough and then fine; all of it is taken back."""
        def cells(what):
            return self.browser.execute_script(
                "const canvas = document.querySelector('canvas.cells'); return canvas && canvas.dataset.cells ? canvas.dataset[arguments[0]] : null", what)
        Select(self.find("#picture-layout")).select_by_value("mosaic")
        self.until("its cells, as the plan has them", lambda: int(cells("cells") or 0) >= 2 and cells("fine") == "true")
        self.draw_over("canvas.cells", (.2, .3), (.4, .4), (.8, .5))
        self.until_says("#cells-said", "1 curve is drawn.")
        self.until("cells along it", lambda: cells("curves") == "1" and cells("fine") == "true")
        assert self.asked_for("plans/mosaic") >= 4 and self.asked_for("flow_lines=") >= 2, "about where they are at first, and then as the plan has them"
        self.press("#sizes summary")
        self.until("the picture to paint on", lambda: self.painted("sizes") == "0")
        self.draw_over("canvas[data-brush=sizes]", (.2, .2), (.3, .3))
        self.until("cells of the sizes that are painted", lambda: self.asked_for("cell_sizes=") >= 2 and cells("fine") == "true")
        self.show("cells")
        self.press("#sizes-undo")
        self.press("#sizes summary")
        self.press("#cells-undo")
        self.until("no curve any more", lambda: cells("curves") == "0")

    def scan_a_sheet(self):
        """What a scan saw waits for a word, on every screen's first line too; then it is stock."""
        self.hands("place", "panel", "scanner")
        self.go("scan")
        chosen = self.browser.execute_script(
            "return [...document.querySelectorAll('main section.card select')].map((one) => one.selectedOptions[0] && one.selectedOptions[0].text)")
        assert chosen == ["show face", "the cell finds out by its tags"], chosen
        self.keep_back("/picture.png")
        self.press("#do-scan")
        self.until_says("main", "A NEW PANEL: SHALL IT ENTER STOCK?")
        self.until_says("#next", "What the scanner saw, proposal ")
        self.until_says("main", "The picture is on its way.")
        assert not self.find("[id^=accept-]").is_enabled(), "nobody has seen it"
        self.let_go()
        self.until("its picture", lambda: self.browser.execute_script(
            "const seen = document.querySelector('img[alt^=\"What was seen\"]'); return seen && !seen.hidden && seen.naturalWidth > 0"))
        self.show("proposal")
        self.press("[id^=accept-]")
        self.until_says("main", "Panel P-0002, ")
        self.until("nothing waits any more", lambda: "SHALL IT ENTER STOCK" not in self.text("main"))

    def sketch(self):
        """Its pixels, once they are of what is wanted now."""
        return self.browser.execute_script("""
            const card = document.querySelector('.sketch'), image = document.querySelector('#sketch-picture');
            if (!card || card.getAttribute('aria-busy') !== 'false' || !image || !image.complete || !image.naturalWidth) return null;
            const canvas = document.createElement('canvas');
            [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
            canvas.getContext('2d').drawImage(image, 0, 0);
            return canvas.toDataURL();""")

    def follow_a_slider(self):
        self.until("a sketch", self.sketch)
        first = self.sketch()
        self.press("#part summary")
        self.find("#slide-closer").send_keys(Keys.END)
        self.until("a sketch of the closer picture", lambda: self.sketch() not in (None, first))
        self.show("sketch")
        self.press("#take-whole")
        self.draw_over("#crop-lower_right", (.5, .5), (.4, .4), (-1, -1.5))
        self.until_says("#part", "Take the whole picture")
        self.until("another shape of it", lambda: self.text("#part-size").split(" of ")[0] not in ("", self.text("#part-size").split("of its ")[-1].split(" pixels")[0]))
        self.until("a sketch of the part", lambda: self.sketch() not in (None, first))
        self.draw_over(".crop-part", (.5, .5), (.6, .6), (.9, .9))
        self.keys("#crop-upper_left", Keys.ARROW_LEFT, Keys.ARROW_LEFT)
        self.until("the part moved", lambda: self.find("#slide-across").get_attribute("value") != "0")
        self.show("crop")
        self.press("#take-whole")
        self.until("the first sketch again", lambda: self.sketch() == first)
        self.press("#part summary")

    def plan_a_picture(self):
        self.go("new")
        self.find("#picture-file").send_keys(os.environ["PICTURE"])
        for field, value in (("#picture-size", "20"), ("#picture-patch", "10")):
            # As a hand does: clear() tells the page of nothing, which then draws the old value again.
            self.find(field).send_keys(Keys.CONTROL, "a")
            self.find(field).send_keys(value)
        self.paint_over_the_picture()
        self.follow_a_slider()
        self.press("#do-plan")
        self.until_says(".side-by-side", "PLAN 2")
        self.lie_along_a_curve()
        self.pin_where_lines_meet()
        self.press("#do-plan")
        self.until_says(".side-by-side", "PLAN 3")
        for plan in (2, 3):
            self.press(f'ul.plans li[data-key="{plan}"] input')
        self.until("two plans side by side", lambda: len(self.browser.find_elements(By.CSS_SELECTOR, ".side-by-side > section")) == 2)
        self.until_says(".side-by-side", "P-0001: ")
        self.show("plans")
        self.press('.side-by-side section[data-key="3"] [data-command=other]')
        self.press("[data-command=brush]")
        self.until("the pieces to choose from", lambda: self.find("svg.chooser").size["height"] > 50)
        self.draw_over("svg.chooser", (.2, .2), (.25, .25))
        self.until_says("[data-command=make-changed]", "Make the plan with 1 change")
        for keys, words in (((Keys.ARROW_RIGHT, Keys.ARROW_RIGHT), "keeps its wood. 1 piece gets other."), ((" ",), "gets other wood. 2 pieces do."),
                            ((Keys.SHIFT, Keys.ARROW_DOWN), "gets other wood. 3 pieces do."), ((" ",), "keeps its wood. 2 pieces get other.")):
            self.keys("svg.chooser", *keys)
            self.until_says("#other-said", words)
        self.show("other-wood")
        self.keys("svg.chooser", Keys.ARROW_UP, " ")
        self.until_says("[data-command=make-changed]", "Make the plan with 1 change")
        self.press("[data-command=make-changed]")
        self.until_says("ul.plans", "4 second")
        self.until_says("#plan-differs", "1 piece has other wood than in plan 3")
        self.press('ul.plans li[data-key="2"] input')
        self.press('.side-by-side section[data-key="2"] [data-command=make-job]')
        self.until_says('.side-by-side section[data-key="2"]', "Job 2 is made of it.")

    def run_it(self):
        self.go("run")
        self.press('.jobs label[data-key="2"] input')
        self.until_says("#do-start", "Start job 2 “second”")
        self.press("[data-command=reset]")
        self.until_says("#state-word", "Idle")
        self.watch_the_bed()
        self.press("#do-start")
        self.until_says("#next", "Lay panel P-0001 on the bed, face down")
        self.until_says("[data-card=load]", "Load panel P-0001")
        self.show("load")
        self.hands("place", "control", "bed", "--face", "back")
        self.until_says("[data-card=load]", "Panel P-0001 is on the bed")
        self.until_says("#next", "Panel P-0001 is found")
        self.show("found")
        self.tick_what_is_asked()
        self.press("[data-command=unsuspend]")
        self.until_says("#state-word", "Execute")
        self.until_says("[data-card=load]", "Panel P-0001 is being cut")
        self.press("[data-command=hold]")
        self.until_says("#state-word", "Held")
        self.until_says("[data-card=load]", "the cut is held")
        self.show("held")
        self.press("[data-command=unhold]")
        self.until_says("#state-word", "Complete")
        self.until_says("#next", "take the pieces out of the machine, then Reset")
        self.show("complete")

    def watch_the_bed(self):
        """While nothing else needs the camera the bed is seen as it is now; a picture that grows old says so."""
        self.until("the bed as it is now", lambda: self.browser.execute_script(
            "const seen = document.querySelector('.view[data-bed=glance] img'); return seen && seen.naturalWidth > 0"))
        self.until_says(".view ~ .age", "Seen")
        self.lose("/bed/glance")
        self.browser.execute_script("window.clock = performance.now.bind(performance); performance.now = () => window.clock() + 11000")
        self.until_says(".view ~ .age", "Not live: this was seen")
        self.show("bed-old")
        self.let_go()
        self.until_says(".view ~ .age", "Seen")
        self.show("bed")
        self.go("cell")
        self.until("nobody to watch", lambda: self.browser.execute_script("return !document.querySelector('.view')"))
        self.go("run")

    def tick_what_is_asked(self):
        """Nothing can be begun before, and what was ticked for an earlier beginning does not count."""
        ticks = self.browser.find_elements(By.CSS_SELECTOR, ".confirm input")
        assert len(ticks) == 2 and not any(tick.is_selected() for tick in ticks), "two things are asked for"
        assert not self.find("[data-command=unsuspend]").is_enabled()
        for tick in ticks:
            tick.click()

    def begin_again(self):
        """The same job, panel and set-up once more, after an End: nothing is ticked then."""
        self.go("run")
        self.press("[data-command=reset]")
        self.until_says("#state-word", "Idle")
        self.press("#do-start")
        self.until_says("[data-card=load]", "Panel P-0001 is on the bed")
        self.tick_what_is_asked()
        self.press("[data-command=stop]")
        self.until_says("#state-word", "Stopped")
        self.press("[data-command=reset]")
        self.until_says("#state-word", "Idle")
        self.press("#do-start")
        self.until_says("[data-card=load]", "Panel P-0001 is on the bed")
        self.tick_what_is_asked()

    def hear_of_alarms(self):
        """An alarm is over and another is new: their numbers stay, and the list is another one."""
        before = self.asked_for("/alarms")
        self.browser.execute_script("window.sockets[window.sockets.length - 1].onmessage({data: JSON.stringify({type: 'alarms'})})")
        self.until("the list of alarms", lambda: self.asked_for("/alarms") > before)

    def look_back(self):
        for screen in ("assembly", "history", "log", "scan"):
            self.go(screen)
            self.until(f"something on {screen}", lambda: len(self.text("main")) > 20)
            self.show(screen)
        self.go("history")
        self.press('a[href="#history/2"]')
        self.until_says("main", "estimated ")
        self.until_says("main", "At the laser")
        self.until_says("main", "took ")
        self.show("history-job")

    def in_german(self):
        """Another language says all that English says, fits on each screen, and holds after the page is loaded anew."""
        lacking = self.browser.execute_async_script("""
            const done = arguments[0];
            Promise.all(["en", "de"].map((name) => import(`/console/words/${name}.js`))).then(([{words: en}, {words: de}]) => {
              const places = (text) => [...new Set(JSON.stringify(text).match(/{\\w+}/g))].sort().join();
              const other = (key) => !(key in de) || places(en[key]) !== places(de[key]) || typeof en[key] !== typeof de[key];
              done({keys: Object.keys(en).filter(other), idle: Object.keys(de).filter((key) => !(key in en) && !key.startsWith("step."))});
            });""")
        assert lacking == {"keys": [], "idle": []}, f"the German catalogue lacks or has too much: {lacking}"
        assert self.text("#language") == "Deutsch"
        self.press("#language")
        self.until_says("#nav", "Platten")
        self.until_says("#role", "Sie bedienen")
        self.until_says("#next", "Als Nächstes:")
        for screen in ("cell", "panels", "new", "run", "scan"):
            self.go(screen)
            self.show(f"german-{screen}")
        self.press("#language")
        self.until_says("#nav", "Panels")

    def stop(self):
        """From a screen that has nothing to do with the laser, scrolled to its end."""
        self.go("log")
        self.browser.execute_script("scrollTo(0, document.body.scrollHeight)")
        self.find("#stop button").click()
        self.until_says("#stop-note", "STOP confirmed")
        self.check_frame("after STOP")
        assert self.browser.execute_script(
            "const box = document.querySelector('#stop-note').getBoundingClientRect(); return box.top >= 0 && box.bottom <= innerHeight"), \
            "what became of STOP is not on the screen"
        self.until_says("#next", "Clear, then Reset")
        self.picture("stopped", "desk")


def play(kind, *parts):
    day = kind(sys.argv[1], sys.argv[2])
    began = time.monotonic()
    try:
        for part in parts:
            getattr(day, part)()
            print(f"{part}: {time.monotonic() - began:.1f} s")
    finally:
        day.browser.quit()


if __name__ == "__main__":
    play(Day, "morning", "look_at_the_wood", "paint_on_the_mask", "draw_a_strip", "scan_a_sheet", "plan_a_picture", "run_it", "begin_again", "hear_of_alarms",
         "look_back", "in_german", "stop", "check_console")
