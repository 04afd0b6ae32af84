#!/usr/bin/python3
"""sight_test.py CONSOLE: whether all of the page can be read and hit: each text against what lies behind it, in both themes, and the box of
each button, link and field, as page_test.py shows the screens.
"""
import sys
import unittest

from page_test import CELL, EVERYTHING, MOSAIC, QUEUE, Page

CONTRAST = 4.5   # WCAG's AA for text of any size; here for what is shut, too
TARGET_PX = 45.35  # 12 mm at 96 pixels to the inch

# unreadable(): texts that are seen with too little contrast; small(): what can be pressed and is too small, or smaller than what stands
# in it; both as sentences.
SIGHT = """
    const looked = {texts: 0, targets: 0};
    const channels = (text) => {
      const found = text.match(/^rgba?\\(([^)]*)\\)$/);
      if (!found) throw new Error('no colour: ' + text);
      const [red, green, blue, alpha = 1] = found[1].split(/[\\s,/]+/).map(Number);
      return [red, green, blue, alpha];
    };
    const over = (above, below) => [0, 1, 2].map((i) => above[3] * above[i] + (1 - above[3]) * below[i]).concat(1);
    const linear = (value) => (value / 255 <= .04045 ? value / 255 / 12.92 : ((value / 255 + .055) / 1.055) ** 2.4);
    const light = ([red, green, blue]) => .2126 * linear(red) + .7152 * linear(green) + .0722 * linear(blue);
    const grey = ([red, green, blue]) => Array(3).fill(.2126 * red + .7152 * green + .0722 * blue);
    const ratio = (one, other) => { const [dark, bright] = [light(one), light(other)].sort((a, b) => a - b); return (bright + .05) / (dark + .05); };
    const styleOf = (node, pseudo) => getComputedStyle(node, pseudo);

    // All grounds that a text in `node` may lie on: the nearest that is opaque, with what is translucent above it, and a gradient's colours.
    function groundsOf(node) {
      const layers = [];
      for (let at = node; at; at = at.parentElement) {
        const {backgroundColor, backgroundImage} = styleOf(at), colour = channels(backgroundColor);
        const stops = backgroundImage === 'none' ? [] : (backgroundImage.match(/rgba?\\([^)]*\\)/g) || []).map(channels);
        layers.unshift({colour, stops});
        if (colour[3] === 1) break;
      }
      let grounds = [channels(styleOf(document.documentElement).backgroundColor)];
      for (const {colour, stops} of layers) {
        grounds = grounds.map((ground) => over(colour, ground));
        grounds = grounds.flatMap((ground) => [ground, ...stops.map((stop) => over(stop, ground))]);
      }
      return grounds;
    }
    const fadedBy = (node) => { let all = 1; for (let at = node; at; at = at.parentElement) all *= Number(styleOf(at).opacity); return all; };
    const isGrey = (node) => Boolean(node.closest('body.not-live main, body.not-live .next'));

    function worst(node, style, grounds = groundsOf(node)) {
      const fade = fadedBy(node), colours = grounds.map((ground) => { const [red, green, blue, alpha] = channels(style.color); return [over([red, green, blue, alpha * fade], ground), ground]; });
      return Math.min(...colours.map((pair) => { const [ink, ground] = isGrey(node) ? pair.map(grey) : pair; return ratio(ink, ground); }));
    }
    const named = (node) => `${node.nodeName.toLowerCase()}${node.id ? '#' + node.id : ''}${[...node.classList].map((one) => '.' + one).join('')} in ${(node.parentElement || node).className || (node.parentElement || node).id || (node.parentElement || node).nodeName}`;
    // For the eye: neither hidden nor for screen readers alone.
    const isSeen = (node) => node.checkVisibility({checkOpacity: true, checkVisibilityCSS: true}) && !node.closest('.unseen, .skip, [inert] .unseen') && styleOf(node).clipPath === 'none';
    const boxOf = (node) => node.getBoundingClientRect();

    function unreadable(place = document.body) {
      const out = [], tell = (node, style, what, grounds) => { const found = worst(node, style, grounds); if (found < given[0]) out.push(`${what}: ${found.toFixed(2)} (${style.color}), ${named(node)}`); };
      const texts = document.createTreeWalker(place, NodeFilter.SHOW_TEXT);
      for (let text = texts.nextNode(); text; text = texts.nextNode()) {
        const node = text.parentElement, words = text.data.trim();
        if (!words || ['SCRIPT', 'STYLE', 'NOSCRIPT'].includes(node.nodeName) || !isSeen(node)) continue;
        ++looked.texts;
        const style = styleOf(node);
        if (node instanceof SVGElement) {
          // On a picture: its own rim is what lies behind it.
          const rim = style.stroke.startsWith('rgb') && style.paintOrder.startsWith('stroke') ? [channels(style.stroke)] : groundsOf(node);
          tell(node, {color: style.fill}, words, rim);
        } else if (node.nodeName === 'OPTION') {
          if (!node.parentElement.disabled) tell(node.parentElement, styleOf(node.parentElement), words);
        } else tell(node, style, words);
      }
      for (const node of place.querySelectorAll('input, select, textarea, button, summary, a')) {
        if (!isSeen(node)) continue;
        if (['INPUT', 'TEXTAREA', 'SELECT'].includes(node.nodeName) && !['checkbox', 'radio', 'range'].includes(node.type)) tell(node, styleOf(node), `value of ${node.id || node.name || node.type}`);
        if (node.placeholder) tell(node, styleOf(node, '::placeholder'), node.placeholder);
        if (node.type === 'file') {
          const button = styleOf(node, '::file-selector-button'), ground = channels(button.backgroundColor);
          tell(node, button, 'its button', groundsOf(node).map((below) => over(ground, below)));
        }
        for (const pseudo of ['::before', '::after']) if (/^".*\\S.*"/.test(styleOf(node, pseudo).content)) tell(node, styleOf(node, pseudo), pseudo);
      }
      return [...new Set(out)];
    }

    // What a finger hits: a field by its label, if that is around it.
    function small(place = document.body) {
      const out = [];
      for (const node of place.querySelectorAll('button, a[href], select, summary, textarea, input')) {
        if (node.type === 'file' && node.hidden) continue;
        const around = ['checkbox', 'radio'].includes(node.type) && node.closest('label') || node;
        if (!isSeen(around)) continue;
        const {width, height} = boxOf(around), inline = styleOf(around).display === 'inline';
        if (!width && !height) continue;
        ++looked.targets;
        // A way in a sentence is as wide as its word.
        const {scrollWidth, scrollHeight, clientWidth, clientHeight} = around, spills = !inline && around.nodeName !== 'INPUT' && around.nodeName !== 'SELECT' && (scrollWidth > clientWidth + 1 || scrollHeight > clientHeight + 1);
        if (spills) out.push(`${around.innerText.trim()}: it is ${clientWidth} x ${clientHeight}, and what stands in it ${scrollWidth} x ${scrollHeight}, ${named(around)}`);
        if (height < given[1] || (!inline && width < given[1])) out.push(`${(around.innerText || around.ariaLabel || around.type || '').trim()}: ${width.toFixed(1)} x ${height.toFixed(1)}, ${named(around)}`);
      }
      return [...new Set(out)];
    }

    const themes = ['light', 'dark'], out = {unreadable: [], small: []};
    // As it is shown now, in both themes; live, and as it is when nobody knows any more.
    function look(screen, place) {
      for (const theme of themes) {
        document.documentElement.dataset.theme = theme;
        for (const live of [true, false]) {
          document.body.classList.toggle('not-live', !live);
          for (const told of unreadable(place)) out.unreadable.push(`${screen}, ${theme}${live ? '' : ', not live'}: ${told}`);
        }
      }
      document.body.classList.remove('not-live');
      for (const told of small(place)) out.small.push(`${screen}: ${told}`);
    }
"""

