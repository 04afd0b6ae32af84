#!/usr/bin/python3
"""console_assembly.py LINK PICTURES: a job is cut, its pieces are laid and ticked off, one is lost and gets other wood;
and what a page lets go of: the browser holds no picture that nobody sees.
"""
import os
import subprocess

from selenium.webdriver.common.keys import Keys

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
        for tick in self.browser.find_elements("css selector", ".confirm input"):
            tick.click()
        self.press("[data-command=unsuspend]")
        self.until_says("#state-word", "Complete")

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

    def lay_by_keyboard(self):
        """Arrows go as the eye does: from the back, right is where the picture's left is."""
        self.browser.execute_script("document.activeElement.blur()")  # the finger had put it there
        self.keys(".assembly svg", Keys.ARROW_LEFT)
        by_keys = self.text("#assembly-said").split(":")[0]
        assert by_keys != self.third
        self.keys(".assembly svg", Keys.ARROW_RIGHT)
        self.said(f"{self.third}: cut, to be laid")
        self.keys(".assembly svg", " ")
        self.said(f"{self.third}: lies at its place")
        self.until_says("#laid-count", "2 of 16")
        self.until("what was said to be taken", lambda: self.find("#tick-piece").is_enabled())
        self.keys(".assembly svg", " ")
        self.said(f"{self.third}: cut, to be laid")
        self.until_says("#laid-count", "1 of 16")

    def kept_in_the_cell(self):
        self.browser.refresh()
        self.until_says("#laid-count", "1 of 16")
        self.said(f"{self.third}: cut, to be laid")
        shown = subprocess.run([os.environ["VENEERCTL"], "job", "assembled", "1", self.third], check=True, stdout=subprocess.PIPE, text=True)
        assert "2 of 16 pieces" in shown.stdout, shown.stdout
        self.said(f"{self.third}: lies at its place")

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

    def find_wood_and_shelf(self):
        subprocess.run([os.environ["VENEERCTL"], "panel", "material", "P-0001", "walnut"], check=True, stdout=subprocess.DEVNULL)
        subprocess.run([os.environ["VENEERCTL"], "panel", "set", "P-0001", "--shelf", "B7"], check=True, stdout=subprocess.DEVNULL)
        self.go("panels")
        for words, found in (("b7", 1), ("walnut", 1), ("b7 walnut", 1), ("ebony", 0)):
            self.find("input[type=search]").send_keys(Keys.CONTROL, "a")
            self.find("input[type=search]").send_keys(words)
            self.until(f"{found} for {words}", lambda: len(self.browser.find_elements("css selector", ".panel")) == found)
        self.find("input[type=search]").send_keys(Keys.CONTROL, "a", Keys.BACKSPACE)
        self.until_says(".panel", "walnut; Shelf B7")


if __name__ == "__main__":
    play(Table, "cut_it", "lay_by_finger", "lay_by_keyboard", "kept_in_the_cell", "lose_one", "let_pictures_go", "find_wood_and_shelf", "check_console")
