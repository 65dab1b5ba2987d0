// SPDX-License-Identifier: MIT
// The start-up writes of a slave in a `.ethercat` file: sdo, idn, aoe, register. [setup]
#pragma once

#include "ethercat/config/slave_pdos.hpp"

namespace hal::ethercat::config {

/// Returns a write by CoE.
master::StartupWrite startup_write(unsigned index, unsigned sub, std::vector<std::uint8_t> data,
                                   State before);

class SlaveWrites {
public:
    SlaveWrites(SlaveInput in, const esi::Device* device, const SlavePdos& pdos)
        : in_(in), device_(device), pdos_(pdos) {}
    void read();

private:
    using Protocol = master::StartupWrite::Protocol;
    void sdo(const Line& line, const std::vector<Word>& words);
    std::optional<ObjectAddress> address_of(const Word& word, bool is_register);
    void reject_key(const Line& line, const std::string& kind);
    std::optional<std::vector<std::uint8_t>> raw_value(const Line& line);
    std::optional<std::vector<std::uint8_t>> typed_value(const Line& line,
                                                         const std::vector<Word>& words,
                                                         const ObjectAddress& address);
    std::optional<DataType> written_type(const Word& word);
    std::optional<DataType> known_type(const Line& line, const std::vector<Word>& words,
                                       const ObjectAddress& address, const std::string& label);
    void idn(const Line& line, const std::vector<Word>& words);
    void aoe(const Line& line, const std::vector<Word>& words);
    void bytes_write(const Line& line, Protocol protocol, unsigned index, unsigned sub,
                     std::uint16_t port);

    SlaveInput in_;
    const esi::Device* device_;
    const SlavePdos& pdos_;
};

}  // namespace hal::ethercat::config