# MOSAIC beside EVERYTHING, which has a type() of its own.
PICTURE = MOSAIC.replace("const type =", "const write =").replace("const told =", "const query =").replace("told('/plans?')", "query('/plans?')")

SCREENS = [["cell"], ["panels"], ["panels", "P-0001"], ["scan"], ["new_picture"], ["run"], ["run", "3"], ["assembly"], ["assembly", "3"], ["alarms"], ["history"], ["history", "3"],
           ["calibration"], ["settings"], ["log"], ["account"]] + [["setup", step] for step in ("devices", "print", "scanner", "camera", "laser", "kerf", "recipes", "wood", "picture", "cut")]


class Sight(Page):
    maxDiff = None

    def setUp(self):
        self.speak("en")
        self.size(1280, 800)

    def size(self, width, height):
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})

    def seen(self, script, *values, texts=50, targets=5):
        """`texts`, `targets`: as many are looked at at least."""
        told = self.does(CELL + EVERYTHING + SIGHT + script + "; return {...out, ...looked, faults};", CONTRAST, TARGET_PX, *values)
        self.assertEqual(told["faults"], [])
        self.assertEqual(told["unreadable"], [])
        self.assertEqual(told["small"], [])
        self.assertGreater(told["texts"], texts)
        self.assertGreater(told["targets"], targets)

    def test_what_is_looked_for_is_found(self):
        told = self.does("const main = document.querySelector('main');" + SIGHT + """
            main.innerHTML = `<p>well</p><p class="dim">dim</p><p data-bad="grey">grey on card</p><p data-bad="faded">faded</p><div data-bad="hatch"><p>hatched</p></div><input type="text" data-bad="hint" placeholder="hint">
              <select data-bad="shut" disabled><option>shut</option></select><svg width="99" height="20"><text y="15" data-bad="drawn">drawn</text></svg><button id="fine">fine</button><button id="tiny">tiny</button><button id="tight">a long word</button><label id="tick"><input type="checkbox">a tick</label><p class="unseen">unseen</p>`;
            const styles = {grey: {color: '#777', background: '#888'}, faded: {opacity: '.4'}, hatch: {background: 'repeating-linear-gradient(45deg, #15181a 0 9px, transparent 9px 20px)'}, hint: {background: '#3c4145'}, shut: {color: '#aaa'}, drawn: {fill: '#ccc'}};
            for (const one of main.querySelectorAll('[data-bad]')) Object.assign(one.style, styles[one.dataset.bad]);
            Object.assign(main.querySelector('#tiny').style, {minHeight: '44px', height: '44px', minWidth: '60px'});
            Object.assign(main.querySelector('#tight').style, {width: '60px', whiteSpace: 'nowrap'});
            Object.assign(main.querySelector('#tick').style, {display: 'inline-flex', height: '30px'});
            document.documentElement.dataset.theme = 'light';
            return {unreadable: unreadable(main).map((one) => one.split(':')[0]), small: small(main).map((one) => one.split(':')[0])};""", CONTRAST, TARGET_PX)
        self.assertEqual(told, {"unreadable": ["grey on card", "faded", "hatched", "drawn", "value of text", "hint", "value of select-one"], "small": ["tiny", "a long word", "a tick"]})

    def test_any_ink_on_any_ground(self):
        """Each colour that the sheets give a text, on each ground that they give it, whatever is shown where."""
        told = self.does(SIGHT.split("// All grounds")[0] + """
            const out = [], rules = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules]).flatMap((rule) => (rule.cssRules && !rule.style ? [...rule.cssRules] : [rule])).filter((rule) => rule.style);
            const inks = new Set(rules.map((rule) => rule.style.color).filter(Boolean)), strange = [...inks].filter((ink) => !['inherit', 'var(--ink)', 'var(--dim)', 'var(--on-attention)', 'rgb(255, 255, 255)'].includes(ink));
            const own = rules.filter((rule) => rule.style.color === 'rgb(255, 255, 255)').map((rule) => rule.selectorText);
            const probe = document.body.appendChild(document.createElement('p'));
            const colour = (name) => { probe.style.color = name.startsWith('--') ? `var(${name})` : name; return channels(getComputedStyle(probe).color); };
            const grounds = ['--ground', '--card', '--well', '--button', '--attention-ground', '--warning-ground', '--alarm-ground', '--not-live'];
            const pairs = [...['--ink', '--dim'].flatMap((ink) => grounds.map((ground) => [ink, ground])), ['--on-attention', '--attention'], ['--on-bar', '--bar'], ['#fff', '--stop'], ['#fff', '#7d0000'], ['#fff', '#a84a00']];
            for (const theme of ['light', 'dark']) {
              document.documentElement.dataset.theme = theme;
              for (const [ink, ground] of pairs) for (const [how, seen] of [['', (one) => one], [', not live', grey]]) {
                const found = ratio(seen(colour(ink)), seen(colour(ground)));
                if (found < given[0]) out.push(`${theme}${how}: ${ink} on ${ground}: ${found.toFixed(2)}`);
              }
            }
            return {out, strange, own: own.sort()};""", CONTRAST)
        self.assertEqual(told, {"out": [], "strange": [], "own": [".live.off", ".stop", ".stop small"]})

    SHOWN = "for (const [name, ...rest] of given[2]) { await show(name, rest); main.className = `screen-${name === 'new_picture' ? 'new' : name}`; look([name, ...rest].join('/'), main); }"

    def test_every_screen_before_an_admin(self):
        self.seen(self.SHOWN, SCREENS, texts=4000, targets=200)

    def test_every_screen_on_a_phone(self):
        self.size(390, 844)
        self.seen(self.SHOWN, SCREENS)

    def test_every_screen_in_german(self):
        self.speak("de")
        self.addCleanup(self.speak, "en")
        self.seen(self.SHOWN, SCREENS)

    def test_every_screen_before_a_viewer(self):
        """What is shut is read, too."""
        self.seen("const before = show; const viewed = async (...of) => { model.role = 'viewer'; await before(...of); };" + self.SHOWN.replace("await show(", "await viewed("), SCREENS)

    def test_jobs_that_wait(self):
        for size in ((1280, 800), (390, 844)):
            self.size(*size)
            self.seen(QUEUE + "main.className = 'screen-run'; look('run, a queue', main);")

    def test_what_stands_on_every_screen(self):
        for size in ((1280, 800), (390, 844)):
            self.size(*size)
            self.seen("""
                const {showFrame, showAge} = await load('frame.js'), {showRefusal} = await load('commands.js');
                const screens = ['cell', 'setup', 'panels', 'scan', 'new', 'run', 'assembly', 'alarms', 'history', 'calibration', 'settings', 'log', 'account'].map((id) => ({id}));
                for (const state of ['Idle', 'Execute', 'Held', 'Suspended', 'Complete', 'Aborted', 'Stopped']) {
                  for (const step of ['redo', 'clear', 'wait', 'start']) {
                    given_to({...about_all, state, reason: 'run veneerctl panel scan', next_step: {...about_all.next_step, step}});
                    showFrame(screens, 'run');
                    showAge();
                    showRefusal('a refusal: raise --patch-mm');
                    for (const id of ['stop-note', 'dead']) { document.getElementById(id).hidden = false; document.getElementById(id).textContent = 'STOP is not confirmed.'; }
                    look(`header ${state} ${step}`, document.querySelector('header'));
                    look(`next ${state} ${step}`, document.getElementById('next'));
                    look(`refusal ${state}`, document.getElementById('refusal'));
                  }
                }
                document.getElementById('live').classList.add('off');
                look('not live', document.querySelector('header'));
                """)

    def test_what_reads_aloud_is_told_which_screen_this_is(self):
        told = self.does(CELL + EVERYTHING + """
            const {showFrame} = await load('frame.js'), heading = () => [...document.querySelectorAll('h1')].map((one) => one.textContent);
            const on = (screen, role) => { model.role = role; given_to(about_all); showFrame([{id: 'run'}, {id: 'log'}], screen); return heading(); };
            return [on('run', 'admin'), on('log', 'viewer'), on('run', 'nobody')];""")
        self.assertEqual(told, [["Run"], ["Log"], ["Sign in"]])

    def test_a_new_picture_with_all_that_is_over_it(self):
        for size in ((1280, 800), (390, 844)):
            self.size(*size)
            self.seen(PICTURE + """
                window.answers = Object.fromEntries(Object.entries(window.answers).sort(([a], [b]) => b.length - a.length));
                page.enter();
                await choose('one.png');
                await until(() => sheet('#part'));
                main.className = 'screen-new';
                for (const layout of ['grid', 'morph', 'mosaic', 'segmentation']) {
                  write('#picture-layout', layout);
                  if (layout === 'mosaic') await fine();
                  for (const one of main.querySelectorAll('details')) one.open = true;
                  await settled();
                  draw();
                  look(`new picture, ${layout}`, main);
                }
                write('#picture-size', 'x');
                look('new picture, a wrong number', main);
                """)

    def test_a_panel_with_a_loose_tag_and_a_strip_that_is_drawn(self):
        for size in ((1280, 800), (390, 844)):
            self.reload()
            self.size(*size)
            self.seen("""
                const tag = (tag_id, x, off_mm) => ({kind: 'tag', face: 'show', tag_id, centre_mm: [x, 5], corners_mm: [[x, 4], [x + 2, 4], [x + 2, 6], [x, 6]], off_mm, off_scan: off_mm && 4, over_limit: off_mm > .05});
                const shape_mm = [[[0, 0], [100, 0], [100, 100], [0, 100]]], kind = (css) => document.querySelector(css);
                window.answers['/panels/P-0001'] = {...panel, fiducials: [tag(7, 10, .3), tag(8, 60, .01), tag(9, 90, null)], zones: [{zone: 1, version: 1, material: 'walnut', area_mm2: 1e4, shape_mm}]};
                window.answers = {'/panels/P-0001/zones': {error: {message: 'the outline holds nothing of panel P-0001'}}, ...window.answers};
                await show('panels', ['P-0001'], {}, async (page) => {
                  const drawn = () => { given_to(about_all); put(main, ...[page.draw('P-0001')].flat()); for (const one of main.querySelectorAll('details')) one.open = true; page.drawn(main, 'P-0001'); };
                  const pressed = async (css) => { await until(() => { drawn(); return kind(css) && !kind(css).disabled; }); kind(css).click(); await settled(); drawn(); };
                  await pressed('#outline');
                  for (const key of [' ', 'ArrowRight', ' ', 'ArrowUp', ' ']) kind('.map').dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true, cancelable: true}));
                  await pressed('#outline-keep');
                  await until(() => { drawn(); return kind('#outline-fault') && kind('ul.marks') && kind('.over-limit'); });
                  main.className = 'screen-panels';
                  look('a panel', main);
                });
                """)

    def test_plans_beside_each_other_and_one_in_hand(self):
        for size in ((1280, 800), (390, 844)):
            self.reload()  # nothing is ticked yet
            self.size(*size)
            self.seen("""
                const ring = (x, y) => [[x, y], [x + 10, y], [x + 10, y + 10], [x, y + 10]];
                const planned = (id, more) => ({id, name: `bird ${id}`, parent: null, options: {layout: 'grid', size_mm: 20, patch_mm: 10, kerf_mm: .2, alternatives: 6}, report: {cost_per_pixel: .1234, cutting_s: 600, warnings: ['raise --patch-mm'], without_lead: 1},
                  pieces: 4, placed: 3, panels: [{panel: 'P-0001'}], outdated_panels: ['P-0001'], segmentation: '/x', jobs: [], lease: null, ...more});
                model.plans = [planned(8, {parent: 7}), planned(7, {jobs: [3], lease: {who: 'anna', since: at, until: at}})];
                const mosaic = ['A1-1', 'A1-2', 'A2-1', 'A2-2'].map((mark, n) => ({mark, panel: n < 3 ? 'P-0001' : null, artwork_outline_mm: ring(10 * (n % 2), 10 * (n >> 1)), panel_outline_mm: ring(20 * n, 5), outline_mm: [ring(0, 0).flat()]}));
                const place = (number, cost_per_pixel, x) => ({number, cost_per_pixel, panel: 'P-0001', panel_outline_mm: ring(x, 5)});
                Object.assign(window.answers, {'/plans/8/pieces': {pieces: mosaic, next: null}, '/plans/7/pieces': {pieces: mosaic.map((piece) => ({...piece, panel_outline_mm: ring(99, 5)})), next: null},
                  '/plans/8/pieces/A1-1/alternatives': {place: place(0, .1, 0), placed: 3, worse: 1, alternatives: [place(1, .12, 90), place(2, .3, 20)], none_because: '', next: null}, '/plans': {plans: model.plans, next: null}});
                window.answers = Object.fromEntries(Object.entries(window.answers).sort(([a], [b]) => b.length - a.length));
                const page = await load('screens/new_picture.js');
                const draw = () => { given_to(about_all); put(main, ...[page.draw()].flat()); page.drawn(main); };
                const pressed = async (css) => { (await until(() => { draw(); return main.querySelector(css); })).click(); await settled(); draw(); };
                main.className = 'screen-new';
                page.enter();
                draw();
                await pressed('.plans li:nth-child(1) input');
                await pressed('.plans li:nth-child(2) input');
                await until(() => { draw(); return main.querySelector('.side-by-side.two svg'); });
                window.answers = {'/alternatives': window.answers['/plans/8/pieces/A1-1/alternatives'], ...window.answers};
                look('two plans', main);
                await pressed('[data-command=other]');
                await until(() => { draw(); return main.querySelector('svg.chooser'); });
                look('a plan in hand', main);
                main.querySelector('svg.chooser').focus();
                for (const key of ['ArrowRight', ' ', 'Enter']) main.querySelector('svg.chooser').dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true}));
                await until(() => { draw(); return main.querySelector('button.place'); });
                look('a piece of it', main);
                await pressed('[data-wish=other]');
                look('a wish', main);
                await pressed('[data-wish=swap]');
                look('a swap', main);
                """)

    def test_the_page_that_answers_stop_without_scripts(self):
        self.browser.get(f"http://127.0.0.1:{self.server.server_address[1]}/console/stopped.html")
        told = self.does("const main = document.querySelector('main');" + SIGHT + "look('stopped', document.body); return out;", CONTRAST, TARGET_PX)
        self.assertEqual(told, {"unreadable": [], "small": []})


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
