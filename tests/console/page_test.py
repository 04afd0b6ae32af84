#!/usr/bin/python3
"""page_test.py CONSOLE: the page's own functions, and cards that are given a cell, in Chromium without a daemon.

The page's files are served as they are; what it would ask the cell for is answered here, and noted.
"""
import http.server
import os
import sys
import threading
import unittest

from selenium import webdriver
from selenium.webdriver.chrome.service import Service

CONSOLE = sys.argv[1]
LEAFLET = "/usr/share/javascript/leaflet"
PATIENCE_S = 60


class Files(http.server.SimpleHTTPRequestHandler):
    """/console/... from the tree; / is the page's frame without its scripts."""
    extensions_map = {".js": "text/javascript", ".css": "text/css", ".html": "text/html"}

    def translate_path(self, path):
        if path.startswith("/console/lib/"):  # as the daemon serves Leaflet
            return os.path.join(LEAFLET, os.path.basename(path).replace("leaflet.js", "leaflet.esm.min.js"))
        return os.path.join(CONSOLE, path.split("?")[0].removeprefix("/console/").lstrip("/"))

    def do_GET(self):
        if self.path != "/":
            return super().do_GET()
        with open(os.path.join(CONSOLE, "index.html"), encoding="utf-8") as file:
            lines = [line for line in file if "<script" not in line]
        self.send_response(200)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.end_headers()
        self.wfile.write("".join(lines).encode())

    def log_message(self, *_):
        pass


# Answers the page, notes what it asks for, and gives modules their words.
STAGE = """
    window.asked = [];
    window.answers = {};
    window.fetch = async (path, how = {}) => {
      window.asked.push({path: String(path), method: how.method || 'GET', body: typeof how.body === 'string' ? JSON.parse(how.body) : null});
      const [, told] = Object.entries(window.answers).find(([part]) => String(path).includes(part)) || ['', {}];
      return {ok: !told.error, status: told.error ? 409 : 200, json: async () => told};
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
        cls.browser.get(place)

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
            ("and more is to come: veneerctl panel scan --panel P-0001 --face back ends it with the last part, --more goes on, --anew gives up what is there",
             "and more is to come: “Scan: back: P-0001” ends it with the last part, “Scan: The panel is larger than the glass: more tiles follow” goes on, “Scan: Scan and begin a new series” gives up what is there", "#scan", "#scan", "#scan"),
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
            ("lay each on the scanner (veneerctl panel scan)", "lay each on the scanner (“Scan: Scan”)", "#scan"),
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
            ("there, then `veneerctl panel decide P-0002 4 written-off`, or `... accepted` when", "there, then “Panels: P-0002: Write it off”, or “Panels: Leave it as it is” when", "#panels/P-0002", "#panels")):
            self.check(sentence, words, *hrefs)

    def test_what_the_page_has_no_button_for_stays(self):
        for sentence in ("name it as `veneerctl panel merge` does", "see veneerctl scanner list, and correct it", "try `veneerctl job redo 3 --never-heard-of`",
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
            const {inEnglish} = await load('parts.js'), node = inEnglish('find other wood with veneerctl job redo 3 A1-2 now');
            return [node.lang, [...node.children].map((one) => [one.nodeName, one.lang, one.getAttribute('href')]), node.textContent]""")
        self.assertEqual(seen, ["en", [["A", "de", "#run"]], "find other wood with „Schneiden: A1-2: Anderes Holz suchen“ now"])


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
    const until = async (is) => { for (let i = 0; i < 500; ++i) { const told = is(); if (told) return told; await new Promise((go) => setTimeout(go, 10)); } throw new Error('it did not come: ' + is); };
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
        self.assertIn("Piece A1-2 is lost", told["sure"])
        self.assertEqual(told["body"], {"pieces": ["A1-2"], "lost": True})

    def test_a_failed_redo_is_told_in_the_pages_words(self):
        self.speak("de")
        self.addCleanup(self.speak, "en")
        told = self.lose_a_piece("there is no panel in stock: scan one with veneerctl panel scan")
        self.assertEqual(told["label"], "Es ist verloren: anderes Holz suchen")
        self.assertEqual(told["said"], "▲ Auftrag 3: Es wurde kein anderes Holz reserviert: There is no panel in stock: scan one with „Scannen: Scannen“.")
        self.assertEqual(told["lang"], "en")

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

    def test_an_open_series_goes_on_as_it_began(self):
        seen = self.does(CELL + """
            const scan = await load('screens/scan.js'), asked = () => window.asked.filter(({path}) => path.endsWith('/scans')).map(({body}) => body);
            window.answers['/proposals'] = {proposals: []};
            model.panels = ['P-0001', 'P-0002'].map((id) => ({id, retired: null}));
            const open = (tiles, more = {}) => ({open_scan: {tiles, panel: 'P-0002', face: 'back', ...more}});
            const draw = (fresh) => { given_to(fresh); window.answers['/status'] = model.cell; put(main, scan.draw()); return main.querySelector('#do-scan'); };
            const chosen = () => [...main.querySelectorAll('select')].map(({value}) => value);
            const choose = (n, value) => { const field = main.querySelectorAll('select')[n]; field.value = value; field.dispatchEvent(new Event('change')); };
            const look = (fresh) => [draw(fresh).disabled, main.querySelector('#scan-other') !== null, ...chosen()];
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
            return {none, atOnce, begun, sent: asked(), face, panel, itself, another: another.slice(2)}""")
        self.assertEqual(seen, {"none": [False, False, "show", ""], "atOnce": True, "begun": [False, False, "back", "P-0002"],
                                "sent": [{"face": "back", "more": False, "panel": "P-0002"}], "face": [True, True, "show", "P-0002"],
                                "panel": [True, True, "back", "P-0001"], "itself": [False, False, "back", ""], "another": ["show", ""]})

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


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
