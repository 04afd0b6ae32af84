#!/usr/bin/python3
"""axe_test.py CONSOLE: every screen as axe-core reads it, in both languages, both themes, on a desk and on a phone: nothing of any weight
that it finds wrong, and nothing that it leaves to people to look at but what HELD lists. Names, roles and order, which sight_test.py does
not look at.

AXE_CORE names its axe.min.js, as ./dev test fetches it; without it nothing is checked, and ctest tells this as skipped.
"""
import json
import os
import sys
import unittest

if not os.environ.get("AXE_CORE"):
    print("skipped: no screen is read by axe-core, since AXE_CORE names none")
    sys.exit(77)

from page_test import CELL, EVERYTHING, QUEUE, Page
from sight_test import SCREENS

SIZES = ((1280, 800), (390, 844))
# What a theme can change; a screen is read whole in the light one.
OF_COLOURS = ["color-contrast", "link-in-text-block"]

# What axe-core cannot tell by itself ("needs review"): of its rule, by the key of its message, what has been looked at, why it is no fault,
# and in READ by what a finding of the kind is known. All else is told.
HELD = {
    "color-contrast nonBmp": ("symbol", "a symbol, no letter; sight_test.py holds it to 4.5:1 as any text"),
    "label-content-name-mismatch": ("symbol", "a symbol is no part of a name: its name says in words what it does"),
    "color-contrast bgOverlap": ("in sight", "something lies over it only until one scrolls, or over its box and not over its text; sight_test.py holds it to 4.5:1"),
    "color-contrast elmPartiallyObscured": ("in sight", "a link beside the edge of the screens' list, which is moved aside; sight_test.py holds it to 4.5:1"),
    "color-contrast elmPartiallyObscuring": ("in sight", "its box is larger than what it stands in, its text is not; sight_test.py holds it to 4.5:1"),
}

READ = """
    // All of an element's text, as it is seen.
    const textsIn = (node) => {
      const walker = document.createTreeWalker(node, NodeFilter.SHOW_TEXT), out = [];
      for (let text = walker.nextNode(); text; text = walker.nextNode()) if (text.data.trim() && text.parentElement.checkVisibility({checkVisibilityCSS: true}) && !text.parentElement.closest('.unseen')) out.push(text);
      return out;
    };
    const isHeld = {
      'symbol': (node) => {
        const named = node.closest('[aria-hidden="true"]') || /\\p{L}{2}/u.test(node.getAttribute('aria-label') || node.innerText || node.textContent);
        const seen = [...node.childNodes].filter(({nodeType}) => nodeType === Node.TEXT_NODE).map(({data}) => data).join('');  // its own
        return Boolean(named) && seen.trim() !== '' && !/[\\p{L}\\p{N}]/u.test(seen);
      },
      // Each line of its text, once it is scrolled to: what a finger would hit there is itself, or lies in it.
      'in sight': (node) => {
        const moved = [];  // whatever holds it
        for (let at = node.parentElement; at; at = at.parentElement) moved.push([at, at.scrollLeft, at.scrollTop]);
        node.scrollIntoView({block: 'center', inline: 'center', behavior: 'instant'});
        const covered = textsIn(node).some((text) => {
          const range = document.createRange();
          range.selectNodeContents(text);
          return [...range.getClientRects()].some(({left, top, width, height}) => {
            const hit = document.elementFromPoint(left + width / 2, top + height / 2);
            return !hit || !(text.parentElement.contains(hit) || (node.contains(hit) && hit.contains(text)));
          });
        });
        for (const [at, left, top] of moved) at.scrollTo({left, top, behavior: 'instant'});
        return !covered;
      },
    };
    const read = async (rules = null) => {
      const {violations, incomplete} = await axe.run(document, {resultTypes: ['violations', 'incomplete'], ...(rules && {runOnly: {type: 'rule', values: rules}})});
      const wrong = violations.flatMap(({id, nodes}) => nodes.map(({html}) => `${id}: ${html.slice(0, 200)}`));
      const unsure = incomplete.flatMap(({id, nodes}) => nodes.flatMap(({html, target, any, all, none}) => [...any, ...all, ...none].map(({data}) => [id, (data && data.messageKey) || ''].filter(Boolean).join(' ')).map((key) => {
        const how = HELD[key], held = how && target.length === 1 && isHeld[how](document.querySelector(target[0]));
        if (held) window.held[key] = true;
        return held ? null : `needs a look: ${key}: ${html.slice(0, 200)}`;
      }))).filter(Boolean);
      return [...wrong, ...unsure];
    };
    window.held = {};
"""
READ = "const HELD = " + json.dumps({key: how for key, (how, why) in HELD.items()}) + ";" + READ


