// SPDX-License-Identifier: MIT
// Texts of error codes: those of drives, and the classes that every CANopen and CoE emergency uses.
#pragma once

#include <cstdint>

namespace hal::cia402 {

/// Returns the text of an error code 603Fh or of an EMCY from a drive (CiA 402, IEC 61800-7-201);
/// for any other code the text of its class, as error_class_word(). Manufacturers also define their
/// own codes: FF00h and those the standard leaves free. [any]
const char* error_word(std::uint16_t code) noexcept;

/// Returns the text of an error code in CiA 301, 7.2.7.1: a communication error, or the class of
/// the code. [any]
const char* error_class_word(std::uint16_t code) noexcept;

}  // namespace hal::cia402
