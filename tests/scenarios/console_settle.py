#!/usr/bin/python3
"""console_settle.py LINK PICTURES: a panel was lifted in mid-cut, and scanned since: what the scan saw of many pieces is said at once."""
from console_day import Day, play

CUT, THERE = "[data-seen=cut]", "[data-seen=still_there]"


class Settling(Day):
    def is_there(self, css):
        return self.browser.execute_script("return document.querySelector(arguments[0]) !== null", css)

    def asked_about(self):
        return self.browser.execute_script("return window.askedAbout")

    def say(self, css, answer):
        self.browser.execute_script(
            "window.askedAbout = ''; window.confirm = (words) => { window.askedAbout = words; return arguments[0]; };".replace("arguments[0]", answer))
        self.press(css)
        self.until("the question", self.asked_about)

    def what_is_out_is_good(self):
        self.until_says("#next", "16 pieces of job 1 are suspect")
        self.go("run")
        self.until("what was seen gone", lambda: self.is_there(CUT))
        assert not self.is_there(THERE), "the other answer would speak of those, too"
        self.say(CUT, "false")
        assert self.is_there(CUT), "somebody thought better of it"
        assert "Say that these pieces are good: A" in self.asked_about(), self.asked_about()
        self.say(CUT, "true")
        self.until("that it is said", lambda: not self.is_there(CUT))

    def what_lies_there_was_never_touched(self):
        """A person has looked: the scan does not see a kerf."""
        self.until("what was seen there", lambda: self.is_there(THERE))
        self.show("settle-as-seen")
        self.say(THERE, "true")
        assert "is none burnt" in self.asked_about(), self.asked_about()
        self.until("that it is said", lambda: not self.is_there(THERE))


if __name__ == "__main__":
    play(Settling, "what_is_out_is_good", "what_lies_there_was_never_touched", "check_console")
