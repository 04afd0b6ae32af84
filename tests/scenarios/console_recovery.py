#!/usr/bin/python3
"""console_recovery.py LINK PICTURES: the wrong panel is laid, STOP falls in the middle of a cut, what is suspect is decided on
from another screen, the rest is cut, a piece is cut once more and another one from other wood, and what is left makes a picture.
"""
import json
import os
import re
import signal
import socket
import subprocess

from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

from console_day import Day, play

OF_A_PIECE_MM = 48      # that its cut burns; its mark comes on top, before it
IN_THE_SECOND_MM = 112  # about half of its cut is burnt then


class Recovery(Day):
    def ctl(self, *arguments):
        return subprocess.run([os.environ["VENEERCTL"], *arguments], check=True, stdout=subprocess.PIPE, text=True).stdout

    def accept(self, seen):
        """Whatever the scan is in doubt about: this is not about that."""
        self.ctl("panel", "accept", str(seen["proposal"]), *(word for one in seen["warnings"] for word in ("--override", one["name"])))

    def status(self):
        return json.loads(self.ctl("status", "--json"))

    def burnt_mm(self):
        """Through the wood of the job's panel, as the twin knows it."""
        sheets = self.twin({"cmd": "burn-log"})["sheets"]
        return sum(one["through_mm"] for one in sheets if one["sheet"] == "control")

    def cut(self):
        """As the page counts them."""
        return int(re.match(r"\d+", self.text("#job-count")).group())

    def tick_all(self, css):
        self.browser.execute_script("for (const tick of document.querySelectorAll(arguments[0])) if (!tick.checked) tick.click()", css)

    def tick_and_go_on(self):
        self.until("Unsuspend to be there", lambda: self.find("[data-command=unsuspend]"))
        self.tick_all(".confirm input")
        self.press("[data-command=unsuspend]")

    def start(self):
        self.press("#do-start")
        self.until_says("[data-card=load]", "P-0001")

    # ---- the wrong panel

    def lay_the_wrong_panel(self):
        """Another one of the stock: a sentence names both, and nothing can be begun."""
        self.hands("new-panel", "other", "--width-mm", "180", "--height-mm", "130", "--strips", "2")
        self.hands("place", "other", "scanner", "--face", "show")
        self.accept(json.loads(self.ctl("panel", "scan", "--json")))
        self.hands("lift", "scanner")
        self.go("run")
        self.press("[data-command=reset]")
        self.until_says("#state-word", "Idle")
        self.start()
        self.until_says("[data-card=load]", "Load panel P-0001")
        self.hands("place", "other", "bed", "--face", "show")
        self.until_says("[data-card=load]", "Panel P-0002 is on the bed, but P-0001 is wanted")
        self.until_says("#next", "P-0001")
        self.tick_all(".confirm input")
        self.until("all to be ticked", lambda: self.browser.execute_script("const ticks = [...document.querySelectorAll('.confirm input')]; return ticks.length === 2 && ticks.every((one) => one.checked)"))
        enabled = self.browser.execute_script("return [...document.querySelectorAll('#do-start, .frame button, [data-command=unsuspend]')].filter((one) => !one.disabled).map((one) => one.innerText)")
        assert enabled == [], f"can be begun with the wrong panel: {enabled}"
        self.show("wrong-panel")
        self.comes_first_on_a_phone()

    def comes_first_on_a_phone(self):
        """What to do, the panel, the commands; then all else."""
        self.size("phone")
        tops = self.browser.execute_script("""
            return ['#next', '[data-card=load]', '.do .card', 'canvas.job-map'].map((css) => document.querySelector(css).getBoundingClientRect().top)""")
        assert tops == sorted(tops), tops
        self.size("desk")

    def lay_the_right_one(self):
        self.hands("lift", "bed")
        self.hands("place", "control", "bed", "--face", "back")
        self.until_says("[data-card=load]", "Panel P-0001 is on the bed")
        self.until("it to be found", lambda: "but P-0001 is wanted" not in self.text("[data-card=load]"))

    # ---- STOP in the middle of a cut

    def stop_in_the_middle(self):
        """The machine tells when the second piece is half cut; slowed down, so that it still is when STOP is pressed."""
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1])
        so_far = self.twin({"cmd": "status"})["laser"]["watchdog"]["burnt_mm"]
        self.twin({"cmd": "signal-at-burn", "pid": os.getpid(), "signal": int(signal.SIGUSR1), "burnt_mm": so_far + IN_THE_SECOND_MM})
        self.tick_and_go_on()
        self.until_says("#state-word", "Execute")
        self.ctl("laser", "override", "--feed", "25", "--power", "25")
        assert signal.sigtimedwait([signal.SIGUSR1], 90), "the second piece is never half cut"
        self.find("#stop button").click()
        self.until_says("#stop-note", "STOP confirmed")
        self.until_says("#state-word", "Aborted")
        self.until_says("#next", "Clear, then Reset")
        self.until("what was cut to be proven", self.is_proven)
        job = self.status()["job"]
        assert job["cut"] >= 1 and job["suspect"] == 1, job
        self.until_says("#job-count", "1 suspect")
        self.before = self.cut()
        self.show("stopped-in-the-middle")

    def twin(self, request):
        with socket.socket(socket.AF_UNIX) as twin:
            twin.connect(os.environ["VENEER_TWIN_SOCKET"])
            twin.sendall(json.dumps(request).encode() + b"\n")
            reply = json.loads(twin.makefile().readline())
        assert reply["ok"], reply
        return reply

    def is_proven(self):
        rows = json.loads(self.ctl("audit", "--kind", "run", "--json"))["entries"]
        return max(rows, key=lambda row: row["id"])["what"] == "run.proven"

    def decide_from_another_screen(self):
        """Clear, and then the one decision, in the first line of a screen that has nothing to do with the laser."""
        self.go("log")
        self.press("#next button")
        self.until_says("#state-word", "Stopped")
        self.until_says("#next", "say what became of it")
        self.until("its wood", lambda: self.browser.execute_script("const seen = document.querySelector('#next .decision img'); return seen && seen.naturalWidth > 0"))
        self.lost = self.text("#next .decision a")
        self.show("decide")
        verdicts = self.browser.execute_script("return [...document.querySelectorAll('#next .decision button')].map((one) => one.innerText)")
        assert verdicts == ["Good", "Lost", "Never touched"], verdicts
        self.press("#next .decision button:nth-of-type(2)")
        self.until("no decision left", lambda: not self.browser.find_elements("css selector", "#next .decision"))
        self.until_says("#next", "Reset homes the laser first")

    # ---- and on

    def cut_the_rest(self):
        self.hands("lift", "bed")
        self.go("run")
        self.press("[data-command=reset]")
        self.until_says("#state-word", "Idle")
        assert self.status()["laser"]["overrides_wanted"]["feed"] == 100, "what was turned down for the last run is still so"
        self.start()
        self.hands("place", "control", "bed", "--face", "back")
        self.until_says("[data-card=load]", "Panel P-0001 is on the bed")
        self.tick_and_go_on()
        self.until_says("[data-card=load]", "Panel P-0001 is being cut")
        self.until("how well it was found", lambda: re.search(r"Fit\s+0\.\d{3} mm", self.text("[data-card=load]")))
        self.watch_it_being_cut()
        self.until_says("#state-word", "Complete")
        self.until_says("#job-count", "15 of 16")
        assert self.before < 15

    def watch_it_being_cut(self):
        """Slowed down, so that it still is: the bed as it is now, with the pieces over it and those that are cut filled in."""
        self.ctl("laser", "override", "--feed", "25", "--power", "25")
        self.until("the bed as it is now, while it is cut", lambda: self.browser.execute_script("""
            const seen = document.querySelector('.view[data-bed=glance] img');
            return document.getElementById('state-word').innerText.includes('Execute') && seen && seen.naturalWidth > 0
              && document.querySelectorAll('.view path.is-cut').length > 0 && document.querySelectorAll('.view path.line:not(.is-cut)').length > 0"""))
        seen = self.browser.execute_script("return document.querySelector('.view[data-bed=glance] img').src")
        self.until("the next picture", lambda: self.browser.execute_script(
            "const next = document.querySelector('.view[data-bed=glance] img'); return next && next.naturalWidth > 0 && next.src !== arguments[0]", seen))
        self.show("being-cut")
        assert self.status()["state"] == "Execute", "it is cut while it is watched"
        self.ctl("laser", "override", "--feed", "100", "--power", "100")

    def cut_one_again(self):
        """While the panel lies as it was cut."""
        before = self.burnt_mm()
        self.press("details[data-key=recut] summary")
        mark = self.text("details[data-key=recut] .chips label")
        self.press("details[data-key=recut] .chips input")
        self.until("what is asked for a burn", lambda: self.find(".confirm input"))
        self.tick_all(".confirm input")
        self.until_says("details[data-key=recut]", f"Cut {mark} again")
        self.show("recut")
        self.press("details[data-key=recut] .commands button")
        self.until("it to be burnt again", lambda: self.burnt_mm() >= before + OF_A_PIECE_MM)
        self.until_says("#state-word", "Complete")
        self.until_says("#job-count", "15 of 16")

    def cut_the_lost_one_from_other_wood(self):
        self.hands("lift", "bed")
        self.press("[data-command=reset]")
        self.until_says("#state-word", "Idle")
        self.until_says("#next", "find other wood for it")
        self.show("missing")
        self.until("other wood to be looked for", lambda: self.browser.execute_script("""
            const card = [...document.querySelectorAll('section.card')].find((one) => one.getAttribute('aria-label').includes('Missing pieces'));
            const find = card && [...card.querySelectorAll('button')].find((one) => one.innerText === 'Find other wood');
            if (!find || find.disabled) return false;
            find.click();
            return true;"""))
        self.until_says("main", f"{self.lost} has other wood now.")
        self.until("no warning of what is not missing any more", lambda: "missing pieces" not in self.text("main").lower())
        self.until_says("#next", "has 1 piece to cut")
        self.start()
        self.hands("place", "control", "bed", "--face", "back")
        self.until_says("[data-card=load]", "Panel P-0001 is on the bed")
        self.tick_and_go_on()
        self.until_says("#state-word", "Complete")
        self.until_says("#job-count", "16 of 16")
        self.hands("lift", "bed")

    # ---- what is left

    def is_compared(self):
        self.tick_all("[data-doubt]")
        self.browser.execute_script("const accept = document.querySelector('[id^=accept-]'); if (accept && !accept.disabled) accept.click()")
        return "Panel P-0001, show face" in self.text("main")

    def plan_from_what_is_left(self):
        """The panel with holes is scanned, and another picture, of tiles with curved borders, finds its wood in it."""
        self.press("[data-command=reset]")
        self.until_says("#state-word", "Idle")
        self.hands("place", "control", "scanner", "--face", "show")
        self.go("scan")
        self.press("#do-scan")
        self.until("it to be compared, and accepted where it is to be", self.is_compared)
        self.hands("lift", "scanner")
        self.show("remnant-scanned")
        self.go("new")
        self.find("#picture-file").send_keys(os.environ["PICTURE"])
        Select(self.find("#picture-layout")).select_by_value("mosaic")
        for field, value in (("#picture-size", "20"), ("#picture-patch", "10")):
            self.find(field).send_keys(Keys.CONTROL, "a")
            self.find(field).send_keys(value)
        self.press("#do-plan")
        self.until("the plan", lambda: ": second" in self.text(".side-by-side").lower())
        self.until_says(".side-by-side", "P-0001: ")
        self.press("[data-command=make-job]")
        self.until_says(".side-by-side", "Job 2 is made of it.")

    def cut_the_second_picture(self):
        """From the remnant, which lies elsewhere on the bed than it did."""
        self.go("run")
        self.press("#do-start")
        panels = [one["panel"] for one in json.loads(self.ctl("job", "show", "2", "--json"))["panels"]]
        for done, panel in enumerate(panels):
            self.until_says("[data-card=load]", panel)
            self.hands("place", "control" if panel == "P-0001" else "other", "bed", "--face", "back")
            self.until_says("[data-card=load]", f"Panel {panel} is on the bed")
            if done == 0:
                self.show("second-picture-found")
            before = self.status()["job"]["cut"]
            self.tick_and_go_on()
            self.until("its pieces to be cut", lambda: self.status()["state"] in ("Complete", "Suspended") and self.status()["job"]["cut"] > before)
            self.hands("lift", "bed")
        self.until_says("#state-word", "Complete")
        self.show("second-picture-cut")


if __name__ == "__main__":
    play(Recovery, "lay_the_wrong_panel", "lay_the_right_one", "stop_in_the_middle", "decide_from_another_screen", "cut_the_rest", "cut_one_again",
         "cut_the_lost_one_from_other_wood", "plan_from_what_is_left", "cut_the_second_picture", "check_console")
