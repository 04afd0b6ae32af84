#!/usr/bin/python3
"""page_test.py CONSOLE: the page's own functions, and cards that are given a cell, in Chromium without a daemon.

The page's files are served as they are; what it would ask the cell for is answered here, and noted.
"""
import http.server
import json
import os
import pathlib
import re
import sys
import threading
import unittest

from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.actions.pointer_input import PointerInput
from selenium.webdriver.common.keys import Keys

CONSOLE = sys.argv[1]
ROOT = pathlib.Path(__file__).resolve().parents[2]
LEAFLET = "/usr/share/javascript/leaflet"
PATIENCE_S = 60


class Files(http.server.SimpleHTTPRequestHandler):
    """/console/... from the tree; / is the page's frame without its scripts."""
    extensions_map = {".js": "text/javascript", ".css": "text/css", ".html": "text/html"}
    refused = ()  # ends of the paths that it does not have at the moment
    lost = []     # what was asked for of those

    def translate_path(self, path):
        if path.startswith("/console/lib/"):  # as the daemon serves Leaflet
            return os.path.join(LEAFLET, os.path.basename(path).replace("leaflet.js", "leaflet.esm.min.js"))
        return os.path.join(CONSOLE, path.split("?")[0].removeprefix("/console/").lstrip("/"))

    def do_GET(self):
        if self.path.split("?")[0].endswith(Files.refused):
            Files.lost.append(self.path)
            return self.send_error(503)
        if self.path != "/":
            return super().do_GET()
        with open(os.path.join(CONSOLE, "index.html"), encoding="utf-8") as file:
            lines = [line for line in file if "<script" not in line]
        self.send_response(200)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.end_headers()
        self.wfile.write("".join(lines).encode())

    def end_headers(self):
        self.send_header("Cache-Control", "no-store")  # what is refused is not had from before
        super().end_headers()

    def log_message(self, *_):
        pass


# Answers the page, notes what it asks for, and gives modules their words.
STAGE = """
    window.asked = [];
    window.answers = {};
    window.realFetch = window.fetch.bind(window);
    window.fetch = async (path, how = {}) => {
      window.asked.push({path: String(path), method: how.method || 'GET', body: typeof how.body === 'string' ? JSON.parse(how.body) : null});
      const [, answer] = Object.entries(window.answers).find(([part]) => String(path).includes(part)) || ['', {}];
      const told = typeof answer === 'function' ? await answer(String(path), how) : answer;
      return {ok: !told.error, status: told.error ? told.error.status || 409 : 200, json: async () => told};
    };"""


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Files)
        threading.Thread(target=cls.server.serve_forever, daemon=True).start()
        options = webdriver.ChromeOptions()
        for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu"):
            options.add_argument(argument)
        options.binary_location = "/usr/bin/chromium"
        cls.browser = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
        cls.browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": STAGE})
        cls.browser.set_script_timeout(PATIENCE_S)
        cls.speak("en")

    @classmethod
    def tearDownClass(cls):
        cls.browser.quit()
        cls.server.shutdown()

    @classmethod
    def speak(cls, language):
        place = f"http://127.0.0.1:{cls.server.server_address[1]}/"
        cls.browser.get(place)
        cls.browser.execute_script("localStorage.setItem('veneer_language', arguments[0])", language)
        cls.browser.get(place)  # nothing holds what drafts are kept in
        cls.browser.execute_async_script("const [done] = arguments, gone = indexedDB.deleteDatabase('veneer_drafts'); gone.onsuccess = gone.onerror = () => done();")

    @classmethod
    def reload(cls):
        """The page anew, as a browser shows it; what it has kept is there."""
        cls.browser.get(f"http://127.0.0.1:{cls.server.server_address[1]}/")

    def refuse(self, *paths):
        Files.refused, Files.lost = paths, []
        self.addCleanup(setattr, Files, "refused", ())

    def does(self, script, *values):
        """An async function's body, with load(module) and the values as `given`; what it returns."""
        told = self.browser.execute_async_script(
            "const done = arguments[arguments.length - 1], given = [...arguments].slice(0, -1), load = (module) => import(`/console/${module}`);"
            "(async () => {" + script + "})().then((value) => done({value: value === undefined ? null : value}), (fault) => done({fault: String(fault.stack || fault)}));", *values)
        self.assertNotIn("fault", told, told.get("fault"))
        return told["value"]


class Numbers(Page):
    def fault(self, text, **rules):
        return self.does("return (await load('fields.js')).faultOf(...given)", text, rules)

    def number(self, text):
        return self.does("const value = (await load('fields.js')).numberOf(...given); return Number.isNaN(value) ? null : value", text)

    def test_a_comma_is_a_point(self):
        for text, value in (("12", 12), ("1.5", 1.5), ("1,5", 1.5), (" 1,5 ", 1.5), (",5", .5), ("7,", 7), ("-2", -2), ("0", 0)):
            with self.subTest(text):
                self.assertEqual(self.number(text), value)
                self.assertEqual(self.fault(text), "")

    def test_what_is_none_is_refused(self):
        for text in ("+5", "1e3", "1E3", "1,5,2", "1.000,5", "0x10", "ten", "5 mm", "--5", ".", ",", "-", "Infinity", "NaN", "1" * 400):
            with self.subTest(text):
                self.assertIn("no number", self.fault(text))
        self.assertIsNone(self.number("1e3"))

    def test_what_may_be_thousands_is_asked_for_again(self):
        for language, typed, decimal, meant in (("en", "1,200", "1.200", "A point is the decimal mark here"), ("de", "1.200", "1,200", "Hier trennt das Komma")):
            self.speak(language)
            self.addCleanup(self.speak, "en")
            self.assertIn(meant, self.fault(typed))
            self.assertIsNone(self.number(typed))
            for text, value in ((decimal, 1.2), ("0,200", .2), ("0.200", .2), ("1,25", 1.25), ("1.25", 1.25), ("1.2000", 1.2), ("1234,567", 1234.567), ("1200", 1200)):
                with self.subTest(language + text):
                    self.assertEqual(self.number(text), value)
                    self.assertEqual(self.fault(text), "")
            for text in ("1.200.000", "1,200,000", "1,200.5", "1.200,5"):
                self.assertTrue(self.fault(text))
                self.assertIsNone(self.number(text))

    def test_blank_is_missing_unless_it_may_be(self):
        for text in ("", "  "):
            self.assertIn("missing", self.fault(text))
            self.assertEqual(self.fault(text, optional=True), "")

    def test_whole_and_bounds(self):
        self.assertEqual(self.fault("3", whole=True), "")
        for text in ("3.5", "3,0", "3."):
            with self.subTest(text):
                self.assertIn("whole number", self.fault(text, whole=True))
        self.assertEqual(self.fault("1", least=1, most=20), "")
        self.assertEqual(self.fault("0.9", least=1), "At least 1.")
        self.assertEqual(self.fault("20,5", most=20), "At most 20.")

    def test_the_fault_stands_at_its_field(self):
        seen = self.does("""
            const {numberField} = await load('fields.js'), {put} = await load('dom.js');
            let typed = '1,5';
            const draw = () => put(document.getElementById('main'), numberField('Passes', typed, (text) => { typed = text; draw(); }, {whole: true, least: 1, id: 'passes'}));
            draw();
            const field = document.getElementById('passes'), before = document.getElementById('main').innerText;
            field.value = '2';
            field.dispatchEvent(new Event('input'));
            return [before, field.getAttribute('aria-invalid'), document.getElementById('main').innerText, document.getElementById('passes') === field]""")
        self.assertIn("whole number", seen[0])
        self.assertEqual(seen[1:], [None, "Passes", True], "the field stays, and its fault goes")


class FirstSize(Page):
    def size(self, panels, *longer):
        return self.does("return (await load('first_size.js')).firstSize(...given)", panels, *longer)

    def test_modest_while_no_panel_is_known(self):
        self.assertEqual(self.size([]), {"size_mm": 190, "patch_mm": 14, "of_wood": False, "lack": ""})

    def test_least_where_nothing_is_free(self):
        least = {"size_mm": 20, "patch_mm": 5, "of_wood": False, "lack": "no_wood"}
        self.assertEqual(self.size([{"retired": {"reason": "lent"}, "free_mm2": 5e4}]), least, "all of it is lent")
        self.assertEqual(self.size([{"retired": None, "free_mm2": 0}]), least)
        self.assertEqual(self.size([{"retired": None, "free_mm2": None, "mask": "uncounted"}])["lack"], "", "nobody knows yet")
        self.assertEqual(self.size([{"retired": None, "free_mm2": None, "mask": "unreadable"}]), least)
        self.assertEqual(self.size([{"retired": None, "free_mm2": 4e4, "scan_again": "sanded"}]), {**least, "lack": "scan_again"}, "it waits for a scan")
        self.assertEqual(self.size([{"retired": None, "free_mm2": 0}, {"retired": {"reason": "lent"}, "free_mm2": 4e4}]), least)

    def test_it_grows_with_the_wood_and_never_asks_for_more_than_there_is(self):
        before = 0
        for free in (100, 1e3, 5e3, 2e4, 1e5, 1e6, 1e8):
            for longer in (1, 1.5, 4):
                told = self.size([{"retired": None, "free_mm2": free / 2}, {"retired": None, "free_mm2": free / 2}], longer)
                self.assertEqual((told["of_wood"], told["lack"]), (True, ""))
                self.assertGreaterEqual(told["size_mm"], 20)
                self.assertLessEqual(told["size_mm"], 360)
                self.assertGreaterEqual(told["patch_mm"], 5)
                if told["size_mm"] > 20:
                    self.assertLess(told["size_mm"] ** 2 * longer, free / 2)
            self.assertGreaterEqual(told["size_mm"], before)
            before = told["size_mm"]


