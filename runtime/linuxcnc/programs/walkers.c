/* SPDX-License-Identifier: MIT */
/*
 * Some programs of LinuxCNC's (halcmd, halrmt, halmeter, halscope, the Tcl package Hal, Python's
 * _hal) follow pointers through its shared memory. A machine of ours has no such memory: a program
 * that is linked to these two variables ends before its main(), with the command that takes its
 * place. It is recognised by where the linker has put them: into the program.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "commands.h"

/* 8 bytes each: programs have copies of that size. Of a library they point to a page that nothing
 * may access: so functions of LinuxCNC's Python module that only test hal_shmem_base work, and
 * those that follow the pointers end with the sentence. */
char *hal_data, *hal_shmem_base;
const int halcyon_here = 0;

static const struct {
    const char *name, *instead;
} replaced[] = {
    {"halcmd", "halcmd of Halcyon, which loadusr and hal linuxcnc find first in PATH"},
    {"halrmt", "hal shell, or the control protocol (docs/protocol.md)"},
    {"halmeter", "hal meter NAME"},
    {"halscope", "hal scope, or hal panel in a browser"},
    {"classicladder",
     "classicladder --nogui FILE.clp, which loads a program for the module classicladder_rt"},
};

static void end(const char* name, const char* instead) {
    fprintf(stderr,
            "%s: this program reads LinuxCNC's memory directly, which a machine of Halcyon does "
            "not have. In its place: %s\n",
            name, instead);
    _exit(1);
}

static const char* const in_place_of_library =
    "Python's and Tcl's hal of Halcyon, which loadusr and hal linuxcnc find first where they are "
    "built";
static int own_variables; /* no program has copies of them */
static char* forbidden;
static long forbidden_size;
static struct sigaction before;

static void on_access(int number, siginfo_t* info, void* context) {
    (void)context;
    const char* const at = info->si_addr;
    if (at >= forbidden && at < forbidden + forbidden_size) {
        end(program_invocation_short_name, in_place_of_library);
    }
    sigaction(number, &before,
              NULL); /* another one's crash: it happens again, as it would without this handler */
}

/* Called by the first hal_init(). */
void halcyon_begins(void) {
    if (forbidden || !own_variables) return;
    forbidden_size = 1 << 20;
    char* const pages = mmap(NULL, (size_t)forbidden_size, PROT_NONE,
                             MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (pages == MAP_FAILED) return;
    forbidden = pages;
    struct sigaction ours = {.sa_flags = SA_SIGINFO | SA_ONSTACK, .sa_sigaction = on_access};
    sigemptyset(&ours.sa_mask);
    sigaction(SIGSEGV, &ours, &before);
    hal_data = hal_shmem_base = forbidden;
}

/* Without its window, classicladder only fills the module's memory with a program, and looks for no
 * pin. */
static int without_window(const char* name, int argc, char** argv) {
    if (strcmp(name, "classicladder") != 0) return 0;
    for (int i = 1; i < argc; ++i) {
        if (strcmp(argv[i], "--nogui") == 0) return 1;
    }
    return 0;
}

/* The C library gives constructors the arguments of main(). */
__attribute__((constructor)) static void check(int argc, char** argv) {
    Dl_info data, here;
    if (dladdr(&halcyon_here, &here) == 0) return;
    for (size_t i = 0;; ++i) {
        if (i == 2) {
            own_variables = 1;
            return;
        }
        if (dladdr(i == 0 ? &hal_data : &hal_shmem_base, &data) != 0 &&
            strcmp(data.dli_fname, here.dli_fname) != 0) {
            break;
        }
    }
    const char *const slash = strrchr(data.dli_fname, '/'), *const name =
                                                                slash ? slash + 1 : data.dli_fname;
    if (without_window(name, argc, argv)) return;
    for (size_t i = 0; i < sizeof replaced / sizeof *replaced; ++i) {
        if (strcmp(name, replaced[i].name) == 0) {
            end(name, replaced[i].instead);
        }
    }
    end(name, "hal shell, hal panel, or Python's hal module");
}

/* Reached by libraries that walk (Tcl's, Python's): these have no copies. */
#define WALKER(function)  \
    void* function(void); \
    void* function(void) { return end(#function, in_place_of_library), NULL; }
WALKER(list_add_after)
WALKER(list_add_before)
WALKER(list_init_entry)
WALKER(list_next)
WALKER(list_prev)
WALKER(list_remove_entry)
WALKER(halpr_find_comp_by_id)
WALKER(halpr_find_funct_by_name)
WALKER(halpr_find_funct_by_owner)
WALKER(halpr_find_param_by_name)
WALKER(halpr_find_param_by_owner)
WALKER(halpr_find_pin_by_name)
WALKER(halpr_find_pin_by_owner)
WALKER(halpr_find_pin_by_sig)
WALKER(halpr_find_sig_by_name)
WALKER(halpr_find_thread_by_name)

/* Python's component_exists() only tests the pointer; component_is_ready() follows it, and ends. */
void* halpr_find_comp_by_name(const char* name);
void* halpr_find_comp_by_name(const char* name) {
    return halcyon_component_exists(name) ? forbidden : NULL;
}

/* Functions that are rarely used and that a machine of ours does not offer to programs. */
#define MISSING(function)                                                                  \
    int function(void);                                                                    \
    int function(void) {                                                                   \
        fprintf(stderr,                                                                    \
                "%s: a machine of Halcyon does not have this function of LinuxCNC's; see " \
                "docs/linuxcnc-compatibility.md\n",                                        \
                #function);                                                                \
        _exit(1);                                                                          \
    }
MISSING(hal_comp_by_id)
MISSING(hal_comp_by_name)
MISSING(hal_comp_insmod_args)
MISSING(hal_enforce_exact_base_period)
MISSING(hal_getref_p)
MISSING(hal_getref_s)
MISSING(hal_list_comp)
MISSING(hal_list_funct)
MISSING(hal_list_p)
MISSING(hal_list_p_s)
MISSING(hal_list_s)
MISSING(hal_list_thread)
MISSING(hal_mutex_force_release)
MISSING(hal_statistics)
