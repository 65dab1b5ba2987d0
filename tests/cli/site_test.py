#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The site of all pages (tools/site): every link leads to a page and an anchor that exist, the search finds, and a browser shows it."""
import re
import subprocess
import sys
import unittest
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

from harness import HAL, ROOT, SANITIZED, Case
from web import Browser, have_browser

BUILD = HAL.parent.parent
REFERENCE = BUILD / "reference/html"
LIBRARIES = (
    re.findall(
        r"^HALCYON_CMARK(?:_EXTENSIONS)?:FILEPATH=(/.*)$",
        (BUILD / "CMakeCache.txt").read_text(),
        re.MULTILINE,
    )
    if (BUILD / "CMakeCache.txt").exists()
    else []
)


class Page(HTMLParser):
    def __init__(self, path):
        super().__init__()
        self.links, self.ids, self.open = [], set(), []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in ("href", "src"):
                self.links.append(value)
            elif name == "id":
                self.ids.add(value)


def dead_links(site):
    pages = {path: Page(path) for path in site.rglob("*.html")}
    for path, page in pages.items():
        for link in page.links:
            if re.match(r"(https?|mailto|ws):", link):
                continue
            name, _, anchor = unquote(link).partition("#")
            target = (path.parent / name).resolve() if name else path
            if not target.is_file():
                yield f"{path.relative_to(site)}: {link} does not exist"
            elif anchor and target in pages and anchor not in pages[target].ids:
                yield f"{path.relative_to(site)}: {link}: no such anchor"


class Site(Case):
    @classmethod
    def build(cls, root, output):
        return subprocess.run(
            [
                sys.executable,
                ROOT / "tools/site/build.py",
                root,
                output,
                "--hal",
                HAL,
                "--reference",
                REFERENCE,
                "--cmark",
                LIBRARIES[0],
                "--extensions",
                LIBRARIES[1],
            ],
            capture_output=True,
            text=True,
        )

    def setUp(self):
        super().setUp()
        self.site = self.folder / "site"

    def built(self):
        done = self.build(ROOT, self.site)
        self.assertEqual(0, done.returncode, done.stdout + done.stderr)

    def test_every_page_is_there_and_every_link_leads_somewhere(self):
        self.built()
        self.assertEqual([], sorted(dead_links(self.site)))
        for name in (
            "index",
            "CONTRIBUTING",
            "docs/tutorials/write-a-netlist",
            "docs/decisions/index",
            "halfiles/furuta/index",
            "reference/pid",
            "commands",
            "errors",
        ):
            self.assertTrue((self.site / f"{name}.html").exists(), name)
        index = (self.site / "search-index.js").read_text()
        self.assertGreater(len(index), 500_000)
        for text in (
            '["Diagnostics","two-writers","errors.html#two-writers"',
            '["pid","","reference/pid.html"',
            '["Commands","run","commands.html#run"',
            '["Commands","can dump","commands.html#can-dump"',
        ):
            self.assertIn(text, index)

    def test_every_page_is_reached_by_links_from_the_first(self):
        self.built()
        pages = {path.resolve(): Page(path) for path in self.site.rglob("*.html")}
        reached, open_pages = set(), [(self.site / "index.html").resolve()]
        while open_pages:
            path = open_pages.pop()
            if path in reached or path not in pages:
                continue
            reached.add(path)
            open_pages += [
                (path.parent / unquote(link).partition("#")[0]).resolve()
                for link in pages[path].links
                if not re.match(r"[a-z]+:|#", link)
            ]
        self.assertEqual(
            [],
            sorted(str(path.relative_to(self.site.resolve())) for path in pages.keys() - reached),
        )

    def test_a_dead_link_in_a_page_fails(self):
        root = self.folder / "root"
        root.mkdir()
        (root / "README.md").write_text(
            "# Title\n\n[there](gone.md), [here](#title), [nowhere](#gone)\n"
        )
        done = self.build(root, self.site)
        self.assertEqual(
            (1, "README.md: links to gone.md, which does not exist\n"),
            (done.returncode, done.stderr),
        )
        self.assertEqual(
            ["index.html: #gone: no such anchor", "index.html: gone.html does not exist"],
            sorted(line for line in dead_links(self.site) if "gone" in line),
        )

    @unittest.skipUnless(have_browser(), "needs Chromium")
    def test_a_browser_shows_and_searches_it_on_screens_and_phones_light_and_dark(self):
        self.built()
        browser = Browser(self)
        browser.open((self.site / "docs/tutorials/write-a-netlist.html").as_uri())
        browser.wait(
            "document.querySelector('nav a[aria-current]').textContent === 'Write a netlist'"
        )
        for width, height, dark in (
            (1280, 800, False),
            (1280, 800, True),
            (390, 800, False),
            (390, 800, True),
        ):
            browser.size(width, height, dark)
            browser.wait(
                f"innerWidth === {width} && document.querySelector('nav details').open === {str(width > 832).lower()}"
            )
            self.assertEqual(
                width,
                browser.evaluate("document.documentElement.scrollWidth"),
                "the page is wider than the screen",
            )
            colours = browser.evaluate(
                "[getComputedStyle(document.body).backgroundColor, getComputedStyle(document.body).color].map(c => c.match(/\\d+/)[0])"
            )
            self.assertEqual(dark, int(colours[0]) < int(colours[1]), colours)
        browser.size(1280, 800)
        browser.evaluate("document.getElementById('search').focus()")
        for words, title, page in (
            ("pid", "pid", "reference/pid.html"),
            ("two-writers", "Diagnostics › two-writers", "errors.html#two-writers"),
            (
                "square wave four",
                "Write a netlist › The four commands",
                "docs/tutorials/write-a-netlist.html#the-four-commands",
            ),
        ):
            browser.evaluate(
                f"(box => {{ box.value = '{words}'; box.dispatchEvent(new Event('input')); }})(document.getElementById('search'))"
            )
            found = "document.querySelector('#found a')"
            browser.wait(
                f"{found}.firstChild.textContent === {title!r} && {found}.href.endsWith({page!r})"
            )
        browser.evaluate("document.querySelector('#found a').click()")
        browser.wait("location.hash === '#the-four-commands'")
        self.assertEqual([], browser.errors)


if __name__ == "__main__":
    if SANITIZED or len(LIBRARIES) < 2 or not REFERENCE.exists():
        print(
            "needs libcmark-gfm, the built reference (ninja reference), and a program without sanitizers"
        )
        sys.exit(77)
    unittest.main()