class Remedies(Page):
    def told(self, sentence):
        parts = self.does("return (await load('by_page.js')).byPage(...given)", sentence)
        return "".join(part if isinstance(part, str) else part["text"] for part in parts), [part["href"] for part in parts if not isinstance(part, str)]

    def check(self, sentence, words, *hrefs):
        with self.subTest(sentence):
            self.assertEqual(self.told(sentence), (words, list(hrefs)))

    def test_each_by_its_button(self):
        lost = "Run: A1-2: It is lost: find other wood"
        for sentence, words, *hrefs in (
            ("piece A1-2 of job 3 is cut: make it again with `veneerctl job redo 3 A1-2 --lost`", f"piece A1-2 of job 3 is cut: make it again with “{lost}”", "#run"),
            ("name those that were lost, with veneerctl job redo 3 PIECE --lost", "name those that were lost, with “Run: It is lost: find other wood”", "#run"),
            ("have it made again with `veneerctl job redo JOB PIECE --lost` if it is lost", "have it made again with “Run: It is lost: find other wood” if it is lost", "#run"),
            ("and more is to come: veneerctl panel scan --panel P-0001 --face back ends it with the last tile, --more goes on, --anew discards what is there",
             "and more is to come: “Scan: back: P-0001” ends it with the last tile, “Scan: The panel is larger than the glass: more tiles follow” goes on, “Scan: Scan and begin a new series” discards what is there", "#scan", "#scan", "#scan"),
            ("when it cannot look any more, veneerctl write-off-look makes them suspect", "when it cannot look any more, “Cell: The camera cannot look any more” makes them suspect", "#cell"),
            ("it is good: say --lost", "it is good: say “Run: It is lost: find other wood”", "#run"),
            ("panel P-0001 has no edit 4: see `veneerctl panel mask P-0001 --list`", "panel P-0001 has no edit 4: see “Panels: P-0001: Painted by hand”", "#panels/P-0001"),
            ("take some back (--list)", "take some back (“Panels: Painted by hand”)", "#panels"),
            ("turn it over and run veneerctl panel scan --face back --panel P-0003", "turn it over and go to “Scan: back: P-0003”", "#scan"),
            ("scan its other face with --face back", "scan its other face with “Scan: back”", "#scan"),
            ("say --face back --panel P-0003, then again", "say “Scan: back: P-0003”, then again", "#scan"),
            ("say it with `veneerctl job settle 3 A1-2 scrap`", "say it with “Run: A1-2: Lost”", "#run"),
            ("say it with veneerctl job settle 3 A1-2 released, or wait", "say it with “Run: A1-2: Never touched”, or wait", "#run"),
            ("say it with veneerctl job settle 3 A1-2 cut", "say it with “Run: A1-2: Good”", "#run"),
            ("look at each piece and say it with veneerctl job settle 3 PIECE VERDICT", "look at each piece and say it with “Run: Suspect pieces”", "#run"),
            ("look at each, then say veneerctl job settle 2 --as-seen --there scrap --pieces A1-1 A2-1 (or released for scrap, when none is burnt)",
             "look at each, then say “Run: Suspect pieces: A1-1, A2-1” (or “Run: Never touched”, when none is burnt)", "#run", "#run"),
            ("say it with veneerctl job settle 3 A312 cut", "say it with “Run: A312: Good”", "#run"),
            ("say it with veneerctl job settle 3 7K cut", "say it with “Run: 7K: Good”", "#run"),
            ("say it with veneerctl job settle 3 12 cut", "say it with “Run: 12: Good”", "#run"),
            ("say it with veneerctl job settle 3 AC cut", "say it with “Run: AC: Good”", "#run"),
            ("have it made with veneerctl job redo 3 AC", "have it made with “Run: AC: Find other wood”", "#run"),
            ("have it made with veneerctl job redo 3: A piece is missing", "have it made with “Run: Find other wood”: A piece is missing", "#run"),
            ("veneerctl job redo 3 A piece of wood", "“Run: Find other wood” A piece of wood", "#run"),
            ("lay each on the scanner (veneerctl panel scan)", "lay each on the scanner (“Scan: Scan”)", "#scan"),
            ("the last one by veneerctl panel scan --again 3", "the last one by “Scan: Scan tile 3 again”", "#scan"),
            ("begin the series anew with veneerctl panel scan --anew", "begin the series anew with “Scan: Scan and begin a new series”", "#scan"),
            ("panel P-0001 was retired: run `veneerctl panel restore P-0001`, or scan the sheet", "panel P-0001 was retired: go to “Panels: Put P-0001 back in stock”, or scan the sheet", "#panels/P-0001"),
            ("it is aborted; veneerctl job start 3 goes on with it", "it is aborted; “Run: job 3: Start” goes on with it", "#run/3"),
            ("so nothing tells how far off the next one will be: calibrate with two more, the sheet at other places (--more)",
             "so nothing tells how far off the next one will be: calibrate with two more, the sheet at other places (--more)"),
            ("scan without --again, and the first tile with --more", "scan without --again, and the first tile with --more"),
            ("calibrate scanner with veneerctl calibrate scanner, --more goes on", "calibrate scanner with “Set up: Scanner”, --more goes on", "#setup/scanner"),
            ("so add a panel, or see what veneerctl job advise says", "so add a panel, or see what “New picture: What would be recognisable?” says", "#new"),
            ("Veneerctl job start 3 goes on with it.", "“Run: job 3: Start” goes on with it.", "#run/3"),
            ("`Veneerctl panel scan` comes first.", "“Scan: Scan” comes first.", "#scan"),
            ("Veneerctl by --confirm \"exhaust\" is asked.", "the tick “exhaust” is asked."),
            ("Run veneerctl panel scan.", "Go to “Scan: Scan”.", "#scan"),
            ("lay the grid on it and run veneerctl calibrate scanner", "lay the grid on it and go to “Set up: Scanner”", "#setup/scanner"),
            ("Make one: with the button in Settings, or with veneerctl db backup.", "Make one: with the button in Settings, or with “Settings: Back up now”.", "#settings"),
            ("see to it and confirm all of it, with veneerctl by --confirm \"exhaust\" --confirm \"air assist\"", "see to it and confirm all of it, with the ticks “exhaust”, “air assist”"),
            ("see veneerctl scanner list, and correct it", "see “Settings: Look for scanners”, and correct it", "#settings"),
            ("is not there: plug it in, and see veneerctl camera list for its name", "is not there: plug it in, and see “Set up: Devices” for its name", "#setup/devices"),
            ("take one with veneerctl camera try \"/dev/v4l/by-id/x\", and look", "take one with “Set up: Devices”, and look", "#setup/devices"),
            ("no panel P-0001 was sawn apart: run veneerctl panel split P-0001 first", "no panel P-0001 was sawn apart: go to “Panels: P-0001 was sawn apart” first", "#panels/P-0001"),
            ("scan it with --retag when the tag was newly glued to it", "scan it with “Scan: choose the panel: New tags were glued to this face: make them its own” when the tag was newly glued to it", "#scan"),
            ("there, then `veneerctl panel decide P-0002 4 written-off`, or `... accepted` when", "there, then “Panels: P-0002: Write it off”, or “Panels: Leave it as it is” when", "#panels/P-0002", "#panels")):
            self.check(sentence, words, *hrefs)

    def test_an_option_by_its_field(self):
        picture = lambda what: f"“New picture: {what}”"
        least = "smallest piece width (command line only)"
        for sentence, words, *hrefs in (
            ("narrower than 2 mm: raise --patch-mm, or lower --cell-aspect", f"narrower than 2 mm: raise {picture('Smallest patch, mm')}, or lower {picture('How long its cells are')}", "#new", "#new"),
            ("plan some of these anew, or raise the limit of oak (--material-limit)", f"plan some of these anew, or raise the limit of oak ({picture('How much of the picture each may take, at most')})", "#new"),
            ("the colour weight is 0: raise it (--w-colour)", f"the colour weight is 0: raise it ({picture('Colour')})", "#new"),
            ("choose that layout (--layout morph)", f"choose that layout ({picture('How it is divided: bent squares that follow its edges')})", "#new"),
            ("let them choose together (--optimize global)", f"let them choose together ({picture('Care: all patches together (takes minutes)')})", "#new"),
            ("cells that are small there (--cell-sizes), or simpler lines for them (--flow-lines)", f"cells that are small there ({picture('How large its cells are')}), or simpler lines for them ({picture('How its cells lie')})", "#new", "#new"),
            ("a smaller --min-size-mm or --min-width-mm", f"a smaller smallest piece size (command line only) or {least}", "", ""),
            ("Size_mm is 5e9: it must be a number from 0.1 to 100000.", f"{picture('Shorter side, mm')} is 5e9: it must be a number from 0.1 to 100000.", "#new"),
            ("patch_mm must be a number, not \"x\"", f"{picture('Smallest patch, mm')} must be a number, not \"x\"", "#new"),
            ("measure both its sides with a rule and give them with --board-width-mm and --board-height-mm", "measure both its sides with a rule and give them with “Set up: Board, width, mm” and “Set up: Board, height, mm”", "#setup/laser", "#setup/laser")):
            self.check(sentence, words, *hrefs)
        for sentence in ("the file size_mm.txt is not there: unheard_of is 3", "leave --rotations at 4", "its /size_mm", "toString_x is 1", "has__own is 1"):
            self.check(sentence, sentence)

    def test_an_option_that_two_screens_have_is_the_one_that_is_looked_at(self):
        self.does("await (await load('words.js')).learn('seldom')")  # as Settings does
        self.browser.execute_script("location.hash = '#settings'")
        self.addCleanup(self.browser.execute_script, "location.hash = ''")
        self.check("size_mm is 5: it must be a number from 10", "“Settings: Side of the square, mm” is 5: it must be a number from 10", "#settings")

    def test_the_planners_and_daemons_refusals_name_no_option(self):
        """Whatever of its sentences the page may show: each option that the planner names has a field, or words."""
        named = set()
        for room in ("planner", "daemon/workers", "daemon/plans/plan_service.cc"):
            for file in [ROOT / room] if room.endswith(".cc") else sorted((ROOT / room).rglob("*.cc")):
                for literal in re.findall(r'"(?:[^"\\\n]|\\.)*"', file.read_text()):
                    named |= set(re.findall(r"(?<![\w-])--[a-z][a-z0-9]*(?:-[a-z0-9]+)*", literal))
        told = self.does("const {byPage} = await load('by_page.js'); return given[0].filter((name) => byPage(`see to it (${name})`).length === 1)", sorted(named - self.ELSEWHERE))
        self.assertGreater(len(named), 8)
        self.assertEqual(told, [])

    # Of veneerctl alone: series and the assembly's maps are no business of the page, and the daemon's workers are started so.
    ELSEWHERE = {"--view", "--rail-mm"}

    def test_what_the_page_has_no_button_for_stays(self):
        for sentence in ("name it as `veneerctl panel merge` does", "try `veneerctl job redo 3 --never-heard-of`",
                         "find wood with `veneerctl job redo 3 AC DE`", "veneerctl job redo 3 AC DE", "veneerctl job redo 3 12 7K", "veneerctl job redo 3 AC 7K",
                         "run veneerctl frobnicate --list 3", "veneerctl job redo 3 --never-heard-of", "an ordinary sentence -- with dashes, and --x-mm", "a `quoted` word", "an odd ` mark", "", "veneerctl", "say --confirm \"half a name", "veneerctl by --confirm \"half"):
            self.check(sentence, sentence)

    def test_whatever_is_said_comes_to_an_end(self):
        odd = self.does("""
            const {byPage} = await load('by_page.js'), words = ['veneerctl', ' ', ' ', '`', '"', '--confirm', '--lost', '--list', '--face', 'back', 'job', 'redo', 'settle', 'panel', 'scan', 'P-0001', 'A1-2', '3', ':', ',', '(or released for scrap, when ', ')', 'by', 'run', '--', '-', '...', 'é'];
            let seed = 1;
            const next = (most) => { seed = (seed * 48271) % 2147483647; return seed % most; };
            for (let n = 0; n < 20000; ++n) {
              const said = Array.from({length: 1 + next(12)}, () => words[next(words.length)]).join('');
              const parts = byPage(said);
              if (/--confirm "[^"]*"/.test(said)) continue;  // told as a tick
              // What is not a way stands as it was said, in its order; between lies a command and nothing else.
              let at = 0;
              for (const [n, part] of parts.entries()) {
                if (part.href) continue;
                const isLed = Boolean(parts[n + 1]), words = part.replace(/\\b[Gg]o to $/, 'run ');
                const found = [part, words].map((one) => (n === 0 ? (said.startsWith(one) ? 0 : -1) : said.indexOf(one, at))).filter((place) => place >= 0);
                if (!found.length) return said;
                const [from] = found, gap = said.slice(at, from);
                if (n > 0 && !/^(`?(veneerctl )?(job|panel)\\b|--|released for scrap)/.test(gap)) return said;
                at = from + part.length;
                if (said.slice(from, at) !== part) at = from + words.length;
                if (!isLed && at !== said.length) return said;
              }
            }
            return ''""")
        self.assertEqual(odd, "", "it was changed beside what leads somewhere")

    def test_in_the_pages_language(self):
        self.speak("de")
        self.addCleanup(self.speak, "en")
        self.check("run `veneerctl panel scan --face back --panel P-0003`", "go to „Scannen: Rückseite: P-0003“", "#scan")
        seen = self.does("""
            const {cellSays} = await load('parts.js'), node = cellSays('find other wood with veneerctl job redo 3 A1-2 now');
            return [node.lang, [...node.children].map((one) => [one.nodeName, one.lang, one.getAttribute('href')]), node.textContent]""")
        self.assertEqual(seen, ["en", [["A", "de", "#run"]], "find other wood with „Schneiden: A1-2: Anderes Holz suchen“ now"])


class Said(Page):
    """What the cell says, on a German page."""
    def setUp(self):
        self.speak("de")
        self.addCleanup(self.speak, "en")

    def told(self, sentence):
        return self.does("return (await load('said.js')).inOwnWords(given[0])", sentence)

    def test_a_sentence_with_what_it_names(self):
        for english, german in (
            ("The lid is open: close it.", "Der Deckel ist offen: Schließen Sie ihn."),
            ("the lid is open: close it", "der Deckel ist offen: Schließen Sie ihn"),
            ("Lay panel P-0003 on the bed, face down: the camera finds it there.", "Legen Sie Platte P-0003 mit der Sichtseite nach unten auf das Bett: Die Kamera findet sie dort."),
            ("Job 3 “A lady in a red hat” has 12 pieces to cut: Start asks for its panel first, and nothing moves before you say so.",
             "Auftrag 3 „A lady in a red hat“ hat 12 Stücke zu schneiden: Start verlangt zuerst die Platte, und nichts bewegt sich, bevor Sie es sagen."),
            ("panel P-0001 found, back face up, fitted to 0.012 mm; 4 pieces: press Unsuspend", "Platte P-0001 ist mit der Rückseite nach oben gefunden, auf 0.012 mm genau; 4 Stücke: Drücken Sie Unsuspend"),
            ("Unhold is not possible while the cell is Idle", "Unhold geht nicht, solange die Zelle Idle ist"),
            ("STOP by anna", "STOP durch anna"),
            ("See to the lid is shut, tick each, then say Unsuspend.", "Prüfen Sie the lid is shut, haken Sie alles ab, dann Unsuspend."),
        ):
            with self.subTest(english):
                self.assertEqual(self.told(english), german)

    def test_one_sentence_within_another_and_beside_it(self):
        self.assertEqual(self.told("the laser is not homed: the lid is open: close it"), "der Laser ist nicht auf Referenz: der Deckel ist offen: Schließen Sie ihn")
        self.assertEqual(self.told("Reset homes the laser; piece A1-2 of job 3 is cut"), "Reset schickt den Laser auf Referenz; Stück A1-2 von Auftrag 3 ist geschnitten")
        self.assertEqual(self.told("what looks like a hair on the glass lies over the wood, at 40 mm from the left and 7 mm from the lower edge (3 mm long): what it hides is left out; clean the glass and scan again"),
                         "über dem Holz liegt, was wie ein Haar auf dem Glas aussieht, bei 40 mm von links und 7 mm von unten (3 mm lang): Was es verdeckt, bleibt weg; wischen Sie das Glas ab und scannen Sie noch einmal")
        overdue = "as if its controller hung or was busy with something else, the cable had lost a byte or this computer was too loaded to hear it: see that the head is free, check cable and supply, end other heavy programs, then Clear and Reset"
        self.assertEqual(self.told("the laser did not finish homing in time, " + overdue),
                         "der Laser kam nicht rechtzeitig auf Referenz, als hinge seine Steuerung oder wäre mit anderem beschäftigt, als wäre im Kabel ein Byte verloren gegangen oder dieser Rechner zu beschäftigt, um sie zu hören: Sehen Sie nach, dass der Kopf frei ist, prüfen Sie Kabel und Strom, beenden Sie andere schwere Programme, dann Clear und Reset")
        self.assertEqual(self.told("no homing switches; it counts from the corner it was given; the lid is closed again; its controller says Door:0"),
                         "keine Referenzschalter; er zählt von der Ecke, die ihm gegeben wurde; der Deckel ist wieder geschlossen; seine Steuerung meldet Door:0")
        self.assertEqual(self.told("lay panel P-0001 on the bed, turned half round, 20 mm of it sticking out at the front: the camera finds it there"),
                         "legen Sie Platte P-0001 auf das Bett, um eine halbe Drehung gedreht, vorne stehen 20 mm von ihr über: Die Kamera findet sie dort")

    def test_what_did_not_come_in_time_as_the_chain_splits_it(self):
        """Sentence and remedy stand apart there, and end otherwise in each state."""
        overdue = ", as if its controller hung or was busy with something else, the cable had lost a byte or this computer was too loaded to hear it"
        seen_to = "see that the head is free, check cable and supply, end other heavy programs, then "
        late = ", als hinge seine Steuerung oder wäre mit anderem beschäftigt, als wäre im Kabel ein Byte verloren gegangen oder dieser Rechner zu beschäftigt, um sie zu hören"
        care = "ehen Sie nach, dass der Kopf frei ist, prüfen Sie Kabel und Strom, beenden Sie andere schwere Programme, dann "
        whats = {
            "the laser did not finish homing in time": "der Laser kam nicht rechtzeitig auf Referenz",
            "the laser's head did not reach the focus height (laser.focus_z_mm) in time": "der Kopf des Lasers kam nicht rechtzeitig auf die Höhe des Fokus (laser.focus_z_mm)",
            "the laser controller does not come back from its reset": "die Steuerung des Lasers meldet sich nach dem Zurücksetzen nicht wieder",
            "the laser controller stopped answering in its check mode": "die Steuerung des Lasers antwortet in ihrem Prüfmodus nicht mehr",
            'the laser still says "Door:0", though its lid is closed': "der Laser meldet noch „Door:0“, obwohl sein Deckel geschlossen ist",
        }
        ends = {
            "Reset": "Reset", "Clear and Reset": "Clear und Reset", "Stop and Reset": "Stop und Reset", "try again": "versuchen Sie es noch einmal",
            "Clear and Reset, or switch the laser off and on": "Clear und Reset, oder schalten Sie den Laser aus und wieder ein",
        }
        for what, was in whats.items():
            self.assertEqual(self.told(what + overdue), was + late)
            for end, ending in ends.items():
                with self.subTest(what + " " + end):
                    self.assertEqual(self.told(what + overdue + ": " + seen_to + end), was + late + ": S" + care + ending)
        for end, ending in ends.items():
            self.assertEqual(self.told("S" + seen_to[1:] + end + "."), "S" + care + ending + ".")

    def test_a_remedy_in_each_state(self):
        for english, german in (
            ("Reset homes it.", "Reset schickt ihn auf Referenz."),
            ("Clear, then Reset homes it.", "Erst Clear; Reset schickt ihn auf Referenz."),
            ("Stop, then Reset tries to connect it again.", "Erst Stop; Reset versucht noch einmal, ihn zu verbinden."),
            ("Clear, then Reset takes the place where its head stands as its corner, or brings the head back to the corner it was given; where the controller has forgotten it, bring the head to that corner and say veneerctl laser here before Reset.",
             "Erst Clear; Reset nimmt den Ort des Kopfes als seine Ecke oder bringt den Kopf zu der Ecke zurück, die ihm gegeben wurde; hat die Steuerung sie vergessen, so bringen Sie den Kopf in diese Ecke und sagen Sie vor Reset veneerctl laser here."),
            ("Set $32=1 so that the beam goes out at rest. Then Reset.", "Stellen Sie $32=1 ein, damit der Strahl im Stillstand ausgeht. Dann Reset."),
            ("Set $32=1 so that the beam goes out at rest. Then Clear and Reset.", "Stellen Sie $32=1 ein, damit der Strahl im Stillstand ausgeht. Dann Clear und Reset."),
            ("See that the head is free, then Clear and Reset.", "Sehen Sie nach, dass der Kopf frei ist, dann Clear und Reset."),
            ("See that the head is free, then Reset.", "Sehen Sie nach, dass der Kopf frei ist, dann Reset."),
            ("Check the cable and the device's power. Then Clear and Reset.", "Prüfen Sie das Kabel und den Strom des Geräts. Dann Clear und Reset."),
            ("Give the daemon's user the group of the device, usually dialout, then restart veneerd.",
             "Nehmen Sie den Benutzer des Dienstes in die Gruppe des Geräts auf, meist dialout, und starten Sie dann veneerd neu."),
            ("the laser has no homing switches, and its controller has forgotten where its head stands: bring the head to the lower left corner of the bed, say veneerctl laser here, then Clear and Reset",
             "der Laser hat keine Referenzschalter, und seine Steuerung hat vergessen, wo der Kopf steht: bringen Sie den Kopf in die linke untere Ecke des Bettes, sagen Sie veneerctl laser here, dann Clear und Reset"),
            ("Check the cable, then Clear and Reset, or correct the port in the configuration, then restart veneerd.",
             "Prüfen Sie das Kabel, dann Clear und Reset, oder berichtigen Sie den Anschluss in der Konfiguration und starten Sie dann veneerd neu."),
            ("the pattern was cancelled after it was begun, and part of it may be burnt: Stop ends it",
             "was gebrannt wird (pattern), wurde mittendrin abgebrochen, und ein Teil davon kann gebrannt sein: mit Stop endet es"),
            ("the pattern was cancelled after it was begun: Stop ends it", "der Lauf ohne Strahl (pattern) wurde mittendrin abgebrochen: mit Stop endet es"),
            ("The laser is held, and nobody wants the rest of it any more: Stop ends it.", "Der Laser ist angehalten, und den Rest will niemand mehr: mit Stop endet es."),
            ("The lid is closed again, and the controller is still coming out of its wait: wait a few seconds.",
             "Der Deckel ist wieder geschlossen, und die Steuerung ist noch dabei, aus dem Warten zu kommen: warten Sie einige Sekunden."),
        ):
            with self.subTest(english):
                self.assertEqual(self.told(english), german)

    def test_what_is_not_known_stays_english_and_is_marked(self):
        for sentence in ("the moon is full", "the laser is not homed: nobody has written this one down", ""):
            with self.subTest(sentence):
                self.assertIsNone(self.told(sentence))
        seen = self.does("""
            const {cellSays} = await load('parts.js'), marked = (node) => (node.nodeType ? node.lang : 'plain');
            return [marked(cellSays('the moon is full')), [cellSays('the lid is open')].flat().map(marked), [cellSays('the lid is open')].flat().join('')]""")
        self.assertEqual(seen, ["en", ["plain"], "der Deckel ist offen"])

    def test_nothing_is_translated_for_who_reads_english(self):
        self.speak("en")
        self.assertIsNone(self.told("the lid is open: close it"))

    def test_every_sentence_of_the_catalogue_is_the_daemons(self):
        """As it stands there; or put together of two or three, a few of more."""
        of_more = ("waits for a scan, and so does 1 more", "has 1 piece to cut")
        said = self.does("return (await load('words/said_de.js')).said")
        sources = []
        for path in [path for room in ("daemon", "calib", "drivers", "planner") for ending in ("cc", "h") for path in ROOT.glob(f"{room}/**/*.{ending}")]:
            code = re.sub(r"^\s*//.*$", "", path.read_text(encoding="utf-8"), flags=re.M)
            for literals in re.findall(r'"(?:[^"\\]|\\.)*"(?:\s*"(?:[^"\\]|\\.)*")*', code):
                sources.append("".join(re.findall(r'"((?:[^"\\]|\\.)*)"', literals)))
        words_of = lambda text: re.findall(r"[\w'’%-]+", text.lower())
        daemon = " | ".join(" ".join(words_of(run)) for text in sources for run in re.split(r"\{[^{}]*\}", text))
        for english, german in said.items():
            with self.subTest(english):
                places = re.findall(r"\{=?(\d)\}", english)
                self.assertEqual(places, [str(n + 1) for n in range(len(places))], "in the order of the sentence")
                self.assertLessEqual(set(re.findall(r"\{(\d)\}", german)), set(places))
                self.assertFalse(english.endswith(".") or german.endswith("."))
                for run in re.split(r"\{=?\d\}", english):
                    self.assertLessEqual(self.parts(words_of(run), f" {daemon} "), 6 if any(words in run for words in of_more) else 3, run)

    @staticmethod
    def parts(words, daemon):
        """Of how many parts that stand in the daemon it is put together: the longest first."""
        count = 0
        while words:
            most = next((n for n in range(len(words), 0, -1) if f" {' '.join(words[:n])} " in daemon), 0)
            if most == 0:
                return 99
            words, count = words[most:], count + 1
        return count


