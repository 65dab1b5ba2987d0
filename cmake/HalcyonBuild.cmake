# SPDX-License-Identifier: MIT
# How everything in this tree is compiled and linked.

get_property(HALCYON_MULTI_CONFIG GLOBAL PROPERTY GENERATOR_IS_MULTI_CONFIG)
if(NOT CMAKE_BUILD_TYPE AND NOT HALCYON_MULTI_CONFIG)
    set(CMAKE_BUILD_TYPE Release CACHE STRING "Debug, Release, RelWithDebInfo or MinSizeRel" FORCE)
endif()
set(CMAKE_CXX_FLAGS_RELEASE "-O2" CACHE STRING "" FORCE)  # assertions stay: they are cheap and never in a hot loop
set(CMAKE_CXX_FLAGS_DEBUG "-O1 -g -fno-omit-frame-pointer" CACHE STRING "" FORCE)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_C_STANDARD 11)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
set(HALCYON_COMPONENT_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/components")
set(CMAKE_INSTALL_RPATH_USE_LINK_PATH ON)  # finds libraries outside of the system's folders, such as OpenCV in /opt, after the installation, too

# No implicit fused multiply-add: what the compiler makes of an expression is the same on every machine (docs/decisions/0030).
add_compile_options(-Wall -Wextra -Wpedantic "$<$<COMPILE_LANGUAGE:CXX>:-Wconversion;-Wshadow>" -ffp-contract=off)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    # g++ 12 warns about its own std::string and std::optional (GCC bugs 105651, 105329, 80635).
    add_compile_options(-Wno-restrict -Wno-array-bounds -Wno-maybe-uninitialized)
endif()
if(CMAKE_SIZEOF_VOID_P EQUAL 4)
    add_compile_options(-Wno-psabi)  # notes that g++ 7 changed how ARM passes some structs
    add_compile_definitions(_TIME_BITS=64 _FILE_OFFSET_BITS=64)  # glibc's default time_t of 32 bits ends in 2038
endif()
if(HALCYON_WERROR)
    add_compile_options(-Werror)
endif()
if(HALCYON_SANITIZE)
    # Omits the checks that double the compile time: a null pointer ends the program anyway, and x86 and ARM load from any address.
    add_compile_options("-fsanitize=${HALCYON_SANITIZE}" -fno-sanitize=null,alignment -fno-sanitize-recover=all -fno-omit-frame-pointer -g1)
    string(REPLACE "-O2" "-O1" CMAKE_CXX_FLAGS_RELEASE "${CMAKE_CXX_FLAGS_RELEASE}")  # without optimisation the tests of the command line are too slow
    add_link_options("-fsanitize=${HALCYON_SANITIZE}")
endif()
# The environment of a program that loads plugins. The leak checker takes a plugin's thread-local memory for what it is not, and dies of it,
# depending on where the heap put it. Fast DDS frees some of its memory by another size than it took.
set(HALCYON_SANITIZER_OPTIONS "ASAN_OPTIONS=intercept_tls_get_addr=0:new_delete_type_mismatch=0")
if(HALCYON_LIGHTLY_OPTIMISED AND NOT HALCYON_SANITIZE)
    string(REPLACE "-O2" "-O1" CMAKE_CXX_FLAGS_RELEASE "${CMAKE_CXX_FLAGS_RELEASE}")
endif()
set(HALCYON_TEST_OPTIONS -O0)  # for the tests' own sources: their assertions take longer to optimise than to run
if(NOT HALCYON_SANITIZE AND NOT HALCYON_LIGHTLY_OPTIMISED)
    # For what is not real time: programs, their commands, and the runtime from the machine to the control socket. The model and what reads
    # netlists keep -O2: a large machine loads a tenth faster.
    set(HALCYON_TOOL_OPTIONS "$<$<CONFIG:Release>:-Os>")
endif()
# A unit of twenty sources takes up to 0.8 GB of memory, one of eight 0.5 GB. Large units need it for each processor.
cmake_host_system_information(RESULT memory_mb QUERY TOTAL_PHYSICAL_MEMORY)
cmake_host_system_information(RESULT processors QUERY NUMBER_OF_LOGICAL_CORES)
math(EXPR memory_mb "${memory_mb} / ${processors}")
set(HALCYON_UNIT_SOURCES 8)
if(memory_mb GREATER 1200)
    set(HALCYON_UNIT_SOURCES 20)
    if(HALCYON_QUICK AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
        # From 128 MB on, g++ collects its garbage again and again while it reads headers: 5 % of the time.
        add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:--param=ggc-min-heapsize=600000>")
    endif()
endif()

# Optional packages, a file of each, and for the script `hal` the part of the tree that needs it: a build configures again when one of them
# was installed or removed since, and forgets the files of one that was removed.
file(STRINGS "${PROJECT_SOURCE_DIR}/cmake/optional" optional REGEX "/")
list(TRANSFORM optional REPLACE "^[^ ]+ ([^ ]+).*" "\\1")
file(GLOB optional CONFIGURE_DEPENDS ${optional})
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/cmake/optional")
get_cmake_property(variables CACHE_VARIABLES)
list(FILTER variables INCLUDE REGEX "^HALCYON_(OPENCV_.|YAML|EDIT|CMARK|WEBSOCKETS|ZSTD|LZ4)")
foreach(variable IN LISTS variables)
    if(IS_ABSOLUTE "${${variable}}" AND NOT EXISTS "${${variable}}")
        unset(${variable} CACHE)
    endif()
endforeach()

# halcyon_needs(NAME PACKAGE...): states the optional Debian packages that a component or a program is built with. The script `hal` reads them
# from components/packages in the build tree, and installs those of what it builds.
function(halcyon_needs name)
    if(ARGN)
        list(JOIN ARGN " " packages)
        set_property(GLOBAL APPEND_STRING PROPERTY HALCYON_NEEDS "${name} ${packages}\n")
    endif()
endfunction()

# halcyon_unity(TARGET [BATCH NUMBER] [SECOND SOURCE...] [THIRD SOURCE...] [ALONE SOURCE...]): compiles the sources of a target eight, or BATCH, at
# a time: without optimisation most of the time goes into reading the same headers and instantiating the same templates. Two sources that are
# compiled together must not define the same name differently, not even in anonymous namespaces. SECOND and THIRD list sources that conflict with
# others, but not with each other: each list is compiled together. ALONE lists those that conflict with every list; they are compiled one by one,
# as are those that cmake/alone.awk finds. For sources without optimisation; for the others with HALCYON_QUICK only, because a change then
# compiles as many of them.
function(halcyon_unity target)
    cmake_parse_arguments(PARSE_ARGV 1 with "" BATCH "SECOND;THIRD;ALONE")
    if(NOT with_BATCH)
        set(with_BATCH 8)
    endif()
    if(NOT HALCYON_UNITY OR NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU" OR CMAKE_CXX_CLANG_TIDY)
        return()
    endif()
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${with_BATCH})
    get_target_property(sources ${target} SOURCES)
    list(FILTER sources INCLUDE REGEX "[.]cpp$")
    list(FILTER sources EXCLUDE REGEX "^[$]<")
    list(TRANSFORM sources REPLACE "^${CMAKE_CURRENT_SOURCE_DIR}/" "")
    list(REMOVE_ITEM sources ${with_SECOND} ${with_THIRD} ${with_ALONE})
    foreach(part IN ITEMS sources with_SECOND with_THIRD)
        if(${part})
            execute_process(COMMAND awk -f "${PROJECT_SOURCE_DIR}/cmake/alone.awk" ${${part}} WORKING_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}"
                            OUTPUT_VARIABLE found ERROR_QUIET)
            string(REGEX REPLACE "\n" ";" found "${found}")
            list(APPEND with_ALONE ${found})
        endif()
    endforeach()
    if(with_ALONE)
        set_source_files_properties(${with_ALONE} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    endif()
    if(with_SECOND)
        set_target_properties(${target} PROPERTIES UNITY_BUILD_MODE GROUP)
        set(with_FIRST ${sources})
        foreach(part IN ITEMS FIRST SECOND THIRD)
            set(number 0)
            foreach(source IN LISTS with_${part})
                math(EXPR unit "${number} / ${with_BATCH}")
                set_source_files_properties("${source}" PROPERTIES UNITY_GROUP "${part}_${unit}")
                math(EXPR number "${number} + 1")
            endforeach()
        endforeach()
    endif()
endfunction()

# The same for optimised targets.
function(halcyon_unity_quick)
    if(HALCYON_QUICK)
        halcyon_unity(${ARGV})
    endif()
endfunction()

# The same for targets with HALCYON_TOOL_OPTIONS, which are not optimised under a sanitizer.
function(halcyon_unity_tool)
    if(HALCYON_SANITIZE OR HALCYON_QUICK)
        halcyon_unity(${ARGV})
    endif()
endfunction()

find_program(HALCYON_CCACHE ccache)
if(HALCYON_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
    set(HALCYON_LAUNCHER sh "${CMAKE_CURRENT_LIST_DIR}/cached_compile.sh" "${HALCYON_CCACHE}" "${PROJECT_SOURCE_DIR}")
    set(CMAKE_C_COMPILER_LAUNCHER ${HALCYON_LAUNCHER})
    set(CMAKE_CXX_COMPILER_LAUNCHER ${HALCYON_LAUNCHER})
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
        add_compile_options(-fpch-preprocess)  # lets ccache see through a precompiled header
        if(HALCYON_SANITIZE)
            add_compile_options("-ffile-prefix-map=${PROJECT_SOURCE_DIR}=.")  # debugging information is the same in any folder
        endif()
    endif()
endif()
find_program(HALCYON_MOLD mold)
if(HALCYON_MOLD AND NOT CMAKE_CROSSCOMPILING)  # a cross compiler looks for one of its own name
    # mold 1.10 lets the read-only-after-relocation area of a program with thread-local variables begin in
    # the last bytes of the page before it, when the code ends there: such a program cannot be started.
    # With code in pages of its own it never does.
    add_link_options(-fuse-ld=mold -Wl,-z,separate-code)
endif()

# halcyon_in_programs(VARIABLE LIBRARY [OTHER...]): how to link a shared library, with those it needs itself: programs take it from its archive where
# there is one: loading eight small libraries takes about half of the processor time in which `hal` starts.
function(halcyon_in_programs variable library)
    cmake_path(REPLACE_EXTENSION library LAST_ONLY ".a" OUTPUT_VARIABLE archive)
    set(archives "${archive}")
    foreach(other IN LISTS ARGN)
        find_library(HALCYON_ARCHIVE_${other} NAMES "lib${other}.a")
        mark_as_advanced(HALCYON_ARCHIVE_${other})
        list(APPEND archives "${HALCYON_ARCHIVE_${other}}")
    endforeach()
    foreach(one IN LISTS archives)
        if(NOT EXISTS "${one}")
            set(${variable} "${library}" PARENT_SCOPE)
            return()
        endif()
    endforeach()
    set(${variable} "$<IF:$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>,${archives},${library}>" PARENT_SCOPE)
endfunction()

# The real-time guard: clang 19's runtime archive (Debian: libclang-rt-19-dev) works with g++ when it is linked into the program as a whole.
# HALCYON_RT_GUARD puts it into every program of the tree; the tests have a guarded program of their own.
if(NOT HALCYON_SANITIZE)
    find_library(HALCYON_RTSAN_ARCHIVE NAMES "libclang_rt.rtsan-${CMAKE_SYSTEM_PROCESSOR}.a"
                 PATHS /usr/lib/llvm-19/lib/clang/19/lib/linux NO_DEFAULT_PATH)
endif()
if(HALCYON_RT_GUARD AND NOT HALCYON_RTSAN_ARCHIVE)
    message(FATAL_ERROR "HALCYON_RT_GUARD needs clang 19's real-time sanitizer; type: apt install libclang-rt-19-dev")
endif()
if(HALCYON_RTSAN_ARCHIVE)
    add_library(halcyon_guard STATIC "${PROJECT_SOURCE_DIR}/runtime/linuxcnc/binary/guard/module_calls.cpp")
    target_compile_features(halcyon_guard PRIVATE cxx_std_20)
    add_library(halcyon_rtsan INTERFACE)
    target_link_libraries(halcyon_rtsan INTERFACE "$<LINK_LIBRARY:WHOLE_ARCHIVE,halcyon_guard>"
                          "$<LINK_LIBRARY:WHOLE_ARCHIVE,${HALCYON_RTSAN_ARCHIVE}>" ${CMAKE_DL_LIBS} pthread rt m)
endif()

# halcyon_precompiled(TARGET): for a target with HALCYON_TOOL_OPTIONS: runtime/precompiled.hpp, compiled once for all of them.
function(halcyon_precompiled target)
    if(NOT TARGET halcyon_precompiled_runtime)
        file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/generated/precompiled.cpp" CONTENT "// Gives the precompiled header a target to belong to.\n")
        add_library(halcyon_precompiled_runtime OBJECT "${PROJECT_BINARY_DIR}/generated/precompiled.cpp")
        target_compile_options(halcyon_precompiled_runtime PRIVATE ${HALCYON_TOOL_OPTIONS})
        target_link_libraries(halcyon_precompiled_runtime PRIVATE fmt::fmt nlohmann_json::nlohmann_json)
        target_precompile_headers(halcyon_precompiled_runtime PRIVATE "${PROJECT_SOURCE_DIR}/runtime/precompiled.hpp")
    endif()
    target_compile_options(${target} PRIVATE ${HALCYON_TOOL_OPTIONS} -fPIC)  # a program's -fPIE would not fit the header
    target_precompile_headers(${target} REUSE_FROM halcyon_precompiled_runtime)
endfunction()

# halcyon_folder(NAME DEPENDENCY... [NOT_REALTIME] [FOLDER PATH] [ALONE SOURCE...]): the library halcyon_NAME from all sources in runtime/NAME or
# runtime/PATH; ALONE as in halcyon_unity(). NOT_REALTIME: compiled with HALCYON_TOOL_OPTIONS and the precompiled header.
function(halcyon_folder name)
    cmake_parse_arguments(PARSE_ARGV 1 with NOT_REALTIME FOLDER ALONE)
    if(NOT with_FOLDER)
        set(with_FOLDER ${name})
    endif()
    file(GLOB_RECURSE sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/runtime/${with_FOLDER}/*.cpp")
    if(sources)
        set(scope PUBLIC)
        add_library(halcyon_${name} STATIC ${sources})
        list(TRANSFORM with_ALONE PREPEND "${PROJECT_SOURCE_DIR}/runtime/${with_FOLDER}/")
        halcyon_unity_quick(halcyon_${name} BATCH ${HALCYON_UNIT_SOURCES} ALONE ${with_ALONE})
        if(with_NOT_REALTIME)
            halcyon_precompiled(halcyon_${name})
        endif()
    else()
        set(scope INTERFACE)
        add_library(halcyon_${name} INTERFACE)
    endif()
    target_include_directories(halcyon_${name} ${scope} "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/runtime>" "$<INSTALL_INTERFACE:include>")
    target_link_libraries(halcyon_${name} ${scope} ${with_UNPARSED_ARGUMENTS})
endfunction()

cmake_path(RELATIVE_PATH CMAKE_INSTALL_FULL_LIBDIR BASE_DIRECTORY "${CMAKE_INSTALL_FULL_BINDIR}" OUTPUT_VARIABLE HALCYON_LIBRARIES_FROM_PROGRAMS)
cmake_path(RELATIVE_PATH CMAKE_INSTALL_FULL_INCLUDEDIR BASE_DIRECTORY "${CMAKE_INSTALL_FULL_BINDIR}" OUTPUT_VARIABLE HALCYON_INCLUDES_FROM_PROGRAMS)
cmake_path(RELATIVE_PATH CMAKE_INSTALL_FULL_DOCDIR BASE_DIRECTORY "${CMAKE_INSTALL_FULL_BINDIR}" OUTPUT_VARIABLE HALCYON_MACHINES_FROM_PROGRAMS)
string(APPEND HALCYON_MACHINES_FROM_PROGRAMS "/halfiles")
# The values of runtime/paths.hpp, in the only source that depends on the path of this build tree.
file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/generated/paths.cpp" @ONLY CONTENT [[
// SPDX-License-Identifier: MIT
#include "paths.hpp"

namespace hal::paths {
constinit const std::string_view version = "@PROJECT_VERSION@";
constinit const std::string_view build_components = "@HALCYON_COMPONENT_OUTPUT_DIRECTORY@";
constinit const std::string_view install_components = "@CMAKE_INSTALL_FULL_LIBDIR@/halcyon/components";
constinit const std::string_view build_python = "@PROJECT_BINARY_DIR@/python";
constinit const std::string_view install_python = "@CMAKE_INSTALL_FULL_LIBDIR@/halcyon/python";
constinit const std::string_view libraries_from_programs = "@HALCYON_LIBRARIES_FROM_PROGRAMS@";
constinit const std::string_view includes_from_programs = "@HALCYON_INCLUDES_FROM_PROGRAMS@";
constinit const std::string_view build_includes = "@PROJECT_SOURCE_DIR@/runtime/abi:@PROJECT_SOURCE_DIR@/runtime/sdk:@PROJECT_SOURCE_DIR@/runtime/linuxcnc/source";
constinit const std::string_view build_machines = "@PROJECT_SOURCE_DIR@/halfiles";
constinit const std::string_view machines_from_programs = "@HALCYON_MACHINES_FROM_PROGRAMS@";
constinit const std::string_view install_includes = "@CMAKE_INSTALL_FULL_INCLUDEDIR@";
}  // namespace hal::paths
]])
