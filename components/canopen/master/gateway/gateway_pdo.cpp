// SPDX-License-Identifier: MIT
#include "gateway_pdo.hpp"

#include <algorithm>

namespace hal::canopen::gateway {

namespace {
bool is(const Frame& f, std::uint32_t cob) {
    return f.id == cob_id(cob) && f.extended == ((cob & cob_extended) != 0);
}
}  // namespace

unsigned Pdos::bits(const Pdo& p) {
    unsigned sum = 0;
    for (const Format* f : p.formats) {
        sum += bits_of(f->type);
    }
    return sum;
}

std::string Pdos::text(unsigned number, const Pdo& p) {
    std::string out = "pdo " + std::to_string(number) + " " + std::to_string(p.formats.size());
    const auto image = load<std::uint64_t>(p.data.data());
    unsigned first = 0;
    for (const Format* f : p.formats) {
        const unsigned size = bits_of(f->type);
        const std::uint64_t value =
            image >> first & (size == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << size) - 1);
        out +=
            " " + text_of({reinterpret_cast<const std::uint8_t*>(&value), bytes_of(f->type)}, *f);
        first += size;
    }
    return out;
}

Error Pdos::configure(bool received, const Command& c) {
    auto& pdos = received ? received_ : sent_;
    Pdo p{.cob = c.numbers[1], .transmission = c.numbers[2], .formats = c.formats};
    if (c.numbers[0] < 1) return Error::syntax;
    const auto id = cob_id(p.cob);
    if ((p.cob & cob_invalid) == 0 && (p.cob & cob_extended) == 0 &&
        (restricted(id) || id == 0x80 || (p.cob & 0x1ffff800) != 0)) {
        return Error::syntax;
    }
    if (bits(p) > 64) return Error::pdo_length;
    if ((p.cob & cob_invalid) != 0 || p.formats.empty()) {
        pdos.erase(c.numbers[0]);
        return Error::none;
    }
    for (const auto& [number, other] : pdos) {
        if (number != c.numbers[0] && ((other.cob ^ p.cob) & 0x3fffffff) == 0) {
            return Error::pdo_used;
        }
    }
    pdos[c.numbers[0]] = p;
    return Error::none;
}

Error Pdos::read(unsigned number, std::string& out) const {
    const auto p = received_.find(number);
    if (p == received_.end() || !p->second.fresh) return Error::state;
    out = text(number, p->second);
    return Error::none;
}

bool Pdos::arrived(unsigned number) const {
    const auto p = received_.find(number);
    return p != received_.end() && p->second.fresh;
}

bool Pdos::request(unsigned number) {
    const auto p = received_.find(number);
    if (p == received_.end() || p->second.transmission != on_request) return false;
    p->second.fresh = false;
    Frame f = make_frame(p->second.cob, static_cast<std::uint8_t>((bits(p->second) + 7) / 8));
    f.remote = true;
    return out_.push(f);
}

bool Pdos::send(const Pdo& p) {
    Frame f = make_frame(p.cob, static_cast<std::uint8_t>((bits(p) + 7) / 8));
    std::copy(p.data.begin(), p.data.end(), f.data.begin());
    return out_.push(f);
}

Error Pdos::write(const Command& c, std::string& why) {
    const auto found = sent_.find(c.numbers[0]);
    if (found == sent_.end()) {
        why = "set tpdo sets it up";
        return Error::state;
    }
    Pdo& p = found->second;
    std::uint64_t image = 0;
    unsigned first = 0;
    std::size_t at = 0;
    if (c.numbers[1] != p.formats.size()) {
        why = "it has " + std::to_string(p.formats.size()) + " values";
        return Error::syntax;
    }
    for (const Format* f : p.formats) {
        std::vector<std::uint8_t> bytes;
        const std::size_t words = words_of(*f);
        if (at + words > c.values.size()) {
            why = "a value is missing";
            return Error::syntax;
        }
        if (!bytes_of(std::span(c.values).subspan(at, words), *f, bytes)) {
            why = "'" + c.values[at].substr(0, 40) + "' is no " + std::string(f->word);

            return Error::syntax;
        }
        at += words;
        std::uint64_t value = 0;
        std::copy(bytes.begin(), bytes.end(), reinterpret_cast<std::uint8_t*>(&value));
        const unsigned size = bits_of(f->type);
        image |= (size == 64 ? value : value & ((std::uint64_t{1} << size) - 1)) << first;
        first += size;
    }
    if (at != c.values.size()) {
        why = "there are more values than it has";
        return Error::syntax;
    }
    store(p.data.data(), image);
    p.fresh = true;
    if (p.transmission == on_event && !send(p)) {
        why = "the bus does not take it";
        return Error::no_memory;
    }
    return Error::none;
}

void Pdos::handle(const Frame& f, const Report& on_pdo) {
    const bool is_sync = f.id == 0x80 && !f.extended && !f.remote;
    if (is_sync) {
        pass_synchronous(on_pdo);
        send_synchronous();
    } else if (f.remote) {
        send_requested(f);
    } else {
        accept(f, on_pdo);
    }
}

/// Synchronous PDOs that have arrived are valid from the SYNC on.
void Pdos::pass_synchronous(const Report& on_pdo) {
    for (auto& [number, p] : received_) {
        if (!p.held) continue;
        p.held = false;
        p.fresh = true;
        p.data = p.waiting;
        on_pdo(text(number, p));
    }
}

void Pdos::send_synchronous() {
    for (auto& [number, p] : sent_) {
        if (!p.fresh || p.transmission > max_synchronous) continue;
        if (p.transmission == 0) {  // acyclic: once for each value
            send(p);
            p.fresh = false;
        } else if (++p.syncs >= p.transmission) {
            send(p);
            p.syncs = 0;
        }
    }
}

void Pdos::send_requested(const Frame& request) {
    for (const auto& [number, p] : sent_) {
        if (is(request, p.cob) && p.transmission == on_request && p.fresh) {
            send(p);
        }
    }
}

void Pdos::accept(const Frame& f, const Report& on_pdo) {
    for (auto& [number, p] : received_) {
        if (!is(f, p.cob) || f.length * 8U < bits(p)) continue;
        std::copy_n(f.data.begin(), 8, p.waiting.begin());
        if (p.transmission <= max_synchronous) {
            p.held = true;
            continue;
        }
        p.data = p.waiting;
        p.fresh = true;
        on_pdo(text(number, p));
    }
}

}  // namespace hal::canopen::gateway