class Axe(Page):
    def setUp(self):
        self.addCleanup(self.speak, "en")

    def open(self, language, size):
        self.speak(language)
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False})
        with open(os.environ["AXE_CORE"], encoding="utf-8") as file:
            self.browser.execute_script(file.read())

    def test_what_is_looked_for_is_found(self):
        self.open("en", SIZES[0])
        told = self.does(READ + """
            document.getElementById('main').innerHTML = '<button id="nameless"></button><p id="pale" style="color: #999; background: #aaa">pale</p><img src="data:,"><input type="text">';
            return [await read(), await read(given[0])];""", OF_COLOURS)
        self.assertEqual([sorted({one.split(":")[0] for one in found}) for found in told],
                         [["button-name", "color-contrast", "image-alt", "label"], ["color-contrast"]])

    def test_what_it_cannot_tell_is_told_unless_it_is_held(self):
        self.open("en", SIZES[0])
        told = self.does(READ + """
            const needs = async (html) => { document.getElementById('main').innerHTML = html; return (await read()).filter((one) => one.startsWith('needs a look')).map((one) => one.split(': ')[1]); };
            const over = '<div style="position: absolute; inset: 0; background: #fff"></div>';
            return [await needs('<p style="background-image: linear-gradient(#fff, #000)">over a picture</p>'), await needs('<div aria-label="Wood">oak</div>'),
              await needs(`<div style="position: relative"><p>under it</p>${over}</div>`), await needs('<div style="position: relative"><p style="position: relative; z-index: 1">over it</p></div>'),
              await needs('<button type="button" aria-label="">\u25b2</button>'), await needs('<button type="button" aria-label="stop moving">\u25a0</button>')]""")
        self.assertEqual(told, [["color-contrast bgGradient"], ["aria-prohibited-attr noRoleSingular"], ["color-contrast bgOverlap"], [], ["color-contrast nonBmp"], []])

    def test_nothing_wrong_on_any_screen(self):
        held = set()
        for language in ("en", "de"):
            for size in SIZES:
                self.open(language, size)
                for name, *rest in SCREENS:
                    with self.subTest(f"{language}, {size[0]} px, {'/'.join([name, *rest])}"):
                        told = self.does(CELL + EVERYTHING + READ + """
                            const [name, rest, colours] = given, id = name === 'new_picture' ? 'new' : name;
                            const {showFrame} = await load('frame.js');
                            await show(name, rest);
                            showFrame(['cell', 'setup', 'panels', 'scan', 'new', 'run', 'assembly', 'alarms', 'history', 'calibration', 'settings', 'log', 'account'].map((id) => ({id})), id);
                            main.className = `screen-${id}`;
                            const out = {};
                            for (const theme of ['light', 'dark']) {
                              document.documentElement.dataset.theme = theme;
                              out[theme] = await read(theme === 'light' ? null : colours);
                            }
                            return {out, faults, held: Object.keys(held), length: main.innerText.length};""", name, rest, OF_COLOURS)
                        held.update(told["held"])
                        self.assertEqual(told["faults"], [])
                        self.assertGreater(told["length"], 30)
                        self.assertEqual(told["out"], {"light": [], "dark": []})
        self.assertEqual(held, set(HELD), "what is held is there")

    def test_nothing_wrong_where_jobs_wait(self):
        for size in SIZES:
            self.open("en", size)
            told = self.does(CELL + EVERYTHING + READ + QUEUE + "main.className = 'screen-run'; return [main.querySelectorAll('.job-places button').length, await read(), faults];")
            self.assertEqual(told, [6, [], []])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