class Log(Page):
    def told(self, what, detail):
        return self.does("return (await load('screens/log_words.js')).told(...given)", what, detail)

    def test_sentences_instead_of_json(self):
        for what, detail, words in (
            ("api.newJob", "POST /api/v1/jobs?name=refined&patch_mm=10&remnants_first=0&size_mm=30 (81490 bytes)", "/jobs: name refined, patch 10 mm, remnants first 0, size 30 mm, 81490 bytes"),
            ("api.command", "POST /api/v1/commands/reset {}", "/commands/reset"),
            ("api.scan", 'POST /api/v1/scans {"accept":true,"face":"show","more":false}', "/scans: accept, face show, no more"),
            ("x", '{"assembled":false,"air":false,"of_job":3}', "not assembled, no air, of job 3"),
            ("x", '{"power":0.87651,"speed_mm_s":1234.56,"kerf_mm":0.0004}', "power 0.877, speed 1234.56 mm/s, kerf 0.0004 mm"),
            ("api.deleteUser.refused", "DELETE /api/v1/users/anna: no", "remove /users/anna: no"),
            ("api.scan.done", '{"face":"show","new":true,"panel":"P-0001","remarks":[],"size_mm":[239.978,160.037],"usable_mm2":19763.1,"zones":6}', "face show, new, panel P-0001, size 239.978 mm × 160.037 mm, usable 197.631 cm², zones 6"),
            ("api.scan.failed", '{"error":{"code":"refused","message":"panel \\"P-0001\\" is \\u201cbent\\u201d"}}', 'panel "P-0001" is “bent”'),
            ("api.scan.failed", '"the \\"glass\\" is empty"', 'the "glass" is empty'),
            ("cell.frame", "0.025; confirmed: exhaust, air assist", "at 2.5 % power; confirmed: exhaust, air assist"),
            ("cell.frame", "0.000; confirmed: ", "dark"),
            ("run.end", "run 3 of job 12 on P-0001", "run 3 of job 12 on P-0001"),
            ("x", "{not json", "{not json"), ("x", "", ""), ("x", "POST /api/v1/x {not json}", "POST /api/v1/x {not json}"), ("x", "GET /a%ZZ", "asked for /a%ZZ")):
            with self.subTest(detail):
                self.assertEqual(self.told(what, detail), words)

    def named(self, what, language="en"):
        return self.does("return (await load('screens/log_words.js')).whatOf(given[0], await load(`words/log_${given[1]}.js`))", what, language)

    def test_what_a_row_is_about_in_words(self):
        for what, english, german in (("api.scan", "Scan", "Scannen"), ("api.scan.done", "Scan: done", "Scannen: fertig"), ("api.scan.refused", "Scan: refused", "Scannen: abgelehnt"),
                                      ("api.setRecipe.failed", "Set a recipe: failed", "Rezept setzen: misslungen"), ("device.choose.failed", "A device could not be chosen", "Ein Gerät konnte nicht gewählt werden"),
                                      ("api.laserTestPattern.done", "Test pattern: done", "Testmuster: fertig"), ("api.burnTestCard.done", "Test card: done", "Probekarte: fertig"), ("api.laserRun", "Drawing at the laser", "Zeichnung am Laser"),
                                      ("run.proven", "The pose was proven after a run", "Die Lage wurde nach einem Lauf bestätigt"),
                                      ("api.unheardOf.done", None, None), ("constructor", None, None), ("", None, None)):
            with self.subTest(what):
                self.assertEqual([self.named(what, "en"), self.named(what, "de")], [english, german])

    def test_every_change_that_the_api_has_is_named_in_both_languages(self):
        paths = json.loads((ROOT / "docs/openapi.json").read_text())["paths"]
        changes = sorted("api." + one["operationId"] for path in paths.values() for method, one in path.items() if method in ("post", "put", "patch", "delete"))
        self.assertGreater(len(changes), 60)
        for language in ("en", "de"):
            with self.subTest(language):
                names = self.does("return (await load(`words/log_${given[0]}.js`)).names", language)
                self.assertEqual([one for one in changes if one not in names], [])
                self.assertEqual(sorted(names), sorted(self.does("return (await load('words/log_en.js')).names")))

    def test_what_somebody_typed_is_text(self):
        seen = self.does("""
            const nasty = '<img src=x onerror="window.burnt = 1">', {model} = await load('model.js'), {put} = await load('dom.js');
            window.answers['/audit'] = {entries: [{id: 1, at: '2026-05-01T07:30:00Z', who: nasty, what: nasty, detail: JSON.stringify({name: nasty, job: nasty})},
                                                  {id: 2, at: '2026-05-01T07:30:00Z', who: 'x', what: 'job', detail: 'job 3 ' + nasty}], next: null};
            const log = await load('screens/log.js'), main = document.getElementById('main');
            log.enter();
            for (let i = 0; i < 200 && !main.querySelector('tbody'); ++i) { await new Promise((go) => setTimeout(go, 10)); put(main, ...log.draw()); }
            return [main.querySelectorAll('img').length, Boolean(window.burnt), main.querySelectorAll('a[href="#history/3"]').length, document.getElementById('log-text').placeholder, main.innerText.includes(nasty)]""")
        self.assertEqual(seen, [0, False, 1, "who, P-0001, A3-12", True])


# A cell that is Idle before an operator, with a job whose pieces are cut.
CELL = """
    const {model} = await load('model.js'), {put} = await load('dom.js'), main = document.getElementById('main');
    const given_to = (fresh) => { model.cell = {state: 'Idle', reason: '', tasks: [], jobs: [], calibration: {}, interlocks: [], panels: 0, ...fresh}; model.cellAt = performance.now(); };
    model.role = 'operator';
    given_to({});
    const settled = () => new Promise((go) => setTimeout(go, 50));  // answers here come at once
    const until = async (is) => { for (const end = performance.now() + 20000; performance.now() < end; await new Promise((go) => setTimeout(go, 10))) { const told = is(); if (told) return told; } throw new Error('it did not come: ' + is); };
"""


