# SPDX-License-Identifier: MIT
# awk -f alone.awk SOURCE...
# Prints the sources that cannot be compiled as one with those before them, because they define a name in an anonymous namespace
# differently. A rough parser for the style of this tree: such a name is in the first line of its declaration, which is not indented.
# Also prints those that call hal::quoted() unqualified, when another source includes std::quoted(), which would be ambiguous.

function finish(    name, taken) {
    for (name in names)
        if (name in owner) taken = 1
    if (taken) print file
    else for (name in names) owner[name] = file
    split("", names)
}

# Returns the name that a line declares, or "".
function declared(text,    at) {
    sub(/^template *<[^>]*(<[^>]*>[^>]*)*> */, "", text)
    if (text ~ /^(using +namespace|namespace|static_assert|friend|extern)/) return ""
    if (match(text, /^(struct|class|enum class|enum|union|using) +[A-Za-z_][A-Za-z_0-9]*/)) {
        text = substr(text, 1, RLENGTH)
        sub(/.* /, "", text)
        return text
    }
    at = match(text, /[({=;[]/)
    if (at) text = substr(text, 1, at - 1)
    sub(/ +$/, "", text)
    if (text !~ /[ *&>]/ || !match(text, /[A-Za-z_][A-Za-z_0-9]*$/)) return ""
    return substr(text, RSTART)
}

FNR == 1 {
    if (file != "") finish()
    file = FILENAME
    depth = inside = raw = comment = 0
}

{
    line = $0
    if (raw) {  # R"( ... )"
        if (!match(line, /\)[a-z]*"/)) next
        line = substr(line, RSTART + RLENGTH)
        raw = 0
    }
    gsub(/\\./, "", line)
    gsub(/'[^']'/, "0", line)
    if (line ~ /^#include <(filesystem|iomanip)>/) manipulators = 1
    gsub(/R"[a-z]*\([^"]*\)[a-z]*"/, "0", line)
    if (match(line, /R"[a-z]*\(/)) {
        raw = 1
        line = substr(line, 1, RSTART - 1)
    }
    gsub(/"[^"]*"/, "0", line)
    sub(/\/\/.*/, "", line)
    if (line ~ /^#/) next
    if (line ~ /(^|[^:_A-Za-z])quoted\(/) quotes[file] = 1
    if (inside && depth == inside && line ~ /^[A-Za-z]/ && (name = declared(line)) != "") names[name] = 1
    if (line ~ /^namespace *\{/ && !inside) inside = depth + 1
    depth += gsub(/\{/, "{", line) - gsub(/\}/, "}", line)
    if (inside && depth < inside) inside = 0
}

END {
    if (file != "") finish()
    if (manipulators)
        for (file in quotes) print file
}
