#!/usr/bin/python3
"""seldom_test.py CONSOLE: what is seldom wanted of the page, as page_test.py asks: panels that are one sheet or were sawn
apart, new tags, how scans fit, the test pattern, a laser's corner, which scanners answer, looking through a camera.
"""
import sys
import unittest

from page_test import CELL, EVERYTHING, Files, Page

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

UNTIL = "const until = async (is) => { for (let i = 0; i < 2000; ++i) { const told = is(); if (told) return told; await new Promise((go) => setTimeout(go, 10)); } throw new Error('it did not come: ' + is); };"


class Seldom(Page):
    def setUp(self):
        self.speak("en")

    def steps(self, script):
        told = self.does(STEPS + "const told = await (async () => {" + script + "})(); return {told, faults}")
        self.assertEqual(told["faults"], [])
        return told["told"]

    def merged(self, reply, language="en", scan_again="null"):
        self.speak(language)
        self.addCleanup(self.speak, "en")
        return self.steps("""
            window.answers['/panels/P-0001'] = {...panel, scan_again: %s};
            await enter('panels', 'P-0001');
            const about = main.querySelector('[data-key="merge-P-0001"]').innerText;
            const offered = [...main.querySelectorAll('#merge-which option')].map(({value}) => value), shut = main.querySelector('#do-merge').disabled;
            type('#merge-which', 'P-0002'); draw();
            says(false); await press('#do-merge');
            const refused = sent('/merge');
            answer({'/panels/P-0001/merge': {panel: 'P-0001', merged: 'P-0002', other_face: %s, fiducials: 4, rms_mm: .01}});
            says(true); await press('#do-merge');
            return {about, offered, shut, refused, sent: sent('/merge'), path: window.asked.find(({path}) => path.includes('/merge')).path, questions, done: main.querySelector('#merge-done')?.innerText, scan: main.querySelector('#merge-scan')?.getAttribute('href'), which: main.querySelector('#merge-which').value}"""
                          % (scan_again, reply))

    def test_two_panels_are_made_one_after_a_question(self):
        told = self.merged("false")
        self.assertEqual(told["offered"], ["", "P-0002"], "neither itself nor one that is out of stock")
        self.assertTrue(told["shut"])
        self.assertEqual((told["refused"], told["sent"]), ([], [{"merged": "P-0002"}]))
        self.assertEqual(told["path"], "/api/v1/panels/P-0001/merge")
        self.assertEqual(told["which"], "")

    def test_what_a_merge_will_do_is_said_before_and_what_it_did_after(self):
        same = self.merged("false")
        self.assertIn("Do this at the one whose show face was really scanned", same["about"])
        self.assertNotIn("scans of both", same["about"])
        for before in (same["about"], same["questions"][1]):
            self.assertRegex(before, r"[Nn]othing is planned on P-0001 or cut from it (then )?until")
        self.assertIn("P-0002 leaves the stock for good", same["questions"][1])
        self.assertIn("was P-0001 scanned by its show face?", same["questions"][1])
        self.assertRegex(same["done"], "P-0002 is one with P-0001 now.*Scan P-0001 again, show face down: until then nothing is planned on it")
        self.assertEqual(same["scan"], "#scan/P-0001")
        back = self.merged("true")
        self.assertEqual(back["scan"], None)
        self.assertEqual(back["done"], "P-0002 was the back of P-0001: its scan and its tags are those of the back now.")
        gone = self.merged("true", scan_again="'wood of it is gone'")
        self.assertRegex(gone["done"], "P-0002 was the back of P-0001: .*what was cut from it is booked here.*Scan P-0001 again, show face down: until then nothing is planned on it or cut from it")
        self.assertEqual(gone["scan"], "#scan/P-0001")
        self.assertRegex(self.merged("true", "de", "'wood of it is gone'")["done"], "P-0002 war die Rückseite von P-0001: .*ist hier verbucht.*Scannen Sie P-0001 nochmals")
        german = self.merged("false", "de")
        self.assertRegex(german["done"], "P-0002 ist jetzt eins mit P-0001.*Scannen Sie P-0001 nochmals")
        self.assertIn("deren Sichtseite wirklich gescannt wurde", german["about"])

    def test_what_comes_of_a_merge_is_told_of_its_own_panel_only(self):
        told = self.steps("""
            answer({'/panels/P-0002': {...panel, id: 'P-0002'}});
            await enter('panels', 'P-0001');
            type('#merge-which', 'P-0002'); draw();
            const ask = window.fetch;
            let reply;
            window.fetch = async (path, how) => { if (String(path).includes('/merge')) await new Promise((go) => { reply = go; }); return ask(path, how); };
            says(true);
            main.querySelector('#do-merge').click();
            await until(() => reply);
            draw();
            const shut = [main.querySelector('#do-merge').disabled, main.querySelector('#do-split').disabled];
            await enter('panels', 'P-0002');
            type('#merge-which', 'P-0001'); type('#split-why', 'too long'); draw();
            reply();
            await settled(); await settled(); draw();
            const kept = [main.querySelector('#merge-which').value, main.querySelector('#split-why').value, main.querySelector('[data-key="merge-P-0002"] [role=status]')];
            model.panels = model.panels.filter(({id}) => id !== 'P-0001');
            draw();
            return {shut, kept, gone: main.querySelector('#merge-which').value, none: main.querySelector('#do-merge').disabled}""")
        self.assertEqual(told, {"shut": [True, True], "kept": ["P-0001", "too long", None], "gone": "", "none": True})

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

    def test_a_part_is_scanned_as_no_panel_and_by_its_show_face(self):
        told = self.steps("""
            window.answers['/panels/P-0001'] = {...panel, retired: {reason: 'sawn apart', at, sawn: true}, parts: []};
            await enter('scan', 'P-0001');
            type('select', 'back'); draw();
            const before = [...main.querySelectorAll('select')].map(({value}) => value).slice(0, 2);
            model.panels[0].retired = {reason: 'sawn apart'};
            await enter('panels', 'P-0001');
            const way = [...main.querySelectorAll('a')].find((one) => one.innerText === 'Scan a part').getAttribute('href');
            await enter('scan', ...way.slice(1).split('/').slice(1));
            const after = [...main.querySelectorAll('select')].map(({value}) => value).slice(0, 2);
            await until(() => !draw().querySelector('#do-scan').disabled);
            await press('#do-scan');
            main.querySelector('#scan-bare')?.click(); draw();
            await press('#do-scan');
            type('select', 'back'); draw();
            return {before, after, sent: sent('/scans'), back: main.querySelector('#scan-bare')}""")
        self.assertEqual(told, {"before": ["back", "P-0001"], "after": ["show", ""], "back": None,
                                "sent": [{"face": "show", "more": False}, {"face": "show", "more": False, "part_of": "P-0001"}]})

    def test_a_panel_that_left_the_stock_is_chosen_no_more(self):
        told = self.steps("""
            await enter('scan', 'P-0001');
            model.panels[0].retired = {reason: 'sawn apart'};
            await until(() => !draw().querySelector('#do-scan').disabled);
            await press('#do-scan');
            return sent('/scans')""")
        self.assertEqual(told, [{"face": "show", "more": False}])

    def test_a_part_is_no_tile_of_another_panels_series(self):
        told = self.steps("""
            const other = (panel) => { const fresh = {open_scan: {tiles: 1, panel, face: 'show', retag: false}}; draw(fresh); screen.enter(...rest); draw(fresh); return main.querySelector('#scan-other') !== null; };
            await enter('scan', 'part', 'P-0003');
            return [other(null), other('P-0002')]""")
        self.assertEqual(told, [False, True])

    def test_its_scans_say_how_they_fit(self):
        told = self.steps("""
            const one = (id, face, rms_mm, max_mm) => ({id, face, device: 'x', sha256: '', dpi: 300, taken: at, rms_mm, max_mm, lattice: null});
            answer({'/panels/P-0001/registration': {panel: 'P-0001', rms_mm: .0123, max_mm: .05, scans: [one(1, 'show', null, null), one(4, 'back', .0123, .05)], next: null}});
            window.answers['/panels/P-0001'] = {...panel, fiducials: [['tag', 'show'], ['tag', 'show'], ['hole', 'show'], ['tag', 'back']].map(([kind, face]) => ({kind, face, tag_id: 1, centre_mm: [1, 1], corners_mm: [[1, 1]]}))};
            await enter('panels', 'P-0001');
            return until(() => { draw(); const fit = main.querySelector('[data-key="fit-P-0001"]').innerText; return !fit.includes('asked for') && fit; })""")
        self.assertRegex(told, r"(?s)2 tags, 1 hole.*1 tag.*Scan 4, .*0\.012 mm on average, 0\.050 mm at worst.*Scan 1, .*nothing to compare it with")

    MARKS = """
            const tag = (tag_id, x, off_mm, off_scan) => ({kind: 'tag', face: 'show', tag_id, centre_mm: [x, 5], corners_mm: [[x, 4], [x + 2, 4], [x + 2, 6], [x, 6]], off_mm, off_scan, over_limit: off_mm > .05});
            const hole = {kind: 'hole', face: 'show', tag_id: null, centre_mm: [80, 80], corners_mm: [[80, 80]], off_mm: .0214, off_scan: 4, over_limit: false};
            window.answers['/panels/P-0001'] = {...panel, fiducials: [tag(7, 10, .3004, 4), tag(8, 30, .012, 4), {...tag(9, 50, null, null), face: 'back', over_limit: false}, hole, {...tag(6, 70, .2, 2), over_limit: false}]};
            answer({'/panels/P-0001/registration': {panel: 'P-0001', rms_mm: .0123, max_mm: .05, scans: [], next: null}});"""

    def test_each_tag_and_hole_says_how_far_it_lies(self):
        told = self.steps(self.MARKS + """
            await enter('panels', 'P-0001');
            const each = await until(() => { draw(); const all = [...main.querySelectorAll('ul.marks')]; return all.length === 2 && all; });
            return each.map((one) => [one.dataset.marks, [...one.children].map(({innerText}) => innerText)])""")
        self.assertEqual(told, [["show", ["Tag 7: ▲ 0.300 mm", "Tag 6: 0.200 mm", "Hole: 0.021 mm", "Tag 8: 0.012 mm"]], ["back", ["Tag 9: how far off is not known"]]])

    def test_on_the_map_one_that_lies_too_far_off_is_labelled(self):
        for language, off, unknown in (("en", "▲ Tag 7, show face: 0.300 mm from where the others put it (scan 4)", "Tag 9, back: how far off is not known"),
                                       ("de", "▲ Marke 7, Sichtseite: 0.300 mm von da, wo die anderen sie erwarten lassen (Scan 4)", "Marke 9, Rückseite: wie weit daneben, ist nicht bekannt")):
            self.speak(language)
            self.addCleanup(self.speak, "en")
            told = self.steps(self.MARKS + """
                const {fiducialWords} = await load('screens/fiducial_words.js');
                await enter('panels', 'P-0001');
                await until(() => { draw(); if (screen.drawn) screen.drawn(main, ...rest); return main.querySelector('.leaflet-tooltip'); });
                return [[...main.querySelectorAll('.leaflet-tooltip')].map(({innerText}) => innerText), ...[0, 2].map((n) => fiducialWords(window.answers['/panels/P-0001'].fiducials[n]))]""")
            self.assertEqual(told, [["▲ 7: 0.30 mm"], off, unknown])

    # ---- the outline of a strip

    def outlined(self, script, refused="null", language="en"):
        """On a panel with strips 1 and 2, once its map is there; tap(x, y) in pixels of the map, key(name, more)."""
        self.speak(language)
        self.addCleanup(self.speak, "en")
        return self.steps("""
            const strip = (zone, x, version = 1) => ({zone, version, material: zone === 1 ? 'walnut' : null, area_mm2: 1e4, shape_mm: [[[x, 0], [x + 100, 0], [x + 100, 100], [x, 100]]]});
            window.answers['/panels/P-0001'] = {...panel, zones: [strip(1, 0), strip(2, 120)]};
            const refused = %s;
            answer({'/panels/P-0001/zones': refused ? {error: {message: refused}} : {panel: 'P-0001', zone: 3, zones: []}});
            await enter('panels', 'P-0001');
            const shown = () => { draw(); if (screen.drawn) screen.drawn(main, ...rest); };
            const one = (css) => main.querySelector(css), said = () => one('#outline-said').innerText;
            await until(() => { shown(); return one('#outline') && !one('#outline').disabled; });
            const tap = (x, y) => {
              const box = one('.map').getBoundingClientRect(), how = {bubbles: true, clientX: box.left + x, clientY: box.top + y, button: 0};
              for (const kind of ['mousedown', 'mouseup', 'click']) one('.map').dispatchEvent(new MouseEvent(kind, how));
              draw();
            };
            const key = (name, more = {}) => { one('.map').dispatchEvent(new KeyboardEvent('keydown', {key: name, bubbles: true, cancelable: true, ...more})); draw(); };
            """ % refused + script)

    def test_an_outline_is_tapped_corner_by_corner_and_becomes_a_strip(self):
        told = self.outlined("""
            await press('#outline');
            const offered = [...main.querySelectorAll('#outline-zone option')].map(({innerText}) => innerText), {width, height} = one('.map').getBoundingClientRect();
            const middle = [width / 2, height / 2];
            tap(middle[0] - 40, middle[1] + 30); tap(middle[0] + 40, middle[1] + 30);
            const two = [said(), one('#outline-keep').disabled];
            tap(middle[0] + 40, middle[1] - 30); tap(middle[0], middle[1]);
            await press('#outline-undo');
            const three = [said(), one('#outline-keep').disabled, one('#outline-keep').innerText];
            tap(1, middle[1]);  // beside the panel: on its edge
            const pieces = window.asked.filter(({path}) => path.includes('/pieces/')).length;
            await press('#outline-keep');
            await until(() => { draw(); return one('#outline-kept'); });
            return {offered, two, three, pieces, sent: sent('/zones'), kept: one('#outline-kept').innerText, left: one('#outline-keep').disabled}""")
        self.assertEqual(told["offered"], ["a further strip", "strip 1: walnut, 100 cm²", "strip 2: wood nobody has named, 100 cm²"])
        self.assertRegex(told["two"][0], r"^A corner at [\d.]+ mm from the left, [\d.]+ mm from below\. 2 corners are set\.$")
        self.assertEqual(told["two"][1], True, "three are needed")
        self.assertEqual(told["three"], ["Taken back. 3 corners are set.", False, "Make this a further strip"])
        (body,) = told["sent"]
        self.assertEqual((list(body), body["mask_version"], body["zones_version"]), (["mask_version", "outline_mm", "zones_version"], 2, 1))
        x1, y1, x2, y2, x3, y3, x4, y4 = body["outline_mm"]
        self.assertAlmostEqual(y1, y2, places=1)
        self.assertAlmostEqual(x2, x3, places=1)
        self.assertGreater(x2, x1)
        self.assertGreater(y3, y2, "up is away from the lower edge")
        self.assertAlmostEqual((x1 + x2) / 2, 120, delta=1)
        self.assertAlmostEqual((y2 + y3) / 2, 80, delta=1)
        self.assertEqual(x4, 0, "no corner lies beside the panel")
        self.assertEqual((told["kept"], told["left"], told["pieces"]), ("Strip 3 is now what lies in the outline.", True, 0))

    def test_an_outline_by_keyboard(self):
        told = self.outlined("""
            await press('#outline');
            type('#outline-zone', '2'); draw();
            key('ArrowLeft'); const moved = said();
            key(' '); key('ArrowRight'); key('ArrowRight'); key(' '); key('ArrowUp', {shiftKey: true}); key(' '); key('ArrowUp'); key(' '); key('Delete');
            const left = said(), described = one('.map').getAttribute('aria-describedby'), keep = one('#outline-keep').innerText;
            await press('#outline-keep');
            await press('#outline');
            return {moved, left, described, keep, sent: sent('/zones'), after: [one('.map').getAttribute('aria-describedby'), Boolean(one('#outline-keep'))]}""")
        self.assertEqual(told["moved"], "At 115.0 mm from the left, 80.0 mm from below")
        self.assertEqual((told["left"], told["described"], told["keep"]), ("Taken back. 3 corners are set.", "outline-keys", "Make this the outline of strip 2"))
        self.assertEqual(told["sent"], [{"zone": 2, "outline_mm": [115, 80, 125, 80, 125, 80.5], "mask_version": 2, "zones_version": 1}])
        self.assertEqual(told["after"], [None, False])

    def test_a_refused_outline_is_told_under_the_map_and_stays(self):
        for language in ("en", "de"):
            told = self.outlined("""
                await press('#outline');
                key(' '); key('ArrowRight'); key(' '); key('ArrowUp'); key(' ');
                await press('#outline-keep');
                await until(() => { draw(); return one('#outline-fault'); });
                const fault = one('#outline-fault'), above = document.getElementById('refusal');
                return [fault.innerText, fault.compareDocumentPosition(one('.map')) & Node.DOCUMENT_POSITION_PRECEDING, above.hidden, one('#outline-keep').disabled]""", refused='"the outline holds nothing of panel P-0001: draw it on the panel"', language=language)
            self.assertEqual(told, ["▲ The outline holds nothing of panel P-0001: draw it on the panel.", 2, True, False])

    THREE_CORNERS = """
            await press('#outline');
            key(' '); key('ArrowRight'); key(' '); key('ArrowUp'); key(' ');
            const become = (changed, is) => {
              window.answers['/panels/P-0001'] = {...panel, zones: [strip(1, 0), strip(2, 120)], ...changed};
              model.panels = model.panels.map((known) => ({...known, free_mm2: Math.random()}));  // asked for anew
              return until(() => { draw(); return is(); });
            };
            """

    def test_an_outline_on_a_panel_that_is_another_one_by_now_waits_for_a_look(self):
        for language, mask, strips in (
                ("en", "▲ The mask was changed since you began this outline: version 2 then, 3 now. Look at the panel as it is now: does the outline still fit?",
                 "▲ Strips were drawn anew since you began this outline: version 1 then, 4 now. Look at the panel as it is now: does the outline still fit?"),
                ("de", "▲ Die Maske hat sich geändert, seit Sie diesen Umriss begonnen haben: damals Fassung 2, jetzt 3. Sehen Sie die Platte an, wie sie jetzt ist: Passt der Umriss noch?",
                 "▲ Streifen wurden neu gezeichnet, seit Sie diesen Umriss begonnen haben: damals Fassung 1, jetzt 4. Sehen Sie die Platte an, wie sie jetzt ist: Passt der Umriss noch?")):
            told = self.outlined(self.THREE_CORNERS + """
                await become({mask_version: 3}, () => one('#outline-mask'));
                const mask = one('#outline-mask').innerText, shut = one('#outline-keep') === null, drawing = one('.map').classList.contains('outlining');
                key(' ');
                await press('#outline-fits');
                const looked = [one('#outline-mask') === null, one('#outline-keep').disabled, one('.map').classList.contains('outlining')];
                await become({mask_version: 3, zones: [strip(1, 0), strip(2, 120, 4)]}, () => one('#outline-strips'));
                const strips = [one('#outline-strips').innerText, one('#outline-mask') === null, one('#outline-keep') === null];
                await press('#outline-fits');
                await press('#outline-keep');
                return {mask, shut, drawing, looked, strips, sent: sent('/zones')}""", language=language)
            self.assertEqual((told["mask"], told["shut"], told["drawing"]), (mask, True, False))
            self.assertEqual(told["looked"], [True, False, True])
            self.assertEqual(told["strips"], [strips, True, True])
            self.assertEqual(told["sent"], [{"outline_mm": [120, 80, 125, 80, 125, 85], "mask_version": 3, "zones_version": 4}], "the corners are kept, and none was added before the look")

    def test_whether_an_outline_still_fits_is_asked_where_it_is_shown(self):
        told = self.outlined(self.THREE_CORNERS + """
            key('Escape');
            await become({mask_version: 3, zones: [strip(1, 0), strip(2, 120, 4)]}, () => main.innerText.includes('100 cm²'));
            await settled(); draw();
            const asked = () => ['#outline-mask', '#outline-strips', '#outline-fits', '#outline-drop'].map((css) => Boolean(one(css)));
            const off = asked();
            await press('#outline');
            return [off, asked()]""")
        self.assertEqual(told, [[False] * 4, [True] * 4])

    def test_an_outline_that_came_too_late_stays_and_the_panel_is_read_anew(self):
        for language, fault in (
                ("en", "▲ This outline was drawn over version 1 of the outlines on panel P-0001, and version 2 counts by now: look whether it still fits, then send it again with `zones_version` 2."),
                ("de", "▲ Dieser Umriss wurde über Fassung 1 der Streifen von Platte P-0001 gezeichnet, und jetzt gilt Fassung 2: Sehen Sie nach, ob er noch passt, dann senden Sie ihn noch einmal, mit `zones_version` 2.")):
            told = self.outlined(self.THREE_CORNERS + """
                window.answers['/panels/P-0001'] = {...panel, zones: [strip(1, 0), strip(2, 120, 2)]};  // nobody has told the page
                await press('#outline-keep');
                await until(() => { draw(); return one('#outline-strips'); });
                const fault = one('#outline-fault').innerText;
                answer({'/panels/P-0001/zones': {panel: 'P-0001', zone: 3, zones: []}});
                await press('#outline-fits');
                const looked = one('#outline-fault') === null;
                await press('#outline-keep');
                await until(() => { draw(); return one('#outline-kept'); });
                return {fault, looked, sent: sent('/zones')}""", refused="'this outline was drawn over version 1 of the outlines on panel P-0001, and version 2 counts by now: look whether it still fits, then send it again with `zones_version` 2'", language=language)
            corners = [120, 80, 125, 80, 125, 85]
            self.assertEqual(told, {"fault": fault, "looked": True, "sent": [{"outline_mm": corners, "mask_version": 2, "zones_version": version} for version in (1, 2)]})

    def test_the_next_outline_is_begun_on_what_the_one_before_has_made(self):
        told = self.outlined("const drawn = {panel: 'P-0001', zone: 3, zones: [strip(1, 0), strip(2, 120), strip(3, 60, 2)]}; answer({'/panels/P-0001/zones': drawn});" + self.THREE_CORNERS + """
            await press('#outline-keep');
            await until(() => { draw(); return one('#outline-kept'); });
            key(' '); key('ArrowLeft'); key(' '); key('ArrowDown'); key(' ');  // before the panel is read anew
            await become({zones: drawn.zones}, () => main.querySelectorAll('#outline-zone option').length === 4);
            const same = one('#outline-strips') === null;
            await press('#outline-keep');
            return {same, sent: sent('/zones').map(({zones_version}) => zones_version)}""")
        self.assertEqual(told, {"same": True, "sent": [1, 2]})

    def test_strokes_of_the_same_hand_leave_its_outline_as_it_is(self):
        told = self.outlined(self.THREE_CORNERS + """
            answer({'/panels/P-0001/mask-edits': {panel: 'P-0001', version: 3, number: 1}});
            await press('#brush');
            key(' ');
            await press('#brush-save');
            await become({mask_version: 3}, () => sent('/mask-edits').length === 1 && one('#brush-save') && one('#brush-save').disabled);
            await press('#outline');
            const same = one('#outline-mask') === null;
            await become({mask_version: 4}, () => one('#outline-mask'));
            return {same, then: one('#outline-mask').innerText}""")
        self.assertEqual(told, {"same": True, "then": "▲ The mask was changed since you began this outline: version 3 then, 4 now. Look at the panel as it is now: does the outline still fit?"})

    # The cell tells every page of a change before it answers whoever asked for it. `path`: of what was asked; `changed`: of the panel.
    TOLD_BEFORE_ANSWERED = """
            let socket, reply;
            window.WebSocket = class { constructor() { socket = this; } };
            answer({'/session': {role: 'admin', who: 'anna', user: 'anna', accounts: true, expires_at: at}});
            (await load('model.js')).begin();
            await until(() => socket && socket.onmessage);
            const outlining = () => one('.map').classList.contains('outlining');
            const ask = window.fetch, hold = (path) => {
              window.fetch = async (asked, how = {}) => {
                if (how.method === 'POST' && String(asked).endsWith(path)) await new Promise((go) => { reply = go; });
                return ask(asked, how);
              };
            };
            const tell = async (changed) => {
              await until(() => reply);
              const before = window.asked.length;
              window.answers['/panels/P-0001'] = {...panel, zones: [strip(1, 0), strip(2, 120)], ...changed};
              socket.onmessage({data: JSON.stringify({type: 'panel', seq: 1})});
              await until(() => { draw(); return window.asked.slice(before).some((one) => one.path.endsWith('/panels/P-0001')); });
              await settled(); await settled(); draw();
            };
            """

    def test_news_of_an_outline_that_is_being_kept_is_no_news_to_who_keeps_it(self):
        told = self.outlined("const drawn = {panel: 'P-0001', zone: 3, zones: [strip(1, 0), strip(2, 120), strip(3, 60, 2)]}; answer({'/panels/P-0001/zones': drawn});" + self.TOLD_BEFORE_ANSWERED + self.THREE_CORNERS + """
            hold('/zones');
            one('#outline-keep').click();
            await tell({zones: drawn.zones});
            const read = main.querySelectorAll('#outline-zone option').length, meanwhile = [one('#outline-strips'), one('#outline-fits')].map(Boolean);
            reply();
            await until(() => { draw(); return one('#outline-kept'); });
            return {read, meanwhile, after: [Boolean(one('#outline-strips')), outlining()]}""")
        self.assertEqual(told, {"read": 4, "meanwhile": [False, False], "after": [False, True]})

    def test_an_outline_that_is_refused_after_the_panel_is_another_one_asks_for_a_look(self):
        told = self.outlined(self.TOLD_BEFORE_ANSWERED + self.THREE_CORNERS + """
            hold('/zones');
            one('#outline-keep').click();
            await tell({zones: [strip(1, 0), strip(2, 120, 2)]});
            const meanwhile = Boolean(one('#outline-strips'));
            reply();
            await until(() => { draw(); return one('#outline-fault'); });
            return [meanwhile, Boolean(one('#outline-strips')), outlining(), one('#outline-fits').disabled]""", refused="'it came too late'")
        self.assertEqual(told, [False, True, False, False], "somebody else drew")

    def test_the_map_is_in_the_outlines_hand_again_once_the_strokes_are_this_hands(self):
        told = self.outlined(self.TOLD_BEFORE_ANSWERED + self.THREE_CORNERS + """
            answer({'/panels/P-0001/mask-edits': {panel: 'P-0001', version: 3, number: 1}});
            await press('#brush');
            key(' ');
            hold('/mask-edits');
            one('#brush-save').click();
            await press('#outline');
            await tell({mask_version: 3});
            reply();
            await until(() => { draw(); return one('#brush-undo') === null; });
            key('ArrowDown'); key(' ');
            return [Boolean(one('#outline-mask')), outlining(), said()]""")
        self.assertEqual(told[:2], [False, True])
        self.assertRegex(told[2], r"4 corners are set\.$")

    def test_the_outline_of_a_strip_that_is_gone_becomes_no_other_one(self):
        told = self.outlined("""
            await press('#outline');
            type('#outline-zone', '2'); draw();
            key(' '); key('ArrowRight'); key(' '); key('ArrowUp'); key(' ');
            window.answers['/panels/P-0001'] = {...panel, zones: [strip(1, 0)]};
            model.panels = model.panels.map((known) => ({...known, free_mm2: 1}));
            await until(() => { draw(); return one('#outline-zone').innerText.includes('gone') || one('#outline-keep').innerText.includes('further'); });
            const gone = [one('#outline-zone').value, one('#outline-keep').innerText, one('#outline-keep').disabled, one('#outline-gone').innerText];
            type('#outline-zone', '0'); draw();
            return [...gone, one('#outline-keep').disabled, one('#outline-gone') === null]""")
        self.assertEqual(told, ["2", "Make this the outline of strip 2", True, "▲ Strip 2 is gone from this panel: choose another one, or a further strip.", False, True])

    def test_an_outline_is_dropped_and_put_away(self):
        told = self.outlined("""
            await press('#outline');
            const box = one('.map').getBoundingClientRect();
            tap(box.width / 2, box.height / 2); tap(box.width / 2 + 1, box.height / 2);
            const twice = said();
            key('ArrowRight'); key(' ');
            const two = said();
            await press('#outline-drop');
            const dropped = [one('#outline-drop').disabled, one('#outline-undo').disabled];
            key('Escape');
            return {twice, two, dropped, away: [one('#outline').getAttribute('aria-pressed'), one('.map').classList.contains('outlining')]}""")
        self.assertRegex(told["twice"], r"1 corner is set, three are needed\.$", "a tap that came twice is one corner")
        self.assertRegex(told["two"], r"2 corners are set\.$")
        self.assertEqual((told["dropped"], told["away"]), ([True, True], ["false", False]))

    def test_a_panel_that_is_retired_takes_the_outline_from_the_hand(self):
        told = self.outlined("""
            await press('#outline');
            const drawing = one('.map').classList.contains('outlining');
            window.answers['/panels/P-0001'] = {...panel, zones: [strip(1, 0)], retired: {reason: 'lent'}};
            model.panels = model.panels.map((known) => ({...known, free_mm2: 1}));
            await until(() => { draw(); return !one('#outline'); });
            return [drawing, one('.map').classList.contains('outlining')]""")
        self.assertEqual(told, [True, False])

    def test_brush_and_outline_take_turns(self):
        told = self.outlined("""
            const hands = () => ['#brush', '#outline'].map((css) => one(css).getAttribute('aria-pressed'));
            await press('#outline');
            const first = hands();
            await press('#brush');
            const second = [hands(), one('.map').classList.contains('painting'), one('.map').classList.contains('outlining')];
            await press('#outline');
            return [first, second, hands(), one('.map').classList.contains('painting')]""")
        self.assertEqual(told, [["false", "true"], [["true", "false"], True, False], ["false", "true"], False])

    def test_its_scans_are_asked_for_once_somebody_looks_and_what_fails_is_said(self):
        told = self.steps("""
            const path = '/panels/P-0001/registration', asked = () => window.asked.filter((one) => one.path.includes(path)).length;
            const one = {id: 1, face: 'show', device: 'x', sha256: '', dpi: 300, taken: at, rms_mm: .0123, max_mm: .05, lattice: null}, card = () => main.querySelector('[data-key="fit-P-0001"]');
            let socket;
            window.WebSocket = class { constructor() { socket = this; } };
            const scans = (told) => { answer({[path]: told}); if (socket) socket.onmessage({data: JSON.stringify({type: 'panel', seq: 1})}); };
            const fault = {error: {message: 'the disk is gone'}};
            answer({'/session': {role: 'admin', who: 'anna', user: 'anna', accounts: true, expires_at: at}});
            (await load('model.js')).begin();
            await until(() => socket && socket.onmessage);
            scans(fault);
            draw = () => { now(); put(main, ...[screen.draw(...rest)].flat()); return main; };  // nothing is unfolded
            await enter('panels', 'P-0001');
            for (const open of main.querySelectorAll('details[open]')) open.open = false;
            await until(() => draw() && card());
            await settled();
            const before = asked();
            screen.enter(...rest);
            await until(() => draw() && card());
            await settled(); draw();
            const unasked = asked() - before;
            card().open = true;
            await until(() => draw() && card().innerText.includes('The disk is gone.'));
            scans({scans: [one], next: null});
            await until(() => draw() && card().innerText.includes('0.012 mm'));
            const well = card().innerText.includes('The disk is gone.');
            scans({scans: [one, {...one, id: 2}], next: null});
            await until(() => draw() && card().innerText.includes('Scan 2'));
            scans(fault);
            await until(() => draw() && card().innerText.includes('The disk is gone.'));
            return {unasked, well, kept: card().innerText.includes('Scan 2')}""")
        self.assertEqual(told, {"unasked": 0, "well": False, "kept": True})

    def test_a_panel_is_scanned_again_from_its_page(self):
        told = self.steps("""
            answer({'/panels/P-0002': {...panel, id: 'P-0002'}, '/scans': {task: 21}});
            await enter('panels', 'P-0002');
            const way = main.querySelector('#scan-again').getAttribute('href');
            await enter('scan', ...way.slice(1).split('/').slice(1));
            await until(() => !draw().querySelector('#do-scan').disabled);
            const field = main.querySelectorAll('select')[1].value, ticked = [];
            main.querySelector('#scan-retag').click(); draw();
            for (const state of ['failed', 'done', 'done']) {
              await press('#do-scan');
              model.tasks.set(21, {id: 21, kind: 'scan', state, progress: 1, text: '', result: state === 'done' ? {panel: 'P-0002', face: 'show'} : undefined});
              await until(() => !draw().querySelector('#do-scan').disabled);
              ticked.push(main.querySelector('#scan-retag').checked);
              model.tasks.delete(21);
              draw();
            }
            return [way, field, ticked, sent('/scans')]""")
        with_tags = {"face": "show", "more": False, "panel": "P-0002", "retag": True}
        self.assertEqual(told, ["#scan/P-0002", "P-0002", [True, False, False], [with_tags, with_tags, {"face": "show", "more": False, "panel": "P-0002"}]],
                         "new tags are asked for until a scan has them")

    def decided_elsewhere(self, verdict):
        """A scan with new tags was proposed; somebody decides on it with another program, of which a task tells."""
        return self.steps("""
            answer({'/proposals/4': {number: 4, decided: null}, '/scans': {task: 21}});
            const isTicked = () => draw().querySelector('#scan-retag').checked, asked = () => window.asked.filter(({path}) => path.endsWith('/proposals')).length;
            await enter('scan', 'P-0001');
            await until(() => !draw().querySelector('#do-scan').disabled);
            main.querySelector('#scan-retag').click(); draw();
            await press('#do-scan');
            model.tasks.set(21, {id: 21, kind: 'scan', state: 'done', progress: 1, text: '', result: {proposal: 4, panel: 'P-0001', face: 'show'}});
            await until(() => draw().querySelector('#accept-4'));
            const before = isTicked();
            window.answers['/proposals'].proposals = [];
            window.answers['/proposals/4'].decided = {verdict: '%s'};
            model.tasks.set(35, {id: 35, kind: 'accept', state: 'done', progress: 1, text: '', result: {}});
            await until(() => !draw().querySelector('#accept-4'));
            await until(() => window.asked.some(({path}) => path.endsWith('/proposals/4')));
            await settled();
            return [before, isTicked()]""" % verdict)

    def test_what_was_accepted_elsewhere_takes_its_tick_along(self):
        self.assertEqual(self.decided_elsewhere("accepted"), [True, False])

    def test_what_was_refused_elsewhere_leaves_its_tick(self):
        self.assertEqual(self.decided_elsewhere("refused"), [True, True], "the next scan of it has new tags too")

    def test_what_the_cell_knows_no_more_is_asked_for_once(self):
        seen = self.steps('''
            const tell = window.fetch, later = window.setTimeout, never = window.clearTimeout, waits = new Map();
            window.fetch = async (path, how) => { const told = await tell(path, how); return String(path).endsWith('/proposals/4') ? {ok: false, status: 404, json: async () => ({error: {message: 'there is no proposal 4'}})} : told; };
            answer({'/scans': {task: 21}});
            const asked = () => window.asked.filter(({path}) => path.endsWith('/proposals/4')).length;
            await enter('scan', 'P-0001');
            await until(() => !draw().querySelector('#do-scan').disabled);
            main.querySelector('#scan-retag').click(); draw();
            await press('#do-scan');
            model.tasks.set(21, {id: 21, kind: 'scan', state: 'done', progress: 1, text: '', result: {proposal: 4, panel: 'P-0001', face: 'show'}});
            await until(() => draw().querySelector('#accept-4'));
            window.setTimeout = (act, ms) => { const id = later(act, ms); waits.set(id, ms); return id; };
            window.clearTimeout = (id) => { waits.delete(id); never(id); };
            window.answers['/proposals'].proposals = [];
            model.tasks.set(35, {id: 35, kind: 'accept', state: 'done', progress: 1, text: '', result: {}});
            await until(() => { draw(); return asked(); });
            await settled();
            return [asked(), [...waits.values()].filter((ms) => ms === 5000)]''')
        self.assertEqual(seen, [1, []])

    def test_new_tags_are_asked_for_until_what_a_scan_proposed_is_in_stock(self):
        told = self.steps("""
            answer({'/proposals/4/accept': {task: 22}, '/proposals/4/picture': {}, '/scans': {task: 21}});
            window.answers['/proposals'].proposals[0].warnings = [];
            const isTicked = () => draw().querySelector('#scan-retag').checked, over = (id, state, result) => { model.tasks.set(id, {id, kind: 'scan', state, progress: 1, text: '', ...(result && {result})}); return isTicked(); };
            const accept = async () => { main.querySelector('#accept-4').click(); await settled(); await settled(); return isTicked(); };
            await enter('scan', 'P-0001');
            await until(() => !draw().querySelector('#do-scan').disabled);
            main.querySelector('#scan-retag').click(); draw();
            await press('#do-scan');
            const proposed = [over(21, 'done'), over(21, 'done', {proposal: 4, panel: 'P-0001', face: 'show'})];
            const path = '/proposals/4/picture.png', dot = document.createElement('canvas');
            await until(() => draw().querySelector('#accept-4'));
            Object.assign(main.querySelector(`img[data-picture="${path}"]`), {came_: path, hidden: false, src: dot.toDataURL()});
            await until(() => !draw().querySelector('#accept-4').disabled);
            const accepted = [await accept(), over(22, 'failed'), await accept(), over(22, 'done', {panel: 'P-0001', face: 'show'})];
            return {proposed, accepted, sent: sent('/scans').length, taken: sent('/accept').length}""")
        self.assertEqual(told, {"proposed": [True, True], "accepted": [True, True, True, False], "sent": 1, "taken": 2})

    def test_a_panel_that_was_gone_to_is_not_replaced_by_an_open_series(self):
        told = self.steps("""
            const open = {open_scan: {tiles: 1, panel: 'P-0002', face: 'show', retag: false}};
            screen = await load('screens/scan.js');
            rest = ['P-0001'];
            now(open);
            screen.enter(...rest);
            draw(open);
            return [main.querySelectorAll('select')[1].value, main.querySelector('#scan-other') !== null, main.querySelector('#do-scan').disabled]""")
        self.assertEqual(told, ["P-0001", True, True])

    def test_new_tags_are_asked_about_of_a_face_that_was_scanned(self):
        told = self.steps("""
            model.panels[1].faces = ['show'];
            await enter('scan', 'P-0002');
            await until(() => !draw().querySelector('#do-scan').disabled);
            main.querySelector('#scan-retag').click(); draw();
            type('select', 'back'); draw();
            const back = main.querySelector('#scan-retag');
            await press('#do-scan');
            const unknown = sent('/scans')[0];
            type('select', 'show'); draw({open_scan: {tiles: 1, panel: 'P-0002', face: 'show', retag: true}});
            const series = main.querySelector('#scan-retag').checked;
            draw();
            return {back, unknown, series, over: main.querySelector('#scan-retag').checked}""")
        self.assertEqual(told, {"back": None, "unknown": {"face": "back", "more": False, "panel": "P-0002"}, "series": True, "over": False})

    def test_a_tile_of_a_refused_series_is_scanned_again(self):
        told = self.steps("""
            const kept = (tiles) => ({kept_scan: {tiles, since: at}});
            await enter('scan', 'P-0001');
            draw(kept(3));
            await until(() => !draw(kept(3)).querySelector('#scan-again-tile').disabled);
            const last = main.querySelector('#scan-again-tile').innerText.split('\\n')[0];
            type('[data-key=kept] select', '2'); draw(kept(3));
            draw(kept(2));
            const atOnce = main.querySelector('#scan-again-tile').disabled;
            await until(() => !draw(kept(2)).querySelector('#scan-again-tile').disabled);
            now(kept(4));
            main.querySelector('#scan-again-tile').click();
            const other = sent('/scans').length;
            now(kept(2));
            main.querySelector('#scan-again-tile').click();
            await until(() => sent('/scans').length);
            return [last, atOnce, other, sent('/scans')]""")
        self.assertEqual(told, ["Scan tile 3 again", True, 0, [{"again": 2}]])

    def test_which_tile_was_chosen_is_of_its_series_only(self):
        told = self.steps("""
            const label = (since) => draw({kept_scan: {tiles: 3, since}}).querySelector('#scan-again-tile').innerText.split('\\n')[0];
            await enter('scan', 'P-0001');
            label(at);
            type('[data-key=kept] select', '1');
            return [label(at), label('2026-05-02T07:30:00Z'), label(at)]""")
        self.assertEqual(told, ["Scan tile 1 again", "Scan tile 3 again", "Scan tile 3 again"])

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

    def burns(self, script, laser="{}", confirm="['exhaust']", role="admin"):
        """Settings with its cards of what the laser burns alone; each burn there is task 12."""
        return self.steps("""
            model.panels = [];
            answer({'/laser/test-pattern': {task: 12}, '/laser/test-card': {task: 12}, '/tasks/12': {}});
            const fresh = {laser: {...about_all.laser, ...%s}, confirm: %s}, drawn = draw;
            draw = (more = {}) => drawn({...fresh, ...more});
            model.role = '%s';
            await enter('settings');
            await until(() => draw().querySelector('#pattern-burn'));
            const card = (of = 'pattern') => main.querySelector(`#${of}-burn`).closest('section').innerText;
            const tick = (of) => { main.querySelector(`[data-key=confirm-${of}] input`).click(); draw(); };
            const moving = (of) => { const seen = {}; for (const state of ['Resetting', 'Execute', 'Holding', 'Held', 'Unholding']) { draw({state}); seen[state] = [main.querySelector(`#${of}-cancel`) !== null, main.querySelector('#burns-runs')?.innerText || '']; } return seen; };
            """ % (laser, confirm, role) + script)

    def only_stop_ends(self, seen):
        self.assertEqual(seen.pop("Resetting"), [True, ""])
        for state, told in seen.items():
            with self.subTest(state):
                self.assertEqual(told, [False, "▲ What moves now is ended by STOP; Hold makes it pause."])

    def test_the_test_pattern_burns_what_was_seen_to(self):
        told = self.burns("""
            const shut = [main.querySelector('#pattern-burn').disabled, main.querySelector('#pattern-dry').disabled];
            type('#pattern-size', '9,9'); draw();
            const none = main.querySelector('#pattern-dry').disabled;
            type('#pattern-size', '20,5'); draw();
            tick('pattern');
            const before = main.querySelector('#pattern-burn').disabled;
            main.querySelector('#pattern-burn').click();
            await until(() => sent('/test-pattern').length);
            await until(() => draw().querySelector('#pattern-cancel'));
            main.querySelector('#pattern-cancel').click();
            await until(() => window.asked.some(({path, method}) => method === 'DELETE' && path.endsWith('/tasks/12')));
            return {shut, none, before, sent: sent('/test-pattern'), left: draw().querySelector('[data-key=confirm-pattern] input').checked}""")
        self.assertEqual(told, {"shut": [True, False], "none": True, "before": False, "sent": [{"size_mm": 20.5, "dry": False, "confirmed": ["exhaust"]}], "left": False})

    def test_the_test_card_burns_what_was_seen_to(self):
        told = self.burns("""
            const shut = main.querySelector('#card-burn').disabled;
            type('#card-operation', 'engrave'); draw();
            tick('card');
            main.querySelector('#card-burn').click();
            await until(() => sent('/laser/test-card').length);
            await until(() => draw().querySelector('#card-cancel'));
            return {shut, sent: sent('/laser/test-card'), questions, other: main.querySelector('#pattern-dry').disabled}""")
        self.assertEqual(told, {"shut": True, "sent": [{"operation": "engrave", "dry": False, "confirmed": ["exhaust"]}], "questions": [], "other": True})

    def test_strokes_are_ended_by_stop_and_not_by_giving_up(self):
        for of in ("pattern", "card"):
            self.speak("en")
            before, seen = self.burns(f"""
                const before = main.querySelector('#burns-runs');
                tick('{of}');
                main.querySelector('#{of}-burn').click();
                await until(() => draw().querySelector('#{of}-cancel'));
                return [before, moving('{of}')]""")
            self.assertEqual(before, None)
            self.only_stop_ends(seen)

    def test_what_was_begun_before_the_page_was_opened_is_told_too(self):
        for of, kind in (("pattern", "laser test-pattern"), ("card", "test card")):
            self.speak("en")
            told = self.burns(f"""
                fresh.tasks = [{{id: 12, kind: '{kind}', state: 'running', progress: .3, text: 'getting ready'}}];
                draw();
                const shut = ['#pattern-dry', '#card-dry'].map((one) => main.querySelector(one).disabled), row = text();
                main.querySelector('#{of}-cancel').click();
                await until(() => window.asked.some(({{path, method}}) => method === 'DELETE' && path.endsWith('/tasks/12')));
                return {{shut, row: row.split('getting ready').length, seen: moving('{of}')}}""")
            self.assertEqual((told["shut"], told["row"]), ([True, True], 2), "once")
            self.only_stop_ends(told["seen"])
        self.speak("en")
        told = self.burns("""
            fresh.tasks = [{id: 12, kind: 'laser run', state: 'running', progress: .3, text: 'layer 2'}];
            draw({state: 'Execute'});
            const now = main.querySelector('[data-key=burns]');
            return [['#pattern-dry', '#card-dry'].map((one) => main.querySelector(one).disabled), now.innerText.split('\\n').filter(Boolean), now.nextElementSibling.contains(main.querySelector('#card-dry'))]""")
        self.assertEqual(told, [[True, True], ["▲ What moves now is ended by STOP; Hold makes it pause.", "layer 2"], True])

    def test_where_nothing_is_asked_by_name_a_question_stands_before_the_burn(self):
        for of, body in (("pattern", {"size_mm": 50}), ("card", {"operation": "cut"})):
            self.speak("en")
            with self.subTest(of):
                told = self.burns(f"""
                    const burn = () => main.querySelector('#{of}-burn');
                    const go = async (word) => {{ says(word); burn().click(); await settled(); await settled(); draw(); return sent('/laser/test-{of}').length; }};
                    return [await go(false), await go(true), sent('/laser/test-{of}'), questions.length, (questions[0] || '').startsWith('Burn the ')]""", confirm="[]")
                self.assertEqual(told, [0, 1, [{**body, "dry": False, "confirmed": []}], 2, True])

    def test_where_the_pattern_is_burnt_and_that_the_head_moves(self):
        seen = "return [card(), ...['#pattern-dry', '#pattern-burn'].map((one) => main.querySelector(one).innerText)]"
        about, dry, burn = self.burns(seen)
        self.assertIn("On scrap wood, in the middle of the bed.", about)
        self.assertEqual((dry, burn), ("Run the pattern dark\nhomes the laser first; stay beside the machine", "Burn the pattern\nhomes the laser first; stay beside the machine"))
        about, dry, burn = self.burns(seen, laser="{finds_home: false}")
        self.assertIn("from the lower left corner that the laser was shown.", about)
        self.assertEqual((dry, burn), ("Run the pattern dark\nthe head moves; stay beside the machine", "Burn the pattern\nthe head moves; stay beside the machine"))
        self.speak("de")
        self.addCleanup(self.speak, "en")
        about, dry, burn = self.burns(seen)
        self.assertIn("In Abfallholz, in der Mitte des Betts.", about)
        self.assertTrue(dry.startswith("Das Muster dunkel abfahren\nfährt zuerst auf Referenz"), dry)

    def test_a_dark_run_of_the_pattern(self):
        told = self.burns("""
            await press('#pattern-dry');
            await until(() => sent('/test-pattern').length);
            model.tasks.set(12, {id: 12, state: 'done', result: {dry: true}});
            await until(() => draw().innerText.includes('with the beam off'));
            return [sent('/test-pattern'), card().includes('is burnt.'), questions.length]""")
        self.assertEqual(told, [[{"size_mm": 50, "dry": True}], False, 0])

    def test_a_dark_run_of_the_card(self):
        for language, dark, burnt in (("en", "with the beam off", "card is done"), ("de", "ohne Strahl", "Karte ist fertig")):
            self.speak(language)
            self.addCleanup(self.speak, "en")
            told = self.burns(f"""
                await press('#card-dry');
                await until(() => sent('/laser/test-card').length);
                model.tasks.set(12, {{id: 12, state: 'done', result: {{dry: true, strokes: 9}}}});
                await until(() => draw().querySelector('#card-dry').disabled === false);
                return [sent('/laser/test-card'), card('card').includes('{dark}'), card('card').includes('{burnt}'), questions.length]""")
            self.assertEqual(told, [[{"operation": "cut", "dry": True}], True, False, 0])

    def draws(self, script, confirm="['exhaust']", role="admin", travel="{min_mm: [0, 0], max_mm: [300, 200]}"):
        """Settings with a drawing of two kinds of line, of which nothing says how the second is burnt until it is typed; its burns are task 12."""
        return self.burns("""
            answer({'/laser/run': {task: 12}});
            const kinds = [{layer: 'cut', colour: '#ff0000', lines: 1, length_mm: 40, power: .85, speed_mm_s: 15, passes: 1, air: false}, {layer: '', colour: '#0000ff', lines: 2, length_mm: 20, power: null, speed_mm_s: null, passes: 1, air: false}];
            const lines = {page_mm: [100, 80], warnings: ['the page has no size'], length_mm: 60, kind_of_stroke: [0, 1, 1], strokes: [3, 2, 2], points_mm: [10, 10, 40, 10, 40, 20, 10, 60, 20, 60, 20, 60, 30, 60], travel: %s};
            const ofCell = window.fetch, queries = [];
            window.headers = [];
            // As the daemon reads it: what is asked of the query is what it would be burnt with.
            let refuse = '';
            window.fetch = async (path, how = {}) => {
              if (String(path).includes('/laser/run')) window.headers.push(how.headers['Idempotency-Key']);
              if (!String(path).includes('/laser/drawing')) return ofCell(path, how);
              const query = new URL(path, location.href).searchParams, list = (name) => (query.has(name) ? query.get(name).split(',').map((one) => (one === '' ? null : Number(one))) : [null, null]);
              queries.push({...Object.fromEntries(query), bytes: how.body.size});
              await window.reading;
              if (refuse) return {ok: false, status: 400, json: async () => ({error: {message: refuse}})};
              const [x, y] = query.has('x_mm') ? [Number(query.get('x_mm')), Number(query.get('y_mm'))] : [10, 10];
              const told = kinds.map((kind, n) => ({...kind, power: list('powers')[n] ?? kind.power, speed_mm_s: list('speeds_mm_s')[n] ?? kind.speed_mm_s, passes: list('passes')[n] ?? 1, air: list('air')[n] === 1}));
              const whole = told.every(({power, speed_mm_s}) => power !== null && speed_mm_s !== null), each = (of) => lines.kind_of_stroke.map((n) => of(told[n]));
              const reply = {...lines, kinds: told, extent: {min_mm: [x, y], max_mm: [x + 30, y + 50]}, fits: lines.travel ? x + 30 <= 300 : null, burning_s: whole ? 90 : null,
                             settings: whole ? {speeds_mm_s: each((one) => one.speed_mm_s), powers: each((one) => one.power), passes: each((one) => one.passes), air: each(({air}) => (air ? 1 : 0))} : null};
              return {ok: true, status: 200, json: async () => reply};
            };
            await until(() => draw().querySelector('#drawing-file'));
            const open = (name = 'a.svg') => { const files = new DataTransfer(), input = main.querySelector('#drawing-file'); files.items.add(new File(['<svg/>'], name)); input.files = files.files; input.dispatchEvent(new Event('change')); };
            const shut = (of) => draw().querySelector(`#drawing-${of}`).disabled;
            const typed = async (fields) => { const before = queries.length; for (const [id, text] of Object.entries(fields)) type(`#drawing-${id}`, text); await until(() => queries.length > before); await settled(); await settled(); draw(); };
            const told = async () => { open(); await until(() => draw().querySelector('#drawing-power-1')); await until(() => queries.length > 1); await settled(); await settled(); draw(); };
            const whole = async () => { await told(); await typed({'power-1': '30', 'speed_mm_s-1': '40'}); };
            const {askStatus} = await load('model.js');
            const status = async (more = {}) => { Object.assign(fresh, more); draw(); await askStatus(); draw(); };
            // As the daemon goes through it: it is Complete after its task is over, and so at rest.
            const ends = async (result) => {
              await status({state: 'Execute'});
              model.tasks.set(12, {id: 12, state: 'done', result});
              await until(() => { draw(); return !main.querySelector('#drawing-cancel') && !main.querySelector('.task[role=status]'); });
              model.tasks.delete(12);
              await status({state: 'Completing'});
              window.coming = shut('burn');
              await status({state: 'Complete'});
            };
            const trace = async () => { const n = sent('/laser/run').length; main.querySelector('#drawing-dry').click(); await until(() => sent('/laser/run').length > n); await ends({dry: true}); };
            """ % travel + script, confirm=confirm, role=role)

    STROKES = {"points_mm": [10, 10, 40, 10, 40, 20, 10, 60, 20, 60, 20, 60, 30, 60], "strokes": [3, 2, 2], "speeds_mm_s": [15, 40, 40], "powers": [.85, .3, .3], "passes": [1, 1, 1], "air": [0, 0, 0]}

    def test_a_drawing_is_burnt_once_it_was_traced_and_what_is_asked_by_name_was_seen_to(self):
        told = self.draws("""
            await whole();
            const before = [shut('dry'), shut('burn')];
            tick('drawing');
            const unseen = shut('burn');
            await trace();
            const traced = [shut('burn'), main.querySelector('[data-key=confirm-drawing] input').checked];
            tick('drawing');
            const may = shut('burn');
            const button = main.querySelector('#drawing-burn');
            button.click(); button.click();
            await until(() => sent('/laser/run').length > 1);
            draw();
            const during = shut('burn');
            await ends({dry: false});
            tick('drawing');
            return {before, unseen, traced, may, during, after: shut('burn'), sent: sent('/laser/run'), keys: new Set(window.headers).size, done: card('drawing').includes('The drawing is burnt.'), questions}""")
        self.assertEqual(told, {"before": [False, True], "unseen": True, "traced": [True, False], "may": False, "during": True, "after": True, "keys": 2, "done": True, "questions": [],
                                "sent": [{**self.STROKES, "dry": True}, {**self.STROKES, "dry": False, "confirmed": ["exhaust"]}]})

    def test_where_nothing_is_asked_by_name_a_question_stands_before_a_drawing_is_burnt(self):
        told = self.draws("""
            await whole();
            await trace();
            const go = async (word) => { says(word); main.querySelector('#drawing-burn').click(); await settled(); await settled(); draw(); return sent('/laser/run').length; };
            return [await go(false), await go(true), questions.length, questions[0].startsWith('Burn the drawing now?')]""", confirm="[]")
        self.assertEqual(told, [1, 2, 2, True])

    def test_a_line_of_which_nobody_says_how_it_is_burnt_shuts_the_drawing(self):
        told = self.draws("""
            await told();
            const first = [shut('dry'), shut('burn'), card('drawing').includes('Nothing says how these are burnt')];
            await typed({'power-1': '30'});
            const half = [shut('dry'), card('drawing').includes('Nothing says how these are burnt')];
            await typed({'speed_mm_s-1': '40'});
            const both = [shut('dry'), card('drawing').includes('Nothing says how these are burnt')];
            return {first, half, both, asked: queries.at(-1)}""")
        self.assertEqual(told, {"first": [True, True, True], "half": [True, True], "both": [False, False],
                                "asked": {"powers": "0.85,0.3", "speeds_mm_s": "15,40", "passes": "1,1", "air": "0,0", "bytes": 6}})

    def test_who_types_goes_on_typing_while_a_drawing_is_read(self):
        told = self.draws("""
            await whole();
            const x = main.querySelector('#drawing-x'), picture = main.querySelector('#drawing-picture'), before = queries.length;
            let goOn;
            window.reading = new Promise((go) => { goOn = go; });
            x.focus();
            type('#drawing-power-1', '40');
            await until(() => queries.length > before && draw() && card('drawing').includes('is read'));
            const during = document.activeElement === x;
            goOn();
            await until(() => draw() && !card('drawing').includes('is read'));
            return {during, after: document.activeElement === x, stays: main.querySelector('#drawing-x') === x && main.querySelector('#drawing-picture') === picture}""", travel="null")
        self.assertEqual(told, {"during": True, "after": True, "stays": True})

    def test_a_drawing_that_became_another_is_traced_anew(self):
        told = self.draws("""
            const after = async (change) => { await trace(); const may = !shut('burn'); await change(); return [may, shut('burn')]; };
            await whole();
            const moved = await after(() => typed({x: '20', y: '30'}));
            const hotter = await after(() => typed({'power-1': '60'}));
            const typing = await after(async () => { type('#drawing-power-1', '6'); draw(); });
            await until(() => queries.at(-1).powers === '0.85,0.06'); await settled(); await settled(); draw();
            const aborted = await after(async () => { await status({state: 'Aborted'}); });
            const other = await after(async () => { open('b.svg'); draw(); });
            return {moved, hotter, typing, aborted, other}""", confirm="[]")
        self.assertEqual(told, {one: [True, True] for one in ("moved", "hotter", "typing", "aborted", "other")})

    def ages(self, change, more="", keep=False):
        """Whether a traced drawing may be burnt: while the cell comes to rest, after three statuses alike, and after the change."""
        told = self.draws("""
            await whole();
            %s
            await trace();
            const coming = window.coming;
            for (let n = 0; n < 3; ++n) await status({lid: 'closed'});
            const still = shut('burn');
            %s
            return [coming, still, shut('burn'), card('drawing').includes('Trace it without the beam first')]""" % (more, change), confirm="[]")
        self.assertEqual(told, [True, False, not keep, not keep])

    def test_a_drawing_is_traced_anew_after_the_lid_was_open(self):
        self.ages("await status({lid: 'open'}); await status({lid: 'closed'});")

    def test_a_drawing_is_traced_anew_when_the_lid_was_open_under_it(self):
        told = self.draws("""
            await whole();
            main.querySelector('#drawing-dry').click(); await until(() => sent('/laser/run').length);
            await status({lid: 'open'}); await status({lid: 'closed'});
            await ends({dry: true});
            return shut('burn')""", confirm="[]")
        self.assertTrue(told)

    def test_a_drawing_is_traced_anew_after_the_head_was_moved(self):
        self.ages("await status({laser: {...fresh.laser, position_mm: [11, 2]}}); await status({laser: {...fresh.laser, position_mm: [1, 2]}});")

    def test_a_drawing_is_traced_anew_after_the_laser_lost_its_place(self):
        self.ages("await status({laser: {...fresh.laser, position_mm: null}}); await status({laser: {...fresh.laser, position_mm: [1, 2]}});")

    def test_a_drawing_is_traced_anew_after_anything_else_ran(self):
        for state in ("Resetting", "Idle", "Execute", "Stopped"):
            with self.subTest(state):
                self.speak("en")
                self.ages(f"await status({{state: '{state}'}}); await status({{state: 'Complete'}});")

    def test_a_drawing_is_traced_anew_after_another_corner(self):
        corner = "says(true); main.querySelector('#do-corner').click(); await until(() => sent('/laser/corner').length); await settled(); draw();"
        told = "await status({laser: {...fresh.laser, finds_home: false, position_mm: [0, 0]}});"
        self.ages(corner, told)
        self.speak("en")
        self.ages("says(false); main.querySelector('#do-corner').click(); await settled(); draw();", told, keep=True)
        self.speak("en")
        self.ages("answer({'/laser/corner': {error: {message: 'it was given up'}}});" + corner, told)

    def test_a_drawing_is_traced_anew_when_nobody_knows_what_was_missed(self):
        self.ages("""
            let socket;
            window.WebSocket = class { constructor() { socket = this; } };
            answer({'/session': {role: 'admin', who: 'anna', user: 'anna', accounts: true, expires_at: at}});
            (await load('model.js')).begin();
            await until(() => socket && socket.onmessage);
            await settled();
            if (shut('burn')) throw new Error('shut before');
            socket.onmessage({data: JSON.stringify({type: 'hello', life: 'b', newest: 4, resumed: false})});
            model.panels = [];
            draw();""")

    def test_a_field_that_was_emptied_is_not_burnt_with_the_recipe(self):
        for field in ("power-0", "speed_mm_s-0"):
            with self.subTest(field):
                self.speak("en")
                told = self.draws("""
                    await whole();
                    await trace();
                    await typed({'%s': ' '});
                    await until(() => queries.at(-1).passes && !main.innerText.includes('the drawing is read'));
                    const untold = main.querySelector('[data-key=drawing-kind-0]').innerText.includes('Nothing says how these are burnt');
                    return [shut('dry'), shut('burn'), untold, main.querySelector('[data-key=drawing-kind-1]').innerText.includes('Nothing says')]""" % field, confirm="[]")
                self.assertEqual(told, [True, True, True, False])

    def test_what_came_of_a_drawing_stands_beside_no_other(self):
        told = self.draws("""
            const says_it = () => { draw(); return ['was traced with', 'is burnt.', 'The lid is open'].map((words) => card('drawing').includes(words)); };
            await whole();
            await trace();
            const mine = says_it();
            await typed({x: '20', y: '30'});
            const moved = says_it();
            main.querySelector('#drawing-dry').click();
            await until(() => sent('/laser/run').length > 1);
            const before = queries.length;
            open('b.svg');
            await until(() => queries.length > before + 1); await settled(); await settled(); draw();
            const during = [shut('dry'), main.querySelector('.task[role=status]') !== null];
            await ends({dry: true});
            const other = says_it();
            await typed({'power-1': '30', 'speed_mm_s-1': '40'});
            answer({'/tasks/12': {id: 12, state: 'failed', error: {message: 'the lid is open'}}});
            main.querySelector('#drawing-dry').click();
            await until(() => says_it()[2]);
            open('c.svg');
            await until(() => { draw(); return main.querySelector('#drawing-name').innerText === 'c.svg'; }); await settled(); await settled();
            return {mine, moved, during, other, failed: says_it()}""", confirm="[]")
        self.assertEqual(told, {"mine": [True, False, False], "moved": [False] * 3, "during": [True, True], "other": [False] * 3, "failed": [False] * 3})

    def test_an_answer_that_was_cut_off_leaves_what_was_shown(self):
        told = self.draws("""
            await whole();
            const ofDrawing = window.fetch, gone = [], revoke = URL.revokeObjectURL;
            URL.revokeObjectURL = (url) => { gone.push(url); revoke.call(URL, url); };
            window.fetch = async (path, how) => { const reply = await ofDrawing(path, how); return String(path).includes('/laser/drawing') ? {...reply, json: async () => { throw new SyntaxError('cut off'); }} : reply; };
            await typed({'power-1': '60'});
            return [shut('dry'), main.querySelector('#drawing-refused').innerText.includes('The cell does not answer. Is veneerd running?'), gone.includes(main.querySelector('#drawing-picture').src)]""")
        self.assertEqual(told, [True, True, False])

    def test_the_file_is_named_and_may_be_chosen_again(self):
        told = self.draws("""
            await whole();
            main.replaceChildren();
            await enter('settings');
            const name = main.querySelector('#drawing-name').innerText, input = main.querySelector('#drawing-file');
            open('a.svg');
            input.addEventListener('click', (event) => event.preventDefault());  // opens nothing here
            const held = input.files.length;
            input.click();
            return [name, held, input.files.length, main.querySelector('#drawing-name').innerText]""")
        self.assertEqual(told, ["a.svg", 1, 0, "a.svg"])

    def test_a_file_that_was_saved_anew_is_to_be_chosen_again(self):
        for language, words in (("en", "a.svg cannot be read any more"), ("de", "a.svg lässt sich nicht mehr lesen")):
            self.speak(language)
            self.addCleanup(self.speak, "en")
            told = self.draws("""
                await whole();
                const ofDrawing = window.fetch, silent = async (path, how) => { if (String(path).includes('/laser/drawing')) { queries.push({}); throw new TypeError('Failed to fetch'); } return ofDrawing(path, how); };
                window.fetch = silent;
                await typed({'power-1': '60'});
                const there = main.querySelector('#drawing-refused').innerText;
                Blob.prototype.arrayBuffer = async () => { throw new DOMException('', 'NotReadableError'); };
                await typed({'power-1': '70'});
                return [there.includes('Is veneerd running?'), main.querySelector('#drawing-refused').innerText, main.querySelectorAll('#drawing-refused button').length, shut('dry')]""")
            self.assertEqual([told[0], told[1].startswith("▲ " + words), told[2], told[3]], [True, True, 0, True], told)

    def test_a_drawing_that_leaves_the_bed_or_cannot_be_read_is_told_and_shut(self):
        told = self.draws("""
            await whole();
            await typed({x: '290', y: '30'});
            const outside = [shut('dry'), main.querySelector('#drawing-outside') !== null, card('drawing').includes('x 290.0 to 320.0 mm, y 30.0 to 80.0 mm (30.0 × 50.0 mm)')];
            type('#drawing-y', ''); draw();
            const half = [shut('dry'), card('drawing').includes('Lower edge of the lines, mm')];
            refuse = 'the drawing has a text: make paths of it';
            await typed({y: '40'});
            return {outside, half, refused: [shut('dry'), main.querySelector('#drawing-refused').innerText.includes('The drawing has a text: make paths of it.')], fields: main.querySelector('#drawing-x') !== null}""")
        self.assertEqual(told, {"outside": [True, True, True], "half": [True, True], "refused": [True, True], "fields": True})

    def test_the_lines_are_shown_over_the_bed_and_what_is_not_known_is_said(self):
        told = self.draws("""
            await whole();
            const image = main.querySelector('#drawing-picture'), svg = await (await ofFetch(image.src)).text();
            return [svg.includes('M10 10L40 10L40 20'), svg.includes('stroke="#0000ff"'), svg.includes('width="300" height="200"'), image.alt.includes('x 10.0 to 40.0 mm'), card('drawing').includes('60 mm, about 2 min'), card('drawing').includes('The page has no size.')]""".replace("ofFetch", "window.realFetch"))
        self.assertEqual(told, [True] * 6)
        self.speak("en")
        self.assertTrue(self.draws("await whole(); return card('drawing').includes('has not told yet how large its bed is') && !shut('dry')", travel="null"))

    def test_a_viewer_sees_why_no_drawing_is_burnt(self):
        told = self.draws("""
            return [main.querySelector('#drawing-file').disabled, ...['dry', 'burn'].map((one) => [shut(one), main.querySelector(`#drawing-${one}`).innerText.split('\\n')[1]])]""", role="viewer")
        self.assertEqual(told, [True, [True, "needs an operator"], [True, "needs an operator"]])

    def test_a_drawing_that_comes_late_is_of_its_own_operation_only(self):
        told = self.burns("""
            const ask = window.fetch, gone = [], revoke = URL.revokeObjectURL, seen = () => draw().querySelector('img.target')?.src || null;
            URL.revokeObjectURL = (url) => { gone.push(url); revoke.call(URL, url); };
            answer({'/test-card': {svg: '<svg xmlns="http://www.w3.org/2000/svg"/>'}});
            const first = [...main.querySelectorAll('button')].find((one) => one.innerText === 'Show it first');
            first.click();
            const url = await until(seen);
            let reply = null;
            window.fetch = async (path, how) => { if (String(path).includes('/test-card')) await new Promise((go) => { reply = go; }); return ask(path, how); };
            first.click();
            await until(() => reply);
            type('#card-operation', 'engrave');
            const chosen = [seen(), gone.includes(url)];
            reply();
            await settled(); await settled();
            return {chosen, late: seen()}""")
        self.assertEqual(told, {"chosen": [None, True], "late": None})

    def test_a_refused_pattern_is_told_and_a_viewer_burns_none(self):
        told = self.burns("""
            answer({'/laser/test-pattern': {error: {message: 'the lid is open'}}});
            await press('#pattern-dry');
            await until(() => !document.getElementById('refusal').hidden);
            return [document.getElementById('refusal').innerText, draw() && main.querySelector('#pattern-dry').disabled, main.querySelector('#pattern-cancel')]""")
        self.assertEqual(told, ["The lid is open.", False, None])
        self.speak("en")
        told = self.burns("""return ['#pattern-dry', '#pattern-burn'].map((one) => [main.querySelector(one).disabled, main.querySelector(one).innerText.split('\\n')[1]])""", role="viewer")
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

    def test_both_screens_tell_of_one_search_for_scanners(self):
        told = self.steps("""
            answer({'/scanners': {task: 30}, '/devices/found': {lasers: [], pictures: []}});
            await enter('setup', 'devices');
            await until(() => draw().querySelector('#look-devices'));
            main.querySelector('#look-devices').click();
            await until(() => sent('/scanners').length);
            await enter('settings');
            await until(() => draw().querySelector('#find-scanners'));
            const shut = main.querySelector('#find-scanners').disabled;
            model.tasks.set(30, {id: 30, state: 'done', result: {scanners: [{name: 'x:1', make: 'Maker One', problem: ''}]}});
            await until(() => draw().innerText.includes('Maker One'));
            const open = !main.querySelector('#find-scanners').disabled;
            await enter('setup', 'devices');
            return [shut, open, draw().querySelector('input[value="x:1"]') !== null, sent('/scanners').length]""")
        self.assertEqual(told, [True, True, True, 1])

    # A camera that tells all, one without a name that lasts, and one that another program has.
    CAMERAS = """
        const set = (name, least, most) => ({name, kind: 'whole', least, most, step: 1, usual: 0, value: 0, active: true, settable: true, choices: []});
        const sized = (code, width, height) => ({code, width, height, most_width: width, most_height: height, step_width: 1, step_height: 1});
        const webcam = {device: '/dev/v4l/by-id/usb-Cam_4711-video-index0', node: '/dev/video0', name: 'HD Webcam', named_by: 'serial_number', problem: '', formats: [sized('YUYV', 640, 480), sized('H264', 4096, 2160), sized('MJPG', 1920, 1080), sized('YUYV', 1920, 1080)],
          controls: [set('exposure_time_absolute', 3, 2047), set('focus_absolute', 0, 250)]};
        const nameless = {...webcam, device: '', node: '/dev/video2', name: 'Nameless', named_by: null, controls: []};
        const busy = {...webcam, device: '/dev/v4l/by-path/pci-2', name: 'Hidden', named_by: 'socket', problem: 'the camera /dev/video4 may be used by root only: write a rule, then plug it in again', formats: [], controls: []};
        const bare = {...webcam, device: '/dev/v4l/by-path/pci-3', name: 'Bare', named_by: 'socket', controls: []};
        const tried = (trial, settings, more = {}) => ({trial, device: webcam.device, width: 1920, height: 1080, format: 'YUYV', settings, doubts: [], ...more});
        const found = {'/devices/found': {lasers: [], pictures: []}, '/scanners': {scanners: []}, '/cameras': {cameras: [webcam, nameless, busy, bare]}};
        const looks = async (more = {}) => {
          answer(found);
          answer(more);
          await enter('setup', 'devices');
          await until(() => draw().querySelector('#look-devices'));
          window.asked = [];
          await press('#look-devices');
          await until(() => Object.keys(found).every((part) => window.asked.some(({path}) => path.includes(part))));
          await until(() => { draw(); return !main.querySelector('#look-devices').disabled; });
        };
        const camera = () => main.querySelector('[data-device=camera]');
        const mark = (value) => { camera().querySelector(`input[value="${value}"]`).click(); draw(); };
        const take = () => camera().querySelector('#choose-camera');
    """

    def test_cameras_are_listed_in_words(self):
        for language, words in (("en", ["known by its socket", "no name that lasts, so another camera may take its place", "nobody can switch that off", "only if its lens does not move"]),
                                ("de", ["an seiner Buchse erkannt", "keinen Namen, der bleibt, sodass eine andere Kamera", "kann das niemand abschalten", "nur verwenden, wenn sich ihr Objektiv nicht"])):
            self.speak(language)
            self.addCleanup(self.speak, "en")
            told, refused = self.steps(self.CAMERAS + """
                await looks();
                return [camera().innerText, [...camera().querySelectorAll('input[type=radio]')].filter(({disabled}) => disabled).map(({value}) => value)]""")
            for word in ["HD Webcam", "/dev/v4l/by-id/usb-Cam_4711-video-index0 – 1920 × 1080, 640 × 480", "may be used by root only", *words]:
                self.assertIn(word, told)
            self.assertNotIn("4096", told, "a format that cannot be read")
            self.assertEqual(refused, ["/dev/video2", "/dev/v4l/by-path/pci-2"])

    def test_no_camera_is_told_with_what_to_do(self):
        told = self.steps(self.CAMERAS + "await looks({'/cameras': {cameras: []}}); return camera().innerText")
        self.assertIn("No camera was found on this computer. Is its cable in?", told)

    def test_a_camera_is_chosen_by_the_picture_that_was_taken_with_it(self):
        told = self.steps(self.CAMERAS + """
            await looks({'/cameras/trial': tried(7, {exposure_time_absolute: '200', focus_absolute: '35'}, {doubts: ['too_dark']})});
            mark(webcam.device);
            const before = [take().disabled, camera().innerText.includes('Take a picture with it first'), [...camera().querySelectorAll('#trial-size option')].map(({value}) => value)];
            await press('#try-camera');
            await until(() => draw().querySelector('[data-key="trial-7"]'));
            const shown = [sent('/cameras/trial'), camera().querySelector('img').dataset.picture, main.querySelector('#trial-exposure_time_absolute').value, camera().querySelector('[data-doubt]').innerText, take().disabled, main.querySelector('#try-figures') === null];
            type('#trial-exposure_time_absolute', '2100'); draw();
            const wrong = [take().disabled, main.querySelector('#try-figures').disabled, camera().querySelector('.number-fault').innerText];
            type('#trial-exposure_time_absolute', '300'); draw();
            const other = [take().disabled, camera().innerText.includes('not those of the picture'), main.querySelector('#try-figures').disabled];
            answer({'/cameras/trial': tried(8, {exposure_time_absolute: '300', focus_absolute: '35'})});
            await press('#try-figures');
            await until(() => draw().querySelector('[data-key="trial-8"]'));
            const again = [sent('/cameras/trial').at(-1), take().disabled, camera().querySelector('[data-doubt]')];
            take().click(); await settled(); draw();
            return {before, shown, wrong, other, again, chosen: sent('/devices/camera')}""")
        device = "/dev/v4l/by-id/usb-Cam_4711-video-index0"
        self.assertEqual(told["before"], [True, True, ["", "1920 1080 YUYV", "1920 1080 MJPG", "640 480 YUYV"]])
        self.assertEqual(told["shown"], [[{"device": device}], "/cameras/trial.jpg?trial=7", "200", "▲ The picture is too dark, or darker than with its automatic settings: light the bed, or take a longer exposure.", False, True])
        self.assertEqual(told["wrong"], [True, True, "▲ At most 2047."])
        self.assertEqual(told["other"], [True, True, False])
        self.assertEqual(told["again"], [{"device": device, "width": 1920, "height": 1080, "format": "YUYV", "settings": ["exposure_time_absolute=300", "focus_absolute=35"]}, False, None])
        self.assertEqual(told["chosen"], [{"kind": "v4l2", "device": device, "trial": 8}])

    def test_whatever_keeps_a_camera_from_being_chosen_is_said_as_soon_as_it_does(self):
        told = self.steps(self.CAMERAS + """
            await looks({'/cameras/trial': {task: 41}});
            mark(webcam.device);
            await press('#try-camera'); draw();
            const looking = main.querySelector('#look-devices').disabled;
            const drawn = [];
            const watch = new MutationObserver(() => { if (camera().querySelector('section.trial')) drawn.push(take().disabled && !camera().querySelector('.hint')); });
            watch.observe(main, {subtree: true, childList: true, attributes: true});
            model.tasks.set(41, {id: 41, state: 'done', result: tried(41, {focus_absolute: '35'})});
            await until(() => draw().querySelector('[data-key="trial-41"]'));
            await settled();
            watch.disconnect();
            return [looking, main.querySelector('#look-devices').disabled, drawn.length > 0, drawn.includes(true)]""")
        self.assertEqual(told, [True, False, True, False])

    def test_a_size_is_the_cameras_for_which_it_was_picked(self):
        told = self.steps(self.CAMERAS + """
            await looks({'/cameras/trial': tried(10, {}, {device: bare.device})});
            mark(webcam.device);
            type('#trial-size', '640 480 YUYV'); draw();
            mark(bare.device);
            const size = main.querySelector('#trial-size').value;
            await press('#try-camera');
            await until(() => draw().querySelector('[data-key="trial-10"]'));
            return [size, sent('/cameras/trial')]""")
        self.assertEqual(told, ["", [{"device": "/dev/v4l/by-path/pci-3"}]])

    def test_a_size_is_tried_as_it_is_wanted(self):
        told = self.steps(self.CAMERAS + """
            await looks({'/cameras/trial': tried(9, {}, {width: 640, height: 480})});
            mark(webcam.device);
            type('#trial-size', '640 480 YUYV'); draw();
            await press('#try-camera');
            await until(() => draw().querySelector('[data-key="trial-9"]'));
            return [sent('/cameras/trial'), take().disabled]""")
        self.assertEqual(told, [[{"device": "/dev/v4l/by-id/usb-Cam_4711-video-index0", "width": 640, "height": 480, "format": "YUYV"}], False])

    def test_why_a_camera_gave_no_picture_is_told_where_it_is_chosen(self):
        told = self.steps(self.CAMERAS + """
            await looks({'/cameras/trial': {task: 40}});
            mark(webcam.device);
            await press('#try-camera');
            model.tasks.set(40, {id: 40, state: 'failed', error: {message: 'the camera is used by another program: close that, then try again'}});
            await until(() => draw().querySelector('[data-key=trial] [role=alert]'));
            return [camera().querySelector('[data-key=trial] [role=alert]').innerText, take().disabled]""")
        self.assertEqual(told, ["▲ The camera is used by another program: close that, then try again.", True])

    def test_a_page_whose_words_do_not_come_comes_up_later_and_stops_meanwhile(self):
        for language in ("de", "en"):
            self.speak(language)
            self.addCleanup(self.speak, "en")
            self.refuse("words/de.js", "words/en.js")
            self.browser.get(f"http://127.0.0.1:{self.server.server_address[1]}/console/index.html")
            told = self.does(UNTIL + """
                await until(() => performance.getEntriesByType('resource').some(({name}) => name.endsWith('words/en.js')));
                document.querySelector('#stop button').click();
                await until(() => document.getElementById('stop-note').innerText.includes(given[0]));
                return [window.asked.filter(({path, method}) => method === 'POST' && path.endsWith('/stop')).length > 0, document.querySelectorAll('#nav a').length]""",
                             {"de": "bestätigt: Strahl aus", "en": "confirmed"}[language])
            self.assertEqual(told, [True, 0])
            Files.refused = ()
            self.assertEqual(self.does(UNTIL + "await until(() => document.querySelector('#nav a')); return document.documentElement.lang"), language)

    def test_who_lacks_the_german_words_reads_english(self):
        self.speak("de")
        self.addCleanup(self.speak, "en")
        self.refuse("words/de.js")
        self.assertEqual(self.does("return (await load('words.js')).language"), "en")

    def test_cards_that_do_not_come_are_told_and_asked_for_by_one(self):
        for screen, file, rest, there in (("settings", "settings_laser.js", [], "#pattern-burn"), ("settings", "settings_drawing.js", [], "#drawing-file"), ("panels", "panel_apart.js", ["P-0001"], "#do-merge")):
            with self.subTest(screen):
                self.speak("en")
                self.refuse(f"screens/{file}")
                told = self.steps("""
                    screen = await load('screens/%s.js');
                    rest = %s;
                    for (let n = 0; n < 3; ++n) { screen.enter(...rest); await settled(); await settled(); draw(); }
                    await settled(); draw();
                    window.look = () => draw().querySelector('%s') !== null;
                    return [[...main.querySelectorAll('p.empty')].some((one) => one.innerText === 'connecting'), window.look()]""" % (screen, rest, there))
                self.assertEqual(told, [True, False])
                self.assertEqual(len(Files.lost), 1, "three who asked are one")
                Files.refused = ()
                self.assertFalse(self.does(UNTIL + """
                    await until(() => window.look());
                    return [...document.querySelectorAll('#main p.empty')].some((one) => one.innerText === 'connecting')"""))

    def test_a_map_that_does_not_come_is_told_on_its_page_and_asked_for_again(self):
        self.refuse("screens/panel_map.js")
        told = self.steps("""
            const fault = () => { draw(); screen.drawn(main, ...rest); return main.querySelector('#no-map')?.innerText || ''; };
            await enter('panels', 'P-0001');
            const said = await until(fault);
            window.look = () => { fault(); return [main.querySelector('#no-map'), main.querySelector('.layers input').disabled, main.querySelector('.map .leaflet-pane') !== null]; };
            return [said, window.look()[1], document.getElementById('refusal').hidden]""")
        self.assertRegex(told[0], "The map cannot be shown")
        self.assertEqual(told[1:], [True, True])
        Files.refused = ()
        self.assertEqual(self.does(UNTIL + "return await until(() => { const told = window.look(); return !told[1] && told; })"), [None, False, True])

    def test_who_has_gone_on_hears_of_no_map(self):
        self.refuse("screens/panel_map.js")
        told = self.steps("""
            await enter('panels', 'P-0001');
            screen.drawn(main, ...rest);
            main.replaceChildren();
            await settled(); await settled(); await settled(); await settled();
            return document.getElementById('refusal').innerText""")
        self.assertEqual(told, "")

    def test_cards_of_settings_stay_when_others_come(self):
        told = self.steps("""
            screen = await load('screens/settings.js');
            rest = [];
            main.replaceChildren();
            screen.enter();
            draw();
            const jog = main.querySelector('.jog').closest('section'), none = main.querySelector('#pattern-burn');
            await until(() => draw().querySelector('#pattern-burn'));
            return [none, main.querySelector('.jog').closest('section') === jog, new Set([...main.querySelectorAll('.column > *')].map(({dataset}) => dataset.key)).size === main.querySelectorAll('.column > *').length]""")
        self.assertEqual(told, [None, True, True])

    def test_each_word_is_there_in_both_languages_and_once(self):
        seen = self.does("""
            const all = {};
            await (await load('words.js')).learn('seldom');
            for (const name of ['en', 'de', 'seldom_en', 'seldom_de']) all[name] = (await load(`words/${name}.js`)).words;
            const places = (text) => [...new Set(JSON.stringify(text).match(/{\\w+}/g))].sort().join();
            const {seldom_en: en, seldom_de: de} = all;
            const unlike = (one, other) => Object.keys({...one, ...other}).filter((key) => !key.startsWith('step.') && (!(key in one) || !(key in other) || places(one[key]) !== places(other[key]) || typeof one[key] !== typeof other[key]));
            return {unlike: [...unlike(all.en, all.de), ...unlike(en, de)],
                    twice: Object.keys(en).filter((key) => key in all.en || key in all.de), enough: Object.keys(en).length > 40}""")
        self.assertEqual(seen, {"unlike": [], "twice": [], "enough": True})

    def test_who_reads_german_loads_no_english(self):
        for language in ("en", "de"):
            self.speak(language)
            self.addCleanup(self.speak, "en")
            told = self.does("""
                await load('words.js');
                return performance.getEntriesByType('resource').map(({name}) => name.match(/words\\/(\\w+)\\.js/)?.[1]).filter(Boolean)""")
            self.assertEqual(sorted(told), [language] if language == "en" else [language, f"said_{language}"])

    def test_the_scanners_that_answer(self):
        told = self.steps("""
            answer({'/scanners': {scanners: [{name: 'x:1', make: 'Maker One', problem: ''}, {name: 'y:2', make: '', problem: 'it is busy'}]}});
            await enter('settings');
            await until(() => draw().querySelector('#find-scanners'));
            await press('#find-scanners');
            await until(() => draw().innerText.includes('Maker One'));
            return text().replace(/\\s+/g, ' ')""")
        self.assertRegex(told, r"Maker One x:1 y:2 ▲ It is busy\.")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
