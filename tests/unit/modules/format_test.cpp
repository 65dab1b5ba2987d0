// SPDX-License-Identifier: MIT
// What modules print in a cycle is formatted as the C library formats it.
#include "linuxcnc/binary/format.hpp"

#include <cfloat>
#include <climits>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <string>

namespace hal::test {
namespace {

std::string ours(std::size_t size, int& length, const char* format, ...) {
    std::string text(size, '#');
    va_list arguments;
    va_start(arguments, format);
    length = modules::format_text(text.data(), size, format, arguments);
    va_end(arguments);
    return text.substr(0, text.find('\0'));
}

template <class... A>
void same(const char* format, A... values) {
    for (const std::size_t size : {4096, 7}) {
        int length = 0;
        std::string expected(size, '#');
        const int wanted = std::snprintf(expected.data(), size, format, values...);
        EXPECT_EQ(expected.substr(0, expected.find('\0')), ours(size, length, format, values...))
            << format;
        EXPECT_EQ(wanted, length) << format;
    }
}

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
#pragma GCC diagnostic ignored "-Wformat-security"

TEST(FormatText, writes_integers_as_the_C_library_does) {
    for (const char* const flags : {"", "-", "+", " ", "0", "#", "-#", "0#", "+0", "0-"}) {
        for (const char* const size : {"", "1", "12", ".0", ".5", "12.5", "3.9"}) {
            for (const char conversion : {'d', 'i', 'u', 'x', 'X', 'o'}) {
                for (const int value : {0, 1, -1, 42, INT_MAX, INT_MIN}) {
                    const std::string format = std::string("<%") + flags + size + conversion + ">";
                    same(format.c_str(), value);
                    same((std::string("<%") + flags + size + "hh" + conversion + ">").c_str(),
                         value);
                    same((std::string("<%") + flags + size + "h" + conversion + ">").c_str(),
                         value);
                    same((std::string("<%") + flags + size + "ll" + conversion + ">").c_str(),
                         static_cast<long long>(value) * 4000000000LL);
                    same((std::string("<%") + flags + size + "l" + conversion + ">").c_str(),
                         static_cast<long>(value));
                    same((std::string("<%") + flags + size + "z" + conversion + ">").c_str(),
                         static_cast<long>(value));
                }
            }
        }
    }
}

TEST(FormatText, writes_reals_as_the_C_library_does) {
    const double values[] = {0.0,     -0.0,      1.0,      -1.5,      0.1,     123456789.0,
                             1e-5,    9.9999995, 99999.95, 1e10,      DBL_MAX, DBL_MIN,
                             -2.5e-7, 2.0 / 3,   INFINITY, -INFINITY, NAN};
    for (const char* const flags : {"", "-", "+", " ", "0", "#", "-#", "0#", "+0"}) {
        for (const char* const size :
             {"", "1", "20", ".0", ".1", ".3", "20.5", "9.2", ".17", ".50", ".500", ".1200"}) {
            for (const char conversion : {'f', 'F', 'e', 'E', 'g', 'G', 'a', 'A'}) {
                for (const double value : values) {
                    // glibc drops the zeros that # keeps when rounding adds a digit: "1.e+05"
                    if ((conversion | 0x20) == 'g' &&
                        std::string(flags).find('#') != std::string::npos && value == 99999.95) {
                        continue;
                    }
                    same((std::string("<%") + flags + size + conversion + ">").c_str(), value);
                }
            }
        }
    }
}

TEST(FormatText, writes_texts_pointers_and_widths_from_arguments) {
    same("%s and %10s and %-10s.", "one", "two", "three");
    same("%.2s %.*s %5.1s", "one", 2, "two", "three");
    same("%c%3c%-3c|", 'a', 'b', 'c');
    same("%p %20p %-20p|", reinterpret_cast<void*>(0x1234), reinterpret_cast<void*>(0x1234),
         static_cast<void*>(nullptr));
    same("%*d %-*d %.*f %*d|", 5, 1, 5, 2, 3, 1.5, -6, 7);
    same("%s %.3s|%.9s|", static_cast<const char*>(nullptr), static_cast<const char*>(nullptr),
         static_cast<const char*>(nullptr));
    same("100%% of %d", 3);
    same("no conversions");
    same("");
    same("%d %s %f %d", 1, "x", 2.0, 3);
    same("%100000d", 7);
}

TEST(FormatText, copies_what_it_does_not_know) {
    int length = 0;
    EXPECT_EQ("a %2$d b", ours(64, length, "a %2$d b", 1, 2));
    EXPECT_EQ("7 %y 8", ours(64, length, "%d %y %d", 7, 8));
    EXPECT_EQ("50%", ours(64, length, "50%"));
    EXPECT_EQ("", ours(1, length, "abc"));
    EXPECT_EQ(3, length);
    EXPECT_EQ(3, (ours(0, length, "abc"), length));
}

#pragma GCC diagnostic pop

}  // namespace
}  // namespace hal::test
