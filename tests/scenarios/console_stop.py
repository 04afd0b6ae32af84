#!/usr/bin/python3
"""console_stop.py LINK PICTURES: STOP that is not heard, or not heard of, what is not live, and Start while others make and cancel jobs."""
import os
import subprocess

from console_day import Day, play

STOP = "/api/v1/stop"
MANY = 24  # more tries than the quick ones


class Doubtful(Day):
    def lost(self):
        return self.browser.execute_script("return window.lost")

    def note(self):
        return self.text("#stop-note") if self.find("#stop-note").is_displayed() else ""

    def clear(self):
        self.press("#next button")
        self.until_says("#state-word", "Stopped")
        self.until("nothing said of STOP any more", lambda: not self.note())

    def sent_until_it_is_heard(self):
        """However long that takes; and who was told that it is not confirmed may say that it is seen to."""
        self.until_says("#next", "Job 1 “control”")
        self.lose(STOP)
        self.find("#stop button").click()
        self.until_says("#stop-note", "STOP is NOT confirmed")
        self.until("many tries", lambda: self.lost() > MANY)
        self.until("that it is seen to", lambda: self.find("#stop-note button").is_displayed())
        self.show("stop-not-confirmed")
        self.let_go()
        self.until_says("#stop-note", "STOP confirmed")
        assert not self.find("#stop-note button").is_displayed()
        self.until_says("#state-word", "Aborted")
        self.clear()

    def sent_no_more_once_it_is_seen_to(self):
        self.lose(STOP)
        self.find("#stop button").click()
        self.until("that it is seen to", lambda: self.find("#stop-note button").is_displayed())
        self.find("#stop-note button").click()
        assert not self.note()
        tries, looks = self.lost(), self.asked_for("/status")
        self.until("two more looks at the cell", lambda: self.asked_for("/status") > looks + 1)
        assert self.lost() == tries, "it is sent although somebody has seen to it"
        assert self.text("#state-word") == "Stopped"
        self.let_go()

    def over_when_the_cell_is_cleared(self):
        """It came, and no answer did: a person who clears the cell after it has aborted has seen it."""
        self.browser.execute_script("""
            const fetch = window.fetch;
            window.letGo = () => { window.fetch = fetch; };
            window.fetch = async (path, ...more) => {
              const reply = await fetch(path, ...more);
              if (String(path).includes(arguments[0])) throw new TypeError("lost");
              return reply;
            };""", STOP)
        self.find("#stop button").click()
        self.until_says("#state-word", "Aborted")
        self.until_says("#stop-note", "STOP is NOT confirmed")
        self.let_go()
        self.lose(STOP)  # so that none comes between Clear and its end
        self.clear()
        tries, looks = self.lost(), self.asked_for("/status")
        self.until("two more looks at the cell", lambda: self.asked_for("/status") > looks + 1)
        assert self.lost() == tries and not self.note(), "STOP is sent at a cell that was cleared"
        self.let_go()

    def few_at_once(self):
        """Pressed again and again at a cell that hangs: each is given up after a while, and two at most are on their way."""
        self.browser.execute_script("""
            const fetch = window.fetch;
            window.waiting = window.most = window.given = 0;
            window.letGo = () => { window.fetch = fetch; };
            window.fetch = (path, how) => !String(path).includes(arguments[0]) ? fetch(path, how) : new Promise((_, lost) => {
              window.most = Math.max(window.most, ++window.waiting);
              how.signal.addEventListener("abort", () => { --window.waiting; ++window.given; lost(new TypeError("given up")); });
            });""", STOP)
        self.browser.execute_script("for (let i = 0; i < 8; ++i) document.querySelector('#stop button').click()")
        self.until_says("#stop-note", "STOP is NOT confirmed")
        self.until("some to be given up", lambda: self.browser.execute_script("return window.given") > 3)
        most = self.browser.execute_script("return window.most")
        self.let_go()
        self.until_says("#stop-note", "STOP confirmed")
        self.until_says("#state-word", "Aborted")
        assert most <= 2, f"{most} STOPs at once on their way to a cell that hangs"

    def told_until_the_cell_itself_says_so(self):
        """What the stream of events tells late is not how the cell is; and the cell goes on saying that it stands."""
        self.until_says("#stop-note", "the cell has stopped")
        shown = self.browser.execute_async_script("""
            const done = arguments[0];
            import("/console/link.js").then(({get}) => get("/status")).then((status) => {
              const late = (state) => window.sockets[window.sockets.length - 1].onmessage({data: JSON.stringify({type: "status", status: {...status, state}})});
              for (const state of ["Aborted", "Execute", "Stopped"]) late(state);
              done(!document.getElementById("stop-note").hidden);
            });""")
        assert shown, "an old state ended what is said of STOP"
        self.until_says("#state-word", "Aborted")
        self.until_says("#stop-note", "the cell has stopped")
        self.in_the_chain()
        self.clear()
        self.until_link("stop", "good")

    def until_link(self, name, state):
        self.until(f"{name} to be {state}", lambda: self.find(f".interlocks [data-key={name}]").get_attribute("data-state") == state)

    def in_the_chain(self):
        """What is in the way stands among what must be so before the beam comes on, with what to do; the rest keeps its place."""
        self.go("cell")
        self.until_link("stop", "blocks")
        self.until_says(".interlocks [data-key=stop]", "See to the cause, then Clear and Reset")
        self.until_says("#interlocks-summary", "1 thing is in the way")
        links = [one.get_attribute("data-key") for one in self.browser.find_elements("css selector", ".interlocks > li")]
        assert links == ["lid", "machine", "stop", "guardian", "consent", "certificates", "camera", "scanner", "disk", "backup", "database"], links
        self.until_link("lid", "unknown")  # nobody has connected the laser: it cannot say
        self.until_link("certificates", "good")
        self.until_link("guardian", "good")
        self.until_link("backup", "warns")
        self.show("interlocks")

    def over_after_the_machine_has_slept(self):
        """Cleared while this page heard of nothing: what it asks then ends it."""
        self.lose("/status")
        self.browser.execute_script("""
            const socket = window.sockets[window.sockets.length - 1];
            window.deaf = {socket, hear: socket.onmessage};
            socket.onmessage = null;""")
        self.find("#stop button").click()
        self.until_says("#stop-note", "STOP confirmed")
        self.another_operator("clear")
        self.let_go()
        self.browser.execute_script("window.deaf.socket.onmessage = window.deaf.hear")
        self.until_says("#state-word", "Stopped")
        self.until("nothing said of STOP any more", lambda: not self.note())

    def loud_when_the_cell_goes_on(self):
        """It was taken, and the cell says that it cuts: nobody takes that for stopped."""
        self.browser.execute_script("""
            const fetch = window.fetch;
            window.letGo = () => { window.fetch = fetch; };
            window.fetch = async (path, ...more) => {
              const reply = await fetch(path, ...more);
              return String(path).endsWith("/status") ? new Response(JSON.stringify({...await reply.json(), state: "Execute"})) : reply;
            };""")
        self.find("#stop button").click()
        self.until_says("#stop-note", "now the cell says Execute")
        assert "dead" in self.find("#stop-note").get_attribute("class")
        self.show("stop-goes-on")
        self.let_go()
        self.until_says("#stop-note", "the cell has stopped")
        self.clear()

    def contrast(self):
        """Of the page's words, the least, and where it is: against the ground they stand on, faded as they are."""
        return self.browser.execute_script("""
            const rgba = (text) => { const [r, g, b, a] = text.match(/[\\d.]+/g).map(Number); return [r, g, b, a === undefined ? 1 : a]; };
            const over = ([r, g, b, a], [R, G, B]) => [r * a + R * (1 - a), g * a + G * (1 - a), b * a + B * (1 - a)];
            const light = (rgb) => rgb.map((v) => (v / 255 <= .03928 ? v / 255 / 12.92 : ((v / 255 + .055) / 1.055) ** 2.4)).reduce((sum, v, i) => sum + v * [.2126, .7152, .0722][i], 0);
            let least = [99, ''];
            const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
            for (let text = walk.nextNode(); text; text = walk.nextNode()) {
              const one = text.parentElement;
              if (!text.data.trim() || !one.checkVisibility() || one.closest('svg, noscript, script, .unseen, .skip')) continue;
              let faded = 1, ground = null, layers = [];
              for (let at = one; at; at = at.parentElement) {
                const style = getComputedStyle(at);
                faded *= Number(style.opacity);
                layers.push(rgba(style.backgroundColor));
              }
              ground = layers.reverse().reduce((below, layer) => over(layer, below), [255, 255, 255]);
              const ink = rgba(getComputedStyle(one).color), seen = over([ink[0], ink[1], ink[2], ink[3] * faded], ground);
              const [a, b] = [light(seen), light(ground)].sort((x, y) => y - x), ratio = (a + .05) / (b + .05);
              if (ratio < least[0]) least = [ratio, `${one.tagName} "${text.data.trim().slice(0, 40)}"`];
            }
            return least;""")

    def can_be_read_when_it_is_not_live(self):
        """What is shut off is hatched and grey, and its words stay readable, in both themes; of this cell nothing may be begun yet."""
        self.go("run")
        for theme in ("light", "dark"):
            self.browser.execute_script("localStorage.setItem('veneer_theme', arguments[0]); document.documentElement.dataset.theme = arguments[0]", theme)
            ratio, where = self.contrast()
            assert ratio >= 4.5, f"{theme}: {ratio:.2f}:1 at {where}"
            self.lose("/api/v1/status")
            self.browser.execute_script("window.clock = performance.now.bind(performance); performance.now = () => window.clock() + 20000")
            self.until("that it is not live", lambda: self.find("body").get_attribute("class") == "not-live")
            ratio, where = self.contrast()
            self.show(f"not-live-{theme}")
            assert ratio >= 4.5, f"not live, {theme}: {ratio:.2f}:1 at {where}"
            print(f"contrast, not live, {theme}: {ratio:.2f}:1 at {where}")
            self.let_go()
            self.browser.execute_script("performance.now = window.clock")
            self.until("that it is live", lambda: self.find("body").get_attribute("class") == "")
        self.browser.execute_script("localStorage.removeItem('veneer_theme'); delete document.documentElement.dataset.theme")

    def another_operator(self, *command):
        subprocess.run([os.environ["VENEERCTL"], *command], check=True, stdout=subprocess.DEVNULL)

    def loud_when_the_laser_does_not_answer(self):
        """The cell has aborted, and what the machine does is not known: nobody is told that the beam is off."""
        self.browser.execute_script("""
            const fetch = window.fetch;
            window.letGo = () => { window.fetch = fetch; };
            window.fetch = async (path, ...more) => {
              const reply = await fetch(path, ...more);
              return String(path).endsWith("/status") ? new Response(JSON.stringify({...await reply.json(), laser: {connected: false, why_not_connected: "the link is gone"}})) : reply;
            };""")
        self.find("#stop button").click()
        self.until_says("#stop-note", "the laser does not answer: use the emergency stop")
        assert "dead" in self.find("#stop-note").get_attribute("class") and "beam off" not in self.note()
        self.let_go()
        self.until_says("#stop-note", "the cell has stopped")
        self.clear()

    def starts_what_its_label_says(self):
        self.go("run")
        self.press("[data-command=reset]")
        self.until_says("#state-word", "Idle")
        self.until_says("#do-start", "Start job 1 “control”")
        self.another_operator("job", "new", os.environ["PICTURE"], "--size-mm", "20", "--patch-mm", "10", "--name", "second")
        self.until_says(".jobs", "second")
        assert self.text("#do-start") == "Start job 1 “control”", "another one's new job came under the finger"
        self.until_says("#next", "Job 1 “control”")
        self.press('.jobs label[data-key="2"] input')
        self.until_says("#do-start", "Start job 2 “second”")
        self.until_says("#next", "Job 2 “second” is chosen here: Start")
        self.show("chosen")
        self.another_operator("job", "cancel", "2")
        taken = self.browser.execute_async_script("""
            const done = arguments[0];
            (function look() {
              const start = document.querySelector('#do-start');
              if (start && start.innerText.includes('job 1')) done(!start.disabled); else setTimeout(look, 5);
            })();""")
        assert not taken, "Start begins another job before anybody could look"
        self.until_says("#next", "Job 1 “control”")
        self.press("#do-start")
        self.until_says("#next", "Lay panel P-0001 on the bed")
        self.until_says("main", "control")


if __name__ == "__main__":
    play(Doubtful, "sent_until_it_is_heard", "sent_no_more_once_it_is_seen_to", "over_when_the_cell_is_cleared",
         "few_at_once", "told_until_the_cell_itself_says_so", "over_after_the_machine_has_slept", "loud_when_the_cell_goes_on",
         "loud_when_the_laser_does_not_answer",
         "can_be_read_when_it_is_not_live", "starts_what_its_label_says", "check_console")
