#!/usr/bin/python3
"""setup_day.py LINK PICTURES: from the unpacked simulated machine to the first cut piece, in the browser alone.

Each of an operator's decisions is one press; how many there were is counted, and more than 12 are too many.
"""
from selenium.webdriver.common.by import By

from console_day import Day, play

MOST_DECISIONS = 12
# Each decision, and the step of Set up that it leads to.
WAY = [("#do-scanner", "camera"), ("#do-camera", "laser"), ("#do-laser", "kerf"), ("#do-kerf", "wood"), ("#do-wood", "wood"),
       ("#do-accept", "wood"), ("#do-wood", "picture"), ("#do-picture", "cut"), ("#do-begin", "cut"), ("#do-lay", "cut"),
       ('[data-command="unsuspend"]', "cut")]


class FirstDay(Day):
    decisions = 0

    def step(self):
        return self.browser.execute_script(
            "const shown = document.querySelector('[data-step]'); return shown ? shown.dataset.step : ''")

    def decide(self, css, step):
        self.press(css)
        self.decisions += 1
        self.until(f"step {step} after {css}", lambda: self.step() == step)

    def set_up(self):
        """A cell that never cut opens with it."""
        self.until("the scanner's step", lambda: self.step() == "scanner")
        self.until_says("#role", "you operate and maintain")
        self.show("setup")
        for css, step in WAY[:5]:
            self.decide(css, step)
        self.until("what was seen", lambda: self.browser.execute_script(
            "const seen = document.querySelector('.seen'); return seen && !seen.hidden && seen.naturalWidth > 0"))
        self.show("setup-proposal")

    def left_and_gone_on_with(self):
        """Another screen, then the page anew: what is done is the cell's."""
        self.go("calibration")
        self.until_says("main", "Calibrate it anew")
        self.show("calibration")
        self.browser.refresh()
        self.until_says("main", "Calibrate it anew")
        self.go("setup")
        for css, step in WAY[5:-1]:
            self.decide(css, step)
        self.until("the panel to be found", lambda: self.find('[data-command="unsuspend"]').is_enabled())
        self.show("setup-found")
        self.decide(*WAY[-1])
        self.until_says("#state-word", "Complete")
        self.until_says("main", "pieces are cut")
        self.show("setup-done")
        assert self.decisions <= MOST_DECISIONS, f"{self.decisions} decisions"
        print("decisions:", self.decisions)

    def settings(self):
        """A recipe of one's own, and the card to find it with."""
        self.go("settings")
        self.until_says("main", "every wood")
        self.show("settings")
        self.press("details[data-key=recipe-form] summary")
        self.find("#recipe-material").send_keys("walnut")
        self.press("#do-recipe")
        self.until_says("main", "walnut, cut")

    def devices(self):
        """A camera is chosen for the next start, and a simulation again in its place, which is asked."""
        self.go("setup")
        self.press("li[data-key=devices] button")
        self.until_says('[data-device="laser"]', "Nothing is chosen yet")
        self.press("#look-devices")
        self.until_says('[data-device="camera"]', "bed.jpg")
        self.until("scanners to be asked for", lambda: self.find("#look-devices").is_enabled())
        self.press('[data-device="camera"] input[value$="bed.jpg"]')
        self.press("#choose-camera")
        self.until_says('[data-device="camera"]', "Next start")
        self.until_says("[data-key=restart]", "started by hand")
        self.show("devices")
        self.press('[data-device="camera"] input[value="sim"]')
        self.until("a word that a simulation is meant to be waited for", lambda: not self.find("#choose-camera").is_enabled())
        self.press("#sure-camera")
        self.press("#choose-camera")
        self.until("the simulation to stay", lambda: "Next start" not in self.text('[data-device="camera"]'))

    def alarms(self):
        """STOP is one; seen, cleared, and over."""
        self.find("#stop button").click()
        self.until_says("#stop-note", "STOP confirmed")
        self.until_says("#nav", "Alarms (1)")
        self.go("alarms")
        self.until("one that is new", lambda: len(self.browser.find_elements(By.CSS_SELECTOR, ".alarms .bad")) == 1)
        self.show("alarms")
        self.press("[data-alarm]")
        self.until_says("main", "seen by console link")
        self.press("#next button")  # Clear, from a screen that has nothing to do with the laser
        self.until_says("main", "over, since")
        self.until("none in the tab", lambda: "(" not in self.text("#nav"))


if __name__ == "__main__":
    play(FirstDay, "set_up", "left_and_gone_on_with", "settings", "devices", "alarms", "check_console")
