# SPDX-License-Identifier: MIT
# `cmake --install` installs files, it does not make them, and stops half way at the first that is missing. So its first step builds the target
# `installed`: all that any rule below installs. Nothing is installed when that fails. A build tree of another user is built as that user,
# so that `sudo cmake --install` leaves no files of root in it.
add_custom_target(installed)
install(CODE "set(halcyon_build \"${PROJECT_BINARY_DIR}\")")
install(CODE [[
    set(halcyon_as)
    execute_process(COMMAND id -u OUTPUT_VARIABLE halcyon_user OUTPUT_STRIP_TRAILING_WHITESPACE)
    execute_process(COMMAND stat -c "%u;%U" "${halcyon_build}" OUTPUT_VARIABLE halcyon_owner OUTPUT_STRIP_TRAILING_WHITESPACE)
    list(POP_FRONT halcyon_owner halcyon_number)
    if(halcyon_user EQUAL 0 AND NOT halcyon_number EQUAL 0 AND NOT halcyon_owner STREQUAL "UNKNOWN")
        set(halcyon_as runuser -u ${halcyon_owner} --)
    endif()
    execute_process(COMMAND ${halcyon_as} "${CMAKE_COMMAND}" --build "${halcyon_build}" --target installed
                    RESULT_VARIABLE halcyon_result OUTPUT_VARIABLE halcyon_output ERROR_VARIABLE halcyon_output)
    if(NOT halcyon_result EQUAL 0)
        message(FATAL_ERROR "nothing was installed, because the build failed:\n${halcyon_output}")
    endif()
]])
