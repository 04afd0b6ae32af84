#!/usr/bin/python3
"""seldom_test.py CONSOLE: what is seldom wanted of the page, as page_test.py asks: panels that are one sheet or were sawn
apart, new tags, how scans fit, the test pattern, a laser's corner, which scanners answer.
"""
import sys
import unittest

from page_test import CELL, EVERYTHING, Page

# Of a screen of EVERYTHING: draw() as it is now, press(), and what was sent.
STEPS = CELL + EVERYTHING + """
    let screen, rest;
    const now = (fresh = {}) => { given_to({...about_all, open_scan: null, ...fresh}); window.answers['/status'] = model.cell; };
    let draw = (fresh) => {
      now(fresh);
      put(main, ...[screen.draw(...rest)].flat());
      for (const one of main.querySelectorAll('details')) one.open = true;
      return main;
    };
    const enter = async (name, ...more) => { rest = more; await show(name, more, {open_scan: null}, (one) => { screen = one; }); draw(); };
    const press = async (css) => { main.querySelector(css).click(); await settled(); await settled(); draw(); };
    const questions = [];
    // Before what EVERYTHING answers.
    const answer = (more) => { window.answers = {...more, ...Object.fromEntries(Object.entries(window.answers).filter(([path]) => !(path in more)))}; };
    const says = (word) => { window.confirm = (question) => { questions.push(question); return word; }; };
    model.panels = ['P-0001', 'P-0002', 'P-0003'].map((id) => ({...panel, id, name: id, retired: id === 'P-0003' ? {reason: 'lent'} : null}));
    const text = () => main.innerText;
"""


