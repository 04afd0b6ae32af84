#!/usr/bin/python3
"""console_stock.py LINK PICTURES: what is kept in the cell, and what people say of it: a scan in doubt, the wood of a panel, a long
shelf whose pictures stand in nobody's way, plans that are many, single pieces of one (console_pieces.py), backups.
"""
import itertools
import os

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from console_day import play
from console_pieces import Pieces

MANY = 40
PLANS = 230  # more than the page asks for at once
SIGNS = "<b>oak</b> <2 mm"


class Stock(Pieces):
    # ---- what a scan is in doubt about

    def leave_it_to_a_maintainer(self):
        """A sheet of no round size: an operator who has looked may refuse it, or leave it to somebody else."""
        self.hands("new-panel", "odd", "--width-mm", "182.5", "--height-mm", "132.5", "--strips", "2")
        self.hands("place", "odd", "scanner", "--face", "show")
        self.doubt_it()
        self.go("scan")
        self.press("#do-scan")
        self.until_says("main", "A NEW PANEL: SHALL IT ENTER STOCK?")
        self.until_says("main", "which is not round, as of a sheet that was sawn by hand")
        self.until("its picture", self.is_seen)
        for name in self.doubts():
            self.press(f"[data-doubt={name}]")
        self.until_says("main", "A doubt here needs a maintainer")
        self.until("refusing to be all that is left", lambda: self.find("[id^=refuse-]").is_enabled() and not self.find("[id^=accept-]").is_enabled())
        self.browser.get("about:blank")  # else the link differs only behind the #, and the page stays
        self.browser.get(os.environ["MAINTAINER_LINK"])
        self.until_says("#role", "you operate and maintain")

    def is_seen(self):
        return self.browser.execute_script(
            "const seen = document.querySelector('img[alt^=\"What was seen\"]'); return seen && !seen.hidden && seen.naturalWidth > 0")

    def doubt_it(self):
        """The sheet is sound: two doubts are put beside what the cell says of it, one of which an operator cannot answer."""
        self.browser.execute_script("""
            const fetch = window.fetch, put = [{name: 'size', text: 'its size is in doubt', overruled_by: 'maintainer'},
                                               {name: 'another', text: 'something else is in doubt'}];
            window.overruled = [];
            window.letGo = () => { window.fetch = fetch; };
            window.fetch = async (path, how = {}) => {
              if (/proposals\\/\\d+\\/accept$/.test(path)) {
                window.overruled.push(JSON.parse(how.body).override);
                return fetch(path, {...how, body: JSON.stringify({override: JSON.parse(how.body).override.filter((name) => put.every((one) => one.name !== name))})});
              }
              const reply = await fetch(path, how);
              if (!/\\/proposals$/.test(path) || !reply.ok) return reply;
              const told = await reply.json();
              for (const one of told.proposals) one.warnings.push(...put);
              return new Response(JSON.stringify(told), {headers: {'Content-Type': 'application/json'}});
            };""")

    def answer_each_doubt(self):
        self.doubt_it()
        self.go("scan")
        self.until("its picture", self.is_seen)
        self.names = list(self.doubts())
        assert {"size", "another"} <= set(self.names) and not any(self.doubts().values()), self.doubts()
        self.until_says("main", f"once all {len(self.names)} doubts are answered")
        assert not self.find("[id^=accept-]").is_enabled(), "nobody has answered anything"
        self.show("doubts")
        for name in self.names[:-1]:
            self.press(f"[data-doubt={name}]")
        self.until_says("main", "once the one doubt is answered")
        assert not self.find("[id^=accept-]").is_enabled(), "one is not answered"

    def doubts(self):
        return self.browser.execute_script("return Object.fromEntries([...document.querySelectorAll('[data-doubt]')].map((one) => [one.dataset.doubt, one.checked]))")

    def answer_in_set_up(self):
        """What was answered stays so on the other screen that asks; accepting says each by its name."""
        self.go("setup")
        self.press("li[data-key=wood] button")
        self.until("what was seen", lambda: self.browser.execute_script(
            "const seen = document.querySelector('.seen'); return seen && !seen.hidden && seen.naturalWidth > 0"))
        # The page learns that its picture is there with its next drawing, and draws all of it anew.
        self.until("one doubt to be open, and nothing to be accepted", lambda: self.doubts() == {name: name != self.names[-1] for name in self.names} and not self.find("#do-accept").is_enabled())
        self.press(f"[data-doubt={self.names[-1]}]")
        self.until("all to be answered", lambda: self.find("#do-accept").is_enabled())
        self.show("setup-doubts")
        self.press("[data-doubt=size]")
        self.until("one to be taken back", lambda: not self.find("#do-accept").is_enabled())
        self.press("[data-doubt=size]")
        self.until("all to be answered again", lambda: self.find("#do-accept").is_enabled())
        self.browser.execute_script("""
            document.querySelector('[data-doubt=size]').click();  // and at once, before the page is drawn anew
            document.querySelector('#do-accept').click();""")
        self.until("one to be taken back", lambda: not self.find("#do-accept").is_enabled())
        assert self.asked_for("/accept") == 0, "accepted with a doubt that is open"
        self.press("[data-doubt=size]")
        self.press("#do-accept")
        self.until("it to be in stock", lambda: self.asked_for("/accept") == 1 and not self.browser.find_elements("css selector", "[data-doubt]"))
        told = self.browser.execute_script("return window.overruled")
        assert len(told) == 1 and sorted(told[0]) == sorted(self.names), told
        self.browser.execute_script("window.letGo()")
        self.hands("lift", "scanner")

    # ---- what is said of a panel

    def name_its_wood(self):
        """Strip by strip, or all at once; its shelf and its thickness; and what was done to it."""
        self.go("panels")
        self.press('.panel[href="#panels/P-0001"]')
        self.until_says("main", "Name its wood, shelf")
        self.press("details[data-key=say] summary")
        strips = len(self.browser.find_elements("css selector", "[id^=say-zone-]"))
        assert strips > 1, "a panel of several strips"
        assert not self.find("#do-say").is_enabled(), "nothing is said yet"
        self.say("#say-all", "walnut")
        self.say("#say-shelf", "B7")
        self.say("#say-veneer_mm", "0.6")
        drawn = lambda: self.browser.execute_script("const canvas = document.querySelector('.map .leaflet-overlay-pane canvas'); return canvas && canvas.toDataURL()")
        self.until("the map", drawn)
        self.browser.execute_script("document.activeElement.blur()")
        before = drawn()
        self.browser.execute_script("document.querySelector('#say-zone-1').focus()")
        self.until("that strip on the map", lambda: drawn() != before)
        self.browser.execute_script("document.activeElement.blur()")
        self.until("the map as it was", lambda: drawn() == before)
        self.browser.execute_script("document.querySelector('#say-zone-1').focus()")
        self.show("say")
        self.press("#do-say")
        self.until_says("details[data-key=say]", "It is kept.")
        assert self.asked_for("/P-0001/material") == 1, "all strips of one wood are said at once"
        self.until_says("main", "walnut, ")
        self.until_says("main", "0.6 mm of veneer")
        self.until("the thickness that was kept", lambda: self.find("#say-veneer_mm").get_attribute("value") == "0.6")
        self.find("#say-veneer_mm").send_keys(Keys.CONTROL, "a", Keys.BACKSPACE)
        self.until_says("#say-emptied", "changed, not taken back")
        assert not self.find("#do-say").is_enabled(), "that is nothing to keep"
        self.say("#say-veneer_mm", "0.6")
        self.until("the hint to go", lambda: not self.browser.find_elements("css selector", "#say-emptied"))
        assert self.find("#say-zone-1").get_attribute("maxlength") == self.find("#say-all").get_attribute("maxlength") == "60"
        self.name_it_with_signs()
        self.say("#say-zone-2", "maple")
        self.keep_back("/P-0001/material")
        self.press("#do-say")
        self.until("it to be on its way", lambda: not self.find("#do-say").is_enabled())
        self.say("#say-shelf", "B8")  # meanwhile
        self.let_go()
        self.until("both kept", lambda: self.asked_for("/P-0001/material") == 3)
        self.until("the shelf to be kept next", lambda: self.find("#do-say").is_enabled())
        assert self.find("#say-shelf").get_attribute("value") == "B8", "what was typed meanwhile is lost"
        assert "It is kept." not in self.text("details[data-key=say]"), "not all of it"
        self.say("#say-shelf", "B7")
        self.until_says("main", "maple, ")
        self.until("walnut in the first strip", lambda: self.find("#say-zone-1").get_attribute("value") == "walnut")
        self.go("panels")
        self.until_says('.panel[href="#panels/P-0001"]', "Shelf B7")

    def name_it_with_signs(self):
        """A name is text, whatever it looks like, where the pointer stands over its strip."""
        self.say("#say-zone-2", SIGNS)
        self.press("#do-say")
        self.until_says("details[data-key=say]", "It is kept.")
        layers = self.browser.execute_script("""
            window.turned = [...document.querySelectorAll('.layers label')].filter((one) => one.querySelector('input').checked !== Boolean(one.querySelector('.layer-zones')));
            window.turned.forEach((one) => one.querySelector('input').click());
            document.querySelector('.map').scrollIntoView({block: 'center'});
            return window.turned.length;""")
        assert layers > 0, "strips are not shown unasked"
        places = itertools.cycle([(across, down) for across in range(-3, 4) for down in range(-3, 4)])

        def next_place_tells_it():
            place, (across, down) = self.find(".map"), next(places)
            ActionChains(self.browser, duration=0).move_to_element_with_offset(
                place, across * place.size["width"] // 8, down * place.size["height"] // 8).perform()
            return self.text(".leaflet-tooltip") == f"2: {SIGNS}"

        self.until("its name as it was typed", next_place_tells_it)
        self.browser.execute_script("window.turned.forEach((one) => one.querySelector('input').click())")

    def say(self, field, words):
        self.until(field, lambda: self.find(field))
        self.find(field).send_keys(Keys.CONTROL, "a")
        self.find(field).send_keys(words)

    def say_what_was_done_to_it(self):
        """Of the other one, since nothing is planned from a panel that was sanded."""
        self.press('.panel[href="#panels/P-0002"]')
        self.until_says("main", "Name its wood, shelf")
        self.press("details[data-key=say] summary")
        self.browser.execute_script("const it = document.querySelector('#say-treated'); it.value = 'sanded'; it.dispatchEvent(new Event('change'))")
        self.until_says("details[data-key=say]", "nothing is planned from it until it is scanned again")
        assert not self.find("#do-say").is_enabled(), "with what?"
        self.say("#say-product", "grit 240")
        self.press("#do-say")
        self.until_says("main", "Waits for a scan")
        self.until_says("main", "grit 240, ")

    def see_its_tags_from_above(self):
        """A panel that is laid face up: its wood with the tags of that face by number, where they are to be seen."""
        self.go("run")
        # Measured in the frame in which they are seen: the next word of the cell says that it waits for no panel.
        off, drawn = self.until_told("the tags of its show face", """
            const done = arguments[0], of = (node) => node.getBoundingClientRect();
            import('/console/model.js').then(({model, changed}) => {
              model.cell = {...model.cell, load: {panel: 'P-0001', face_up: 'show', found: false, sentence: ''}};
              changed();
              requestAnimationFrame(() => requestAnimationFrame(() => {
                const seen = document.querySelector('.load .view img'), over = document.querySelector('svg.tags[data-show=P-0001]');
                if (!seen || !seen.naturalWidth || !over || !over.querySelector('text')) return done(null);
                const wood = of(seen), lies = of(over), share = (box) => [(box.left + box.width / 2 - wood.left) / wood.width, (box.top + box.height / 2 - wood.top) / wood.height];
                done([Math.max(Math.abs(lies.width - wood.width), Math.abs(lies.height - wood.height)), Object.fromEntries([...over.querySelectorAll('g')].map((one) => [one.textContent, share(of(one))]))]);
              }));
            });""")
        assert off <= 1, f"they do not lie on the wood: {off} px"
        told = self.browser.execute_async_script("""
            const done = arguments[0];
            import('/console/link.js').then(({get}) => get('/panels/P-0001')).then((panel) => done(Object.fromEntries(panel.fiducials
              .filter((one) => one.kind === 'tag' && one.face === 'show').map((one) => [one.tag_id, [one.centre_mm[0] / panel.width_mm, 1 - one.centre_mm[1] / panel.height_mm]]))));""")
        assert drawn and drawn.keys() == told.keys() and len(told) > 3, (drawn, told)
        far = {tag: [abs(a - b) for a, b in zip(drawn[tag], told[tag])] for tag in told}
        assert max(max(one) for one in far.values()) < .03, far

    def until_told(self, what, script):
        """What it says, once that is something."""
        told = None
        def says():
            nonlocal told
            told = self.browser.execute_async_script(script)
            return told is not None
        self.until(what, says)
        return told

    # ---- a long shelf

    def open_a_map_from_a_long_shelf(self):
        """Pictures of panels that nobody sees are not asked for, and those of a left screen stand before no map."""
        self.go("cell")
        self.browser.execute_script("""
            const fetch = window.fetch;
            window.shelf = new Set();
            window.letGo = () => { window.fetch = fetch; };
            window.fetch = async (path, how = {}) => {
              if (/\\/stock.jpg\\?width=480$/.test(path)) {  // by nobody answered
                window.shelf.add(path);
                return new Promise((_, lost) => how.signal.addEventListener('abort', () => lost(new TypeError('given up'))));
              }
              const reply = await fetch(path, how);
              if (!/\\/panels\\?/.test(path) || !reply.ok) return reply;
              const told = await reply.json();
              const [one] = told.panels;
              for (let n = 0; n < arguments_; ++n) told.panels.push({...one, id: `P-9${String(n).padStart(3, '0')}`});
              return new Response(JSON.stringify(told), {headers: {'Content-Type': 'application/json'}});
            };""".replace("arguments_", str(MANY)))
        self.browser.execute_async_script("const done = arguments[0]; import('/console/model.js').then((model) => model.loadPanels()).then(() => done())")
        asked = lambda: self.browser.execute_script("return window.shelf.size")
        self.go("panels")
        self.until("a long shelf", lambda: len(self.browser.find_elements("css selector", ".panel")) > MANY)
        self.until("pictures of what is seen to be asked for", lambda: asked() == 2)
        self.browser.execute_script("scrollTo(0, document.body.scrollHeight)")
        self.until("two of those at the end instead", lambda: asked() == 4)
        late = self.browser.execute_script("return [...window.shelf].slice(2)")
        assert all(int(path.split("P-9")[1][:3]) > MANY / 2 for path in late), late
        self.browser.execute_script("scrollTo(0, 0)")
        self.press('.panel[href="#panels/P-0001"]')
        self.until("its map", lambda: self.browser.execute_script(
            "const scan = document.querySelector('.map img.leaflet-image-layer'); return scan && scan.naturalWidth > 0"))
        self.browser.execute_script("window.letGo()")
        self.browser.execute_async_script("const done = arguments[0]; import('/console/model.js').then((model) => model.loadPanels()).then(() => done())")
        self.go("panels")
        self.until("the shelf's own pictures", lambda: self.browser.execute_script(
            "const all = [...document.querySelectorAll('.panel img')]; return all.length === 2 && all.every((one) => one.naturalWidth > 0)"))

    # ---- many plans

    def find_a_plan_among_many(self):
        """An older one is found by its name and by going on; what was looked at long ago is asked for again."""
        self.browser.execute_script("""
            const fetch = window.fetch;
            window.limits = [];
            window.letGo = () => { window.fetch = fetch; };
            window.fetch = async (path, how = {}) => {
              const copied = /\\/plans\\/9\\d\\d\\d(.*)$/.exec(path);
              if (copied) { window.asked.push(path); return fetch(`/api/v1/plans/1${copied[1]}`, how); }
              if (!/\\/plans\\?/.test(path)) return fetch(path, how);
              const reply = await fetch('/api/v1/plans?limit=1000', how);
              if (!reply.ok) return reply;
              const told = await reply.json(), [one] = told.plans, page = new URL(path, location).searchParams;
              const all = Array.from({length: arguments_}, (_, n) => ({...one, id: 9000 + arguments_ - n, name: `copy ${arguments_ - n}`, jobs: []})).concat(told.plans);
              const limit = Number(page.get('limit')), from = Number(page.get('cursor') || 0);
              window.limits.push(limit);
              told.plans = all.slice(from, from + limit);
              told.next = from + limit < all.length ? String(from + limit) : null;
              return new Response(JSON.stringify(told), {headers: {'Content-Type': 'application/json'}});
            };""".replace("arguments_", str(PLANS)))
        load = lambda: self.browser.execute_async_script("const done = arguments[0]; import('/console/model.js').then((model) => model.loadPlans()).then(() => done())")
        limit = lambda: self.browser.execute_script("return window.limits.at(-1)")
        load()
        assert limit() == 200, limit()
        self.go("new")
        rows = lambda: len(self.browser.find_elements("css selector", "ul.plans li"))
        self.until("the newest plans", lambda: rows() == 24)
        self.show("plans-many")
        self.say("#plans-search", "control")  # the oldest of all
        self.until("the one of this name", lambda: rows() == 1)
        assert limit() == 1000, limit()
        self.say("#plans-search", "nowhere")
        self.until_says("main", "No plan has this number")
        self.find("#plans-search").send_keys(Keys.CONTROL, "a", Keys.BACKSPACE)
        self.until("the newest again", lambda: rows() == 24)
        load()
        assert limit() == 200, "all of them are asked for though nobody looks for one"
        while limit() == 200:
            before = rows()
            self.press("#plans-more")
            self.until("older ones", lambda: rows() > before)
            self.until("the cell to be asked", lambda: limit() == 400 or rows() < 200)
        self.press("#plans-more")
        self.until("all of them", lambda: rows() == PLANS + 1)
        assert limit() == 400 and not self.browser.find_elements("css selector", "#plans-more"), "there are no more"
        self.say("#plans-search", "copy")
        self.find("#plans-search").send_keys(Keys.CONTROL, "a", Keys.BACKSPACE)
        self.until("the newest once more", lambda: rows() == 24)
        for number in range(9000 + PLANS, 9000 + PLANS - 10, -1):
            self.press(f'ul.plans li[data-key="{number}"] input')
            self.until(f"pieces of plan {number}", lambda: self.asked_for(f"/plans/{number}/pieces") == 1)
            self.press(f'ul.plans li[data-key="{number}"] input')
        self.press(f'ul.plans li[data-key="{9000 + PLANS - 1}"] input')
        self.until("the first one's pieces to be asked for again", lambda: self.asked_for(f"/plans/{9000 + PLANS - 1}/pieces") == 2)
        self.browser.execute_script("window.letGo()")

    # ---- backups

    def back_up(self):
        self.go("settings")
        self.until_says("main", "No backup yet.")
        self.press("#do-backup")
        self.until_says("#backup-made", "Made ")
        self.until("it in the list", lambda: len(self.browser.find_elements("css selector", "#backups li")) == 1)
        self.until_says("#backups", "2 panels, 1 job, 16 pieces")
        self.press("#do-check")
        self.until_says("#check-done", "the database is sound")
        self.show("backups")
        assert not self.browser.execute_async_script("""
            const done = arguments[0];
            import('/console/model.js').then(({model, changed}) => {
              model.cell = {...model.cell, database: {state: 'damaged', sentence: 'a page is damaged'}};
              changed();
              requestAnimationFrame(() => requestAnimationFrame(() => done(Boolean(document.querySelector('#check-done')))));
            });"""), "sound and damaged at once"

    def spoken_as_it_is_written(self):
        """A German page tells what the cell says in German, and marks as English what it has no words for."""
        self.press("#language")
        self.until_says("#nav", "Platten")
        self.go("new")
        self.until_says("#draft-restored", "in diesem Browser gespeichert")  # the picture that was chosen while the page spoke English
        self.browser.execute_script("window.confirm = () => true")
        self.press("#draft-afresh")
        self.browser.execute_script("document.querySelector('#main form').dispatchEvent(new Event('submit', {cancelable: true}))")
        self.until_says("#refusal", "Wählen Sie erst ein Bild.")
        assert self.find("#refusal").get_attribute("lang") == "de", "the page's own words"
        self.go("alarms")
        self.hear_it_when_wanted()
        self.find("#stop button").click()
        self.until_says("#state-word", "Aborted")
        self.until("an alarm", lambda: self.browser.execute_script("return document.querySelector('.alarms b')"))
        told = self.browser.execute_script("return ['#state-reason', '.alarms b'].map((css) => { const one = document.querySelector(css); return [one.innerText, one.closest('[lang]').lang, one.querySelectorAll('[lang=en]').length]; })")
        assert [(lang, english) for _, lang, english in told] == [("de", 0), ("de", 0)] and "STOP durch" in told[0][0], told
        self.until("a tone", lambda: self.tones() > self.tried)
        self.press("#next button")
        self.until_says("#state-word", "Stopped")
        self.press("#sound")
        self.press("#language")
        self.until_says("#nav", "Panels")

    def tones(self):
        return self.browser.execute_script("return window.tones")

    def hear_it_when_wanted(self):
        """Once somebody has put the sound on, who hears it then."""
        self.browser.execute_script("""
            window.tones = 0;
            const end = {connect: () => end, gain: {}};
            window.AudioContext = class {
              currentTime = 0;
              resume() {}
              createGain() { return end; }
              createOscillator() { return {frequency: {}, connect: () => end, start() { ++window.tones; }, stop() {}}; }
            };""")
        self.press("#sound")
        self.until("a try", lambda: self.tones() > 0)
        self.tried = self.tones()


if __name__ == "__main__":
    play(Stock, "leave_it_to_a_maintainer", "answer_each_doubt", "answer_in_set_up", "name_its_wood", "say_what_was_done_to_it", "see_its_tags_from_above", "open_a_map_from_a_long_shelf",
         "find_a_plan_among_many", "hand_over_a_plan", "want_changes", "make_the_changed_plan", "back_up", "spoken_as_it_is_written", "check_console")