class Cards(Page):
    def setUp(self):
        self.speak("en")  # each with modules of its own

    def lose_a_piece(self, failure):
        return self.does(CELL + """
            const pieces = await load('screens/pieces.js'), commands = await load('commands.js');
            model.jobs = [{id: 3, name: 'bird', state: 'complete', cut: 2, suspect: 0, missing: 0, pieces: 2}];
            window.answers['/jobs?limit'] = {jobs: model.jobs, next: null};
            window.answers['/jobs/3/pieces'] = {pieces: ['A1-1', 'A1-2'].map((mark, n) => ({id: n + 1, mark, state: 'cut', panel: 'P-0001'})), next: null};
            window.answers['/jobs/3/redo'] = {task: 9};
            let sure = '';
            window.confirm = (words) => { sure = words; return true; };
            const draw = () => put(main, ...pieces.pieceCards());
            const seen = (css) => { draw(); return main.querySelector(css); };
            draw();
            main.querySelector('details[data-key=lost]').open = true;
            await until(() => seen('select[aria-label=Piece] option[value="A1-2"], select:nth-of-type(2) option[value="A1-2"]'));
            const choose = [...main.querySelectorAll('details[data-key=lost] select')][1];
            choose.value = 'A1-2';
            choose.dispatchEvent(new Event('change'));
            await until(() => { draw(); return !main.querySelector('#do-lost').disabled; });
            main.querySelector('#do-lost').click();
            const asked = await until(() => window.asked.find(({path}) => path.includes('/redo')));
            if (given[0]) {
              model.tasks.set(9, {id: 9, state: 'failed', error: {message: given[0]}});
              model.jobs[0].missing = 1;
              await until(() => seen('[data-key=redone]'));
            }
            return {label: main.querySelector('#do-lost').innerText, sure, body: asked.body, said: main.querySelector('[data-key=redone]')?.innerText, lang: main.querySelector('[data-key=redone] [lang]')?.lang}""", failure)

    def test_a_lost_piece_is_asked_for_as_lost(self):
        told = self.lose_a_piece("")
        self.assertEqual(told["label"], "It is lost: find other wood")
        self.assertIn("Is piece A1-2 lost", told["sure"])
        self.assertEqual(told["body"], {"pieces": ["A1-2"], "lost": True})

    def test_a_failed_redo_is_told_in_the_pages_words(self):
        self.speak("de")
        self.addCleanup(self.speak, "en")
        told = self.lose_a_piece("there is no panel in stock: scan one with veneerctl panel scan")
        self.assertEqual(told["label"], "Es ist verloren: anderes Holz suchen")
        self.assertEqual(told["said"], "▲ Auftrag 3: Es wurde kein anderes Holz reserviert: There is no panel in stock: scan one with „Scannen: Scannen“.")
        self.assertEqual(told["lang"], "en")

    def test_what_came_of_a_redo_is_of_the_last_one(self):
        told = self.does(CELL + """
            const pieces = await load('screens/pieces.js');
            model.jobs = [3, 4].map((id) => ({id, name: 'bird', state: 'incomplete', cut: 1, suspect: 0, missing: 1, pieces: 2}));
            window.answers['/jobs?limit'] = {jobs: model.jobs, next: null};
            window.answers['/pieces'] = {pieces: [], next: null};
            window.answers['/status'] = model.cell;
            let id = 9;
            const out = [];
            const end = async (job, task) => {
              window.answers['/redo'] = {task: ++id};
              await pieces.redo(job, null);
              model.tasks.set(id, {id, ...task});
              put(main, ...pieces.pieceCards());
              out.push(main.querySelector('[data-key=redone]')?.innerText || '');
            };
            await end(3, {state: 'failed', error: {code: 'refused', message: 'nothing is free'}});
            await end(4, {state: 'cancelled', error: {code: 'cancelled', message: 'it was cancelled'}});
            await end(4, {state: 'done', result: {redone: [{mark: 'A1-1'}], cost_per_pixel: 1, cost_per_pixel_before: 1}});
            return out""")
        self.assertEqual(told[:2], ["▲ job 3: Other wood was not reserved: Nothing is free.", ""])
        self.assertIn("job 4: A1-1 has other wood now.", told[2])

    def test_clear_is_about_what_was_shown(self):
        told = self.does(CELL + """
            const {clearing, mayClear} = await load('commands.js'), stopped = (reason) => ({state: 'Aborted', reason});
            // As a status tells it.
            window.answers['/status'] = {state: 'Idle', reason: '', tasks: []};
            const tell = async (fresh) => { window.answers['/status'] = {tasks: [], ...fresh}; await (await load('model.js')).askStatus(); };
            await tell({state: 'Execute', reason: ''});
            await tell(stopped('the lid was opened'));
            const atOnce = mayClear();
            await until(mayClear);
            const press = clearing();
            await tell(stopped('STOP was pressed'));
            press();
            const other = window.asked.filter(({path}) => path.includes('/commands/clear')).length;
            await until(mayClear);
            clearing()();
            await until(() => window.asked.some(({path}) => path.includes('/commands/clear')));
            return [atOnce, other]""")
        self.assertEqual(told, [False, 0], "not at once, and not of another thing")

    def test_a_look_that_is_owed_is_given_up_as_it_was_shown(self):
        told = self.does(CELL + """
            const cell = await load('screens/cell.js'), asked = () => window.asked.filter(({path}) => path.includes('write-off-look')).length;
            let sure = '';
            window.confirm = (words) => { sure = words; return true; };
            const owed = (pieces) => ({owed_look: {job: 3, panel: 'P-0001', pieces, sentence: 'the camera has not seen panel P-0001'}});
            const given_now = (fresh) => { given_to(fresh); window.answers['/status'] = model.cell; };
            const draw = (fresh) => { given_now(fresh); put(main, ...cell.draw()); return main.querySelector('#write-off-look'); };
            const none = draw({});
            const atOnce = draw(owed(2)).disabled;
            await until(() => !draw(owed(2)).disabled);
            given_now(owed(4));
            main.querySelector('#write-off-look').click();
            await settled();
            const other = asked(), unasked = sure;
            // While somebody reads the question.
            await until(() => !draw(owed(4)).disabled);
            window.confirm = () => { window.answers['/status'] = {...model.cell, ...owed(6)}; return true; };
            main.querySelector('#write-off-look').click();
            await settled();
            const meanwhile = asked();
            window.confirm = (words) => { sure = words; return true; };
            await until(() => !draw(owed(4)).disabled);
            main.querySelector('#write-off-look').click();
            await until(asked);
            return [none, atOnce, other, unasked, meanwhile, sure]""")
        self.assertEqual(told[:5], [None, True, 0, "", 0])
        self.assertIn("Shall 4 pieces of job 3 on panel P-0001 be suspect", told[5])

    def test_a_panel_says_in_words_what_nobody_knows_of_its_wood(self):
        told = self.does(CELL + """
            const panels = await load('screens/panels.js');
            const sheet = (id, mask, book) => ({id, name: id, retired: null, woods: [], width_mm: 240, height_mm: 160, mask, free_mm2: 7e4, reserved_mm2: 5e4, cut_mm2: 0, area_book_mm2: book});
            model.panels = [sheet('P-0001', 'counted', {free: 65000, reserved: 12000}), sheet('P-0002', 'uncounted', null), sheet('P-0003', 'unreadable', null)];
            put(main, panels.draw());
            return [...main.querySelectorAll('a.panel')].map((one) => one.innerText)""")
        for said, words in zip(told, ("650 cm² free, 120 cm² reserved", "Its wood is not counted yet.", "Its mask cannot be read")):
            self.assertIn(words, said)
        self.assertNotIn("cm²", told[1] + told[2])

    def test_an_open_series_goes_on_as_it_began(self):
        seen = self.does(CELL + """
            const scan = await load('screens/scan.js'), asked = () => window.asked.filter(({path}) => path.endsWith('/scans')).map(({body}) => body);
            window.answers['/proposals'] = {proposals: []};
            model.panels = ['P-0001', 'P-0002'].map((id) => ({id, retired: null, faces: ['show']}));
            const open = (tiles, more = {}) => ({open_scan: {tiles, panel: 'P-0002', face: 'back', ...more}});
            const draw = (fresh) => { given_to(fresh); window.answers['/status'] = model.cell; put(main, scan.draw()); return main.querySelector('#do-scan'); };
            const chosen = () => [...main.querySelectorAll('select')].map(({value}) => value);
            const choose = (n, value) => { const field = main.querySelectorAll('select')[n]; field.value = value; field.dispatchEvent(new Event('change')); };
            const look = (fresh) => [draw(fresh).disabled, main.querySelector('#scan-other') !== null, main.innerText.includes('the next scan belongs to this series'), ...chosen()];
            const none = look({open_scan: null}), atOnce = draw(open(1)).disabled;
            await until(() => !draw(open(1)).disabled);
            const begun = look(open(1));
            main.querySelector('#do-scan').click();
            await until(() => asked().length);
            await settled();
            choose(0, 'show');
            const face = look(open(1));
            choose(0, 'back'); choose(1, 'P-0001');
            const panel = look(open(1));
            choose(1, '');
            const itself = look(open(1)), another = look(open(1, {face: 'show', panel: null}));
            return {none, atOnce, begun, sent: asked(), face, panel, itself, another: another.slice(3)}""")
        self.assertEqual(seen, {"none": [False, False, False, "show", ""], "atOnce": True, "begun": [False, False, True, "back", "P-0002"],
                                "sent": [{"face": "back", "more": False, "panel": "P-0002"}], "face": [True, True, False, "show", "P-0002"],
                                "panel": [True, True, False, "back", "P-0001"], "itself": [False, False, True, "back", ""], "another": ["show", ""]})

    def test_a_tile_of_before_is_told_by_its_series_alone(self):
        seen = self.does(CELL + """
            const scan = await load('screens/scan.js');
            window.answers['/proposals'] = {proposals: []};
            window.answers['/status'] = {state: 'Idle', reason: '', tasks: []};
            window.answers['/scans'] = {task: 7};
            const draw = (open_scan) => { given_to({open_scan}); put(main, scan.draw()); };
            draw(null);
            main.querySelector('#do-scan').click();
            await until(() => window.asked.some(({path}) => path.endsWith('/scans')));
            await settled();
            model.tasks.set(7, {id: 7, state: 'done', result: {tiles: 2, face: 'show'}});
            draw({tiles: 2, panel: null, face: 'show'});
            const there = main.innerText.match(/2 tiles are scanned/g).length;
            draw(null);
            return [there, main.innerText.includes('tiles are scanned')]""")
        self.assertEqual(seen, [1, False])

    def test_a_scan_tells_its_tiles_and_how_they_fit(self):
        words = self.does(CELL + """
            const scan = await load('screens/scan.js');
            window.answers['/proposals'] = {proposals: [{number: 4, panel: null, warnings: [], size_mm: [240, 160], usable_mm2: 1e4, lost_mm2: 0, gained_mm2: 0}]};
            window.answers['/status'] = {state: 'Idle', reason: '', tasks: []};
            window.answers['/scans'] = {task: 7};
            const draw = () => { given_to({}); put(main, scan.draw()); };
            draw();
            main.querySelector('#do-scan').click();
            await until(() => window.asked.some(({path}) => path.endsWith('/scans')));
            const told = (result) => { model.tasks.set(7, {id: 7, state: 'done', result}); draw(); return main.innerText; };
            const tiles = {tiles: 3, registration: {rms_mm: .0123, max_mm: .05, left_out_mm: .061}};
            const known = await until(() => { const words = told({panel: 'P-0001', face: 'back', ...tiles}); return words.includes('Panel P-0001') && words; });
            return [known, await until(() => { const words = told({proposal: 4, ...tiles}); return words.includes('Accept it') && words; }), told({proposal: 5, ...tiles})]""")
        for told in words[:2]:
            self.assertRegex(told, r"Tiles\s+3\s+Fit of the tags\s+0.012 mm\s+Worst of them\s+0.050 mm\s+Worst, if left out\s+0.061 mm")
        self.assertNotIn("Worst of them", words[2], "of another scan")

    def ask_about_strips(self, then):
        """A scan that asks about a strip it left out and one it took, and of its size, with its picture; `then`: a script, draw() draws."""
        return self.does(CELL + """
            const scan = await load('screens/scan.js'), ring = (left, right) => [[left, 12], [right, 12], [right, 150], [left, 150]];
            const warned = ['strip-1', 'strip-2', 'size'].map((name) => ({name, text: `something is in doubt about ${name}`, overruled_by: 'operator'}));
            window.answers['/proposals'] = {proposals: [{number: 4, panel: null, warnings: warned, size_mm: [240, 160], usable_mm2: 1e4, lost_mm2: 0, gained_mm2: 0,
              asked: [{warning: 'strip-1', outline_mm: ring(20, 70), confidence: .37, taken: false, reason: 'it looks like the board'}, {warning: 'strip-2', outline_mm: ring(80, 130), confidence: .8, taken: true, reason: '14 % of it does not look like the rest'}]}]};
            window.answers['/proposals/4/accept'] = {task: 8};
            window.answers['/status'] = {state: 'Idle', reason: '', tasks: []};
            const draw = () => { given_to({}); put(main, scan.draw()); return main; }, path = '/proposals/4/picture.png';
            const wood = document.createElement('canvas'), pen = wood.getContext('2d');
            [wood.width, wood.height] = [720, 480];
            const paint = (colour, ...box) => { pen.fillStyle = colour; pen.fillRect(...box); };
            paint('#e8e4da', 0, 0, 720, 480);
            for (const [left, colour] of [[60, '#ded3bd'], [240, '#7a5230'], [420, '#b98d5a']]) paint(colour, left, 30, 150, 414);
            await until(() => draw().querySelector('#accept-4'));
            Object.assign(main.querySelector(`img[data-picture="${path}"]`), {came_: path, hidden: false, src: wood.toDataURL()});
            await until(() => draw().querySelector('.seen-strips svg'));
            const press = (name) => { main.querySelector(`[data-strip=${name}]`).click(); draw(); };
            const signs = () => [...main.querySelectorAll('.seen-strips text')].map((one) => one.textContent), canAccept = () => !main.querySelector('#accept-4').disabled;
            """ + then)

    def test_a_strip_that_a_scan_asks_about_is_answered_with_one_press(self):
        told = self.ask_about_strips("""
            const begun = [signs(), canAccept(), main.querySelectorAll('[data-doubt]').length];
            press('strip-1-wood'); press('strip-2-no_wood');
            const said = [signs(), canAccept(), main.innerText.includes('It becomes usable'), main.innerText.includes('in later scans too')];
            press('strip-2-no_wood');
            const again = signs();
            press('strip-2-no_wood');
            main.querySelector('[data-doubt=size]').click(); draw();
            const may = canAccept();
            main.querySelector('#accept-4').click();
            const sent = await until(() => window.asked.find((one) => one.path.endsWith('/accept')));
            return {begun, said, again, may, sent: sent.body}""")
        self.assertEqual(told["begun"], [["1 ?", "2 ?"], False, 1])
        self.assertEqual(told["said"], [["1 ✓", "2 ✕"], False, True, True])
        self.assertEqual(told["again"], ["1 ✓", "2 ?"])
        self.assertTrue(told["may"])
        sent = told["sent"]
        self.assertEqual(json.loads(sent) if isinstance(sent, str) else sent, {"wood": ["strip-1"], "no_wood": ["strip-2"], "override": ["size"]})

    def test_strips_lie_on_the_picture_where_the_scan_saw_them(self):
        off = self.ask_about_strips("""
            const image = main.querySelector('.seen-strips img').getBoundingClientRect(), line = main.querySelector('.seen-strips .line').getBoundingClientRect();
            return [line.left - image.left - image.width * 20 / 240, image.right - line.right - image.width * 170 / 240, line.top - image.top - image.height * 10 / 160, image.bottom - line.bottom - image.height * 12 / 160]""")
        for side in off:
            self.assertLess(abs(side), 2, off)

    def test_a_series_is_begun_anew_as_it_is_shown(self):
        told = self.does(CELL + """
            const scan = await load('screens/scan.js'), asked = () => window.asked.filter(({path}) => path.endsWith('/scans')).map(({body}) => body);
            window.confirm = () => true;
            window.answers['/proposals'] = {proposals: []};
            const given_now = (tiles) => { given_to({open_scan: {tiles, panel: null, face: 'show'}}); window.answers['/status'] = model.cell; };
            const draw = (tiles) => { given_now(tiles); put(main, scan.draw()); return main.querySelector('#scan-anew'); };
            draw(1);
            const words = main.querySelector('[data-key=series]').innerText, stale = draw(2);
            const atOnce = stale.disabled;
            await until(() => !draw(2).disabled);
            given_now(3);
            main.querySelector('#scan-anew').click();
            await settled();
            const other = asked().length;
            // While somebody reads the question.
            await until(() => !draw(3).disabled);
            window.confirm = () => { window.answers['/status'] = {...model.cell, open_scan: {tiles: 4, panel: null, face: 'show'}}; return true; };
            main.querySelector('#scan-anew').click();
            await settled();
            const meanwhile = asked().length;
            window.confirm = () => true;
            await until(() => !draw(3).disabled);
            main.querySelector('#scan-anew').click();
            await until(() => asked().length);
            return [words.includes('1 tile is scanned'), atOnce, other, meanwhile, asked()]""")
        self.assertEqual(told, [True, True, 0, 0, [{"face": "show", "more": False, "anew": True}]])

    def test_what_is_in_the_way_shuts_the_first_cut_and_calibration_off(self):
        told = self.does(CELL + """
            const {cutStep} = await load('screens/setup_wood.js'), {cameraStep, laserStep} = await load('screens/setup_calibrate.js');
            model.role = 'maintainer';
            model.jobs = [{id: 1, name: 'bird', state: 'planned', cut: 0, pieces: 4}];
            const about = {hands: true, certificate: () => ({rms_mm: .01}), setup: {collected: {view_heights_mm: [], grid_scans: 0}, panel_thickness_mm: 2.1}};
            const look = (css, step, ...interlocks) => { given_to({interlocks}); put(main, step.body(about)); return [main.querySelector(css).disabled, (main.querySelector('[data-blocked]') || {}).innerText || '']; };
            const camera = {name: 'camera', state: 'blocks', sentence: 'the camera is silent', remedy: 'See to it.'}, machine = {name: 'machine', state: 'blocks', sentence: 'the controller says Alarm', remedy: 'Reset.'};
            const warns = {...machine, state: 'warns'};
            return [look('#do-begin', cutStep), look('#do-begin', cutStep, camera), look('#do-begin', cutStep, machine), look('#do-begin', cutStep, warns),
                    look('#do-camera', cameraStep), look('#do-camera', cameraStep, camera), look('#do-camera', cameraStep, machine), look('#do-laser', laserStep), look('#do-laser', laserStep, machine)]""")
        silent, alarm = "▲ Bed camera: The camera is silent. See to it.", "▲ Machine: The controller says Alarm. Reset."
        self.assertEqual(told, [[False, ""], [True, silent], [True, alarm], [False, ""], [False, ""], [True, silent], [False, ""], [False, ""], [True, alarm]])

    def test_the_power_of_a_frame_is_used_as_it_is_shown(self):
        told = self.does(CELL + """
            const run = await load('screens/run.js'), suspended = {state: 'Suspended', confirm: [], load: {panel: 'P-0001', found: true, rms_mm: .01, frame_max_power: .03}};
            const draw = () => { given_to(suspended); put(main, run.draw()); };
            const out = [];
            for (const typed of ['1,25', '0.04', '2.96', '3.1', 'x']) {
              draw();
              const field = main.querySelector('#frame-power'), button = () => main.querySelector('.frame button');
              field.value = typed;
              field.dispatchEvent(new Event('input'));
              draw();
              const before = window.asked.length, words = button().innerText;
              button().click();
              const sent = window.asked.slice(before).find(({path}) => path.includes('/commands/frame'));
              out.push([words.split('\\n')[0], button().disabled ? null : sent.body && sent.body.power]);
              await new Promise((go) => setTimeout(go, 0));
            }
            return out""")
        self.assertEqual(told, [["Trace the frame at 1.3 % power", .013], ["Trace the frame, dark", None], ["Trace the frame at 3 % power", .03], ["Trace the frame, dark", None], ["Trace the frame, dark", None]])

    def test_a_sketch_of_other_numbers_is_marked_as_old(self):
        seen = self.does(CELL + """
            const page = await load('screens/new_picture.js');
            const paper = document.createElement('canvas');
            paper.width = 60; paper.height = 40;
            const picture = new File([await new Promise((made) => paper.toBlob(made))], 'dot.png', {type: 'image/png'});
            const preview = paper.toDataURL('image/jpeg').split(',')[1];
            window.answers['/plans/sketch'] = {preview_jpeg: preview, width_mm: 60, height_mm: 40, pieces: 6, likeness: .5, layout: 'grid', unfilled: 0, patch_mm: 14, left_out: []};
            const draw = () => { given_to({panels: 0}); put(main, page.draw()); };
            const sheet = (css) => { draw(); return main.querySelector(css); };
            draw();
            const proposed = [main.querySelector('#picture-size').value, main.querySelector('#picture-patch').value];
            const files = new DataTransfer();
            files.items.add(picture);
            const input = main.querySelector('#picture-file');
            input.files = files.files;
            input.dispatchEvent(new Event('change'));
            await until(() => sheet('#sketch-picture'));
            const fresh = main.querySelector('.sketch.old') !== null, field = main.querySelector('#picture-size');
            const type = (text) => { field.value = text; field.dispatchEvent(new Event('input')); draw(); };
            type('1e3');
            const old = [main.querySelector('.sketch.old') !== null, main.querySelector('.sketch').innerText.includes('This is an earlier sketch.'), main.querySelector('#do-plan').disabled];
            const before = window.asked.filter(({path}) => path.includes('/sketch')).length;
            type('150,5');
            await until(() => { draw(); return window.asked.filter(({path}) => path.includes('/sketch')).length > before; });
            const last = window.asked.filter(({path}) => path.includes('/sketch')).pop().path;
            await until(() => { draw(); return !main.querySelector('.sketch.old'); });
            return {proposed, fresh, old, size: new URLSearchParams(last.split('?')[1]).get('size_mm'), may: !main.querySelector('#do-plan').disabled}""")
        self.assertEqual(seen, {"proposed": ["190", "14"], "fresh": False, "old": [True, True, True], "size": "150.5", "may": True})

    def test_a_sketch_in_squares_becomes_one_of_the_plans_own_pieces(self):
        seen = self.does(CELL + MOSAIC + """
            const sketches = (fine) => window.asked.filter(({path}) => path.includes('/plans/sketch') && path.includes('fine=1') === fine).map(({path}) => new URLSearchParams(path.split('?')[1]));
            page.enter();
            await choose('dot.png');
            await until(() => sheet('#sketch-picture'));
            const grid = [sketches(true).length, sheet('#sketch-squares')];
            type('#picture-layout', 'mosaic');
            await until(() => { draw(); return sketches(true).length === 1; });
            await until(() => !sheet('#sketch-squares'));
            const [first] = sketches(true), before = sketches(false).length;
            // What only the cells follow asks for no squares.
            window.answers['/plans/sketch'] = {error: {message: 'no wood: scan some'}};
            await until(() => sheet('#slide-cell_aspect'));
            type('#slide-cell_aspect', '2');
            await until(() => { draw(); return sketches(true).length === 2; });
            const longer = sketches(true)[1];
            const state = await until(() => { const said = sheet('#sketch-squares'); return said && said.innerText; });
            return {grid, layout: first.get('layout'), aspect: [first.get('cell_aspect'), longer.get('cell_aspect')], squares: sketches(false).length - before, state}""")
        self.assertEqual(seen, {"grid": [0, None], "layout": "mosaic", "aspect": [None, "2"], "squares": 0, "state": "Drawn in squares. The plan has other pieces."})

    def test_pieces_of_before_never_stand_for_those_that_are_wanted(self):
        seen = self.does(CELL + MOSAIC + FINER + """
            await choose('dot.png');
            await until(() => shown() === '6');
            press('#picture-refine');
            await until(() => shown() === '9');
            press('#picture-refine');
            const unticked = [shown(), words()];
            type('#picture-layout', 'segmentation');
            await until(() => shown() === '9');
            const files = new DataTransfer(), input = sheet('#picture-drawing');
            files.items.add(new File(['<svg/>'], 'areas.svg', {type: 'image/svg+xml'}));
            input.files = files.files;
            input.dispatchEvent(new Event('change'));
            const drawing = [shown(), words()];
            type('#picture-layout', 'mosaic');
            await until(() => shown() === '9');
            finer = () => ({error: {status: 400, message: 'no room: say more'}});
            await until(() => sheet('#slide-cell_aspect'));
            type('#slide-cell_aspect', '2');
            const said = await until(() => { const one = sheet('#sketch-declined'); return one && one.innerText; });
            return {unticked, drawing, declined: [shown(), words(), said]}""")
        other = "Drawn in squares. The plan has other pieces."
        self.assertEqual(seen, {"unticked": ["6", None], "drawing": ["6", other], "declined": ["6", other, "▲ No room: say more."]})

    def test_pieces_wait_for_the_lines_and_for_a_hand(self):
        seen = self.does(CELL + MOSAIC + FINER + """
            const lines = window.answers['/plans/mosaic'], asked = () => window.asked.filter(({path}) => path.includes('/plans/sketch') && path.includes('fine=1')).length;
            let go = null, aborted = 0;
            window.answers['/plans/mosaic'] = async (path) => { if (path.includes('fine=1')) await new Promise((done) => { go = done; }); return lines; };
            finer = (how) => new Promise((done, fail) => how.signal.addEventListener('abort', () => { ++aborted; fail(new Error('aborted')); }));
            await choose('dot.png');
            await until(() => shown() === '6');
            type('#picture-layout', 'mosaic');
            await until(() => { draw(); return go; });
            await quiet();
            const early = asked();
            go();
            await until(() => { draw(); return asked() === 1; });
            const real = window.setTimeout;
            let later = null;
            window.setTimeout = (act, ms, ...more) => (ms === 120 ? (later = act, 0) : real(act, ms, ...more));
            await until(() => sheet('#slide-cell_aspect'));
            type('#slide-cell_aspect', '2');
            await quiet();
            const unsettled = [aborted, asked()];
            window.setTimeout = real;
            return {early, unsettled}""")
        self.assertEqual(seen, {"early": 0, "unsettled": [1, 1]})

    def test_a_plan_goes_before_sketches(self):
        seen = self.does(CELL + MOSAIC + FINER + """
            const order = [];
            let plans = null;
            finer = (how) => new Promise((done, fail) => { order.push('fine'); how.signal.addEventListener('abort', () => { order.push('aborted'); fail(new Error('aborted')); }); });
            window.answers['/plans?'] = async () => { order.push('plan'); await new Promise((done) => { plans = done; }); return {task: 5}; };
            await choose('dot.png');
            await until(() => shown() === '6');
            press('#picture-refine');
            await until(() => { draw(); return order.length; });
            press('#do-plan');
            await until(() => { draw(); return plans; });
            await quiet();
            const meanwhile = [...order];
            plans();
            await until(() => { draw(); return order.length > 3; });
            return [meanwhile, order]""")
        self.assertEqual(seen, [["fine", "aborted", "plan"], ["fine", "aborted", "plan", "fine"]])

    def test_pieces_are_asked_for_again_where_the_cell_is_full_or_silent(self):
        seen = self.does(CELL + MOSAIC + FINER + """
            const real = window.setTimeout, often = finer;
            window.setTimeout = (act, ms, ...more) => real(act, [1500, 5000].includes(ms) ? 0 : ms, ...more);
            let tries = 0;
            const full = (status) => ({error: {status, message: 'full: ask again'}});
            const rounds = [() => full(429), () => full(503), () => { throw new Error('silent'); }];
            finer = (how) => (rounds[tries++] || often)(how);
            await choose('dot.png');
            await until(() => shown() === '6');
            press('#picture-refine');
            await until(() => shown() === '9');
            let squares = 0;
            const coarse = rough;
            rough = () => (squares++ ? coarse() : full(503));
            type('#picture-size', '150');
            await until(() => squares === 2 && shown() === '9');
            window.setTimeout = real;
            return tries""")
        self.assertEqual(seen, 5)

    def test_no_pieces_are_asked_for_while_a_run_executes(self):
        seen = self.does(CELL + MOSAIC + FINER + """
            let tries = 0;
            const often = finer, cutting = () => { given_to({state: 'Execute', panels: 0}); put(main, page.draw()); };
            finer = () => { ++tries; return often(); };
            await choose('dot.png');
            await until(() => shown() === '6');
            main.querySelector('#picture-refine').click();
            cutting();
            await quiet();
            cutting();
            const meanwhile = [tries, main.querySelector('#sketch-squares').innerText];
            await until(() => shown() === '9');
            return meanwhile""")
        self.assertEqual(seen, [0, "Drawn in squares. The plan has other pieces."])

    def test_pins_lie_on_the_border_of_the_picture_that_is_sent(self):
        seen = self.does(CELL + MOSAIC + FINER + """
            const often = finer;
            let sent = null;
            window.answers['/plans/grid'] = {error: {message: 'no'}};
            finer = async (how, path) => { const {width, height} = await createImageBitmap(how.body); sent = {pins: new URLSearchParams(path.split('?')[1]).get('pinned_vertices'), width, height}; return often(); };
            await choose('dot.png', 1000, 663);
            await until(() => shown() === '6');
            type('#picture-layout', 'morph');
            const canvas = await until(() => sheet('canvas.lines'));
            const key = (name) => { canvas.dispatchEvent(new KeyboardEvent('keydown', {key: name, bubbles: true, cancelable: true})); draw(); };
            for (let i = 0; i < 60; ++i) key('ArrowRight');
            key(' ');
            await until(() => { draw(); return sent && sent.pins; });
            return {x: Number(sent.pins.split(',')[2]), width: Number(sheet('#picture-size').value) * sent.width / sent.height, smaller: sent.width < 1000}""")
        self.assertTrue(seen["smaller"])
        self.assertAlmostEqual(seen["x"], seen["width"], delta=.0001)

    def test_the_first_size_follows_the_wood_until_a_picture_is_there(self):
        seen = self.does(CELL + """
            const page = await load('screens/new_picture.js');
            const look = (...panels) => { model.panels = panels; given_to({panels: panels.length}); put(main, page.draw()); return [main.querySelector('#picture-size').value, main.querySelector('#picture-patch').value, Boolean(main.querySelector('#no-wood'))]; };
            const sheet = (free_mm2) => ({id: 'P-0001', free_mm2, retired: null});
            const none = look(), some = look(sheet(2e4)), empty = look(sheet(0));
            const field = main.querySelector('#picture-size');
            field.value = '55';
            field.dispatchEvent(new Event('input'));
            const retired = look({...sheet(2e4), retired: {reason: 'lent'}}), waits = look({...sheet(2e4), scan_again: 'sanded'})[2] && main.querySelector('#no-wood').innerText;
            return [none, some[0], empty, look(sheet(2e4))[0], retired[2], waits]""")
        self.assertEqual(seen[0], ["190", "14", False])
        self.assertTrue(20 < int(seen[1]) < 190, seen)
        self.assertEqual(seen[2], ["20", "5", True])
        self.assertEqual(seen[3:], ["55", True, "▲ No wood is free: scan it again (P-0001)."], "what somebody typed stays")

    def first_sizes(self, picture):
        """The size as the page begins, with a picture, once its first wood is there, and when more of it comes."""
        return self.does(CELL + """
            const page = await load('screens/new_picture.js'), {isOpened} = await load('sketch.js');
            const sheet = (free_mm2) => ({id: 'P-0001', free_mm2, retired: null});
            const look = (...panels) => { model.panels = panels; given_to({panels: panels.length}); put(main, page.draw()); return Number(main.querySelector('#picture-size').value); };
            model.cell = null;
            put(main, page.draw());
            const first = [main.querySelector('#picture-size').value, main.querySelector('#picture-patch').value, main.innerText.includes('missing')];
            const paper = document.createElement('canvas');
            paper.width = 60; paper.height = 40;
            const file = given[0] ? new File([await new Promise((made) => paper.toBlob(made))], 'dot.png', {type: 'image/png'}) : new File(['II*'], 'dot.tif', {type: 'image/tiff'});
            const files = new DataTransfer();
            files.items.add(file);
            look(sheet(0));
            const input = main.querySelector('#picture-file');
            input.files = files.files;
            input.dispatchEvent(new Event('change'));
            await until(() => isOpened(input.files[0]));
            return [first, look(sheet(0)), look(sheet(2e4)), look(sheet(9e4))]""", picture)

    def test_a_size_that_was_proposed_without_wood_follows_the_first_wood(self):
        first, bare, some, more = self.first_sizes(True)
        self.assertEqual((first, bare), (["190", "14", False], 20))
        self.assertGreater(some, 20, "a panel was scanned")
        self.assertEqual(more, some, "no number changes under a finger")

    def test_a_picture_that_the_browser_cannot_read_keeps_its_size_too(self):
        first, bare, some, more = self.first_sizes(False)
        self.assertEqual(bare, 20)
        self.assertGreater(some, 20)
        self.assertEqual(more, some)