class Seldom(Page):
    def setUp(self):
        self.speak("en")

    def steps(self, script):
        told = self.does(STEPS + "const told = await (async () => {" + script + "})(); return {told, faults}")
        self.assertEqual(told["faults"], [])
        return told["told"]

    def test_two_panels_are_made_one_after_a_question(self):
        told = self.steps("""
            await enter('panels', 'P-0001');
            const offered = [...main.querySelectorAll('#merge-which option')].map(({value}) => value), shut = main.querySelector('#do-merge').disabled;
            type('#merge-which', 'P-0002'); draw();
            says(false); await press('#do-merge');
            const refused = sent('/merge');
            says(true); await press('#do-merge');
            return {offered, shut, refused, sent: sent('/merge'), path: window.asked.find(({path}) => path.includes('/merge')).path, questions, done: text().includes('P-0002 is one with P-0001 now'), which: main.querySelector('#merge-which').value}""")
        self.assertEqual(told["offered"], ["", "P-0002"], "neither itself nor one that is out of stock")
        self.assertTrue(told["shut"])
        self.assertEqual((told["refused"], told["sent"]), ([], [{"merged": "P-0002"}]))
        self.assertEqual(told["path"], "/api/v1/panels/P-0001/merge")
        self.assertIn("P-0002 leaves the stock for good", told["questions"][1])
        self.assertEqual((told["done"], told["which"]), (True, ""))

    def test_what_was_chosen_for_one_panel_is_not_chosen_for_another(self):
        told = self.steps("""
            await enter('panels', 'P-0001');
            type('#merge-which', 'P-0002'); type('#split-why', 'too long'); draw();
            const before = [main.querySelector('#merge-which').value, main.querySelector('#split-why').value];
            answer({'/panels/P-0002': {...panel, id: 'P-0002'}});
            await enter('panels', 'P-0002');
            return [before, [main.querySelector('#merge-which').value, main.querySelector('#split-why').value]]""")
        self.assertEqual(told, [["P-0002", "too long"], ["", ""]])

    def test_a_panel_is_sawn_apart_after_a_question(self):
        told = self.steps("""
            await enter('panels', 'P-0001');
            says(false); await press('#do-split');
            const refused = sent('/split').length;
            type('#split-why', ' too long '); draw();
            says(true); await press('#do-split');
            return [refused, sent('/split'), questions[1]]""")
        self.assertEqual(told[:2], [0, [{"reason": "too long"}]])
        self.assertIn("Was P-0001 sawn apart?", told[2])

    def test_it_is_taken_back_until_a_part_is_there(self):
        told = self.steps("""
            const sawn = (parts) => { window.answers['/panels/P-0001'] = {...panel, retired: {reason: 'sawn apart', at, sawn: true}, parts}; };
            sawn([]);
            await enter('panels', 'P-0001');
            const none = [main.querySelector('#do-merge'), main.querySelector('#do-split'), main.querySelector('#scan-again')];
            await press('#unsplit');
            const back = sent('/restore').length;
            sawn(['P-0007']);
            await enter('panels', 'P-0001');
            return [none, back, main.querySelector('#unsplit'), main.querySelectorAll('a[href="#panels/P-0007"]').length]""")
        self.assertEqual(told, [[None, None, None], 1, None, 1])

    def test_its_scans_say_how_they_fit(self):
        told = self.steps("""
            const one = (id, face, rms_mm, max_mm) => ({id, face, device: 'x', sha256: '', dpi: 300, taken: at, rms_mm, max_mm, lattice: null});
            answer({'/panels/P-0001/registration': {panel: 'P-0001', rms_mm: .0123, max_mm: .05, scans: [one(1, 'show', null, null), one(4, 'back', .0123, .05)], next: null}});
            window.answers['/panels/P-0001'] = {...panel, fiducials: [['tag', 'show'], ['tag', 'show'], ['hole', 'show'], ['tag', 'back']].map(([kind, face]) => ({kind, face, tag_id: 1, centre_mm: [1, 1], corners_mm: [[1, 1]]}))};
            await enter('panels', 'P-0001');
            return main.querySelector('[data-key="fit-P-0001"]').innerText""")
        self.assertRegex(told, r"(?s)2 tags, 1 hole.*1 tag.*Scan 4, .*0\.012 mm on average, 0\.050 mm at worst.*Scan 1, .*nothing to compare it with")

    def test_a_panel_is_scanned_again_from_its_page(self):
        told = self.steps("""
            answer({'/panels/P-0002': {...panel, id: 'P-0002'}});
            await enter('panels', 'P-0002');
            const way = main.querySelector('#scan-again').getAttribute('href');
            await enter('scan', ...way.slice(1).split('/').slice(1));
            await until(() => !draw().querySelector('#do-scan').disabled);
            const field = main.querySelectorAll('select')[1].value;
            main.querySelector('#scan-retag').click(); draw();
            await press('#do-scan');
            const ticked = main.querySelector('#scan-retag').checked;
            await until(() => !draw().querySelector('#do-scan').disabled);
            await press('#do-scan');
            return [way, field, ticked, sent('/scans')]""")
        self.assertEqual(told, ["#scan/P-0002", "P-0002", False, [{"face": "show", "more": False, "panel": "P-0002", "retag": True}, {"face": "show", "more": False, "panel": "P-0002"}]],
                         "new tags are asked for once")

    def test_a_series_with_new_tags_ends_with_them(self):
        told = self.steps("""
            await enter('scan');
            const open = {open_scan: {tiles: 1, panel: 'P-0002', face: 'back', retag: true}};
            await until(() => !draw(open).querySelector('#do-scan').disabled);
            const words = main.querySelector('[data-key=series]').innerText;
            main.querySelector('#do-scan').click();
            await until(() => sent('/scans').length);
            return [words.includes('with new tags'), sent('/scans')]""")
        self.assertEqual(told, [True, [{"face": "back", "more": False, "panel": "P-0002", "retag": True}]])

    def test_the_test_pattern_burns_what_was_seen_to(self):
        told = self.steps("""
            model.panels = [];
            answer({'/laser/test-pattern': {task: 12}, '/tasks/12': {}});
            await enter('settings');
            await until(() => draw().querySelector('#pattern-burn'));
            const shut = [main.querySelector('#pattern-burn').disabled, main.querySelector('#pattern-dry').disabled];
            type('#pattern-size', '9,9'); draw();
            const none = main.querySelector('#pattern-dry').disabled;
            type('#pattern-size', '20,5'); draw();
            main.querySelector('[data-key=confirm-pattern] input').click(); draw();
            const before = main.querySelector('#pattern-burn').disabled;
            main.querySelector('#pattern-burn').click();
            await until(() => sent('/test-pattern').length);
            await until(() => draw().querySelector('#pattern-cancel'));
            main.querySelector('#pattern-cancel').click();
            await until(() => window.asked.some(({path, method}) => method === 'DELETE' && path.endsWith('/tasks/12')));
            return {shut, none, before, sent: sent('/test-pattern'), left: draw().querySelector('[data-key=confirm-pattern] input').checked}""")
        self.assertEqual(told, {"shut": [True, False], "none": True, "before": False, "sent": [{"size_mm": 20.5, "dry": False, "confirmed": ["exhaust"]}], "left": False})

    def test_strokes_are_ended_by_stop_and_not_by_giving_up(self):
        told = self.steps("""
            model.panels = [];
            answer({'/laser/test-pattern': {task: 12}, '/tasks/12': {}});
            await enter('settings');
            await until(() => draw().querySelector('#pattern-burn'));
            const before = main.querySelector('#pattern-runs');
            main.querySelector('[data-key=confirm-pattern] input').click(); draw();
            main.querySelector('#pattern-burn').click();
            await until(() => draw().querySelector('#pattern-cancel'));
            const seen = {};
            for (const state of ['Resetting', 'Execute', 'Holding', 'Held', 'Unholding']) { draw({state}); seen[state] = [main.querySelector('#pattern-cancel') !== null, main.querySelector('#pattern-runs')?.innerText || '']; }
            return [before, seen]""")
        self.assertEqual(told[0], None)
        self.assertEqual(told[1].pop("Resetting"), [True, ""])
        for state, seen in told[1].items():
            with self.subTest(state):
                self.assertEqual(seen, [False, "▲ What moves now is ended by STOP; Hold makes it pause."])

    def pattern(self, script, laser="{}", confirm="['exhaust']", role="admin"):
        return self.steps("""
            model.panels = [];
            answer({'/laser/test-pattern': {task: 12}, '/tasks/12': {}});
            const fresh = {laser: {...about_all.laser, ...%s}, confirm: %s}, drawn = draw;
            draw = (more = {}) => drawn({...fresh, ...more});
            model.role = '%s';
            await enter('settings');
            await until(() => draw().querySelector('#pattern-burn'));
            const card = () => main.querySelector('#pattern-burn').closest('section').innerText;
            """ % (laser, confirm, role) + script)

    def test_where_nothing_is_asked_by_name_a_question_stands_before_the_burn(self):
        told = self.pattern("""
            says(false); await press('#pattern-burn');
            const none = sent('/test-pattern').length;
            says(true); await press('#pattern-burn');
            await until(() => sent('/test-pattern').length);
            return [none, sent('/test-pattern'), questions.length]""", confirm="[]")
        self.assertEqual(told, [0, [{"size_mm": 50, "dry": False, "confirmed": []}], 2])

    def test_where_the_pattern_is_burnt_and_that_the_head_moves(self):
        seen = "return [card(), ...['#pattern-dry', '#pattern-burn'].map((one) => main.querySelector(one).innerText)]"
        about, dry, burn = self.pattern(seen)
        self.assertIn("On scrap wood, in the middle of the bed.", about)
        self.assertEqual((dry, burn), ("Run the pattern dark\nhomes the laser first; stay beside the machine", "Burn the pattern\nhomes the laser first; stay beside the machine"))
        about, dry, burn = self.pattern(seen, laser="{finds_home: false}")
        self.assertIn("from the lower left corner on that the laser was shown.", about)
        self.assertEqual((dry, burn), ("Run the pattern dark\nthe head moves; stay beside the machine", "Burn the pattern\nthe head moves; stay beside the machine"))
        self.speak("de")
        self.addCleanup(self.speak, "en")
        about, dry, burn = self.pattern(seen)
        self.assertIn("In Abfallholz, in der Mitte des Betts.", about)
        self.assertTrue(dry.startswith("Das Muster dunkel abfahren\nfährt zuerst auf Referenz"), dry)

    def test_a_dark_run_of_the_pattern(self):
        told = self.pattern("""
            await press('#pattern-dry');
            await until(() => sent('/test-pattern').length);
            model.tasks.set(12, {id: 12, state: 'done', result: {dry: true}});
            await until(() => draw().innerText.includes('with the beam off'));
            return [sent('/test-pattern'), card().includes('is burnt.'), questions.length]""")
        self.assertEqual(told, [[{"size_mm": 50, "dry": True}], False, 0])

    def test_a_refused_pattern_is_told_and_a_viewer_burns_none(self):
        told = self.pattern("""
            answer({'/laser/test-pattern': {error: {message: 'the lid is open'}}});
            await press('#pattern-dry');
            await until(() => !document.getElementById('refusal').hidden);
            return [document.getElementById('refusal').innerText, draw() && main.querySelector('#pattern-dry').disabled, main.querySelector('#pattern-cancel')]""")
        self.assertEqual(told, ["The lid is open.", False, None])
        self.speak("en")
        told = self.pattern("""return ['#pattern-dry', '#pattern-burn'].map((one) => [main.querySelector(one).disabled, main.querySelector(one).innerText.split('\\n')[1]])""", role="viewer")
        self.assertEqual(told, [[True, "needs a maintainer"]] * 2)

    def test_only_a_laser_that_does_not_find_its_corner_is_told(self):
        told = self.steps("""
            await enter('settings');
            await until(() => draw().querySelector('#pattern-burn'));
            const finds = main.querySelector('#do-corner'), laser = {...about_all.laser, finds_home: false};
            draw({laser});
            const shown = main.querySelector('#do-corner') !== null;
            const tell = async (word) => { says(word); draw({laser}); main.querySelector('#do-corner').click(); await settled(); return sent('/laser/corner').length; };
            return [finds, shown, await tell(false), await tell(true)]""")
        self.assertEqual(told, [None, True, 0, 1])

    def test_the_corner_is_told_at_rest_and_then_reset_is_pressed(self):
        told = self.steps("""
            await enter('settings');
            await until(() => draw().querySelector('#pattern-burn'));
            const laser = {...about_all.laser, finds_home: false}, note = () => main.querySelector('[data-key=corner]').innerText, shut = {}, arrows = {};
            for (const state of ['Execute', 'Resetting', 'Held', 'Stopped', 'Idle']) { draw({laser, state}); shut[state] = main.querySelector('#do-corner').disabled; arrows[state] = note().includes('arrows'); }
            draw({laser, state: 'Stopped'});
            window.confirm = () => { now({laser, state: 'Execute'}); return true; };
            main.querySelector('#do-corner').click(); await settled();
            const meanwhile = sent('/laser/corner').length;
            says(true);
            draw({laser, state: 'Stopped'});
            main.querySelector('#do-corner').click(); await settled(); await settled();
            draw({laser, state: 'Stopped'});
            const stopped = note();
            draw({laser, state: 'Idle'});
            return {shut, arrows, meanwhile, sent: sent('/laser/corner').length, stopped: stopped.includes('Taken. Now press Reset.'), later: note().includes('Taken')}""")
        self.assertEqual(told, {"shut": {"Execute": True, "Resetting": True, "Held": True, "Stopped": False, "Idle": False}, "meanwhile": 0, "sent": 1, "stopped": True, "later": False,
                                "arrows": {"Execute": False, "Resetting": False, "Held": False, "Stopped": False, "Idle": True}})

    def test_the_scanners_that_answer(self):
        told = self.steps("""
            answer({'/scanners': {scanners: [{name: 'x:1', make: 'Maker One', problem: ''}, {name: 'y:2', make: '', problem: 'it is busy'}]}});
            await enter('settings');
            await until(() => draw().querySelector('#find-scanners'));
            await press('#find-scanners');
            await until(() => draw().innerText.includes('Maker One'));
            return text().replace(/\\s+/g, ' ')""")
        self.assertRegex(told, r"Maker One x:1 y:2 y:2 ▲ It is busy\.")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
