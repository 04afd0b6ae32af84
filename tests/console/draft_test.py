#!/usr/bin/python3
"""draft_test.py CONSOLE: what a browser keeps of the page, asked as page_test.py asks: the draft of a new picture, by whom, over which
picture, and in a browser that keeps nothing.
"""
import sys
import unittest

from selenium.webdriver.support.ui import WebDriverWait

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
    const drafts = await load('drafts.js'), anna = ['user', 'anna'];
    if (!given[0] || !given[0].session) model.session = {who: 'user anna', user: 'anna', role: 'operator', accounts: true};
    await Promise.all(['picture_brush', 'grid_lines', 'cell_curves', 'crop_frame'].map((name) => load(`${name}.js`)));
    // What lies in the store once all that was asked of it before is done: as another page would see it.
    const inStore = (how, act) => new Promise((done) => {
      const request = indexedDB.open('veneer_drafts', 2);
      request.onupgradeneeded = () => request.result.createObjectStore('drafts');
      request.onsuccess = () => {
        const transaction = request.result.transaction('drafts', how), out = {};
        act(transaction.objectStore('drafts'), out);
        transaction.oncomplete = () => { request.result.close(); done(out); };
      };
    });
    const stored = async (owner = anna) => {
      const out = await inStore('readonly', (store, told) => { for (const part of ['form', 'picture', 'drawing']) store.get([...owner, part]).onsuccess = ({target}) => { told[part] = target.result || null; }; });
      const fileOf = (part) => (out[part] && out[part].id === out.form[part] ? out[part].file : null);
      return out.form && {...out.form, picture: fileOf('picture'), drawing: fileOf('drawing')};
    };
    const plant = (owner, record) => inStore('readwrite', (store) => { store.put({version: 2, id: 'planted', at: Date.now(), of: null, picture: null, drawing: null, ...record}, [...owner, 'form']); });
    const soon = async (is) => { for (const end = performance.now() + 20000; performance.now() < end; await new Promise((go) => setTimeout(go, 10))) { const told = await is(); if (told) return told; } throw new Error('it did not come: ' + is); };
    const kept = (is, owner = anna) => soon(async () => { draw(); const told = await stored(owner); return told && is(told) && told; });
    const forgotten = (owner = anna) => soon(async () => !await stored(owner));
    // All that waits is kept at once, and what was kept has come.
    const atOnce = async () => { dispatchEvent(new Event('pagehide')); await stored(); await settled(); draw(); };
    const entered = async () => { page.enter(); await until(() => sheet('#draft')); await settled(); draw(); await atOnce(); };
    const come = async () => { page.enter(); await until(() => sheet('#draft-restored')); };
    const shutOf = (kind) => { const put = IDBObjectStore.prototype.put; IDBObjectStore.prototype.put = function (value, key) { if (kind(value)) throw new DOMException('full', 'QuotaExceededError'); return put.call(this, value, key); }; return () => { IDBObjectStore.prototype.put = put; }; };
    // Until it is let go on, the store tells nothing.
    const heldStore = () => {
      const open = indexedDB.open.bind(indexedDB), waiting = [];
      indexedDB.open = (...of) => { const request = open(...of), late = {}; request.onupgradeneeded = (event) => { late.result = request.result; if (late.onupgradeneeded) late.onupgradeneeded(event); }; for (const how of ['onsuccess', 'onerror']) request[how] = (event) => waiting.push(() => { late.result = request.result; late[how](event); }); return late; };
      return {isAsked: () => waiting.length > 0, goOn() { indexedDB.open = open; waiting.forEach((tell) => tell()); }};
    };
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
        return self.at("const plan = await planned(); await kept(({form, picture, opening}) => picture && !opening && form.limits.size && form.w_edge === .9 && form.paint.length && form.curves.length); return plan")

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
        self.assertRegex(seen["told"], "As you left it on .* kept in this browser")
        self.assertEqual((seen["size"], seen["file"], seen["curves"], seen["fault"]), ("150,5", "bird.bmp", "1", None))

    def test_what_was_only_looked_at_is_as_old_as_it_was(self):
        self.begin()
        at = self.at("return (await stored()).at")
        self.reload()
        seen = self.at("await come(); await until(() => sheet('canvas.cells')); await fine(); await atOnce(); const {at} = await kept(({opening}) => !opening), says = Boolean(sheet('#draft-restored')); type('#slide-w_edge', '.4'); return [at, says, Boolean(sheet('#draft-restored'))]")
        self.assertEqual(seen, [at, True, False], "what was changed is not what stood there")

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
            const gone = [sheet('#target'), sheet('#draft-restored'), sheet('#draft-afresh').disabled, sheet('#picture-file').files.length, sheet('#picture-layout').value, document.activeElement.id];
            await forgotten();
            await choosePicture(await painted(200));
            type('#picture-layout', 'mosaic');
            await fine();
            const plan = await planned(), drawn = curves();
            await kept(({picture}) => picture);
            press('#draft-afresh');
            await forgotten();
            return {asked: asked.length, stays, gone, curves: drawn, plan}""")
        self.assertEqual((seen["asked"], seen["stays"], seen["gone"], seen["curves"]), (3, True, [None, None, True, 0, "grid", "picture-file"], "0"))
        for name in ("flow_lines", "cell_sizes", "importance", "wood_limit"):
            self.assertNotIn(name, seen["plan"])
        self.reload()
        self.assertIsNone(self.at("await entered(); type('#slide-w_edge', '.7'); await kept(({form}) => form.w_edge === .7); return sheet('#draft-restored') || sheet('#target')"), "what was forgotten stays so")

    def test_its_button_stands_there_from_the_first_and_moves_nothing(self):
        seen = self.at("""
            page.enter();
            await until(() => sheet('#picture-size') && sheet('#draft'));
            const place = () => [...main.querySelectorAll('#picture-size, #picture-layout, #do-plan')].map((one) => Math.round(one.getBoundingClientRect().top + scrollY));
            const before = [place(), sheet('#draft-afresh').disabled, sheet('#draft').getAttribute('role')];
            await entered();
            type('#picture-size', '77');
            await kept(({form}) => form.size_mm === '77');
            draw();
            return {before, after: [place(), sheet('#draft-afresh').disabled, sheet('#draft').getAttribute('role')]}""")
        self.assertEqual(seen["before"][1:], [True, None])
        self.assertEqual(seen["after"], [seen["before"][0], False, None])

    # ---- a picture that ends the page -------------------------------------------------------------------------------

    NEVER_OPEN = "const openBitmap = window.createImageBitmap; window.opening = 0; window.createImageBitmap = () => { ++window.opening; return new Promise(() => {}); };"

    def test_a_picture_that_ends_the_page_is_not_opened_unasked_again(self):
        before = self.begin()
        self.reload()
        self.at(self.NEVER_OPEN + "page.enter(); await until(() => { draw(); return window.opening; }); await kept(({opening}) => opening)")
        self.reload()
        seen = self.at(self.NEVER_OPEN + """
            await come();
            const shown = [window.opening, sheet('#target'), sheet('#draft-waits').innerText];
            type('#slide-w_edge', '.4');
            const {picture, opening} = await kept(({form}) => form.w_edge === .4);
            return {shown, kept: [picture.name, opening]}""")
        self.assertEqual(seen["shown"][:2], [0, None])
        self.assertIn("bird.bmp is kept, but was not opened by itself", seen["shown"][2])
        self.assertEqual(seen["kept"], ["bird.bmp", True], "it is no less kept for that")
        self.reload()
        seen = self.at("await come(); type('#slide-w_edge', '.9'); press('#draft-open'); await until(() => sheet('canvas.cells')); await fine(); const plan = await planned(); await kept(({opening, form}) => !opening && form.w_edge === .9); return [plan, document.activeElement.id, sheet('#draft-waits')]")
        self.assertEqual(seen, [before, "picture-file", None])
        self.reload()
        self.at("page.enter(); await until(() => sheet('#target'))")

    def test_a_picture_is_kept_once_it_is_open(self):
        seen = self.at(self.NEVER_OPEN + """
            await entered();
            type('#slide-w_edge', '.4');
            await kept(({form}) => form.w_edge === .4);
            await choose('one.png');
            type('#slide-w_edge', '.7');
            await atOnce();
            const before = await stored();
            window.createImageBitmap = openBitmap;
            await choosePicture(await painted(200));
            return [before.picture, (await kept(({picture}) => picture)).picture.name]""")
        self.assertEqual(seen, [None, "bird.bmp"])

    def test_a_picture_that_is_too_large_for_the_cell_is_neither_read_whole_nor_kept(self):
        seen = self.at("""
            let read = 0;
            const bytes = Blob.prototype.arrayBuffer;
            Blob.prototype.arrayBuffer = function () { ++read; return bytes.call(this); };
            await entered();
            await choosePicture(new File([new Uint8Array(64 * 1024 * 1024 + 1)], 'huge.bmp', {lastModified: 1}));
            const {picture, of} = await kept(({of}) => of);
            await until(() => sheet('#draft-fault'));
            return [read, picture, of.name, sheet('#draft-fault').innerText]""")
        self.assertEqual(seen[:3], [0, None, "huge.bmp"])
        self.assertIn("could not be kept", seen[3])

    # ---- two tabs ---------------------------------------------------------------------------------------------------

    def other_tab(self):
        first = self.browser.current_window_handle
        self.browser.switch_to.new_window("tab")
        second = self.browser.current_window_handle
        self.browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": page_test.STAGE})

        def leave():
            self.browser.switch_to.window(second)
            self.browser.close()
            self.browser.switch_to.window(first)
        self.addCleanup(leave)
        self.reload()
        return first, second

    def test_of_two_tabs_the_later_change_is_kept_with_its_picture(self):
        self.begin()
        first, second = self.other_tab()
        self.at("await come(); await choosePicture(await painted(90, 'fox.bmp')); await kept(({picture}) => picture && picture.name === 'fox.bmp')")
        self.browser.switch_to.window(first)
        self.assertEqual(self.at("type('#slide-w_edge', '.4'); const {picture, of} = await kept(({form}) => form.w_edge === .4); return [picture && picture.name, of.name]"), ["bird.bmp", "bird.bmp"])
        self.browser.switch_to.window(second)
        self.assertEqual(self.at("type('#slide-w_edge', '.6'); const {picture, of} = await kept(({form}) => form.w_edge === .6); return [picture && picture.name, of.name]"), ["fox.bmp", "fox.bmp"])

    def test_what_one_tab_forgets_does_not_come_back_from_another_one(self):
        self.begin()
        first, second = self.other_tab()
        self.at("await come(); await until(() => sheet('#target')); await kept(({opening}) => !opening); window.confirm = () => true; press('#draft-afresh'); await forgotten()")
        self.browser.switch_to.window(first)
        seen = self.at("await until(() => !sheet('#target')); type('#slide-w_edge', '.4'); const {picture, form} = await kept(({form}) => form.w_edge === .4); return [picture, form.paint.length, form.curves.length, form.limits.size]")
        self.assertEqual(seen, [None, 0, 0, 0])

    def test_another_draft_in_another_tab_stays_when_one_is_forgotten(self):
        self.at("await entered(); await choosePicture(await painted(200)); await kept(({picture}) => picture)")
        first, second = self.other_tab()
        self.at("await come(); await until(() => sheet('#target')); window.confirm = () => true; press('#draft-afresh'); await forgotten(); await choosePicture(await painted(90, 'fox.bmp')); await kept(({picture}) => picture)")
        self.browser.switch_to.window(first)
        self.at("await until(() => !sheet('#target')); await choosePicture(await painted(90, 'owl.bmp')); await kept(({of}) => of && of.name === 'owl.bmp')")
        self.browser.switch_to.window(second)
        seen = self.at("window.confirm = () => true; press('#draft-afresh'); await stored(); await settled(); return (await stored()).picture.name")
        self.browser.switch_to.window(first)
        self.assertEqual([seen, self.at("return sheet('#picture-file').files[0].name")], ["owl.bmp", "owl.bmp"])

    # ---- whose it is ------------------------------------------------------------------------------------------------

    ANNA, BEN, NOBODY = ({"session": True, "who": who, "user": user, "role": "operator", "accounts": True} for who, user in (("user anna", "anna"), ("user ben", "ben"), ("anonymous at 192.0.2.1", None)))

    def by(self, session, script):
        return self.at("model.session = given[0];" + script, session)

    def link(self, number, uid=1000):
        return {"session": True, "who": f"console link {number} of uid {uid}", "user": None, "role": "operator", "accounts": False}

    def test_each_user_has_a_draft(self):
        self.begin()
        self.reload()
        seen = self.by(self.BEN, "await entered(); type('#slide-w_edge', '.4'); await kept(({form}) => form.w_edge === .4, ['user', 'ben']); return [sheet('#target'), sheet('#draft-restored')]")
        self.assertEqual(seen, [None, None])
        self.reload()
        self.at("await come(); await until(() => sheet('#target'))")

    def test_one_console_link_after_the_other_is_one_user(self):
        self.by(self.link(3), "await entered(); await choosePicture(await painted(200)); await kept(({picture, opening}) => picture && !opening, ['link', 'uid 1000'])")
        self.reload()
        self.by(self.link(4), "await come(); await until(() => sheet('#target'))")
        self.reload()
        self.assertIsNone(self.by(self.link(5, 1001), "await entered(); type('#slide-w_edge', '.4'); await kept(({form}) => form.w_edge === .4, ['link', 'uid 1001']); return sheet('#target')"))

    def test_what_is_kept_comes_once_the_cell_says_who_asks(self):
        self.begin()
        self.reload()
        seen = self.by({"session": True, "who": "", "user": None}, """
            page.enter();
            await until(() => sheet('#draft'));
            await stored();
            await settled();
            const before = sheet('#target');
            model.session = {who: 'user anna', user: 'anna'};
            await until(() => sheet('#target'));
            return before""")
        self.assertIsNone(seen)

    def test_of_who_has_not_signed_in_nothing_is_kept_and_the_page_says_so(self):
        seen = self.by(self.NOBODY, """
            await entered();
            const before = sheet('#draft-fault');
            type('#slide-w_edge', '.4');
            await atOnce();
            const first = sheet('#draft-fault').innerText;
            model.session = {who: 'user anna', user: 'anna'};
            await kept(({form}) => form.w_edge === .4);
            const fault = sheet('#draft-fault');
            model.session = given[0];
            type('#slide-w_edge', '.7');
            await atOnce();
            return {before, first, fault, later: sheet('#draft-fault').innerText, stays: (await stored()).form.w_edge, all: (await inStore('readonly', (store, out) => { store.getAllKeys().onsuccess = ({target}) => { out.keys = target.result; }; })).keys}""")
        self.assertEqual((seen["before"], seen["fault"], seen["stays"], seen["all"]), (None, None, .4, [["user", "anna", "form"]]))
        for told in (seen["first"], seen["later"]):
            self.assertIn("You are not signed in", told)

    def test_the_page_begins_anew_before_whoever_signs_in_next(self):
        self.by(self.ANNA, "await entered(); await choosePicture(await painted(200)); await kept(({picture}) => picture); type('#slide-w_edge', '.4'); window.stays = true; setTimeout(() => { model.session = {who: 'user ben', user: 'ben'}; draw(); })")
        WebDriverWait(self.browser, page_test.PATIENCE_S).until(lambda browser: browser.execute_script("return document.readyState === 'complete' && !window.stays"))
        self.assertEqual(self.at("return [(await stored()).form.w_edge, await stored(['user', 'ben'])]"), [.4, None])

    def test_what_was_forgotten_stays_so_where_the_page_is_left_at_once(self):
        self.begin()
        # What the page asks the store before it forgets is not answered while it is there.
        self.at("""
            const ask = IDBObjectStore.prototype.get;
            let asked = 0;
            IDBObjectStore.prototype.get = function (key) { ++asked; const again = () => { ask.call(this, key).onsuccess = again; }; again(); return {}; };
            window.confirm = () => true;
            press('#draft-afresh');
            await until(() => asked)""")
        self.reload()
        self.assertTrue(self.at("return await stored() === null"))

    def test_nobody_forgets_the_draft_of_another_user(self):
        seen = self.by(self.ANNA, """
            await entered();
            await choosePicture(await painted(200));
            await kept(({picture}) => picture);
            model.session = {who: 'anonymous', user: null};
            window.confirm = () => true;
            press('#draft-afresh');
            await atOnce();
            return [sheet('#target'), (await stored()).picture.name]""")
        self.assertEqual(seen, [None, "bird.bmp"])

    def test_the_oldest_drafts_go(self):
        seen = self.at("""
            const day = 24 * 3600 * 1000, names = ['a', 'b', 'c', 'd', 'e', 'f'];
            for (const [n, name] of names.entries()) await plant(['user', name], {at: Date.now() - n * day, form: {}});
            await plant(['link', 'uid 1'], {at: Date.now() - 31 * day, form: {}});
            await plant(anna, {at: Date.now() - 29 * day, form: {w_edge: .7, paint: [], curves: [], pins: []}});
            await come();
            return [sheet('#slide-w_edge').value, (await inStore('readonly', (store, out) => { store.getAllKeys().onsuccess = ({target}) => { out.keys = target.result; }; })).keys.map(([, name]) => name)]""")
        self.assertEqual(seen, ["0.7", ["a", "anna", "b", "c", "d"]])
        self.reload()
        self.assertIsNone(self.at("await plant(anna, {at: Date.now() - 31 * 24 * 3600 * 1000, form: {w_edge: .7, paint: [], curves: [], pins: []}}); await entered(); return stored()"))

    # ---- what could not be kept -------------------------------------------------------------------------------------

    NO_ROOM = "const room = shutOf(({file}) => file);"

    def test_a_picture_that_is_too_large_is_asked_for_and_no_other_one_is_taken_for_it(self):
        self.at(self.NO_ROOM + "await entered(); await choosePicture(await painted(200)); type('#picture-layout', 'mosaic'); await until(() => sheet('canvas.cells')); await fine()")
        self.over("canvas.cells", (.25, .5), (.3, .5), (.75, .5))
        fault = self.at("type('#slide-closer', '.5'); await kept(({form}) => form.curves.length && form.wide < 1); await until(() => sheet('#draft-fault')); return sheet('#draft-fault').innerText")
        self.assertIn("could not be kept", fault)
        self.reload()
        seen = self.at("""
            await come();
            const asked = [sheet('#draft-picture').innerText, sheet('#target'), sheet('#picture-layout').value];
            await choosePicture(await painted(100));
            await until(() => sheet('canvas.cells'));
            await fine();
            const plan = await planned(), other = [curves(), plan.flow_lines || null, plan.crop || null];
            await choosePicture(await painted(200));
            await fine();
            const again = await planned();
            return {asked, other, again: [curves(), Boolean(again.flow_lines), again.crop]}""")
        self.assertIn("bird.bmp could not be kept in this browser: choose it again", seen["asked"][0])
        self.assertEqual(seen["asked"][1:], [None, "mosaic"])
        self.assertEqual(seen["other"], ["0", None, None], "it has the same name, size and date, and is another picture")
        self.assertEqual(seen["again"], ["1", True, "15,10,30,20"])

    def test_what_is_of_a_picture_that_could_not_be_kept_outlives_other_changes(self):
        self.at(self.NO_ROOM + "await entered(); await choosePicture(await painted(200)); type('#slide-closer', '.5'); type('input[type=text]', 'my bird'); await kept(({form}) => form.wide < 1 && form.name === 'my bird')")
        self.reload()
        self.at("await come(); type('#slide-w_edge', '.4'); await kept(({form}) => form.w_edge === .4)")
        self.reload()
        seen = self.at("""
            await come();
            const asked = sheet('#draft-picture').innerText;
            let sure = 0;
            window.confirm = () => { ++sure; return false; };
            press('#draft-afresh');
            await choosePicture(await painted(90, 'fox.bmp'));
            const {crop, name} = await planned();
            await choosePicture(await painted(200));
            const again = await planned();
            return {asked, sure, fox: [crop || null, name], bird: [again.crop, again.name, again.w_edge]}""")
        self.assertIn("bird.bmp could not be kept", seen["asked"])
        self.assertEqual((seen["sure"], seen["fox"], seen["bird"]), (1, [None, "fox"], ["15,10,30,20", "my bird", "0.4"]))

    DRAWING = """
        const chooseDrawing = (text = '<svg/>') => { const files = new DataTransfer(), input = sheet('#picture-drawing'); files.items.add(new File([text], 'pieces.svg', {lastModified: 1})); input.files = files.files; input.dispatchEvent(new Event('change')); draw(); };
    """

    def test_a_drawing_whose_picture_could_not_be_kept_goes_with_it_again(self):
        self.at(self.DRAWING + "const room = shutOf(({file}) => file && file.name === 'bird.bmp'); await entered(); await choosePicture(await painted(200)); type('#picture-layout', 'segmentation'); chooseDrawing(); await kept(({drawing}) => drawing)")
        self.reload()
        seen = self.at("""
            await come();
            const shown = [sheet('#draft-picture') !== null, sheet('#drawing-name').innerText];
            type('#slide-w_edge', '.4');
            const {drawing} = await kept(({form}) => form.w_edge === .4);
            await choosePicture(await painted(200));
            return {shown, kept: drawing && drawing.name, plan: (await planned()).segmentation_bytes}""")
        self.assertEqual(seen, {"shown": [True, "pieces.svg"], "kept": "pieces.svg", "plan": "6"})

    def test_a_drawing_that_could_not_be_kept_is_asked_for(self):
        self.at(self.DRAWING + "const room = shutOf(({file}) => file && file.name === 'pieces.svg'); await entered(); await choosePicture(await painted(200)); type('#picture-layout', 'segmentation'); chooseDrawing(); await kept(({picture, drawing_name}) => picture && drawing_name)")
        self.reload()
        seen = self.at(self.DRAWING + "await come(); await until(() => sheet('#target')); const says = sheet('#drawing-lost').innerText; chooseDrawing(); await kept(({drawing}) => drawing); return [says, sheet('#drawing-lost')]")
        self.assertIn("pieces.svg could not be kept in this browser: choose it again", seen[0])
        self.assertIsNone(seen[1])

    def test_a_draft_is_kept_whole_or_not_at_all(self):
        self.begin()
        seen = self.at("""
            const room = shutOf(({file}) => !file);
            await choosePicture(await painted(90, 'fox.bmp'));
            await until(() => sheet('#draft-fault'));
            room();
            const {picture, of, form} = await stored();
            return [sheet('#draft-fault').innerText.includes('keeps nothing'), picture && picture.name, of.name, form.curves.length]""")
        self.assertEqual(seen, [True, "bird.bmp", "bird.bmp", 1])

    def test_what_waits_for_a_slow_store_is_the_newest_alone(self):
        seen = self.at("""
            await entered();
            // Whoever else has the store holds it for as long as there is something to do.
            let isHeld = true, puts = 0;
            const keepOne = IDBObjectStore.prototype.put, held = inStore('readwrite', (store) => { const again = () => { if (isHeld) store.get('x').onsuccess = again; }; again(); });
            await settled();
            IDBObjectStore.prototype.put = function (...of) { ++puts; return keepOne.apply(this, of); };
            const later = window.setTimeout;
            window.setTimeout = (act) => later(act);
            for (const value of ['.1', '.2', '.3', '.4', '.6', '.7']) { type('#slide-w_edge', value); await settled(); }
            window.setTimeout = later;
            isHeld = false;
            await held;
            await kept(({form}) => form.w_edge === .7);
            return puts""")
        self.assertLessEqual(seen, 2)

    def test_a_store_that_is_shut_or_full_keeps_nothing_and_breaks_nothing(self):
        for way in ("Object.defineProperty(window, 'indexedDB', {value: undefined})", "indexedDB.open = () => { throw new DOMException('shut', 'SecurityError'); }",
                    "indexedDB.open = () => { const request = {error: new DOMException('shut', 'InvalidStateError')}; setTimeout(() => request.onerror()); return request; }",
                    "IDBObjectStore.prototype.put = () => { throw new DOMException('full', 'QuotaExceededError'); }"):
            with self.subTest(way):
                self.reload()
                seen = self.at(way + """;
                    const lost = [];
                    addEventListener('unhandledrejection', ({reason}) => lost.push(String(reason)));
                    page.enter(); await until(() => sheet('#draft')); await choosePicture(await painted(200)); type('#picture-layout', 'mosaic'); await fine();
                    await until(() => sheet('#draft-fault'));
                    const said = sheet('#draft-fault').innerText, plan = await planned();
                    window.confirm = () => true;
                    press('#draft-afresh');
                    await settled();
                    return [said, plan.layout, sheet('#target'), lost]""")
                self.assertIn("This browser keeps nothing", seen[0])
                self.assertEqual(seen[1:], ["mosaic", None, []])

    def test_what_is_kept_wrongly_is_left_alone(self):
        seen = self.at("""
            await plant(anna, {form: {size_mm: 5, layout: {}, wood: [], limits: 'x', w_edge: .7, patch_mm: '9', typed: true, strange: 1, paint: [{key: 'x', name: 'x', width: 9, height: 9, masks: {}}], curves: [{key: 'x', curves: [[['a', 1]]]}], pins: [{name: 'x', holds: [['y', 1]]}]}});
            await come();
            return [sheet('#picture-layout').value, sheet('#picture-patch').value, sheet('#slide-w_edge').value, sheet('#picture-size').value === '5']""")
        self.assertEqual(seen, ["grid", "9", "0.7", False])

    # ---- a store that answers late ----------------------------------------------------------------------------------

    def test_what_somebody_has_begun_stays_when_the_draft_comes(self):
        self.begin()
        self.reload()
        seen = self.at("""
            const late = heldStore();
            page.enter();
            await until(() => { draw(); return late.isAsked(); });
            await choosePicture(await painted(90, 'fox.bmp'));
            late.goOn();
            await kept(({of}) => of && of.name === 'fox.bmp');
            return [sheet('#picture-file').files[0].name, sheet('#draft-restored'), sheet('#picture-layout').value]""")
        self.assertEqual(seen, ["fox.bmp", None, "grid"])

    def test_what_somebody_has_set_stays_when_the_draft_comes(self):
        self.begin()
        self.reload()
        seen = self.at("""
            const late = heldStore();
            page.enter();
            await until(() => { draw(); return late.isAsked(); });
            type('#slide-w_texture', '.4');
            late.goOn();
            const {form} = await kept(({form}) => form.w_texture === .4);
            return [sheet('#slide-w_texture').value, sheet('#slide-w_edge').value, form.curves.length]""")
        self.assertEqual(seen, ["0.4", "0.5", 1], "what was drawn over pictures is nobody's loss")

    def test_start_afresh_holds_for_what_has_not_come_yet(self):
        self.begin()
        self.reload()
        seen = self.at("""
            const late = heldStore();
            window.confirm = () => true;
            page.enter();
            await until(() => { draw(); return late.isAsked(); });
            type('#slide-w_texture', '.4');
            press('#draft-afresh');
            late.goOn();
            await forgotten();
            draw();
            return [sheet('#target'), sheet('#draft-restored'), sheet('#slide-w_texture').value]""")
        self.assertEqual(seen, [None, None, "0"])

    def test_it_has_words_in_both_languages(self):
        for language in ("en", "de"):
            self.speak(language)
            self.assertEqual(self.at("const {t} = await load('words.js'); return ['restored', 'afresh', 'sure', 'picture', 'files', 'all', 'nobody', 'drawing', 'waits', 'open'].map((one) => `draft.${one}`).filter((name) => t(name) === name)"), [])


class Shut(Page):
    def setUp(self):
        self.reload()

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

    FULL = "Storage.prototype.setItem = () => { throw new DOMException('full', 'QuotaExceededError'); };"

    def test_what_a_full_store_does_not_take_counts_more_than_what_it_has(self):
        seen = self.does("localStorage.setItem('one', 'old'); localStorage.setItem('two', 'old');" + self.FULL + """
            const {recall, remember} = await load('link.js');
            remember('one', 'new');
            remember('two', null);
            Storage.prototype.removeItem = () => { throw new DOMException('shut', 'SecurityError'); };
            const before = recall('one');
            remember('one', null);
            return [before, recall('two'), recall('one')]""")
        self.assertEqual(seen, ["new", None, None])

    def test_what_no_store_takes_outlives_the_pages_own_reload(self):
        self.does(self.FULL + """
            const {beginAnew, remember} = await load('link.js');
            remember('veneer_language', 'de');
            remember('veneer_session', 'x', () => sessionStorage);
            window.stays = true;
            setTimeout(beginAnew);""")
        anew = lambda: WebDriverWait(self.browser, page_test.PATIENCE_S).until(lambda browser: browser.execute_script("return document.readyState === 'complete' && !window.stays"))
        anew()
        seen = "const {headersOf} = await load('link.js'), {language} = await load('words.js'); window.stays = true; return [language, headersOf({}).Authorization || null]"
        self.assertEqual(self.does(self.FULL + seen), ["de", "Bearer x"])
        self.reload()
        anew()
        self.assertEqual(self.does(seen), ["en", None], "no further than the page says")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
