# SPDX-License-Identifier: MIT
# halcyon_commit(TARGET): adds a source to TARGET with the commit in `hal --version`. It is written again when the checked-out commit changes,
# which git records in logs/HEAD: a build that has nothing else to do does not ask git.
function(halcyon_commit target)
    find_program(HALCYON_GIT git)
    set(record)
    set(git)
    if(HALCYON_GIT AND EXISTS "${PROJECT_SOURCE_DIR}/.git")
        set(git "${HALCYON_GIT}")
        execute_process(COMMAND "${git}" -c safe.directory=* rev-parse --path-format=absolute --git-path logs/HEAD
                        WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}" OUTPUT_VARIABLE path OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
        if(path)
            file(GLOB record CONFIGURE_DEPENDS "${path}")  # configured again when it is removed
        endif()
    endif()
    set(source "${PROJECT_BINARY_DIR}/generated/commit.cpp")
    set(script "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/commit.cmake")
    add_custom_command(OUTPUT "${source}" COMMAND "${CMAKE_COMMAND}" "-DGIT=${git}" "-DROOT=${PROJECT_SOURCE_DIR}" "-DOUTPUT=${source}" -P "${script}"
                       DEPENDS ${record} "${script}" VERBATIM)
    target_sources(${target} PRIVATE "${source}")
endfunction()
