// SPDX-License-Identifier: MIT
// Process data that the master copies from slave to slave: section [copy] of a `.ethercat` file.
// Everything here is [setup].
//
//     [copy]
//     y.target-torque = x.torque-actual-value
//     valve.7000:1    = panel.6000:1 safe 1
#pragma once

#include "ethercat/config/config_text.hpp"

namespace hal::ethercat::config {

/// Returns where an object of a slave is in its process data, in one direction; nullopt: no PDO has
/// it.
std::optional<DataLocation> locate(const Bus&, std::size_t slave, bool output, std::uint16_t index,
                                   std::uint8_t sub);

/// Returns how many bits the sync manager of a location has from there on.
std::size_t bits_behind(const Bus&, const DataLocation&);

/// Reads the section [copy], once all slaves are read. The outputs that are copied have pins that
/// only show what is sent.
class DataCopyReader {
public:
    DataCopyReader(Bus& bus, Report& report) : bus_(bus), report_(report) {}
    void read(Section& section);

private:
    /// One end of a copy.
    struct End {
        Word text;  ///< SLAVE.OBJECT, for messages
        std::size_t slave = 0;
        bool output = false;
        /// a value with its samples, or a whole PDO
        struct Part {
            DataLocation at;
            unsigned bits = 0;
            master::Entry* entry = nullptr;  ///< nullptr: a whole PDO
        };
        std::vector<Part> parts;
        std::vector<master::Entry*> entries;  ///< all that are in it
    };
    void read_line(Line& line);
    std::optional<End> parse_end(const Word& text, bool output);
    void find_parts(const Word& object, End& end);
    void find_pdo(std::uint16_t index, End& end);
    void report_unknown(const Word& object, const End& end);
    bool check(const End& to, const End& from);
    bool check_types(const End& to, const End& from);
    bool parse_loss(const Line& line, const std::vector<Word>& words, unsigned bits,
                    DataCopy& copy);

    Bus& bus_;
    Report& report_;
    std::map<const master::Entry*, std::uint32_t> copied_;  ///< the line of each
};

}  // namespace hal::ethercat::config
