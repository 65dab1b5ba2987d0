# SPDX-License-Identifier: MIT
# awk -v command=run -v machines=halfiles -f needs.awk -- ARGUMENT...
# Prints what a command of `hal` needs in addition to the program, one name per line: components, with _ for -, and
#     bus       the program of the bus tools
#     python    Python's module hal
#     all       all components
# It runs before the program is built, so it is only a rough parser of netlists and INI files: it may print an unused name, or one that is not
# a component, and it misses names that only the program can determine. The program builds missing ones later (runtime/machine/load/plugins.cpp).

function emit(name) {
    gsub(/["']/, "", name)
    gsub(/-/, "_", name)
    if (name != "" && !(name in emitted)) {
        emitted[name] = 1
        print name
    }
}

# The possible values of a variable of a netlist.
function offer(text,    words, i, count) {
    count = split(text, words, /[ \t=,]+/)
    for (i = 1; i <= count; ++i)
        if (words[i] ~ /^[A-Za-z][A-Za-z0-9_-]*$/) offered[words[i]] = 1
}

function folder_of(path) {
    return path ~ /\// ? substr(path, 1, match(path, /\/[^\/]*$/)) : ""
}

# Whether a file exists. Closes it, so a file that is being read is not asked: it would be read from its beginning again.
function there(path,    line, result) {
    if (path in seen) return 1
    result = (getline line < path)
    close(path)
    return result >= 0
}

# A Python program may import the module.
function read_program(path,    line) {
    while ((getline line < path) > 0)
        if (line ~ /^[ \t]*(import|from)[ \t]+(py)?hal([ \t.,]|$)/) emit("python")
    close(path)
}

# Names the bus tools for a program and its first word that are in them, as `hal can`.
function emit_bus(program, word) {
    if (program ~ /(^|\/)hal$/ && word ~ /^(can|canopen|node|ethercat|scocan|modbus|mesa)$/) emit("bus")
}

# Whether a command loads components, or prints their pages.
function needs_components() {
    return command ~ /^(run|examples|sim|check|graph|doc|shell|build|halrun)$/
}

# A command of a netlist, or several words of the command line that may be one.
function read_command(text, folder,    words, count, i) {
    sub(/#.*/, "", text)
    count = split(text, words, /[ \t]+/)
    for (i = 1; i < count; ++i) {
        if (words[i] == "loadrt") {
            if (words[i + 1] ~ /[[$]/) substituted = 1
            else emit(words[i + 1])
        }
        if (words[i] == "source") read_file(words[i + 1], folder)
        emit_bus(words[i], words[i + 1])
        if (words[i] == "loadusr") for (; i <= count; ++i) {
            if (words[i] ~ /[.]py$/) {
                read_program(words[i])
                read_program(folder words[i])
            }
            emit_bus(words[i], words[i + 1])
        }
    }
}

# Finds a file as it was named, or in the folder of the file that names it.
function read_file(name, folder,    path, line, text, ini) {
    gsub(/["']/, "", name)
    path = there(name) ? name : folder name
    if (path in seen) return
    seen[path] = 1
    ini = path ~ /[.]ini$/
    folder = folder_of(path)
    while ((getline line < path) > 0) {
        sub(/\r$/, "", line)
        if (line ~ /\\$/) {
            text = text substr(line, 1, length(line) - 1) " "
            continue
        }
        text = text line
        if (!ini) read_command(text, folder)
        else if (text ~ /^[ \t]*[^#; \t][^=]*=/) {
            offer(substr(text, index(text, "=") + 1))
            if (text ~ /^[ \t]*(POSTGUI_)?HALFILE[ \t]*=/) {
                sub(/^[^=]*=[ \t]*/, "", text)
                sub(/[ \t].*/, "", text)
                read_file(folder text, "")
            } else if (text ~ /^[ \t]*HALCMD[ \t]*=/) read_command(substr(text, index(text, "=") + 1), folder)
        }
        text = ""
    }
    close(path)
}

BEGIN {
    emit_bus("hal", command)
    if (!needs_components()) exit
    for (i = 2; i < ARGC; ++i) {  # the first is the command itself
        if (ARGV[i] == "--node" || ARGV[i] ~ /^--node=/) nodes = 1
        if (command == "doc" && ARGV[i] == "--all") emit("all")
        if (command ~ /^(doc|build)$/ && ARGV[i - 1] != "--output" && ARGV[i] ~ /^[A-Za-z]/ && ARGV[i] !~ /[\/.]/) emit(ARGV[i])
        offer(ARGV[i])
        line = line " " ARGV[i]
    }
    if (command == "examples" && ARGC > 2) read_file(machines "/" ARGV[2] ".hal", "")
    if (command != "doc") {
        for (i = 2; i < ARGC; ++i)
            if (ARGV[i] !~ /^-/ && (ARGV[i] ~ /[.](hal|ini)$/ || command ~ /^(run|sim|check|graph|halrun|build)$/)) read_file(ARGV[i], "")
        read_command(line, "")
    }
    if (nodes) {  # the signals between the nodes of a cell
        emit("node")
        emit("dds_publish")
        emit("dds_subscribe")
    }
    if (substituted) for (name in offered) emit(name)
}