# New picture with a picture of 60 x 40 pixels, to be made of cells; the cell answers with two of them.
MOSAIC = """
    const page = await load('screens/new_picture.js');
    const plate = document.createElement('canvas').toDataURL('image/jpeg').split(',')[1];
    Object.assign(window.answers, {
      '/plans/sketch': {preview_jpeg: plate, width_mm: 60, height_mm: 40, pieces: 6, likeness: .5, layout: 'grid', unfilled: 0, patch_mm: 14, left_out: []},
      '/plans/mosaic': {width_mm: 60, height_mm: 40, cells: 2, lines: [[[30, 0], [30, 40]]]}, '/plans?': {task: 5}});
    model.panels = [['P-0001', 'maple'], ['P-0002', 'walnut']].map(([id, wood]) => ({id, woods: [wood], free_mm2: 70000}));
    window.answers['/panels'] = {panels: model.panels, next: null};
    const draw = () => { given_to({panels: 0}); put(main, page.draw()); page.drawn(main); };
    const sheet = (css) => { draw(); return main.querySelector(css); };
    const choose = async (name, width = 60, height = 40) => {
      const paper = document.createElement('canvas');
      Object.assign(paper, {width, height});
      const files = new DataTransfer(), input = sheet('#picture-file');
      files.items.add(new File([await new Promise((made) => paper.toBlob(made))], name, {type: 'image/png', lastModified: 1}));
      input.files = files.files;
      input.dispatchEvent(new Event('change'));
    };
    const type = (css, text) => { const field = sheet(css); field.value = text; field.dispatchEvent(new Event(field.nodeName === 'SELECT' ? 'change' : 'input')); draw(); };
    const press = (css) => { sheet(css).click(); draw(); };
    const ofSketch = (path, part) => part !== '/plans/sketch' || !path.includes('fine=1');  // squares; of finer ones tests ask otherwise
    const told = (part) => { const last = window.asked.filter(({path}) => path.includes(part) && ofSketch(path, part)).pop(); return last ? Object.fromEntries(new URLSearchParams(last.path.split('?')[1])) : null; };
    const fine = () => until(() => { const canvas = sheet('canvas.cells'); return canvas && canvas.dataset.fine === 'true'; });
    const planned = async () => { const before = window.asked.length; press('#do-plan'); await until(() => window.asked.slice(before).some(({path}) => path.includes('/plans?'))); return told('/plans?'); };
    const curves = () => sheet('canvas.cells').dataset.curves;
"""


# A cell that draws squares, 6 pieces, by rough(), and the plan's own, 9, by finer().
FINER = """
    const squaresTold = window.answers['/plans/sketch'];
    let rough = () => squaresTold, finer = () => ({...squaresTold, pieces: 9});
    window.answers['/plans/sketch'] = async (path, how) => (path.includes('fine=1') ? finer(how, path) : rough());
    const shown = () => { const one = sheet('#sketch-picture'); return one && one.dataset.pieces; };
    const words = () => { const one = sheet('#sketch-squares'); return one && one.innerText; };
    // As long as a request takes that is on its way already, and longer than a hand rests.
    const quiet = async () => {
      const ends = performance.now() + 400;
      await until(() => performance.now() > ends);
    };
    page.enter();
"""


class Watching(Page):
    def test_the_bed_is_watched_while_the_cell_says_that_it_may_be(self):
        """Whatever it does: the page has no list of states of its own."""
        told = self.does(CELL + """
            const {bedView} = await load('watch.js'), kEveryMs = 2000, real = window.setTimeout;
            let rounds = 0;
            window.setTimeout = (act, ms, ...more) => { if (ms === kEveryMs) ++rounds; return real(act, ms === kEveryMs ? 0 : ms, ...more); };
            window.answers['/bed.jpg'] = {error: {}};  // no look yet
            const glances = () => window.asked.filter(({path}) => path.includes('/bed/glance.jpg')).length, out = [];
            for (const [state, may_be_watched] of [['Execute', true], ['Idle', false], ['Completing', true], ['Suspended', false], ['Held', true]]) {
              given_to({state, may_be_watched});
              const before = glances(), from = rounds;
              await until(() => { bedView('none'); return may_be_watched ? glances() > before : rounds > from + 5; });
              out.push([state, glances() > before]);
            }
            return out""")
        self.assertEqual(told, [["Execute", True], ["Idle", False], ["Completing", True], ["Suspended", False], ["Held", True]])


