#!/usr/bin/python3
"""console_drawing.py LINK PICTURES: a drawing is burnt from Settings: run dark, shut again once the head has moved, run dark anew, burnt."""
import os
import subprocess

from selenium.webdriver.common.keys import Keys

from console_day import Day, play


class Drawn(Day):
    def write(self, css, text):
        def written():
            field = self.find(css)
            field.send_keys(Keys.CONTROL, "a")
            field.send_keys(text)
            return field.get_attribute("value") == text
        self.until(f"{text} in {css}", written)

    def is_open(self, css):
        return self.browser.execute_script("const found = document.querySelector(arguments[0]); return Boolean(found) && !found.disabled", css)

    def trace(self):
        self.press("#drawing-dry")
        self.until_says("#state-word", "Complete")
        self.until_says("main", "The drawing was traced with the beam off")
        self.until("that it may be burnt, but for what is asked by name", lambda: "Trace it without the beam first" not in self.text("main"))
        self.browser.execute_script("for (const box of document.querySelectorAll('[data-key=confirm-drawing] input:not(:checked)')) box.click()")
        self.until("that it may be burnt", lambda: self.is_open("#drawing-burn"))

    def reset(self):
        subprocess.run([os.environ["VENEERCTL"], "reset"], check=True, stdout=subprocess.DEVNULL)
        self.until_says("#state-word", "Idle")

    def a_drawing_is_burnt_once_it_was_traced(self):
        self.until_says("#role", "you operate")
        self.go("settings")
        self.until("the drawing's card", lambda: self.is_open("#drawing-file"))
        self.find("#drawing-file").send_keys(os.environ["DRAWING"])
        self.write("#drawing-power-0", "50")
        self.write("#drawing-speed_mm_s-0", "200")
        self.write("#drawing-x", "100")
        self.write("#drawing-y", "120")
        self.until_says("main", "x 100.0 to 160.0 mm, y 120.0 to 160.0 mm")
        assert not self.is_open("#drawing-burn"), "nobody has seen yet where it would burn"
        self.trace()
        self.browser.execute_script("document.querySelector('#drawing-file').closest('.card').scrollIntoView()")
        self.show("drawing")
        self.reset()  # by somebody else: the head has moved
        self.until("that it is shut again", lambda: not self.is_open("#drawing-burn"))
        self.trace()
        self.press("#drawing-burn")
        self.until_says("main", "The drawing is burnt")
        self.until("that each burning is traced", lambda: not self.is_open("#drawing-burn"))


if __name__ == "__main__":
    play(Drawn, "a_drawing_is_burnt_once_it_was_traced", "check_console")
