#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""build.py ROOT OUTPUT --hal PROGRAM --reference FOLDER --cmark LIBRARY --extensions LIBRARY

Writes all Markdown pages below ROOT, what they link to, the component reference, the commands and the diagnostics as one site."""
import argparse
import fnmatch
import html
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path, PurePosixPath

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
from markdown import Markdown, plain  # noqa: E402

PICTURES = {".svg", ".png", ".csv"}
NAVIGATION = (  # title, pages: a path, or a pattern of paths
    (
        "Start",
        (
            "README.md",
            "docs/glossary.md",
            "docs/tutorials/write-a-netlist.md",
            "docs/tutorials/*.md",
        ),
    ),
    ("Guides", ("docs/[!dvgi]*.md", "docs/device-descriptions.md")),
    ("Reference", ("reference/index.html", "commands.html", "errors.html")),
    ("Machines", ("halfiles/README.md", "halfiles/*/README.md")),
    (
        "Project",
        (
            "CONTRIBUTING.md",
            "CHANGELOG.md",
            "SECURITY.md",
            "docs/versioning.md",
            "docs/design.md",
            "docs/internals/README.md",
            "docs/internals/*.md",
            "docs/decisions/README.md",
        ),
    ),
    ("Folders", ("[!hir]*/README.md", "runtime/README.md")),
)


def parent_of(page, other):
    """A relative address of `other`, from `page`."""
    return os.path.relpath(other, PurePosixPath(page).parent).replace(os.sep, "/")


def address(path):
    """Where a file of the tree is in the site."""
    path = PurePosixPath(path)
    if path.suffix == ".md":
        return str(
            path.with_name("index.html") if path.name == "README.md" else path.with_suffix(".html")
        )
    return str(path) if path.suffix in {*PICTURES, ".html"} else f"{path}.html"


class Site:
    def __init__(self, options):
        self.root, self.output = Path(options.root).resolve(), Path(options.output).resolve()
        self.options = options
        self.markdown = Markdown(options.cmark, options.extensions)
        self.pages = {}  # address -> (title, body)
        self.wanted = set()  # files and folders that pages link to
        self.problems = []

    # --- pages

    def tracked(self):
        git = [
            "git",
            "-c",
            "safe.directory=*",
            "-C",
            str(self.root),
            "ls-files",
            "-z",
            "--cached",
            "--others",
            "--exclude-standard",
            "*.md",
        ]
        if (self.root / ".git").exists():
            names = subprocess.run(git, check=True, capture_output=True).stdout.decode().split("\0")
        else:
            names = [
                p.relative_to(self.root).as_posix()
                for p in self.root.rglob("*.md")
                if p.relative_to(self.root).parts[0] != "build"
            ]
        return sorted(name for name in names if name and (self.root / name).is_file())

    def resolve(self, page, link):
        """The address of what a page of the tree links to."""
        if re.match(r"[a-z]+:", link) or link.startswith("#"):
            return link
        path, _, anchor = link.partition("#")
        target = os.path.normpath(os.path.join(os.path.dirname(page), path))
        found = self.root / target
        if found.is_dir():
            target = f"{target}/README.md" if (found / "README.md").exists() else target
            where = address(target) if target.endswith(".md") else f"{target}/index.html"
        else:
            where = address(target)
        if not found.exists():
            self.problems.append(f"{page}: links to {link}, which does not exist")
        elif not target.endswith(".md"):
            self.wanted.add(target)
        return parent_of(address(page), where) + (f"#{anchor}" if anchor else "")

    def add_markdown(self, name):
        text = self.markdown.html((self.root / name).read_text(encoding="utf-8"))
        text = re.sub(
            r'(<a href|<img src)="([^"]*)"',
            lambda m: f'{m[1]}="{html.escape(self.resolve(name, html.unescape(m[2])))}"',
            text,
        )
        title = re.search(r"<h1[^>]*>(.*?)<a class", text)
        self.pages[address(name)] = (plain(title[1]) if title else name, text)

    def add_linked(self):
        """Pictures as they are; sources as pages; folders as lists."""
        for name in sorted(self.wanted):
            path = self.root / name
            if path.is_dir():
                entries = "".join(
                    f"<li>{html.escape(p.name)}</li>"
                    for p in sorted(path.iterdir())
                    if not p.name.startswith(".")
                )
                self.pages[f"{name}/index.html"] = (
                    name,
                    f"<h1>{html.escape(name)}</h1><ul>{entries}</ul>",
                )
            elif path.suffix in PICTURES:
                (self.output / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, self.output / name)
            else:
                source = html.escape(path.read_text(encoding="utf-8", errors="replace"))
                self.pages[address(name)] = (
                    name,
                    f"<h1>{html.escape(name)}</h1><pre><code>{source}</code></pre>",
                )

    def add_reference(self):
        for path in sorted(Path(self.options.reference).glob("*.html")):
            text = path.read_text(encoding="utf-8")
            body = re.search(r"<body>\n(.*)</body>", text, re.DOTALL)[1]
            body = re.sub(
                r"<script>.*?</script>|<nav>.*?</nav>|<p><input id=\"search\".*?</p>",
                "",
                body,
                flags=re.DOTALL,
            )
            for table in set(re.findall(r"<table>.*?</table>", body, re.DOTALL)):
                kind = "wide pins" if 'class="type"' in table else "wide"
                body = body.replace(table, f'<div class="{kind}">{table}</div>')
            title = re.search(r"<title>(.*?) · Halcyon</title>", text)[1]
            self.pages[f"reference/{path.name}"] = (html.unescape(title), body)

    def printed(self, *words):
        return subprocess.run(
            [self.options.hal, *words],
            check=True,
            capture_output=True,
            text=True,
            env={**os.environ, "NO_COLOR": "1"},
        ).stdout

    def add_printed(self, name, title, introduction, entries):
        """A page of what the program prints about each of `entries`: (heading, words of the command)."""
        body = f'<h1 id="{name}">{title}</h1>\n<p>{introduction}</p>\n'
        for heading, words in entries:
            anchor = heading.replace(" ", "-")
            body += f'<h2 id="{anchor}">{html.escape(heading)}</h2>\n<pre class="printed">{html.escape(self.printed(*words))}</pre>\n'
        self.pages[f"{name}.html"] = (title, body)

    def commands(self):
        for line in self.printed("help").splitlines():
            if found := re.match(r"  ([\w-]+) +\S", line):
                shown = self.printed("help", found[1])
                grouped = (
                    re.findall(
                        rf"^  ({found[1]} [\w -]*\w)  +\S|^  ({found[1]} [\w -]*\w) \S",
                        shown,
                        re.MULTILINE,
                    )
                    if "COMMAND …" in shown
                    else []
                )
                if not grouped:
                    yield found[1], ("help", found[1])
                for first, second in grouped:
                    name = self.command_in(first or second)
                    if name:
                        yield name, ("help", *name.split())

    def command_in(self, words):
        """The longest beginning of `words` that is a command."""
        parts = words.split()
        for count in range(len(parts), 1, -1):
            shown = subprocess.run(
                [self.options.hal, "help", *parts[:count]], capture_output=True, text=True
            )
            if shown.returncode == 0 and shown.stdout.startswith(f"hal {' '.join(parts[:count])}:"):
                return " ".join(parts[:count])
        return None

    def add_below(self):
        """At the end of a folder's page: the pages below it that it does not link to."""
        below = {}
        for where in sorted(self.pages):
            folders = (
                PurePosixPath(where).parents
                if not where.endswith("/index.html")
                else PurePosixPath(where).parent.parents
            )
            page = next(
                (
                    p
                    for p in (f"{folder}/index.html" for folder in folders if folder.name)
                    if p in self.pages
                ),
                None,
            )
            if page and f'href="{html.escape(parent_of(page, where))}' not in self.pages[page][1]:
                below.setdefault(page, []).append(where)
        for page, found in below.items():
            items = "".join(
                f'<li><a href="{html.escape(parent_of(page, where))}">{html.escape(self.pages[where][0])}</a></li>'
                for where in found
            )
            title, body = self.pages[page]
            self.pages[page] = (
                title,
                f'{body}\n<h2 id="in-this-folder">In this folder</h2>\n<ul>{items}</ul>',
            )

    # --- the site

    def navigation(self):
        """(section, [(address, title)...]): each page once, where it is named first."""
        listed = set()
        for title, patterns in NAVIGATION:
            items = []
            for pattern in map(address, patterns):
                where = [
                    w
                    for w in sorted(self.pages)
                    if w.count("/") == pattern.count("/")
                    and fnmatch.fnmatchcase(w, pattern)
                    and w not in listed
                ]
                listed.update(where)
                items += [(w, "Halcyon" if w == "index.html" else self.pages[w][0]) for w in where]
            yield title, items

    @staticmethod
    def navigation_of(sections, here):
        def item(where, title):
            current = ' aria-current="page"' if where == here else ""
            return f'<li><a href="{html.escape(parent_of(here, where))}"{current}>{html.escape(title)}</a></li>'

        return "\n".join(
            f"<h2>{title}</h2>\n<ul>{''.join(item(*one) for one in items)}</ul>"
            for title, items in sections
        )

    def write(self):
        sections = list(self.navigation())
        for where, (title, body) in self.pages.items():
            top = parent_of(where, "index.html")[: -len("index.html")]
            page = TEMPLATE.format(
                title=html.escape(title),
                top=top,
                navigation=self.navigation_of(sections, where),
                body=body,
            )
            path = self.output / where
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(page, encoding="utf-8")
        for name in ("style.css", "search.js"):
            shutil.copyfile(HERE / name, self.output / name)
        index = json.dumps(list(self.index()), ensure_ascii=False, separators=(",", ":"))
        (self.output / "search-index.js").write_text(
            f"window.halcyonIndex={index};\n", encoding="utf-8"
        )

    def index(self):
        """An entry per section: page, heading, address, text."""
        for where, (title, body) in sorted(self.pages.items()):
            parts = re.split(r'<h[1-3] id="([^"]*)">(.*?)(?:<a class="anchor".*?)?</h[1-3]>', body)
            for text, anchor, heading in zip(
                [parts[0] if parts[0].strip() else "", *parts[3::3]],
                ["", *parts[1::3]],
                ["", *parts[2::3]],
            ):
                words = " ".join(plain(text.replace("<", " <")).split())
                if words or heading:
                    yield [title, plain(heading), where + (f"#{anchor}" if anchor else ""), words]

    def build(self):
        if self.output.exists():
            shutil.rmtree(self.output)
        self.output.mkdir(parents=True)
        for name in self.tracked():
            self.add_markdown(name)
        self.add_linked()
        self.add_reference()
        self.add_printed(
            "commands",
            "Commands",
            "What <code>hal help COMMAND</code> prints.",
            list(self.commands()),
        )
        codes = [
            line.split()[0]
            for line in self.printed("explain").splitlines()
            if re.match(r"\s*[a-z][a-z0-9-]+  ", line)
        ]
        self.add_printed(
            "errors",
            "Diagnostics",
            "What <code>hal explain CODE</code> prints; the code is in [brackets] at the end of a message.",
            [(code, ("explain", code)) for code in codes],
        )
        self.add_below()
        self.write()
        print(f"{len(self.pages)} pages in {self.output}/index.html")
        if self.problems:
            sys.exit("\n".join(self.problems))


TEMPLATE = """<!DOCTYPE html>
<!-- SPDX-License-Identifier: MIT -->
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title} · Halcyon</title>
<link rel="stylesheet" href="{top}style.css">
<script src="{top}search.js" data-top="{top}" defer></script>
</head>
<body>
<a class="skip" href="#content">to the content</a>
<header><a class="name" href="{top}index.html">Halcyon</a>
<div id="finder" role="search" hidden><input id="search" type="search" placeholder="search (/)" aria-label="search" autocomplete="off"><ol id="found" hidden></ol></div></header>
<nav><details open><summary>Pages</summary>
{navigation}
</details></nav>
<main id="content">
{body}
</main>
</body>
</html>
"""


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    for position in ("root", "output"):
        parser.add_argument(position)
    for option in ("hal", "reference", "cmark", "extensions"):
        parser.add_argument(f"--{option}", required=True)
    Site(parser.parse_args()).build()
