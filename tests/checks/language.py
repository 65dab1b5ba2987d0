#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""language.py ROOT [PATH...]: no string, page or comment uses a paraphrase where the field has a term.

Each rule is a pattern and the term to use. Checked are string literals and comments of sources, whole pages, netlists and expected outputs.
Not checked are identifiers: in code, in backticks, with a hyphen (thread-refused), or as the only word of a string (a key, a pin); except those of
the installed headers, whose parts have a vocabulary of their own. A line that quotes somebody else's output ends with the comment `language: quoted`.
"""

import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from files import tracked

RULES = [
    (
        r"(?<!there )(?:is|are|was|were|be) no (?!longer|more than|doubt|less|worse|better|fewer|such|good|slower|faster|different)[a-z-]+",
        "is not a valid X, invalid X, missing",
    ),
    (
        r"(?:that|which|it|this|one) (?:is|are) none|means nothing|there is no (?:option|argument|pin|command|component|thread|signal|function)s?\b(?! yet)",
        "invalid X, unknown X, missing",
    ),
    (r"(?:is|are|was|were) there twice|(?:is|are) twice (?:there|in)", "duplicate"),
    (r"(?:is|are|was|were) not there\b|\black(?:s|ed|ing)?\b(?! of)", "missing"),
    (r"(?:is|are|was|were) not known\b", "unknown, unsupported"),
    (
        r"\brefus(?:e|es|ed|al|als|ing)\b(?<!connection refused)(?! (?:the |a |further )?connections?)",
        "rejected (input), denied (permission); only a connection is refused",
    ),
    (r"\b(?:says?|said|saying|tells?|told|telling)\b", "reports, prints, logs, warns, states"),
    (r"\bbeliev\w+\b", "valid, accepted"),
    (r"\bmend(?:s|ed|ing)?\b|\bheal(?:s|ed|ing)?\b", "fix, repair, recover"),
    (
        r"\b(?:stands?|standing|stood) still\b",
        "stalls; the host is suspended; stops; at standstill",
    ),
    (r"\b(?:goes|go|going|gone|went) away\b", "is lost, disconnects, is removed"),
    (r"\b(?:comes|come|coming|came) back\b", "reconnects, recovers, returns"),
    (
        r"\b(?:is|are|was|were|be|been|being|falls?|fell|goes|went|stays?|stayed|remains?|keeps?) silent\b|\bsilent (?:for|since|node|station|drive|program|master)",
        "offline, not responding, no frames",
    ),
    (r"\bso long\b(?! as)|\bso long as\b", "duration, for at least N, as long as"),
    (r"\bpunctual\w*\b", "wake-up latency"),
    (r"\blate by\b", "latency, lateness"),
    (r"\b(?<!heart )beats?\b", "external clock reference, SYNC"),
    (r"\bwhole or not(?: at all)?\b|\bwhole or nothing\b", "atomic"),
    (r"\bundone\b", "rolled back"),
    (r"\b(?:at|in) one cycle boundary\b", "at the same cycle boundary"),
    (r"\bwhat is left\b|\bwhat was left\b", "remaining"),
    (
        r"\bno room\b|\broom (?:for|to|in)\b|\bhas room\b|\bmore room\b|\bis room\b",
        "capacity, space",
    ),
    (r"\bpatience\b|\bpatient(?:ly)?\b", "timeout"),
    (r"\bstrangers?\b", "unexpected response, unknown station, foreign"),
    (r"\bhas? the say\b", "takes precedence"),
    (r"\b(?:looks?|asks?|looking|asking) all the time\b", "polls, spins"),
    (r"\bthe way (?:to|from) the\b|\bthis way to\b", "path, path delay"),
    (
        r"\bwords (?:a|the|an|it|its|each|every|what|faults|events|them)\b|\bworded\b",
        "formats the message",
    ),
    (r"\bkeeper\b|\bjudge[sd]?\b|\bworkshop\b|\baside\b", "name the job"),
    (r"\bstretch(?:es)?\b", "segment, batch, chunk"),
    (r"\bsomebody\b|\bwhoever\b|\bwherefrom\b|\bwhereto\b", "name the actor"),
]
COMPILED = [(re.compile(pattern, re.IGNORECASE), term) for pattern, term in RULES]

# Parts of identifiers in the installed headers. Names of the ABI stay: other programs use them.
PUBLIC_HEADERS = ("runtime/abi/hal/", "runtime/sdk/hal/", "runtime/text/")
PARTS = [
    (r"most|longest|largest", "max"),
    (r"least|smallest", "min"),
    (r"room", "capacity, space"),
    (r"places?", "index, slot, offset, address"),
    (r"take", "parse, apply, receive, accept, pop"),
    (r"wish|asked|heard|patience|rubbish", "name the job"),
]
IDENTIFIERS = [
    (
        re.compile(rf"(?<![A-Za-z0-9])(?:[a-z0-9]+_)*(?:{part})(?:_[a-z0-9]+)*_?(?![A-Za-z0-9_])"),
        term,
    )
    for part, term in PARTS
]
ABI_NAMES = {"room", "place", "take", "write_in_place", "in_place"}

C_LIKE = {".c", ".h", ".cpp", ".hpp"}
HASH = {".py", ".sh", ".cmake", ".hal", ".ini", ".awk", ".comp"}
PAGES = {".md", ".expected", ".txt"}
OTHER = {".lua"}
SKIP = {"LICENSE", "tests/checks/language.py", "tests/checks/catches.py"}

C_TEXT = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\((.*?)\)\1"|"(?:[^"\\\n]|\\.)*"', re.DOTALL)
PY_TEXT = re.compile(
    r'"""(?:.|\n)*?"""|\'\'\'(?:.|\n)*?\'\'\'|"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)*\'|#[^\n]*'
)
LUA_TEXT = re.compile(r'"(?:[^"\\\n]|\\.)*"|--[^\n]*')


def texts(path, source):
    """(offset, text) of what a person reads in this file."""
    suffix = path.suffix
    if (
        suffix in PAGES
        or path.name in ("expected", "README", "CMakeLists.txt", "hal")
        or suffix in {".hal", ".ini", ".sh", ".cmake", ".awk", ".comp"}
    ):
        if suffix in {".sh", ".cmake", ".awk"} or path.name in ("CMakeLists.txt", "hal"):
            pattern = re.compile(r'"(?:[^"\\\n]|\\.)*"|(?:^|(?<=\s))#[^\n]*', re.MULTILINE)
            yield from ((m.start(), m.group()) for m in pattern.finditer(source))
        else:
            yield 0, source
    elif suffix in C_LIKE:
        yield from ((m.start(), m.group()) for m in C_TEXT.finditer(source))
    elif suffix == ".py":
        yield from ((m.start(), m.group()) for m in PY_TEXT.finditer(source))
    elif suffix == ".lua":
        yield from ((m.start(), m.group()) for m in LUA_TEXT.finditer(source))


def is_identifier(text, match):
    """Returns whether the match is a name and not prose: in backticks, part of a hyphenated name, a member, or the only word of a string."""
    before, after = text[: match.start()][-1:], text[match.end() :][:1]
    alone = before == after and before in ("`", '"', "'") and " " not in match.group()
    return alone or before == "-" or after == "-" or text[: match.start()].endswith(("self.", "->"))


def identifiers(name, source):
    """(offset, identifier, term) of the names in an installed header that use a paraphrase."""
    if not name.startswith(PUBLIC_HEADERS) or not name.endswith((".h", ".hpp")):
        return
    code = C_TEXT.sub(lambda text: re.sub(r"[^\n]", " ", text.group()), source)
    for pattern, term in IDENTIFIERS:
        for match in pattern.finditer(code):
            if match.group() not in ABI_NAMES:
                yield match.start(), match.group(), term


def violations(root, only=()):
    for path in tracked(root):
        name = path.as_posix()
        if name in SKIP or (only and not name.startswith(tuple(only))):
            continue
        try:
            source = (root / path).read_text()
        except (UnicodeDecodeError, OSError):
            continue
        lines = source.splitlines()
        for offset, identifier, term in identifiers(name, source):
            yield name, source.count("\n", 0, offset) + 1, identifier, term
        for offset, text in texts(path, source):
            for pattern, term in COMPILED:
                for match in pattern.finditer(text):
                    number = source.count("\n", 0, offset + match.start()) + 1
                    if "language: quoted" not in lines[number - 1] and not is_identifier(
                        text, match
                    ):
                        yield name, number, " ".join(match.group().split()), term


def main(root, *only):
    found = sorted(set(violations(root, only)))
    for name, number, words, term in found:
        print(f"{name}:{number}: '{words}': use: {term}")
    return 1 if found else 0


if (
    __name__ == "__main__"
):  # the test run passes the build tree, too; a person may pass folders instead
    sys.exit(
        main(
            Path(sys.argv[1]),
            *(folder for folder in sys.argv[2:] if not Path(folder).is_absolute()),
        )
    )
