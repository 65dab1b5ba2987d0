// SPDX-License-Identifier: MIT
// What tclsh executes before a netlist. The variables halcyon::requests, answers, pass and commands
// are set before it.
#pragma once

namespace hal::tools {

constexpr const char* tcl_prelude = R"tcl(
package provide Hal 1.0
fconfigure $halcyon::requests -translation binary -buffering full
fconfigure $halcyon::answers -translation binary

# A request is its size and a line feed, then the words separated by NUL; an answer is the status, the size and a line feed, then the text.
proc halcyon::request {words} {
    set bytes [encoding convertto utf-8 [join $words \0]]
    puts -nonewline $halcyon::requests "[string length $bytes]\n$bytes"
    flush $halcyon::requests
    if {[gets $halcyon::answers head] < 0} {exit 1}
    lassign $head status size
    return [::list $status [encoding convertfrom utf-8 [read $halcyon::answers $size]]]
}

proc hal {args} {
    if {[llength $args] == 0} {return -code error {wrong # args: should be "hal COMMAND ..."}}
    if {$args eq "--commands"} {return $halcyon::commands}
    # The list $::KINS(KINEMATICS) of one value, "trivkins coordinates=XYYZ", is the name and its arguments.
    if {[lindex $args 0] eq "loadrt"} {set args [lreplace $args 1 1 {*}[join [lindex $args 1]]]}
    set loads [expr {[lindex $args 0] in {loadrt loadusr}}]
    # With the loads runs what only looks; what it looks for may be missing then.
    set looks [expr {!$loads && $halcyon::pass eq "loads"}]
    if {$looks && [lindex $args 0] ni {list show getp gets ptype stype save status help}} return
    if {$loads && $halcyon::pass eq "rest"} return
    lassign [halcyon::request $args] status text
    if {$status == 0} {return $text}
    if {!$looks} {return -code error $text}
}

if {$halcyon::pass ne "both"} {
    namespace eval tp {}
    proc tp::passnumber {} {expr {$halcyon::pass eq "rest"}}
}

foreach halcyon::name $halcyon::commands {
    if {[info commands ::$halcyon::name] eq ""} {interp alias {} $halcyon::name {} hal $halcyon::name}
}

# As in LinuxCNC's haltcl, a value is an expression, and a table is printed; `hal setp` and `hal show` take the words as they are, and return.
# Tcl makes Inf of a number beyond the range of double: such a number is passed as it is, and rejected.
proc halcyon::value {text} {
    set value [uplevel 2 [::list expr $text]]
    if {$value in {Inf -Inf} && [string match {*[0-9]*} $text] && [string is double -strict $text]} {return $text}
    return $value
}
foreach halcyon::name {setp sets} {
    interp alias {} $halcyon::name {}
    proc $halcyon::name {name value} "hal $halcyon::name \$name \[halcyon::value \$value\]"
}
interp alias {} show {}
proc show {args} {puts [hal show {*}$args]}

proc halcyon::run {file} {
    if {![catch {uplevel #0 [::list source $file]} message options]} return
    set lines [split [dict get $options -errorinfo] \n]
    set last [lindex [lsearch -all -glob $lines {    (file "*" line *)}] end]
    if {$last eq ""} {set last end}
    puts stderr [join [lrange $lines 0 $last] \n]
    exit 1
}

proc halcyon::converse {prompts} {
    set text ""
    while 1 {
        if {$prompts} {
            puts -nonewline [expr {$text eq "" ? "haltcl: " : "haltcl+: "}]
            flush stdout
        }
        if {[gets stdin line] < 0} return
        append text $line \n
        if {![info complete $text]} continue
        if {[catch {uplevel #0 $text} result]} {puts stderr $result} elseif {$result ne ""} {puts $result}
        set text ""
    }
}
)tcl";

}  // namespace hal::tools
