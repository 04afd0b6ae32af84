#!/usr/bin/python3
"""draft_test.py CONSOLE: what a browser keeps of the page, asked as page_test.py asks: the draft of a new picture, by whom, over which
picture, and in a browser that keeps nothing.
"""
import sys
import unittest

import page_test
from page_test import CELL, MOSAIC, Page

# Of a picture whose bytes are its own, as many as any other's: only what it shows tells it from one of the same name.
DRAFT = """
    const painted = async (colour, name = 'bird.bmp') => {
      const bytes = new Uint8Array(54 + 60 * 40 * 3).fill(colour), head = new DataView(bytes.buffer);
      bytes.fill(0, 0, 54);
      bytes.set([66, 77]);
      for (const [at, value] of [[2, bytes.length], [10, 54], [14, 40], [18, 60], [22, 40]]) head.setUint32(at, value, true);
      head.setUint16(26, 1, true); head.setUint16(28, 24, true);
      return new File([bytes], name, {type: 'image/bmp', lastModified: 1});
    };
    const choosePicture = async (file) => {
      const files = new DataTransfer(), input = sheet('#picture-file'), {isOpened} = await load('sketch.js');
      files.items.add(file);
      input.files = files.files;
      input.dispatchEvent(new Event('change'));
      await until(() => isOpened(input.files[0]));
      draw();
    };
    const drafts = await load('drafts.js');
    const kept = async (is) => { for (let i = 0; i < 500; ++i) { draw(); const told = await drafts.readDraft(model.session.user || ''); if (told && is(told)) return told; await new Promise((go) => setTimeout(go, 10)); } throw new Error('it was not kept: ' + is); };
    const come = async () => { page.enter(); await until(() => sheet('#draft') || sheet('#part')); };
    const forgotten = async () => { for (let i = 0; i < 200; ++i) { if (!await drafts.readDraft('')) return; await settled(); } throw new Error('it is kept'); };
    // The store is asked before anything else is done.
    const entered = async () => { page.enter(); await until(() => sheet('#picture-layout')); await drafts.readDraft(''); await settled(); draw(); };
"""