class Mosaic(Page):
    def setUp(self):
        self.speak("en")
        self.browser.set_window_size(1280, 900)
        self.at("page.enter(); await choose('one.png'); await until(() => sheet('#picture-layout') && sheet('#part')); type('#picture-layout', 'mosaic'); await until(() => sheet('canvas.cells')); await fine()")

    def at(self, script, *values):
        return self.does(CELL + MOSAIC + script, *values)

    def over(self, css, *shares, by="touch"):
        """From place to place, each as shares of what is drawn over, and up; then the page is drawn."""
        left, top, width, height = self.browser.execute_script(
            "const one = document.querySelector(arguments[0]); one.scrollIntoView({block: 'center', behavior: 'instant'}); const {left, top, width, height} = one.getBoundingClientRect(); return [left, top, width, height]", css)
        hand = ActionBuilder(self.browser, mouse=PointerInput(by, by))
        for number, (x, y) in enumerate(shares):
            hand.pointer_action.move_to_location(round(left + x * width), round(top + y * height))
            if number == 0:
                hand.pointer_action.pointer_down()
        hand.pointer_action.pointer_up()
        hand.perform()
        self.at("draw()")

    def keys(self, css, *keys):
        self.browser.execute_script("document.querySelector(arguments[0]).focus({focusVisible: true})", css)
        self.browser.find_element("css selector", css).send_keys(*keys)
        self.at("draw()")

    def lines(self, text):
        return [[tuple(int(one) for one in point.split(",")) for point in line.split(" ")] for line in text.split(";")] if text else []

    def near(self, line, *places):
        self.assertEqual(len(line), len(places), line)
        for point, place in zip(line, places):
            for at, wanted in zip(point, place):
                self.assertAlmostEqual(at, wanted, delta=80, msg=str(line))

    def test_a_stroke_is_a_curve_that_cells_lie_along(self):
        for by in ("touch", "mouse"):
            self.over("canvas.cells", (.25, .5), (.3, .5), (.75, .5), by=by)
            seen = self.at("await fine(); return [told('/plans/mosaic'), curves(), sheet('#cells-state').innerText, sheet('#cells-said').innerText, await planned(), told('/plans/sketch')]")
            self.near(*self.lines(seen[0]["flow_lines"]), (2500, 5000), (7500, 5000))
            self.assertEqual(seen[1:4], ["1", "2 cells, about as the plan will have them", "1 curve is drawn."])
            self.assertEqual({name: seen[4][name] for name in ("layout", "flow_lines")}, {"layout": "mosaic", "flow_lines": seen[0]["flow_lines"]})
            self.assertNotIn("flow_lines", seen[5], "squares lie along nothing")
            self.assertEqual(self.at("press('#cells-undo'); await fine(); return [curves(), 'flow_lines' in told('/plans/mosaic')]"), ["0", False])

    def test_a_curve_is_of_the_picture_whatever_part_is_wanted(self):
        self.over("canvas.cells", (.25, .5), (.3, .5), (.75, .5))
        seen = self.at("""
            await fine();
            const first = told('/plans/mosaic').flow_lines;
            type('#slide-closer', '.5'); type('#slide-across', '0'); type('#slide-down', '.5');
            await fine();
            const half = told('/plans/mosaic').flow_lines, plan = await planned();
            type('#slide-down', '0'); type('#slide-closer', '.7');
            await fine();
            const beside = [told('/plans/mosaic').flow_lines || null, sheet('#cells-outside') !== null, curves(), (await planned()).flow_lines || null];
            press('#take-whole');
            await fine();
            return {first, half, plan: [plan.flow_lines, plan.crop], beside, again: told('/plans/mosaic').flow_lines}""")
        self.near(*self.lines(seen["half"]), (5000, 5000), (10000, 5000))
        self.assertEqual(seen["plan"], [seen["half"], "0,10,30,20"], "in the frame of the part that is planned")
        self.assertEqual(seen["beside"], [None, True, "1", None])
        self.assertEqual(seen["again"], seen["first"])

    def test_corners_are_tapped_and_the_last_one_twice(self):
        for place in ((.2, .2), (.5, .2), (.8, .7), (.8, .7)):
            self.over("canvas.cells", place)
        self.assertIsNone(self.at("return sheet('#cells-end')"), "it has ended")
        self.over("canvas.cells", (.2, .8))
        self.over("canvas.cells", (.4, .9))
        self.at("press('#cells-end')")
        one, other = self.lines(self.at("await fine(); return told('/plans/mosaic').flow_lines"))
        self.near(one, (2000, 2000), (5000, 2000), (8000, 7000))
        self.near(other, (2000, 8000), (4000, 9000))
        self.at("press('#cells-erase')")
        self.over("canvas.cells", (.05, .5))
        self.assertEqual(self.at("return [curves(), sheet('#cells-said').innerText]"), ["2", "No curve is near: nothing is erased."])
        self.over("canvas.cells", (.35, .2))
        self.assertEqual(self.lines(self.at("await fine(); return told('/plans/mosaic').flow_lines")), [other])
        self.assertEqual(self.at("press('#cells-undo'); return curves()"), "2")
        self.over("canvas.cells", (.05, .5), (.5, .2), (.4, .9), (.2, .9), (.95, .95))
        self.assertEqual(self.at("return [curves(), sheet('#cells-draw').getAttribute('aria-pressed')]"), ["0", "true"], "all that the finger came over, and what erased draws nothing")
        self.at("press('#cells-undo'); press('#cells-undo')")
        self.assertEqual(self.at("press('#cells-none'); await fine(); return [curves(), told('/plans/mosaic').flow_lines || null]"), ["0", None])
        self.assertEqual(self.at("press('#cells-undo'); return curves()"), "2", "nothing is lost")

    def test_a_stroke_from_the_last_corner_goes_on(self):
        self.over("canvas.cells", (.2, .2))
        self.over("canvas.cells", (.5, .2))
        self.over("canvas.cells", (.5, .2), (.55, .25), (.8, .5))
        self.near(*self.lines(self.at("await fine(); return told('/plans/mosaic').flow_lines")), (2000, 2000), (5000, 2000), (8000, 5000))

    def test_a_curve_by_keyboard(self):
        self.keys("canvas.cells", Keys.SHIFT, Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.NULL, Keys.ENTER)
        self.near(*self.lines(self.at("await fine(); return told('/plans/mosaic').flow_lines")), (5000, 5000), (5250, 5000), (5500, 5000))
        self.keys("canvas.cells", Keys.ARROW_DOWN)
        self.assertEqual(self.at("return sheet('#cells-said').innerText"), "55 % from the left, 53 % from the top")
        self.keys("canvas.cells", Keys.DELETE)
        self.assertEqual(self.at("return [curves(), sheet('#cells-said').innerText]"), ["0", "The curve is erased."])

    def test_erasing_a_curve_by_keyboard_leaves_the_open_one_open(self):
        self.over("canvas.cells", (.25, .5), (.3, .5), (.75, .5))
        self.over("canvas.cells", (.2, .2))
        self.keys("canvas.cells", Keys.DELETE)  # the crosshair is in the middle, on the first
        self.assertEqual(self.at("return sheet('#cells-said').innerText"), "The curve is erased.")
        self.over("canvas.cells", (.5, .2))
        self.near(*self.lines(self.at("await fine(); return told('/plans/mosaic').flow_lines")), (2000, 2000), (5000, 2000))

    def test_curves_are_erased_by_keyboard_with_the_tool_too(self):
        self.over("canvas.cells", (.25, .5), (.3, .5), (.75, .5))
        self.over("canvas.cells", (.2, .8), (.3, .8), (.4, .8))
        self.at("press('#cells-erase')")
        self.keys("canvas.cells", Keys.SPACE)  # the crosshair is in the middle, on the first
        self.assertEqual(self.at("return [curves(), sheet('#cells-said').innerText]"), ["1", "The curve is erased."])
        self.keys("canvas.cells", Keys.SPACE)
        self.assertEqual(self.at("return [curves(), sheet('#cells-said').innerText]"), ["1", "No curve is near: nothing is erased."])
        self.keys("canvas.cells", *[Keys.ARROW_DOWN] * 12, *[Keys.ARROW_LEFT] * 9, Keys.SHIFT, *[Keys.ARROW_LEFT] * 3, Keys.NULL)
        self.assertEqual(self.at("return [curves(), sheet('#cells-draw').getAttribute('aria-pressed'), sheet('#cells-end')]"), ["0", "false", None], "on its way, and what erases draws nothing when nothing is left")

    def focus_after(self, css, *keys):
        self.browser.execute_script("document.querySelector(arguments[0]).focus()", css)
        self.browser.switch_to.active_element.send_keys(*keys or (Keys.ENTER,))
        return self.at("draw(); await settled(); draw(); const at = document.activeElement; return at.id || at.className || at.nodeName")

    def test_a_button_that_goes_hands_its_focus_on(self):
        self.over("canvas.cells", (.2, .2))
        self.over("canvas.cells", (.5, .2))
        self.assertEqual(self.focus_after("#cells-end"), "cells", "there the curve was, and the next one begins")
        self.assertEqual(self.focus_after("#cells-none"), "cells", "there is nothing to erase any more")
        while self.at("return !sheet('#cells-undo').disabled"):
            focus = self.focus_after("#cells-undo")
        self.assertEqual(focus, "cells", "nothing is left to take back")
        self.over("canvas.cells", (.2, .2))
        self.assertEqual(self.focus_after("#cells-undo"), "cells")
        self.at("sheet('#sizes').open = true; draw()")
        self.over("canvas[data-brush=sizes]", (.25, .5))
        self.assertEqual(self.focus_after("#sizes-undo"), "paint")
        self.over("canvas[data-brush=sizes]", (.25, .5))
        self.over("canvas[data-brush=sizes]", (.5, .5))
        self.assertEqual(self.focus_after("#sizes-undo"), "sizes-undo", "a button that stays keeps it")

    def test_nothing_moves_while_a_number_is_typed_anew(self):
        self.over("canvas.cells", (.25, .5), (.3, .5), (.75, .5))
        for width, height in ((1280, 900), (390, 844)):
            self.browser.set_window_size(width, height)
            told = self.at("""
                await fine();
                const boxes = () => ['#picture-size', '#picture-patch', '#picture-layout', 'canvas.cells', '#slide-cell_aspect', '#do-plan'].map((css) => { const one = sheet(css); if (!one) return 'gone'; const box = one.getBoundingClientRect(); return Math.round(box.top + scrollY); });
                const before = boxes(), out = [];
                for (const typed of ['', '1', '1e', '-', '1,200', '0.05', '150']) {
                  type('#picture-patch', typed === '150' ? '14' : typed);
                  out.push([typed, boxes().join() === before.join() ? 'still' : boxes().join(), sheet('#lengths-said').classList.contains('number-fault'), sheet('#do-plan').disabled]);
                  await settled();
                  draw();
                  type('#picture-patch', '14');
                }
                return [before.join(), out]""")
            for typed, moved, fault, shut in told[1]:
                with self.subTest(f"{width} {typed}"):
                    self.assertEqual(moved, "still", told[0])
                    self.assertEqual((fault, shut), (typed not in ("1", "150"),) * 2)

    def test_lines_of_before_are_those_of_a_number_that_is_typed_anew(self):
        seen = self.at("""
            type('#picture-size', 'x');
            await settled(); draw();
            const still = [sheet('canvas.cells').dataset.fine, told('/plans/mosaic').size_mm];
            type('#picture-size', '120');
            await until(() => { draw(); return told('/plans/mosaic').size_mm === '120'; });
            return still""")
        self.assertEqual(seen, ["true", "190"])

    # How bright the canvas is there, from 0 to 1; the darkest of what lies around it. The picture is white.
    BRIGHT = """
        const brightAround = (x, y, far) => { const canvas = sheet('canvas.cells'), {data} = canvas.getContext('2d').getImageData(Math.round(x * canvas.width) - far, Math.round(y * canvas.height) - far, 2 * far + 1, 2 * far + 1); return Math.min(...Array.from({length: data.length / 4}, (_, i) => (data[4 * i] + data[4 * i + 1] + data[4 * i + 2]) / 765)); };
        const bright = (x, y) => brightAround(x, y, 0);
        window.answers['/plans/mosaic'] = {width_mm: 60, height_mm: 40, cells: 2, lines: [[[0, 10], [60, 10]]]};"""

    def test_cells_lie_where_the_cell_says_from_the_lower_left(self):
        seen = self.at(self.BRIGHT + "type('#slide-cell_aspect', '1.5'); await fine(); await until(() => sheet('canvas.cells').dataset.cells === '2'); draw(); return [.75, .25, .5].map((y) => brightAround(.3, y, 4))")
        self.assertLess(seen[0], .6, "a line with dark rims, a quarter from below")
        self.assertGreater(min(seen[1:]), .9, seen)

    def test_a_cross_to_erase_by_lies_on_the_part_that_is_seen(self):
        self.over("canvas.cells", (.2, .5), (.3, .5), (.9, .5))
        seen = self.at(self.BRIGHT + """
            type('#slide-closer', '.5'); type('#slide-across', '0'); type('#slide-down', '.5');
            await fine();
            press('#cells-erase');
            draw();
            return [bright(.7 + 12 / 720, .5), bright(.7, .5)]""")
        self.assertGreater(seen[0], .9, "the disc of the cross, in the middle of what is seen of the curve")
        self.assertLess(seen[1], .2, "the cross itself")

    def test_curves_beside_the_edges_or_instead_of_them(self):
        self.assertIsNone(self.at("return sheet('#cells-instead')"), "instead of nothing they are not")
        self.over("canvas.cells", (.25, .5), (.3, .5), (.75, .5))
        seen = self.at("""
            await fine();
            const beside = told('/plans/mosaic').flow_lines_only || null;
            press('#cells-instead');
            await fine();
            const instead = [told('/plans/mosaic').flow_lines_only, (await planned()).flow_lines_only, sheet('#cells-instead').getAttribute('aria-pressed')];
            press('#cells-undo');
            await fine();
            return [beside, instead, told('/plans/mosaic').flow_lines_only || null]""")
        self.assertEqual(seen, [None, ["1", "1", "true"], None])

    def test_curves_stay_with_their_picture_and_layout(self):
        self.over("canvas.cells", (.25, .5), (.3, .5), (.75, .5))
        seen = self.at("""
            await choose('two.png');
            await until(() => sheet('#cells') && sheet('#cells').innerText.includes('over one.png stay'));
            await fine();
            const other = [curves(), told('/plans/mosaic').flow_lines || null];
            await choose('one.png');
            await until(() => sheet('canvas.cells') && curves() === '1');
            type('#picture-layout', 'grid');
            const idle = [sheet('#cells-idle') !== null, sheet('canvas.cells') === null, (await planned()).flow_lines || null];
            type('#picture-layout', 'mosaic');
            return [other, idle, curves()]""")
        self.assertEqual(seen, [["0", None], [True, True, None], "1"])

    def test_many_curves_are_sent_with_fewer_points(self):
        sent = self.at("""
            const canvas = sheet('canvas.cells');
            canvas.setPointerCapture = () => {}; canvas.hasPointerCapture = () => true;
            const {left, top, width, height} = canvas.getBoundingClientRect();
            for (let row = 1; row < 20; ++row) {
              const say = (name, x, y) => canvas.dispatchEvent(new PointerEvent(name, {isPrimary: true, button: 0, pointerId: 1, clientX: left + x * width, clientY: top + y * height}));
              say('pointerdown', 0, row / 20);
              for (let n = 1; n <= 60; ++n) say('pointermove', n / 60, row / 20 + (n % 2 ? .02 : 0));
              say('pointerup', 1, row / 20);
            }
            await fine();
            return [curves(), told('/plans/mosaic').flow_lines]""")
        lines = self.lines(sent[1])
        self.assertEqual((sent[0], len(lines)), ("19", 19))
        self.assertLessEqual(sum(map(len, lines)), 400)

    def test_sizes_of_cells_are_painted(self):
        self.at("sheet('#sizes').open = true; draw()")
        self.over("canvas[data-brush=sizes]", (.25, .5), (.3, .5))
        seen = self.at("""
            await fine();
            const cells = told('/plans/mosaic').cell_sizes, plan = await planned(), painted = sheet('canvas[data-brush=sizes]').dataset.painted;
            await until(() => { draw(); return told('/plans/sketch'); });
            type('#picture-layout', 'grid');
            const squares = [(await planned()).cell_sizes || null, sheet('#sizes-idle') !== null];
            type('#picture-layout', 'mosaic');
            await fine();
            press('#sizes-undo');
            await fine();
            return {cells, plan: plan.cell_sizes, painted, sketch: told('/plans/sketch').cell_sizes || null, squares, undone: told('/plans/mosaic').cell_sizes || null}""")
        mask = seen["cells"]
        self.assertRegex(mask, "^48x32:[0-9a-f]{1536}$")
        row = mask.split(":")[1][15 * 48:16 * 48]
        self.assertEqual((row[13], row[40]), ("f", "8"), "small where the brush was, else as the rest")
        self.assertEqual((seen["plan"], seen["sketch"], seen["squares"], seen["undone"]), (mask, None, [None, True], None))
        self.assertGreater(int(seen["painted"]), 5)

    def test_one_size_everywhere_says_nothing_and_is_not_sent(self):
        self.at("sheet('#sizes').open = true; sheet('#sizes [data-choice=background]').click(); sheet('#sizes [data-choice=large]').click(); draw()")
        for row in range(0, 11):
            self.over("canvas[data-brush=sizes]", (.01, row / 10 * .98 + .01), (.99, row / 10 * .98 + .01))
        self.assertEqual(self.at("await fine(); return [told('/plans/mosaic').cell_sizes || null, sheet('#sizes-even') !== null, sheet('canvas[data-brush=sizes]').dataset.painted]"), [None, True, "1536"])

    def test_sizes_are_painted_by_keyboard(self):
        self.at("sheet('#sizes').open = true; draw()")
        self.keys("canvas[data-brush=sizes]", Keys.SPACE)
        self.assertEqual(self.at("return sheet('#sizes-said').innerText"), "Painted at 50 % from the left, 50 % from the top: small")
        self.assertTrue(self.at("await fine(); return told('/plans/mosaic').cell_sizes"))

    def test_how_long_cells_are(self):
        seen = self.at("""
            const usual = [(await planned()).cell_aspect || null, sheet('#cells').innerText.includes('Cells as long as wide')];
            type('#slide-cell_aspect', '2.5');
            await fine();
            const long = [told('/plans/mosaic').cell_aspect, (await planned()).cell_aspect, told('/plans/sketch').cell_aspect || null];
            type('#picture-layout', 'morph');
            return [usual, long, (await planned()).cell_aspect || null]""")
        self.assertEqual(seen, [[None, True], ["2.5", "2.5", None], None])

    def test_marks_of_which_cells_need_room_go_with_all_that_asks_for_cells(self):
        seen = self.at("""
            window.answers['/plans/advice'] = {task: 6};
            const advised = async () => { const before = window.asked.length; press('#do-advise'); await until(() => window.asked.slice(before).some(({path}) => path.includes('/plans/advice'))); return told('/plans/advice').marks || null; };
            const all = async () => { await fine(); return [told('/plans/mosaic').marks || null, await advised(), (await planned()).marks || null, told('/plans/sketch').marks || null]; };
            const usual = await all();
            type('#picture-marks', 'short');
            const short = await all();
            type('#picture-marks', 'place');
            return [usual, short, await all()]""")
        self.assertEqual(seen, [[None] * 4, ["short", "short", "short", None], [None] * 4])

    def test_a_wood_takes_no_more_than_its_share(self):
        seen = self.at("""
            await until(() => sheet('#slide-limit_walnut'));
            const usual = (await planned()).wood_limit || null;
            type('#slide-limit_walnut', '.3');
            const limited = (await planned()).wood_limit, sketched = await until(() => { draw(); return told('/plans/sketch').wood_limit; });
            press('#picture-refine');
            const idle = sheet('#limits-idle');
            const refined = [(await planned()).wood_limit || null, idle.checkVisibility()];
            press('#picture-refine');
            sheet('[data-key=maple] input').click();
            draw();
            const without = [(await planned()).wood_limit || null, sheet('#slide-limit_walnut') !== null];
            return {usual, limited, sketched, refined, without}""")
        self.assertEqual(seen, {"usual": None, "limited": "walnut=0.3", "sketched": "walnut=0.3", "refined": [None, True], "without": [None, True]})

    def test_a_share_of_wood_that_is_not_there_is_not_sent(self):
        seen = self.at("""
            await until(() => sheet('#slide-limit_walnut'));
            type('#slide-limit_walnut', '.3');
            sheet('#more [data-key=P-0001] input').click();
            draw();
            const elsewhere = [(await planned()).wood_limit || null, sheet('#slide-limit_walnut').value];
            sheet('#more [data-key=P-0001] input').click();
            draw();
            const back = (await planned()).wood_limit;
            window.answers['/panels'].panels = model.panels = model.panels.map((panel) => ({...panel, retired: panel.id === 'P-0002'}));
            const gone = [(await planned()).wood_limit || null, sheet('#slide-limit_walnut') !== null];
            type('#slide-limit_walnut', '1');
            return {elsewhere, back, gone, after: sheet('#slide-limit_walnut') !== null}""")
        self.assertEqual(seen, {"elsewhere": [None, "0.3"], "back": "walnut=0.3", "gone": [None, True], "after": False})

    def test_the_shape_of_cells_is_chosen_for_a_picture_that_only_the_cell_reads(self):
        self.at("""
            type('#slide-cell_aspect', '2.5');
            const files = new DataTransfer(), input = sheet('#picture-file');
            files.items.add(new File(['II*'], 'scan.tiff', {type: 'image/tiff', lastModified: 2}));
            input.files = files.files;
            input.dispatchEvent(new Event('change'));
            await until(() => !sheet('canvas.cells') && sheet('#slide-cell_aspect'))""")
        self.assertEqual(self.at("return sheet('#slide-cell_aspect').value"), "2.5")

    def test_what_the_cell_refuses_is_said_and_asked_again(self):
        seen = self.at("""
            const good = window.answers['/plans/mosaic'];
            window.answers['/plans/mosaic'] = {error: {message: 'the mosaic would have 4000 pieces'}};
            type('#picture-patch', '2');
            const said = await until(() => { const fault = sheet('#cells .fault'); return fault && fault.innerText; });
            window.answers['/plans/mosaic'] = good;
            press('#cells .fault button');
            await fine();
            return [said.split('\\n')[0], sheet('#cells .fault') === null]""")
        self.assertIn("The mosaic would have 4000 pieces.", seen[0])
        self.assertTrue(seen[1])

    def test_all_of_it_has_words_in_both_languages(self):
        for language in ("en", "de"):
            self.speak(language)
            told = self.at("""
                page.enter();
                await choose('one.png');
                await until(() => sheet('#part'));
                type('#picture-layout', 'mosaic');
                await fine();
                const one = await load('words.js'), names = ['draw', 'erase', 'end', 'undo', 'none', 'beside', 'instead', 'corner', 'count', 'erased', 'nothing', 'enough', 'unreadable', 'idle', 'outside', 'left', 'coming', 'finer', 'done', 'at', 'tool', 'edges', 'aspect', 'square', 'map', 'keys', 'about'].map((name) => `cells.${name}`);
                const others = ['background', 'figure', 'detail', 'all', 'idle', 'even', 'map', 'about'].map((name) => `sizes.${name}`);
                return [...names, ...others, 'cells', 'sizes', 'limits', 'limits.idle'].filter((name) => one.t(name, {n: 1}) === name)""")
            self.assertEqual(told, [])
        self.speak("en")


