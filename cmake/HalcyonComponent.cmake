# SPDX-License-Identifier: MIT
# add_hal_component(NAME SOURCE...): a plugin NAME.so that exports `hal_plugin` and nothing else.
#
# Works in this tree and, after find_package(Halcyon), in any other. The target is component_NAME. Outside of this tree a `test.hal`
# with its `expected` beside the CMakeLists.txt becomes the test NAME, run by ctest.

# hal_component_options(TARGET): how the sources of a plugin are compiled.
function(hal_component_options target)
    target_link_libraries(${target} PRIVATE Halcyon::sdk)
    target_compile_options(${target} PRIVATE -fno-plt -ffp-contract=off "$<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique>"
        "$<$<CONFIG:>:-O2>")  # without a build type: optimised, with assertions
    set_target_properties(${target} PROPERTIES
        CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON POSITION_INDEPENDENT_CODE ON DEFINE_SYMBOL "")
endfunction()

function(add_hal_component name)
    include(GNUInstallDirs)
    set(target "component_${name}")
    add_library(${target} MODULE ${ARGN})
    hal_component_options(${target})
    # The version script also hides the templates of libstdc++, which -fvisibility=hidden does not hide.
    set(map "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/plugin.map")
    target_link_options(${target} PRIVATE "LINKER:--version-script=${map}")
    if(NOT (HALCYON_SANITIZE AND CMAKE_CXX_COMPILER_ID MATCHES "Clang"))  # Clang links the sanitizer into the program only
        target_link_options(${target} PRIVATE "LINKER:-z,defs")
    endif()
    set_target_properties(${target} PROPERTIES OUTPUT_NAME "${name}" PREFIX "" SUFFIX ".so" LINK_DEPENDS "${map}"
        INSTALL_RPATH "$ORIGIN/../..")  # for programs other than hal, which loads Halcyon's libraries itself
    if(HALCYON_COMPONENT_OUTPUT_DIRECTORY)
        set_target_properties(${target} PROPERTIES LIBRARY_OUTPUT_DIRECTORY "${HALCYON_COMPONENT_OUTPUT_DIRECTORY}")
    endif()
    if(TARGET halcyon_precompiled)  # in this tree: the sdk's header is read once for all components
        target_precompile_headers(${target} REUSE_FROM halcyon_precompiled)
    endif()
    if(HALCYON_COMPONENT_FOLDER)  # in this tree: the folder below components/ is its group; the summary is for components that are not built yet
        list(GET ARGN 0 source)
        cmake_path(ABSOLUTE_PATH source)
        file(STRINGS "${source}" summary REGEX "^HAL_COMPONENT[(]" LIMIT_COUNT 1)
        cmake_path(RELATIVE_PATH source BASE_DIRECTORY "${HALCYON_COMPONENT_FOLDER}")
        string(REGEX MATCH "^[^/]+" group "${source}")
        if(NOT summary MATCHES "^HAL_COMPONENT[(][^\"]*\"[^\"]*\", *\"([^\"]*)\"")
            set(CMAKE_MATCH_1 "")
        endif()
        set_property(GLOBAL APPEND_STRING PROPERTY HALCYON_GROUPS "${name} ${group} ${CMAKE_MATCH_1}\n")
        set_property(GLOBAL APPEND PROPERTY HALCYON_PLUGINS ${target})
    endif()
    set(test "${CMAKE_CURRENT_SOURCE_DIR}")
    if(HALCYON_PROGRAM AND EXISTS "${test}/test.hal" AND EXISTS "${test}/expected" AND NOT TEST ${name})
        add_test(NAME ${name} COMMAND "${CMAKE_COMMAND}" "-DHAL=${HALCYON_PROGRAM}" "-DPLUGINS=$<TARGET_FILE_DIR:${target}>" "-DTEST=${test}"
                 -P "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/HalcyonTest.cmake")
    endif()
    install(TARGETS ${target} LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}/halcyon/components")
endfunction()