class Drafts(Page):
    def setUp(self):
        self.speak("en")
        self.browser.set_window_size(1280, 900)

    def at(self, script, *values):
        return self.does(CELL + MOSAIC + DRAFT + script, *values)

    over, lines, near = page_test.Mosaic.over, page_test.Mosaic.lines, page_test.Mosaic.near

    def begin(self):
        """A picture of cells with a curve over it, small cells, some of it that matters, and a share of a wood."""
        self.at("await entered(); await choosePicture(await painted(200)); type('#picture-layout', 'mosaic'); type('#picture-size', '150,5'); await until(() => sheet('canvas.cells')); await fine(); sheet('#sizes').open = sheet('#matters').open = true; draw()")
        self.over("canvas.cells", (.25, .5), (.3, .5), (.75, .5))
        for brush in ("sizes", "matters"):
            self.over(f"canvas[data-brush={brush}]", (.25, .5), (.3, .5))
        self.at("type('#slide-limit_walnut', '.3'); type('#slide-w_edge', '.9'); draw()")
        return self.at("const plan = await planned(); await kept(({form, picture}) => picture && form.limits.size && form.w_edge === .9 && form.paint.length && form.curves.length); return plan")

    def test_all_of_it_is_there_again_after_a_reload(self):
        before = self.begin()
        for name in ("flow_lines", "cell_sizes", "importance", "wood_limit"):
            self.assertIn(name, before)
        self.reload()
        seen = self.at("""
            page.enter();
            await until(() => sheet('canvas.cells'));
            const field = sheet('#picture-file').files[0];
            return {plan: await planned(), told: sheet('#draft-restored').innerText, size: sheet('#picture-size').value, file: field && field.name, curves: curves(), fault: sheet('#draft-fault')}""")
        self.assertEqual(seen["plan"], before)
        self.assertRegex(seen["told"], "This is what stood here on .* kept in this browser")
        self.assertEqual((seen["size"], seen["file"], seen["curves"], seen["fault"]), ("150,5", "bird.bmp", "1", None))

    def test_pins_of_a_grid_are_there_again(self):
        self.at("""
            window.answers['/plans/grid'] = {width_mm: 60, height_mm: 40, rows: 3, columns: 4, vertices: Array.from({length: 20}, (_, n) => [n % 5 * 15, 40 - Math.floor(n / 5) * 40 / 3]), lines: []};
            await entered(); await choosePicture(await painted(200)); type('#picture-size', '40'); type('#picture-layout', 'morph'); await until(() => sheet('canvas.lines'));""")
        self.over("canvas.lines", (.25, .333), (.27, .36), (.3, .4))
        before = self.at("const plan = await planned(); await kept(({form}) => form.pins.length); return plan.pinned_vertices")
        self.assertTrue(before)
        self.reload()
        self.assertEqual(self.at("page.enter(); await until(() => sheet('canvas.lines')); return (await planned()).pinned_vertices"), before)

    def test_start_afresh_forgets_it_after_a_question(self):
        self.begin()
        self.reload()
        seen = self.at("""
            await come();
            const asked = [];
            window.confirm = (words) => { asked.push(words); return asked.length > 1; };
            press('#draft-afresh');
            const stays = sheet('#target') !== null;
            press('#draft-afresh');
            const gone = [sheet('#target'), sheet('#draft'), sheet('#picture-file').files.length, sheet('#picture-layout').value];
            await forgotten();
            await choosePicture(await painted(200));
            type('#picture-layout', 'mosaic');
            await fine();
            const plan = await planned(), drawn = curves();
            press('#draft-afresh');
            await forgotten();
            return {asked: asked.length, stays, gone, curves: drawn, plan}""")
        self.assertEqual((seen["asked"], seen["stays"], seen["gone"], seen["curves"]), (3, True, [None, None, 0, "grid"], "0"))
        for name in ("flow_lines", "cell_sizes", "importance", "wood_limit"):
            self.assertNotIn(name, seen["plan"])
        self.reload()
        self.assertIsNone(self.at("await entered(); await settled(); return sheet('#draft-restored') && sheet('#draft-restored').innerText"), "what was forgotten stays so")

    def test_each_user_has_a_draft(self):
        self.begin()
        self.reload()
        seen = self.at("""
            model.session = {who: 'anna', user: 'anna', role: 'operator', accounts: true};
            await entered();
            await drafts.readDraft('anna');
            await settled();
            return [sheet('#target'), sheet('#draft')]""")
        self.assertEqual(seen, [None, None])
        self.reload()
        self.at("await come(); await until(() => sheet('#target'))")

    def test_one_console_link_after_the_other_is_one_user(self):
        of = "model.session = {who: 'console link %d of uid 1000', user: null, role: 'operator', accounts: false};"
        self.at(of % 3 + "await entered(); await choosePicture(await painted(200)); for (let i = 0; i < 200 && !await drafts.readDraft('console link of uid 1000'); ++i) await settled();")
        self.reload()
        self.at(of % 4 + "await come(); await until(() => sheet('#target'))")
        self.reload()
        self.assertIsNone(self.at(of.replace("1000", "1001") % 5 + "await entered(); await settled(); draw(); return sheet('#target')"))

    def test_nothing_is_kept_under_the_name_of_whoever_comes_next(self):
        seen = self.at("""
            model.session = {who: 'anna', user: 'anna', role: 'operator', accounts: true};
            await entered();
            await choosePicture(await painted(200));
            model.session = {who: 'ben', user: 'ben', role: 'operator', accounts: true};
            type('#picture-size', '77');
            for (let i = 0; i < 200 && !await drafts.readDraft('anna'); ++i) await settled();
            await settled();
            return [Boolean(await drafts.readDraft('anna')), await drafts.readDraft('ben')]""")
        self.assertEqual(seen, [True, None])

    # The store has room for all but files.
    NO_ROOM = """
        const keepOne = IDBObjectStore.prototype.put;
        IDBObjectStore.prototype.put = function (value, key) { if (value instanceof File) throw new DOMException('full', 'QuotaExceededError'); return keepOne.call(this, value, key); };
    """

    def test_a_picture_that_is_too_large_is_asked_for_and_no_other_one_is_taken_for_it(self):
        self.at(self.NO_ROOM + "await entered(); await choosePicture(await painted(200)); type('#picture-layout', 'mosaic'); await until(() => sheet('canvas.cells')); await fine()")
        self.over("canvas.cells", (.25, .5), (.3, .5), (.75, .5))
        fault = self.at("await kept(({form}) => form.curves.length); await until(() => sheet('#draft-fault')); return sheet('#draft-fault').innerText")
        self.assertIn("too large to be kept", fault)
        self.reload()
        seen = self.at("""
            await come();
            const asked = [sheet('#draft-picture').innerText, sheet('#target'), sheet('#picture-layout').value];
            await choosePicture(await painted(100));
            await until(() => sheet('canvas.cells'));
            await fine();
            const other = [curves(), (await planned()).flow_lines || null];
            await choosePicture(await painted(200));
            await fine();
            return {asked, other, again: [curves(), Boolean((await planned()).flow_lines)]}""")
        self.assertIn("bird.bmp could not be kept in this browser: choose it again", seen["asked"][0])
        self.assertEqual(seen["asked"][1:], [None, "mosaic"])
        self.assertEqual(seen["other"], ["0", None], "it has the same name, size and date, and is another picture")
        self.assertEqual(seen["again"], ["1", True])

    def test_a_store_that_is_shut_or_full_keeps_nothing_and_breaks_nothing(self):
        for way in ("Object.defineProperty(window, 'indexedDB', {value: undefined})", "indexedDB.open = () => { throw new DOMException('shut', 'SecurityError'); }",
                    "indexedDB.open = () => { const request = {error: new DOMException('shut', 'InvalidStateError')}; setTimeout(() => request.onerror()); return request; }",
                    "IDBObjectStore.prototype.put = () => { throw new DOMException('full', 'QuotaExceededError'); }"):
            with self.subTest(way):
                self.reload()
                seen = self.at(way + """;
                    const lost = [];
                    addEventListener('unhandledrejection', ({reason}) => lost.push(String(reason)));
                    await entered(); await choosePicture(await painted(200)); type('#picture-layout', 'mosaic'); await fine();
                    await until(() => sheet('#draft-fault'));
                    const said = sheet('#draft-fault').innerText, plan = await planned();
                    window.confirm = () => true;
                    press('#draft-afresh');
                    await settled();
                    return [said, plan.layout, sheet('#target'), lost]""")
                self.assertIn("This browser keeps nothing", seen[0])
                self.assertEqual(seen[1:], ["mosaic", None, []])

    def test_what_is_kept_wrongly_is_left_alone(self):
        self.at("""
            await drafts.keepDraft('', {form: {size_mm: 5, layout: {}, wood: [], limits: 'x', w_edge: .7, patch_mm: '9', typed: true, strange: 1, paint: [{key: 'x', name: 'x', width: 9, height: 9, masks: {}}], curves: [{key: 'x', curves: [[['a', 1]]]}], pins: [{name: 'x', holds: [['y', 1]]}]}, picture: null, drawing: null});""")
        self.reload()
        seen = self.at("await come(); return [sheet('#picture-layout').value, sheet('#picture-patch').value, sheet('#slide-w_edge').value, sheet('#picture-size').value === '5']")
        self.assertEqual(seen, ["grid", "9", "0.7", False])

    def test_what_somebody_has_begun_stays_when_the_draft_comes(self):
        self.begin()
        self.reload()
        seen = self.at("""
            const open = indexedDB.open.bind(indexedDB), waiting = [];
            indexedDB.open = (...of) => { const request = open(...of), late = {}; request.onupgradeneeded = (event) => late.onupgradeneeded && late.onupgradeneeded(event); for (const how of ['onsuccess', 'onerror']) request[how] = (event) => waiting.push(() => { late.result = request.result; late[how](event); }); return late; };
            page.enter();
            await until(() => waiting.length && sheet('#picture-layout'));
            await choosePicture(await painted(90, 'fox.bmp'));
            indexedDB.open = open;
            waiting.forEach((tell) => tell());
            await settled(); await settled(); draw();
            return [sheet('#picture-file').files[0].name, sheet('#draft-restored'), sheet('#picture-layout').value]""")
        self.assertEqual(seen, ["fox.bmp", None, "grid"])

    def test_it_has_words_in_both_languages(self):
        for language in ("en", "de"):
            self.speak(language)
            self.assertEqual(self.at("const {t} = await load('words.js'); return ['restored', 'afresh', 'sure', 'picture', 'files', 'all'].map((one) => `draft.${one}`).filter((name) => t(name) === name)"), [])


