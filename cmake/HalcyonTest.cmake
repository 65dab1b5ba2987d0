# SPDX-License-Identifier: MIT
# cmake -DHAL=PROGRAM -DPLUGINS=FOLDER -DTEST=FOLDER -P HalcyonTest.cmake
# Runs FOLDER/test.hal on the virtual clock; its output must equal FOLDER/expected.
set(ENV{HALCYON_PLUGIN_PATH} "${PLUGINS}:$ENV{HALCYON_PLUGIN_PATH}")
execute_process(COMMAND "${HAL}" sim --quiet test.hal WORKING_DIRECTORY "${TEST}" OUTPUT_VARIABLE printed ERROR_VARIABLE output RESULT_VARIABLE status)
file(READ "${TEST}/expected" expected)
if(status EQUAL 0 AND printed STREQUAL expected)
    return()
endif()
if(status EQUAL 0)
    string(CONCAT why "it prints\n" "${printed}" "and 'expected' has\n" "${expected}")
else()
    set(why "hal sim test.hal ends with status ${status}:\n")
endif()
string(REPLACE "\n" "\n    " text "${why}${output}")  # indented, so that CMake does not wrap the lines
message(FATAL_ERROR "${TEST}/test.hal:\n    ${text}")