# A cell that has something of everything, before an admin: every screen has all of its parts.
EVERYTHING = """
    const at = '2026-05-01T07:30:00Z', listed = (name, ...all) => ({[name]: all, next: null});
    const square = (x, y, side) => [x, y, x + side, y, x + side, y + side, x, y + side];
    const panel = {id: 'P-0001', name: 'walnut', parent: null, shelf: 'A1', woods: ['walnut', 'maple'], width_mm: 240, height_mm: 160, free_mm2: 2e4, cut_mm2: 900, reserved_mm2: 0, open_differences: 1,
      retired: null, scan_again: null, mask: 'counted', mask_version: 2, faces: ['show', 'back'], rms_mm: .01, created: at, px_per_mm: 4, fiducials: [],
      facts: {shelf: 'A1', veneer_mm: .6, substrate_mm: 1.5}, treatments: [{product: 'oil', on: '2026-05-01'}], remnant: {woods: [{material: 'walnut', free_mm2: 2e4}], square: {side_mm: 90.5}, circle: {diameter_mm: 99}},
      area_book_mm2: {panel: 38400, free: 2e4, reserved: 0, cut: 900, kerf: 100, suspect: 0, scrap: 0, unusable: 17400},
      zones: [1, 2].map((zone) => ({zone, version: 1, material: zone === 1 ? 'walnut' : null, area_mm2: 1e4, outline_mm: [square(0, 0, 50)], outlines_mm: [square(0, 0, 50)]}))};
    const job = {id: 3, name: 'bird', state: 'incomplete', cut: 1, suspect: 1, missing: 1, pieces: 3, archived: false, created: at, newest_plan: 5, plan: 5, now: '', next: 'redo what is missing', runs: [{id: 1, panel: 'P-0001', started: at, ended: at, result: 'done', who: 'anna', pose_rms_mm: .012}],
      panels: [{panel: 'P-0001', cut: 1, pieces: 3}]};
    const pieces = ['cut', 'suspect', 'scrap'].map((state, n) => ({id: n + 1, mark: `A1-${n + 1}`, state, panel: 'P-0001', panel_outline_mm: [square(10, 10, 9)], outline_mm: [square(10, 10, 9)], sighting: state === 'suspect' ? {seen: 'unclear', gone_share: .4, at} : null}));
    const certificates = ['scanner', 'camera', 'axes', 'kerf'].flatMap((kind) => [2, 1].map((id) => ({id, kind, state: 'valid', issued: at, expires: at, made_on: 'x', rms_mm: .01, kerf_mm: .2, doubts: ['it was made of one scan']})));
    const recipe = {speed_mm_s: 15, power: .8765, passes: 2, air: true, kerf_back_mm: .2, kerf_show_mm: .22};
    Object.assign(window.answers, {
      '/status': {}, '/panels/P-0001/ledger': listed('allocations', {id: 1, piece: 1, mark: 'A1-1', state: 'cut', outline_mm: [square(10, 10, 9)], area_mm2: 81}),
      '/panels/P-0001/differences': listed('differences', {id: 4, kind: 'lost', place_mm: [10, 10], area_mm2: 30, pieces: [{mark: 'A1-1', job: 3}], decided: null}),
      '/panels/P-0001/versions': listed('versions', {version: 1, at, who: 'anna', current: false}, {version: 2, at, who: 'anna', current: true}), '/panels/P-0001/scans': listed('scans'), '/panels/P-0001/mask': listed('edits'), '/panels/P-0001/edits': listed('edits'),
      '/panels/P-0001': panel, '/panels': listed('panels', panel), '/jobs/3/pieces': listed('pieces', ...pieces), '/jobs/3': job, '/jobs': listed('jobs', job), '/plans': listed('plans'),
      '/materials': listed('materials', {material: 'walnut'}), '/certificates': listed('certificates', ...certificates),
      '/users': {users: [{name: 'anna', role: 'admin'}, {name: 'ben', role: 'viewer'}]}, '/tokens': {tokens: [{user: 'anna', name: 'shelf', role: 'viewer', expires_at: at}]},
      '/recipes': {otherwise: {cut: recipe, engrave: recipe}, recipes: [{material: 'walnut', operation: 'cut', ...recipe}], next: null}, '/backups': {folder: '/x', backups: [{name: 'b', made_at: at, panels: 1, jobs: 1, pieces: 3, bytes: 5e6, missing: []}], next: null},
      '/proposals': {proposals: [{number: 4, panel: 'P-0001', warnings: [{name: 'x', text: 'it looks otherwise', overruled_by: 'maintainer'}, {name: 'strip-1', text: 'a strip is left out', overruled_by: 'operator'}], asked: [{warning: 'strip-1', outline_mm: [[20, 12], [70, 12], [70, 150]], confidence: .37, taken: false, reason: 'it looks like the board'}], size_mm: [240, 160], usable_mm2: 1e4, lost_mm2: 5, gained_mm2: 6, remarks: ['a remark']}]},
      '/setup': {collected: {view_heights_mm: [0, 0], grid_scans: 1}, panel_thickness_mm: 2.1}, '/alarms': listed('alarms', {id: 1, state: 'new', urgent: true, sentence: 'run veneerctl panel scan', about: 'x', since: at}),
      '/history/events': listed('events', ...['made', 'running', 'stopped', 'aborted', 'complete', 'cancelled', 'archived', 'in sight again', 'pieces made again'].map((what) => ({at, kind: 'job', what, job: 3, who: 'anna'}))),
      '/bed/look': {grid_tags: 0, grid_has: 9, panels: [], tags: []},
      '/audit': listed('entries', {id: 1, at, who: 'anna', what: 'api.scan', detail: 'POST /api/v1/scans {"more":false}'}),
      '/devices/found': {lasers: [{port: 'usb:1', kind: 'lihuiyu', name: 'K40', named_by: 'usb', refusal: ''}], pictures: []}, '/scanners': {scanners: [{name: 'x:1', make: 'x', problem: ''}]},
      '/devices': {choose: true, laser: {kind: 'sim', set_by: 'nobody'}, scanner: {kind: 'sim', set_by: 'nobody', dpi: 300}, camera: {kind: 'sim', set_by: 'nobody'}},
    });
    // The longest that fits: /jobs/3/pieces is not /jobs.
    window.answers = Object.fromEntries(Object.entries(window.answers).sort(([a], [b]) => b.length - a.length));
    model.role = 'admin';
    model.session = {who: 'anna', role: 'admin', user: 'anna', expires_at: at, accounts: true};
    Object.assign(model, {panels: [panel], jobs: [job]});
    const about_all = {panels: 1, calibration: {scanner: 'valid', camera: 'missing', axes: 'expired', kerf: 'valid'}, laser: {connected: true, state: 'Idle', homed: true, position_mm: [1, 2], firmware: 'x', overrides_wanted: {feed: 90}, beam_on: false},
      recut: {job: 3, panel: 'P-0001', pieces: 1}, owed_look: {job: 3, panel: 'P-0001', pieces: 2, sentence: 'the camera has not seen panel P-0001'}, open_scan: {tiles: 2, panel: 'P-0001', face: 'show'}, kept_scan: null,
      confirm: ['exhaust'], interlocks: [{name: 'camera', state: 'warns', sentence: 'the camera is slow', remedy: 'See to it.', age_s: 3}], next_step: {step: 'redo', sentence: 'redo what is missing', command: 'veneerctl job redo 3', job: 3},
      load: {panel: 'P-0001', found: true, face_up: 'back', how: 'back up', rms_mm: .01, frame_max_power: .03, focus_mm: 2, setups: 1, setup: 1, sentence: 'panel P-0001 is found'}, database: {state: 'good', sentence: ''}};
    const faults = [];
    addEventListener('unhandledrejection', ({reason}) => faults.push(String(reason && reason.stack || reason)));
    addEventListener('error', ({message}) => faults.push(message));
    // A screen as console.js shows it, often enough that what it asks for has come.
    const type = (css, text) => { const field = main.querySelector(css); field.value = text; field.dispatchEvent(new Event(field.nodeName === 'SELECT' ? 'change' : 'input')); };
    const sent = (part) => window.asked.filter(({path, method}) => method === 'POST' && path.includes(part)).map(({body}) => body);
    const show = async (name, rest = [], fresh = {}, body = () => null) => {
      const screen = await load(`screens/${name}.js`);
      main.replaceChildren();
      if (screen.enter) screen.enter(...rest);
      for (let n = 0; n < 4; ++n) {
        given_to({...about_all, ...fresh});
        window.answers['/status'] = model.cell;
        put(main, ...[screen.draw(...rest)].flat());
        for (const one of main.querySelectorAll('details')) one.open = true;
        if (screen.drawn) screen.drawn(main, ...rest);
        await settled();
      }
      return body(screen);
    };
"""


