#!/usr/bin/python3
"""axe_test.py CONSOLE: every screen as axe-core reads it, in both languages, both themes, on a desk and on a phone: nothing that it
calls serious or critical. Names, roles and order, which sight_test.py does not look at.

AXE_CORE names its axe.min.js, as ./dev test fetches it; without it nothing is checked, and ctest tells this as skipped.
"""
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

READ = """
    const read = async (rules = null) => {
      const {violations} = await axe.run(document, {resultTypes: ['violations'], ...(rules && {runOnly: {type: 'rule', values: rules}})});
      return violations.filter(({impact}) => ['serious', 'critical'].includes(impact)).flatMap(({id, nodes}) => nodes.map(({html}) => `${id}: ${html.slice(0, 200)}`));
    };
"""


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

    def test_nothing_serious_on_any_screen(self):
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
                            return {out, faults, length: main.innerText.length};""", name, rest, OF_COLOURS)
                        self.assertEqual(told["faults"], [])
                        self.assertGreater(told["length"], 30)
                        self.assertEqual(told["out"], {"light": [], "dark": []})


    def test_nothing_serious_where_jobs_wait(self):
        for size in SIZES:
            self.open("en", size)
            told = self.does(CELL + EVERYTHING + READ + QUEUE + "main.className = 'screen-run'; return [main.querySelectorAll('.job-places button').length, await read(), faults];")
            self.assertEqual(told, [6, [], []])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
