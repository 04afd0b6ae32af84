#!/usr/bin/python3
"""console_assembly.py LINK PICTURES: a job is cut, its pieces are laid and ticked off, one is lost and gets other wood;
and what a page lets go of: the browser holds no picture that nobody sees.
"""
import json
import os
import subprocess

from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

from console_day import Day, play


class Table(Day):
    def cut_it(self):
        self.until_says("#next", "Job 1 “control”")
        self.go("run")
        self.press("[data-command=reset]")
        self.until_says("#state-word", "Idle")
        self.press("#do-start")
        self.until_says("#next", "Lay panel P-0001 on the bed")
        self.until("its back with the tags", lambda: self.browser.execute_script(
            "return document.querySelectorAll('svg.back[data-back=P-0001] text').length") > 0)
        self.show("load-back")
        self.hands("place", "control", "bed", "--face", "back")
        self.until_says("[data-card=load]", "Panel P-0001 is on the bed")
        self.look_closely()
        for tick in self.browser.find_elements("css selector", ".confirm input"):
            tick.click()
        self.press("[data-command=unsuspend]")
        self.until_says("#state-word", "Complete")

    def look_closely(self):
        """Picture and strokes grow together, and the head is where the machine says that it is."""
        shown = lambda: self.browser.execute_script("""
            const svg = document.querySelector('.view[data-bed] svg'), img = document.querySelector('.view[data-bed] img');
            return [svg.getAttribute('viewBox').split(' ').map(Number), new DOMMatrix(getComputedStyle(img).transform).a];""")
        assert shown() == [[0, 0, 1, 1], 1], shown()
        self.press("#bed-close")
        self.until("a part of the picture", lambda: shown()[0][2] < 1)
        [_, _, wide, high], larger = shown()
        assert wide == high and abs(larger * wide - 1) < 1e-6, "the lines are not where the picture shows what they are of"
        self.until("the head", lambda: len(self.browser.find_elements("css selector", ".view path.head")) == 2)
        self.show("close-up")
        self.press("#bed-whole")
        self.until("all of it", lambda: shown()[0] == [0, 0, 1, 1])

    def said(self, words):
        self.until_says("#assembly-said", words)

    def tap(self, mark):
        """Where it is drawn: as somebody who looks for its mark."""
        left, top, width, height = self.browser.execute_script("""
            const text = [...document.querySelectorAll('.assembly text')].find((one) => one.textContent.endsWith(arguments[0]));
            text.scrollIntoView({block: 'center', behavior: 'instant'});  // not under what stays at the top
            const box = text.getBoundingClientRect(); return [box.left, box.top, box.width, box.height];""", mark)
        self.browser.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": "mousePressed", "x": left + width / 2, "y": top + height / 2, "button": "left", "clickCount": 1})
        self.browser.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": "mouseReleased", "x": left + width / 2, "y": top + height / 2, "button": "left", "clickCount": 1})

    def lay_by_finger(self):
        self.go("assembly")
        self.until_says("#laid-count", "0 of 16 pieces lie at their places")
        assert self.browser.execute_script("return Boolean(document.querySelector('.assembly.mirrored'))"), "it is laid face down"
        self.until("the picture", lambda: self.browser.execute_script("const seen = document.querySelector('.assembly img'); return seen && !seen.hidden && seen.naturalWidth > 0"))
        marks = self.browser.execute_script("return [...document.querySelectorAll('.assembly text')].map((one) => one.textContent)")
        self.first, self.second, self.third = marks[0], marks[1], marks[2]
        self.tap(self.second)
        self.said(f"{self.second}: cut, to be laid")
        self.press("#tick-piece")
        self.said(f"{self.second}: lies at its place")
        self.until_says("#laid-count", "1 of 16")
        self.until_says(".assembly-piece", "Ticked off by console link")
        self.press("#next-piece")
        self.said(f"{self.third}: cut, to be laid")
        self.show("assembly")

    def see_from(self, view):
        """The picture beneath the outlines turns with them, and marks stay as they are read."""
        self.find(f".assembly-views button[data-view={view}]").click()
        self.until(f"the {view} view", lambda: self.find(f".assembly-views button[data-view={view}]").get_attribute("aria-pressed") == "true")
        turned = self.browser.execute_script("return [...document.querySelectorAll('.assembly img, .assembly svg')].map((one) => getComputedStyle(one).transform)")
        assert turned == ["matrix(-1, 0, 0, 1, 0, 0)" if view == "back" else "none", "none"], turned

    def on_screen(self, mark):
        return self.browser.execute_script("""
            const box = [...document.querySelectorAll('.assembly text')].find((one) => one.textContent.endsWith(arguments[0])).getBoundingClientRect();
            return box.left + box.width / 2;""", mark)

    def in_picture(self, mark):
        """As the cell has it: seen from the show side."""
        return self.browser.execute_async_script("""
            const [mark, done] = arguments;
            import('/console/link.js').then(({askAll}) => askAll('/jobs/1/pieces', 'pieces')).then((pieces) => {
              const xs = pieces.find((one) => one.mark === mark).artwork_outline_mm.map(([x]) => x);
              done((Math.min(...xs) + Math.max(...xs)) / 2);
            });""", mark)

    def lay_by_keyboard(self):
        """Arrows go as the eye does: from the back, right is where the picture's left is."""
        self.browser.execute_script("document.activeElement.blur()")  # the finger had put it there
        beside = {}
        for view, sign in (("back", -1), ("show", 1)):
            self.see_from(view)
            self.keys(".assembly svg", Keys.ARROW_LEFT)
            said = lambda: self.text("#assembly-said").split(":")[0]
            self.until("a piece beside it", lambda: said() not in ("", self.third))
            beside[view] = said()
            assert self.on_screen(beside[view]) < self.on_screen(self.third), f"{view}: {beside[view]} is not left of {self.third} on the screen"
            assert sign * self.in_picture(beside[view]) < sign * self.in_picture(self.third), f"{view}: {beside[view]} is on the wrong side in the picture"
            self.keys(".assembly svg", Keys.ARROW_RIGHT)
            self.said(f"{self.third}: cut, to be laid")
        assert beside["back"] != beside["show"], "the same neighbour is left of it from both sides"
        self.see_from("back")
        self.keys(".assembly svg", " ")
        self.said(f"{self.third}: lies at its place")
        self.until_says("#laid-count", "2 of 16")
        self.until("what was said to be taken", lambda: self.find("#tick-piece").is_enabled())
        self.keys(".assembly svg", " ")
        self.said(f"{self.third}: cut, to be laid")
        self.until_says("#laid-count", "1 of 16")

    def seen_above_the_sheet(self):
        """On a phone the piece is a sheet at the foot of the screen, and its place on the map stays in sight above it."""
        self.size("phone")
        self.tap(self.second)
        self.said(self.second)
        places = lambda: self.browser.execute_script("""
            const of = (css) => document.querySelector(css).getBoundingClientRect();
            return [of('header').bottom, of('.assembly .ring').top, of('.assembly .ring').bottom, of('.assembly-piece').top, of('.assembly-piece').bottom, innerHeight];""")
        def seen():
            header, top, bottom, sheet, foot, window = places()
            return header <= top < bottom <= sheet and foot <= window and window - sheet < .35 * window
        self.until("the piece on the map above the sheet", seen)
        redo = lambda: self.browser.execute_script("return Boolean(document.querySelector('#redo-piece').offsetParent)")
        assert not redo(), "what is seldom done takes the map's place"
        self.picture("assembly-sheet", "phone")
        self.press("#piece-more")
        self.until("more", redo)
        self.press("#piece-more")
        self.until("less", lambda: not redo())
        self.size("desk")
        self.tap(self.third)

    def find_in_the_log(self):
        """The cell looks through all of it; a row leads to what it names."""
        whats = lambda: self.browser.execute_script("return [...document.querySelectorAll('tbody td:nth-child(3) small')].map((one) => one.textContent)")
        self.go("log")
        self.until("requests among the rows", lambda: any(what.startswith("api.") for what in whats()))
        Select(self.find("#log-kind")).select_by_value("run")
        self.until("runs and nothing else", lambda: whats() and all(what.startswith("run.") for what in whats()))
        self.find("#log-text").send_keys("p-0001 end")
        self.until("the end of the run", lambda: whats() == ["run.end"])
        self.until_says("tbody td:nth-child(3)", "A run ended")
        self.show("log-found")
        self.find("#log-text").send_keys(" nowhere")
        self.until_says("main", "Nothing like that is noted")
        self.press("#log-everything")
        self.until("requests again", lambda: any(what.startswith("api.") for what in whats()))
        self.browser.execute_script("location.hash = '#log/job/1'")
        self.until("what is noted of job 1", lambda: "job.start" in whats() and "alarm.new" not in whats())
        self.press("tbody a[href='#history/1']")
        self.until_says("main", "Job 1: control")

    def kept_in_the_cell(self):
        self.browser.refresh()
        self.until_says("#laid-count", "1 of 16")
        self.said(f"{self.third}: cut, to be laid")
        shown = subprocess.run([os.environ["VENEERCTL"], "job", "assembled", "1", self.third], check=True, stdout=subprocess.PIPE, text=True)
        assert "2 of 16 pieces" in shown.stdout, shown.stdout
        self.said(f"{self.third}: lies at its place")

    def overtaken_by_another(self):
        """Ticked off here, and taken back by somebody else before the lists came: what the cell says last is so."""
        ctl = lambda *more: subprocess.run([os.environ["VENEERCTL"], "job", "assembled", "1", self.third, *more], check=True, stdout=subprocess.DEVNULL)
        ctl("--take-back")
        self.said(f"{self.third}: cut, to be laid")
        self.until("the button", lambda: self.find("#tick-piece").is_enabled())
        self.keep_back("/jobs/1/pieces")
        taken = self.asked_for("/jobs/1/assembled")
        self.press("#tick-piece")
        self.said(f"{self.third}: lies at its place")
        self.until("it to be taken", lambda: self.asked_for("/jobs/1/pieces") > 0 and self.asked_for("/jobs/1/assembled") > taken)
        self.until_says_assembled(2)
        ctl("--take-back")
        self.let_go()
        self.said(f"{self.third}: cut, to be laid")
        self.until_says("#laid-count", "1 of 16")
        ctl()
        self.said(f"{self.third}: lies at its place")

    def until_says_assembled(self, pieces):
        """To the cell, whatever this page shows."""
        show = lambda: subprocess.run([os.environ["VENEERCTL"], "job", "show", "1", "--json"], check=True, stdout=subprocess.PIPE, text=True).stdout
        self.until(f"{pieces} to be laid in the cell", lambda: json.loads(show())["assembled"] == pieces)

    def lose_one(self):
        self.tap(self.second)
        self.said(f"{self.second}: lies at its place")
        self.browser.execute_script("window.confirm = () => true")
        self.press("#redo-piece")
        self.until_says(".assembly-piece", "still to be cut")
        self.until_says("#laid-count", "1 of 16")
        self.show("assembly-redo")

    def live_pictures(self):
        return self.browser.execute_script("return window.urls.size")

    def let_pictures_go(self):
        """From screen to screen and back, and as many are held as before."""
        self.browser.execute_script("""
            window.urls = new Set();
            const make = URL.createObjectURL, drop = URL.revokeObjectURL;
            URL.createObjectURL = (...what) => { const url = make.call(URL, ...what); window.urls.add(url); return url; };
            URL.revokeObjectURL = (url) => { window.urls.delete(url); return drop.call(URL, url); };""")
        def round_trip():
            self.go("panels")
            self.until("thumbnails", lambda: self.browser.execute_script("const seen = document.querySelector('.panel img'); return seen && seen.naturalWidth > 0"))
            self.press('.panel[href="#panels/P-0001"]')
            self.until("the map", lambda: self.browser.execute_script(
                "const scan = document.querySelector('.map img.leaflet-image-layer'); return scan && scan.naturalWidth > 0"))
            self.go("history")
            self.until("a picture", lambda: self.browser.execute_script("const seen = document.querySelector('.wood'); return seen && seen.naturalWidth > 0"))
            self.go("log")
            self.until("none is held", lambda: self.live_pictures() == 0)
        round_trip()
        round_trip()

    def wood_of_a_plan_as_it_is_now(self):
        """An older question's answer comes after a younger one's: the younger one counts."""
        self.browser.execute_script("""
            const fetch = window.fetch;
            let first = true;
            window.letGo = null;
            window.fetch = async (path, ...more) => {
              const reply = await fetch(path, ...more), late = first && String(path).endsWith('/panels/P-0001');
              if (!late) return reply;
              first = false;
              const old = await reply.text();
              await new Promise((go) => { window.letGo = () => { window.fetch = fetch; go(); }; });
              return new Response(old);
            };""")
        self.go("new")
        self.until("the first question to be answered", lambda: self.browser.execute_script("return Boolean(window.letGo)"))
        subprocess.run([os.environ["VENEERCTL"], "panel", "material", "P-0001", "maple"], check=True, stdout=subprocess.DEVNULL)
        self.until_says(".side-by-side", "maple")
        self.let_go()
        looks = self.asked_for("/status")
        self.until("two more looks at the cell", lambda: self.asked_for("/status") > looks + 1)
        assert "maple" in self.text(".side-by-side"), "an old answer took the place of a new one"

    def find_wood_and_shelf(self):
        """What somebody else says of a panel is on this page at once, on the shelf and on the panel's own screen."""
        ctl = lambda *command: subprocess.run([os.environ["VENEERCTL"], "panel", *command], check=True, stdout=subprocess.DEVNULL)
        self.go("panels")
        self.until_says(".panel", "P-0001")
        ctl("material", "P-0001", "walnut")
        self.until_says(".panel", "walnut")
        self.press('.panel[href="#panels/P-0001"]')
        self.until_says("main", "walnut")
        ctl("material", "P-0001", "cherry")
        self.until_says("main", "cherry")
        ctl("set", "P-0001", "--shelf", "B7")
        self.until_says("main", "B7")
        ctl("material", "P-0001", "walnut")
        self.go("panels")
        for words, found in (("b7", 1), ("walnut", 1), ("b7 walnut", 1), ("ebony", 0)):
            self.find("input[type=search]").send_keys(Keys.CONTROL, "a")
            self.find("input[type=search]").send_keys(words)
            self.until(f"{found} for {words}", lambda: len(self.browser.find_elements("css selector", ".panel")) == found)
        self.find("input[type=search]").send_keys(Keys.CONTROL, "a", Keys.BACKSPACE)
        self.until_says(".panel", "walnut; Shelf B7")


if __name__ == "__main__":
    play(Table, "cut_it", "lay_by_finger", "lay_by_keyboard", "seen_above_the_sheet", "kept_in_the_cell", "overtaken_by_another", "lose_one", "let_pictures_go", "find_wood_and_shelf", "wood_of_a_plan_as_it_is_now", "find_in_the_log", "check_console")
