# SPDX-License-Identifier: MIT
# cmake -DNAME=halcyon_link -DHEADERS=FILE,... -DREFERENCE=FILE -DDEFINITION=FILE -P interface_hash.cmake
# Writes two sources about the symbol NAME_interface_HASH: one defines it, the other needs it. The hash is that of the headers' text without
# comments and blanks.
cmake_minimum_required(VERSION 3.25)
string(REPLACE "," ";" HEADERS "${HEADERS}")
set(all)
foreach(header IN LISTS HEADERS)
    file(READ "${header}" text)
    string(REGEX REPLACE "//[^\n]*" "" text "${text}")
    string(REGEX REPLACE "[ \t\r\n]+" " " text "${text}")
    string(APPEND all "${text}\n")
endforeach()
string(SHA256 hash "${all}")
string(SUBSTRING "${hash}" 0 12 hash)
set(symbol "${NAME}_interface_${hash}")
file(CONFIGURE OUTPUT "${DEFINITION}" @ONLY CONTENT [=[
// SPDX-License-Identifier: MIT
// Generated: the version of this library's headers.
extern "C" [[gnu::visibility("default")]] void @symbol@();
void @symbol@() {}  // no variable: a program that has these objects and the library, too, would have it twice
]=])
file(CONFIGURE OUTPUT "${REFERENCE}" @ONLY CONTENT [=[
// SPDX-License-Identifier: MIT
// Generated: what is compiled with these headers loads only with the library that belongs to them.
extern "C" void @symbol@();
namespace {
[[gnu::used]] void (*const @NAME@_compiled_with)() = &@symbol@;
}
]=])
