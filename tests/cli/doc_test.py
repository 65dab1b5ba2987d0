#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""hal doc --all: the component reference as web pages and man pages."""
import html.parser
import os
import shutil
import subprocess
import unittest

from harness import Case, needs_package


class Links(html.parser.HTMLParser):
    """What a page links to, which ids it has, and whether its elements are closed."""

    EMPTY = {"meta", "input", "br", "hr", "img", "col"}

    def __init__(self, text):
        super().__init__()
        self.links, self.ids, self.open = [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.links += [attributes[key] for key in ("href", "src") if attributes.get(key)]
        self.ids += [attributes["id"]] if "id" in attributes else []
        if tag not in self.EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            raise AssertionError(f"</{tag}> closes nothing that is open")


class Reference(Case):
    def names(self):
        return [line.split()[0] for line in self.good("doc").splitlines()]

    def test_the_synopsis_has_the_name_of_the_file(self):
        self.assertIn("loadrt and2 [", self.good("doc", "and2"))
        self.assertIn("loadrt conv_bit_float [", self.good("doc", "conv_bit_float"))
        self.assertIn("loadrt safety_switch [", self.good("doc", "safety_switch"))

    def test_web_pages_are_whole_and_need_nothing_else(self):
        self.assertEqual("", self.good("doc", "--all", "--output", "pages"))
        folder = self.folder / "pages"
        index = Links((folder / "index.html").read_text())
        self.assertEqual(
            sorted(os.listdir(folder)),
            sorted([*index.links, "index.html"]),
            "the index has every page once",
        )
        self.assertIn("search", index.ids)
        for name in os.listdir(folder):
            text = (folder / name).read_text()
            page = Links(text)
            self.assertEqual([], page.open, name)
            self.assertEqual(len(set(page.ids)), len(page.ids), f"{name} has an id twice")
            if name != "index.html":
                self.assertEqual(["index.html"], page.links, name)
        self.assertEqual(len(self.names()), len(index.links))
        self.assertIn('<h2 id="pins">', (folder / "sum2.html").read_text())

    @needs_package("estimation")
    def test_defaults_are_the_shortest_number_that_is_read_as_the_same(self):
        page = self.good("doc", "fir") + self.good("doc", "furuta")
        self.assertIn("below 0.5 (default 0.1)\n", page)
        self.assertIn("rad (default 0)\n", page)
        self.assertNotIn("0000)", page)

    @unittest.skipUnless(shutil.which("groff"), "no groff here")
    def test_man_pages_are_read_without_a_warning(self):
        self.assertEqual("", self.good("doc", "--all", "--man", "--output", "man9"))
        pages = sorted(os.listdir(self.folder / "man9"))
        self.assertEqual(len(self.names()), len(pages))
        self.assertTrue(
            all(page.startswith("hal-") and page.endswith(".9") for page in pages), pages
        )
        # as man does it, but one process for all
        done = subprocess.run(
            ["groff", "-Kutf8", "-Tutf8", "-P-cbou", "-t", "-man", "-ww", "-rLL=200n", *pages],
            cwd=self.folder / "man9",
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            stdin=subprocess.DEVNULL,
            text=True,
        )
        self.assertEqual((0, ""), (done.returncode, done.stderr))
        self.assertEqual(len(pages), done.stdout.count("SYNOPSIS"))

    def test_pages_of_some_components_and_rejected_options(self):
        self.good("doc", "sum2", "--markdown", "-o", "some")
        self.assertEqual(["sum2.md"], os.listdir(self.folder / "some"))
        self.assertTrue(self.good("doc", "sum2", "--html").startswith("<!DOCTYPE html>"))
        self.assertEqual(
            "hal doc: --all needs a folder; type: hal doc --all --output DIR\n",
            self.bad("doc", "--all"),
        )
        self.assertIn("leave one out", self.bad("doc", "--all", "sum2", "-o", "x"))
        self.assertIn("exclude each other", self.bad("doc", "sum2", "--html", "--man"))
        self.write("file", "")
        self.assertEqual(
            "hal doc: cannot create 'file/x': Not a directory\n",
            self.bad("doc", "--all", "-o", "file/x"),
        )


if __name__ == "__main__":
    unittest.main()
