"""Single pieces of a plan in the browser: looked at, kept, swapped, given other wood or another place; and the plan that
is made of it beside the one before. Steps of console_stock.py.
"""
import os

from selenium.webdriver.common.keys import Keys

from console_day import Day

OLD, PLACES, NEW = 2, 3, 4  # the plan; the same with other places for its pieces; what was made of that


class Pieces(Day):
    def places_hold(self):
        """What no finger shows: a piece lies in another one's place as that one lay, and what is too near is told."""
        fault = self.browser.execute_async_script("""
            const done = arguments[0];
            import('/console/piece_places.js').then(({inPlaceOf, tooNear}) => {
              const square = (x, y, side) => [[x, y], [x + side, y], [x + side, y + side], [x, y + side]];
              const laid = (ring, turn, x, y) => ring.map(([u, v]) => [Math.cos(turn) * u - Math.sin(turn) * v + x, Math.sin(turn) * u + Math.cos(turn) * v + y]);
              const piece = (ring, ...how) => ({artwork_outline_mm: ring, panel_outline_mm: laid(ring, ...how)});
              const one = piece(square(0, 0, 6), .5, 10, 10), other = piece(square(6, 0, 6), 2, 50, 20);
              const apart = (a, b) => Math.max(...a.map(([x, y], i) => Math.hypot(x - b[i][0], y - b[i][1])));
              if (apart(inPlaceOf(one, other), other.panel_outline_mm) > 1e-9) return done('a square fills the other one\\'s place');
              const bar = piece([[0, 20], [12, 20], [12, 22], [0, 22]], 0, 0, 0), there = inPlaceOf(bar, one);
              if (Math.abs(Math.hypot(there[1][0] - there[0][0], there[1][1] - there[0][1]) - 12) > 1e-9) return done('a piece changed its shape');
              const beside = square(6.5, 0, 6), plus = [[-3, 2], [9, 2], [9, 3], [-3, 3]];
              for (const [ring, gap, near] of [[beside, .49, false], [beside, .51, true], [square(2, 2, 1), .1, true], [square(-5, -5, 30), .1, true], [plus, .1, true]])
                for (const [a, b] of [[square(0, 0, 6), ring], [ring, square(0, 0, 6)]])
                  if (tooNear(a, b, gap) !== near) return done(`${JSON.stringify([a, b])} ${gap}`);
              done('');
            }).catch((fault) => done(String(fault)));""")
        assert not fault, fault

    def hand_over_a_plan(self):
        """A plan of nine pieces, taken in hand; it has no other places, which are found by making it once more."""
        self.places_hold()
        self.go("new")
        self.find("#picture-file").send_keys(os.environ["PICTURE"])
        for field, value in (("#picture-size", "24"), ("#picture-patch", "8")):
            self.find(field).send_keys(Keys.CONTROL, "a")
            self.find(field).send_keys(value)
        self.press("#do-plan")
        self.until(f"plan {OLD}", lambda: self.find(f'.side-by-side section[data-key="{OLD}"]'))
        self.press(f'.side-by-side section[data-key="{OLD}"] [data-command=other]')
        self.until_says(".piece-sheet", "No piece is chosen yet")
        self.tap(1, 1)
        self.until_says(".piece-sheet", "Piece A2-2")
        self.until_says("#piece-fits", "cost per pixel")
        self.wood_is_seen(".piece-wood")
        self.until_says(".places-none", "made without other places")
        self.press("[data-command=find-places]")
        self.until(f"plan {PLACES} in hand", lambda: self.find(f'.side-by-side section[data-key="{PLACES}"] .places'))
        self.until_says(".piece-sheet", "Piece A2-2")
        assert len(self.browser.find_elements("css selector", ".place")) == 6

    def tap(self, column, row):
        """On the middle of a piece, the first at 0, 0, as a finger does."""
        self.until("the picture", lambda: self.find("svg.chooser").size["height"] > 50)
        self.draw_over("svg.chooser", ((column + .5) / 3, (row + .5) / 3))

    def wood_is_seen(self, css):
        self.until(f"the wood of {css}", lambda: self.browser.execute_script(
            "const all = [...document.querySelectorAll(arguments[0])]; return all.length > 0 && all.every((one) => !one.hidden && one.naturalWidth > 0)", css))

    def wished(self):
        return self.browser.execute_script("return [...document.querySelectorAll('.wishes li > .grow')].map((one) => one.innerText)")

    def said(self, words):
        self.until_says("#other-said", words)

    def want_changes(self):
        """One thing for each piece; what takes its place is told, and what cannot be is said at once."""
        self.wood_is_seen(".place img")
        self.press("[data-place='2']")
        self.said("A2-2 goes to place 2, on panel P-0001")
        self.wood_is_seen("img.laid-wood")
        self.press("[data-wish=keep]")
        self.said("A2-2 stays, whatever else changes. That takes the place of: A2-2 goes to place 2")
        self.until_says("#wishes-rest", "8 other pieces are planned anew")
        self.press("[data-place='1']")
        self.until("one wish", lambda: self.wished() == ["A2-2 goes to place 1, on panel P-0001"])
        self.until_says("#wishes-rest", "All other pieces stay as they are")
        self.show("piece")
        self.swap_two()
        self.press("[data-command=brush]")
        self.draw_over("svg.chooser", (.1, .8), (.2, .85))
        self.until_says("[data-command=make-changed]", "Make the plan with 3 changes")
        for keys, words in (((Keys.ARROW_RIGHT, Keys.ARROW_LEFT), "A3-1 gets other wood"), ((Keys.SHIFT, Keys.ARROW_RIGHT), "A3-2 gets other wood. 2 pieces do."), ((" ",), "A3-2 keeps its wood. 1 piece gets other.")):
            self.keys("svg.chooser", *keys)
            self.said(words)
        self.show("pieces-brush")

    def swap_two(self):
        """By keyboard: from the piece, to the button, and back to the picture for the other one."""
        self.keys("svg.chooser", Keys.ARROW_UP)
        self.until_says(".piece-sheet", "Piece A1-2")
        self.press("[data-wish=swap]")
        self.said("Tap the piece that A1-2 is to change places with")
        self.keys("svg.chooser", " ")
        self.said("A piece cannot change places with itself")
        self.keys("svg.chooser", Keys.ESCAPE)
        self.until("no swap", lambda: self.find("[data-wish=swap]").get_attribute("aria-pressed") == "false")
        self.press("[data-wish=swap]")
        self.show("pieces-swap")
        self.keys("svg.chooser", Keys.ARROW_RIGHT)
        self.said("A1-3 can change places with A1-2")
        self.keys("svg.chooser", Keys.ENTER)
        self.said("A1-2 and A1-3 change places")
        self.until("both at the other's place", lambda: len(self.browser.find_elements("css selector", "img.laid-wood")) == 3)
        self.wood_is_seen("img.laid-wood")

    def what_fails_leaves_the_wishes(self):
        """A plan that cannot be made says so beside what was wanted, which can be made otherwise."""
        before = self.wished()
        self.browser.execute_script("""
            const fetch = window.fetch;
            window.letGo = () => { window.fetch = fetch; };
            window.fetch = (path, how = {}) => fetch(path, /\/changes$/.test(path) ? {...how, body: JSON.stringify({...JSON.parse(how.body), swap: ['A1-2,B9-9']})} : how);""")
        self.press("[data-command=make-changed]")
        self.until_says("#wishes-task", "the plan that is kept has no piece B9-9")
        self.let_go()
        assert self.wished() == before, self.wished()

    def make_the_changed_plan(self):
        self.press("[data-command=choose]")
        self.show("pieces")
        assert sorted(self.wished()) == ["A1-2 and A1-3 change places", "A2-2 goes to place 1, on panel P-0001", "A3-1 gets other wood"], self.wished()
        self.what_fails_leaves_the_wishes()
        self.press("[data-command=make-changed]")
        self.until("both plans, one beside the other", lambda: self.browser.execute_script(
            "return [...document.querySelectorAll('.side-by-side > section')].map((one) => one.dataset.key).join()") == f"{PLACES},{NEW}")
        self.until_says("#plan-differs", "4 pieces have other wood than in plan 3")
        self.until("rings about them", lambda: self.browser.execute_script(
            "const rings = [...document.querySelectorAll('path.ring.inner')]; return rings.length === 2 && rings.every((one) => one.getAttribute('d').split('Z').length === 5)"))
        self.show("pieces-made")