class Shut(Page):
    def test_a_browser_that_keeps_nothing_shows_the_page_all_the_same(self):
        shut = "Object.defineProperty(window, 'localStorage', {get() { throw new DOMException('shut', 'SecurityError'); }}); Object.defineProperty(window, 'sessionStorage', {get() { throw new DOMException('shut', 'SecurityError'); }});"
        full = "Storage.prototype.setItem = () => { throw new DOMException('full', 'QuotaExceededError'); };"
        for way in (shut, full, shut.replace("throw new DOMException('shut', 'SecurityError')", "return null")):
            with self.subTest(way):
                self.reload()
                told = self.does(way + """
                    const {recall, remember, headersOf} = await load('link.js'), {t} = await load('words.js'), alarms = await load('alarms.js');
                    await load('stop.js');
                    await load('frame.js');
                    document.getElementById('theme').click();
                    alarms.setSound(false);
                    remember('veneer_session', 'x', () => sessionStorage);
                    const signed = headersOf({}).Authorization;
                    remember('veneer_session', null, () => sessionStorage);
                    return [t('draft.afresh'), document.documentElement.dataset.theme, document.querySelector('#stop small').textContent !== '', alarms.soundOn(), recall('nothing'), signed, headersOf({}).Authorization || null]""")
                self.assertEqual(told, ["Start afresh", "light", True, False, None, "Bearer x", None])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