# Three jobs that wait: 2, 3, 4. The cell does as it is told, and says so a moment later.
QUEUE = """
        const begin = () => main.querySelector('#do-start').innerText;
        let order = [2, 3, 4];
        const tell = () => { window.answers['/jobs'].jobs = [5, 4, 3, 2].map((id) => ({...job, id, state: id === 5 ? 'complete' : 'planned', name: `job ${id}`, queue_place: order.indexOf(id) + 1 || null})); };
        window.answers = {'/move': {jobs: order}, ...window.answers};
        tell();
        model.jobs = window.answers['/jobs'].jobs;
        await show('run', [], {next_step: null}, (page) => { window.page = page; });
        const draw = () => { given_to({...about_all, next_step: null}); window.answers['/status'] = model.cell; put(main, ...[window.page.draw()].flat()); window.page.drawn(main); };
        const rows = () => [...main.querySelectorAll('.jobs label')].map(({dataset}) => Number(dataset.key));
        const press = async (id, then) => {
          const field = main.querySelector(id);
          field.focus();
          window.answers['/move'].jobs = then;
          field.click();
          order = then;
          tell();
          for (let n = 0; n < 4; ++n) { await settled(); draw(); }
          return document.activeElement.id;
        };
"""


class Screens(Page):
    def setUp(self):
        self.speak("en")

    def shown(self, script):
        told = self.does(CELL + EVERYTHING + "const told = await (async () => {" + script + "})(); return {told, faults}")
        self.assertEqual(told["faults"], [])
        return told["told"]

    def test_each_is_drawn_before_an_admin(self):
        for language in ("en", "de"):
            self.speak(language)
            self.addCleanup(self.speak, "en")
            told = self.shown("""
                const screens = [['cell'], ['panels'], ['panels', 'P-0001'], ['scan'], ['new_picture'], ['run'], ['run', '3'], ['assembly'], ['assembly', '3'], ['alarms'], ['history'], ['history', '3'], ['calibration'], ['settings'], ['log'], ['account'],
                                 ...['devices', 'print', 'scanner', 'camera', 'laser', 'kerf', 'recipes', 'wood', 'picture', 'cut'].map((step) => ['setup', step])];
                const out = {};
                for (const [name, ...rest] of screens) {
                  try { await show(name, rest); } catch (fault) { faults.push(`${name}/${rest}: ${fault.stack}`); }
                  const small = [...main.querySelectorAll('button, select, summary, a[href^="#"], input[type=text], label:has(input)')].filter((one) => one.offsetParent && one.getBoundingClientRect().height < 44).map((one) => one.outerHTML);
                  out[[name, ...rest].join('/')] = [main.innerText.length, (main.innerText.match(/undefined|NaN|\\[object/) || [''])[0], small];
                }
                return out""")
            for screen, (length, odd, small) in told.items():
                with self.subTest(f"{language} {screen}"):
                    self.assertGreater(length, 30)
                    self.assertEqual(odd, "")
                    self.assertEqual(small, [], "smaller than 12 mm")

    def test_a_laser_without_homing_switches_is_not_called_homed(self):
        told = self.shown("""
            const out = [];
            for (const laser of [{}, {finds_home: true}, {finds_home: false}, {finds_home: false, homed: false}, {finds_home: false, connected: false}]) {
              await show('cell', [], {laser: {...about_all.laser, ...laser}});
              const says = (words) => main.innerText.includes(words);
              out.push([says('no homing switches: counts from the corner it was given'), says('no homing switches: does not count from its corner yet'), says('not homed')]);
            }
            return out""")
        self.assertEqual(told, [[False, False, False], [False, False, False], [True, False, False], [False, True, False], [False, False, False]])

    # ---- numbers that go from a field to the cell

    def numbers(self, screen, field, button, part, typed, prepare="", finish=""):
        """For each of what is typed: the fault at the field, whether the button is shut, and what was sent."""
        return self.does(CELL + EVERYTHING + """
            const [screen, rest, css, press, part, texts] = given, out = [];
            const page = await show(screen, rest, {}, (page) => page);
            const draw = () => { given_to(about_all); window.answers['/status'] = model.cell; put(main, ...[page.draw(...rest)].flat()); };
            """ + prepare + """
            out.push(main.querySelector(css).value);
            for (const text of texts) {
              type(css, text);
              draw();
              """ + finish + """
              const before = sent(part).length, button = main.querySelector(press), off = button.disabled;
              const fault = main.querySelector(css).parentNode.querySelector('.number-fault');
              const said = fault ? fault.innerText : '';
              button.click();
              await settled();
              draw();
              out.push([said, off, sent(part)[before] || null]);
            }
            if (faults.length) throw new Error(faults.join());
            return out""", *screen, field, button, part, typed)

    THOUSANDS = "▲ A point is the decimal mark here, and this may be thousands: write 1200 or 1.2."

    def test_the_speed_of_a_recipe(self):
        told = self.numbers(("settings", []), "#recipe-speed_mm_s", "#do-recipe", "/recipes/", ["1,200", "12,5"],
                            "[...main.querySelectorAll('li[data-key=walnut-cut] button')][0].click(); draw(); const power = main.querySelector('#recipe-power').value; if (power !== '87.65') throw new Error('power ' + power);")
        self.assertEqual(told, ["15", [self.THOUSANDS, True, None],
                                ["", False, {"speed_mm_s": 12.5, "power": .8765, "passes": 2, "air": True, "kerf_back_mm": .2, "kerf_show_mm": .22}]])

    def test_how_thick_a_panel_is(self):
        told = self.numbers(("panels", ["P-0001"]), "#say-veneer_mm", "#do-say", "/facts", ["1,200", "0,7"])
        self.assertEqual(told, ["0.6", [self.THOUSANDS, True, None], ["", False, {"veneer_mm": .7}]])

    def test_how_far_a_machine_travels(self):
        told = self.numbers(("setup", ["devices"]), "#choose-travel_x_mm", "button#choose-laser", "/devices/laser", ["1,200", "300,5"], """
            main.querySelector('#look-devices').click();
            await until(() => { draw(); return main.querySelector('input[value="usb:1"]') && !main.querySelector('#look-devices').disabled; });
            main.querySelector('input[value="usb:1"]').click();
            draw();
            main.querySelector('#sure-laser').click();
            draw();
            type('#choose-travel_y_mm', '200');
            draw();""")
        self.assertEqual(told, ["", [self.THOUSANDS, True, None],
                                ["", False, {"kind": "lihuiyu", "port": "usb:1", "confirmed": ["a laser is at this port"], "board": "m2", "travel_x_mm": 300.5, "travel_y_mm": 200}]])

    def test_how_long_a_token_is_good(self):
        told = self.numbers(("account", []), "input[name=days]", "#do-new-token", "/tokens/", ["0", "1,5", "30"], finish="main.querySelector('input[name=token]').value = 'shelf'; main.querySelector('select[name=user]').value = 'ben';")
        self.assertEqual([told[0], told[1][0], told[1][2], told[2][0], told[2][2], told[3]],
                         ["90", "▲ At least 1.", None, "▲ Only a whole number, without point or comma.", None, ["", False, {"role": "viewer", "days": 30}]])

    def test_how_high_the_blocks_are(self):
        told = self.numbers(("setup", ["camera"]), "label:has(> input[inputmode]) input", "#do-camera", "/calibration/camera", ["4", "31,5"])
        self.assertEqual(told, ["30", ["▲ At least 5.", True, None], ["", False, {"height_mm": 31.5, "more": True}]])

    def test_how_large_the_board_is(self):
        told = self.numbers(("setup", ["laser"]), "#board-height", "#do-laser", "/calibration/laser", ["1,290", "290,5"],
                            finish="for (const one of main.querySelectorAll('fieldset.confirm input')) if (!one.checked) one.click(); draw();")
        self.assertEqual([told[0], told[1], told[2][:2]], ["290", [self.THOUSANDS, True, None], ["", False]])
        self.assertEqual({name: told[2][2][name] for name in ("board_height_mm", "board_width_mm", "height_mm")}, {"board_height_mm": 290.5, "board_width_mm": 490, "height_mm": 2.1})

    def test_the_machine_is_told_in_the_pages_words(self):
        for language, wanted in (("en", ["Hold", "Speed of the cut 90 %, Power 80 %"]), ("de", ["angehalten", "Tempo des Schnitts 90 %, Leistung 80 %"])):
            self.speak(language)
            self.addCleanup(self.speak, "en")
            told = self.shown("""
                const laser = {connected: true, homed: true, overrides_wanted: {feed: 90, rapid: 100, power: 80}}, row = (label) => [...main.querySelectorAll('.facts li')].find((one) => one.querySelector('.label').innerText === t(label)).children[2];
                const {t} = await load('words.js');
                await show('cell', [], {laser: {...laser, state: 'Hold:0'}});
                const out = [row('laser').innerText, row('overrides').innerText];
                await show('cell', [], {laser: {...laser, state: 'Unheard'}});
                return [...out, row('laser').innerText, row('laser').querySelector('[lang]').lang]""")
            self.assertEqual(told, [*wanted, "Unheard", "en"])

    # What GRBL reports (its manual, "Real-time Status Reports"), and what a Lihuiyu board's driver makes of its answers.
    SAYS = ("Idle", "Run", "Hold:0", "Hold:1", "Jog", "Alarm", "Door:0", "Door:1", "Door:2", "Door:3", "Check", "Home", "Sleep",
            "Ready", "Busy", "Held", "Rejected", "Finished", "No power")

    def test_each_word_of_a_controller_is_known(self):
        for language in ("en", "de"):
            self.speak(language)
            self.addCleanup(self.speak, "en")
            told = self.shown("""
                const laser = {connected: true}, {t} = await load('words.js'), out = {};
                for (const state of %s) {
                  await show('cell', [], {laser: {...laser, state}});
                  const row = [...main.querySelectorAll('.facts li')].find((one) => one.querySelector('.label').innerText === t('laser')).children[2];
                  out[state] = [row.innerText, row.querySelector('[lang]') === null];
                }
                return out""" % json.dumps(self.SAYS))
            for state, (words, known) in told.items():
                self.assertTrue(known, f"{language} has no word for {state}")
                self.assertNotRegex(words, r"\d", state)
            # GRBL's number tells whether a lid is still open, and whether the head still moves.
            self.assertEqual([told[state][0] for state in ("Door:0", "Door:1", "Door:2", "Door:3", "Hold:1")],
                             ["Deckel wieder zu, wartet", "Deckel offen", "Deckel offen, hält an", "Deckel wieder zu, fährt weiter", "hält an"] if language == "de" else
                             ["Door (closed again, waits)", "Door (open)", "Door (open, stopping)", "Door (closed again, going on)", "Hold (stopping)"])

    def test_grain_counts_where_pieces_choose_together(self):
        told = self.shown("""
            await show('new_picture', [], {}, (page) => page);
            const page = await load('screens/new_picture.js'), draw = () => { put(main, ...[page.draw()].flat()); };
            const idle = () => { draw(); return Boolean(main.querySelector('#grain-idle')); }, out = [idle()];
            type('#slide-w_grain', '.1'); out.push(idle());
            const said = main.querySelector('#grain-idle').innerText;
            type('#picture-optimize', 'global'); out.push(idle());
            type('#picture-optimize', 'greedy'); out.push(idle());
            main.querySelector('#picture-refine').click(); draw(); type('#picture-rematch', '2'); out.push(idle());
            return {out, said}""")
        self.assertEqual(told["out"], [False, True, False, True, False])
        self.assertEqual(told["said"], "▲ “Care: all patches together (takes minutes)” makes the grain count, and so does “Let borders follow the picture, as curves” with “How often to choose wood again for refined borders, at most” above 0; otherwise patches choose one by one, and it does not.")

    def test_no_shut_button_is_the_next_step(self):
        told = self.shown("""
            window.answers['/certificates'] = {certificates: [], next: null};
            const out = {};
            for (const step of ['scanner', 'camera', 'laser', 'kerf']) {
              await show('setup', [step]);
              out[step] = [...main.querySelectorAll('button.next')].map(({disabled}) => disabled);
            }
            return out""")
        self.assertEqual(told, {"scanner": [False], "camera": [False], "laser": [], "kerf": []})

    def test_a_way_to_a_job_chooses_it(self):
        told = self.shown("""
            const begin = () => main.querySelector('#do-start').innerText;
            window.answers['/jobs'].jobs = model.jobs = [2, 3].map((id) => ({...job, id, state: 'planned', name: `job ${id}`}));
            await show('run', [], {next_step: null});
            const usual = begin();
            await show('run', ['3'], {next_step: null});
            return [usual, begin()]""")
        self.assertIn("job 2", told[0])
        self.assertIn("job 3", told[1])

    def test_the_queue_is_in_the_order_that_people_choose(self):
        told = self.shown(QUEUE + """
            const before = [rows(), begin(), [...main.querySelectorAll('.job-places button')].map(({id, disabled}) => [id, disabled])];
            const focus = [await press('#later-2', [3, 2, 4])];
            const after = [rows(), begin()];
            focus.push(await press('#later-2', [3, 4, 2]), await press('#earlier-4', [4, 3, 2]));
            await show('history');
            return {before, after, focus, sent: sent('/move'), paths: window.asked.filter(({path}) => path.includes('/move')).map(({path}) => path.replace('/api/v1', '')),
                    history: [...main.querySelectorAll('ul.list > li')].map(({dataset}) => Number(dataset.key)), words: main.innerText}""")
        self.assertEqual(told["before"][0], [2, 3, 4, 5], "the one that is cut next stands first, what is over last")
        self.assertIn("job 2", told["before"][1])
        self.assertEqual(told["before"][2], [["earlier-2", True], ["later-2", False], ["earlier-3", False], ["later-3", False], ["earlier-4", False], ["later-4", True]])
        self.assertEqual(told["after"][0], [3, 2, 4, 5])
        self.assertIn("job 3", told["after"][1], "Start begins with the first of the queue")
        self.assertEqual(told["paths"], ["/jobs/2/move", "/jobs/2/move", "/jobs/4/move"])
        self.assertEqual(told["sent"], [{"before": 4}, {}, {"before": 3}])
        self.assertEqual(told["focus"], ["later-2", "earlier-2", "later-4"], "the job keeps the focus, by the button that is not shut")
        self.assertEqual(told["history"], [4, 3, 2, 5])
        self.assertIn("place 1 of the queue", told["words"])

    def test_the_job_that_is_being_cut_stands_first_and_has_no_place(self):
        told = self.shown(QUEUE + """
            order = [3, 4];
            tell();
            model.jobs = window.answers['/jobs'].jobs.map((one) => (one.id === 2 ? {...one, state: 'running'} : one));
            draw();
            return [rows(), [...main.querySelectorAll('.job-places button')].map(({id}) => id)]""")
        self.assertEqual(told, [[2, 3, 4, 5], ["earlier-3", "later-3", "earlier-4", "later-4"]])

    def test_a_move_is_said_and_its_buttons_stand_side_by_side(self):
        told = self.shown(QUEUE + """
            main.className = 'screen-run';
            const tops = ['#earlier-3', '#later-3'].map((id) => main.querySelector(id).getBoundingClientRect().top), said = () => main.querySelector('#queue-said').textContent;
            const out = [tops[0] === tops[1], said()];
            await press('#later-2', [3, 2, 4]);
            return [...out, said()]""")
        self.assertEqual(told, [True, "", "Job 2: place 2 of 3."])

    # Somebody else was first: the job stands where it stood, and what happens to it later is none of this page's doing.
    def test_a_move_that_changes_nothing_takes_no_focus_later(self):
        told = self.shown(QUEUE + """
            await press('#later-2', [2, 3, 4]);
            document.activeElement.blur();
            order = [3, 2, 4];
            tell();
            model.jobs = window.answers['/jobs'].jobs;
            draw();
            return [rows(), document.activeElement === document.body]""")
        self.assertEqual(told, [[3, 2, 4, 5], True])

    def test_one_job_alone_has_no_order_and_a_viewer_gives_none(self):
        told = self.shown(QUEUE + """
            model.role = 'viewer';
            draw();
            const shut = [...main.querySelectorAll('.job-places button')].every(({disabled}) => disabled);
            model.role = 'admin';
            model.jobs = model.jobs.filter(({id}) => id === 2 || id === 5);
            draw();
            return [shut, main.querySelectorAll('.job-places button').length, main.querySelector('.jobs').innerText.includes('queue')]""")
        self.assertEqual(told, [True, 0, False])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
