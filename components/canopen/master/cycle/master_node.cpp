// SPDX-License-Identifier: MIT
#include "master_node.hpp"

#include <algorithm>
#include <iterator>

#include "canopen/master/boot/master_objects.hpp"
#include "canopen/protocol/srdo_description.hpp"

namespace hal::canopen {

namespace {

constexpr std::uint16_t received_base = 0x2000;
constexpr std::uint16_t sent_base = 0x4000;
constexpr std::uint16_t filler = 0x5fff;

constexpr std::uint16_t dispatcher_list = 0x1fd0;
constexpr unsigned per_index = 254;

Type own_type(Type type) {
    if (is_real(type)) return type;
    if (is_signed(type)) return Type::integer64;
    return Type::unsigned64;
}

void set(Description& d, std::uint16_t index, std::uint8_t sub, std::uint64_t value,
         unsigned bytes) {
    EntryDescription* e = d.find(index, sub);
    if (e == nullptr) return;
    e->value.resize(bytes);
    for (unsigned i = 0; i < bytes; ++i) {
        e->value[i] = static_cast<std::uint8_t>(value >> (8 * i));
    }
}

class Maker {
public:
    explicit Maker(const config::MasterConfig& config) : config_(config) {}

    OwnNode make() {
        Description& d = out_.description;
        d = basic_device(
            {.device_type = 0, .name = "Halcyon master", .heartbeat_ms = config_.heartbeat_ms});
        const bool produces =
            config_.sync == config::SyncMode::cycle || config_.sync == config::SyncMode::timed;
        set(d, 0x1005, 0, config_.sync_cob | (produces ? cob_flag30 : 0), 4);
        if (config_.sync == config::SyncMode::follow) {
            set(d, 0x1006, 0, static_cast<std::uint64_t>(config_.sync_period / microsecond), 4);
        }
        set(d, 0x1007, 0, 0, 4);
        set(d, 0x1019, 0, config_.sync_counter, 1);
        if (config_.time_period > 0) {
            set(d, 0x1012, 0, 0x100 | cob_flag30, 4);
        }
        set(d, 0x1029, 1, 1, 1);  // an error of the bus is the network's state, not ours
        d.add(filler, 0, Type::unsigned64, Access::read_write).mappable();
        for (std::size_t n = 0; n < config_.nodes.size(); ++n) {
            for (const config::Pdo& pdo : config_.nodes[n].pdos) {
                if (pdo.safety) {
                    safety(n, pdo);
                } else if (pdo.to_node) {
                    send(n, pdo);
                } else {
                    receive(n, pdo);
                }
            }
        }
        for (Sent& sent : out_.sent) {
            finish(sent);
        }
        if (dispatched_ != 0) {
            finish_dispatcher_list();
        }
        add_master_objects(d, config_.setup());
        if (config_.flying.enabled) {
            flying(d);
        }
        add_srdos(d, srdos_);
        return std::move(out_);
    }

private:
    /// 1F90h, in ms.
    void flying(Description& d) const {
        const FlyingSetup& f = config_.flying;
        set(d, 0x1f80, 0, startup_of(config_.setup()) | 1U << 5, 4);
        d.add(0x1f90, 0, Type::unsigned8, Access::constant, 6,
              "NMT flying master timing parameters");
        const Time times[] = {f.timeout,       f.delay,       f.priority * millisecond,
                              f.priority_slot, f.device_slot, f.search_interval()};
        for (std::uint8_t n = 0; n < std::size(times); ++n) {
            d.add(0x1f90, static_cast<std::uint8_t>(n + 1), Type::unsigned16, Access::read_only,
                  static_cast<std::uint64_t>(times[n] / millisecond));
        }
    }

    void receive(std::size_t node, const config::Pdo& pdo) {
        PdoDescription p;
        p.cob = pdo.cob;
        p.transmission = 255;  // what came is seen in the cycle it came in, not after the next SYNC
        p.event_ms =
            static_cast<std::uint16_t>(std::clamp<Time>(pdo.limit / millisecond, 0, 65535));
        p.multiplex = pdo.multiplex;
        if (pdo.multiplexed()) {
            for (const config::Object& object : pdo.objects) {
                dispatch(node, object);
            }
        } else {
            for (const config::Object& object : pdo.objects) {
                const Placed* at =
                    object.filler ? nullptr : &out_.placed[position(node, false, object)];
                p.mapping.push_back(at == nullptr ? map_entry(filler, 0, object.bits)
                                                  : map_entry(at->index, at->sub, object.bits));
            }
        }
        out_.received.push_back({node, &pdo, static_cast<unsigned>(out_.received.size() + 1)});
        add_rpdo(out_.description, out_.received.back().number, p);
    }

    /// A row of 1FD0h–1FFFh: which of our objects takes that of the node.
    void dispatch(std::size_t node, const config::Object& object) {
        const Placed& at = out_.placed[position(node, false, object, object.type)];
        const std::uint8_t id = config_.nodes[node].setup.id;
        const auto row = std::uint64_t{1} << 56 | std::uint64_t{at.index} << 40 |
                         std::uint64_t{at.sub} << 32 | std::uint64_t{object.index} << 16 |
                         std::uint64_t{object.sub} << 8 | id;
        out_.description.add(static_cast<std::uint16_t>(dispatcher_list + dispatched_ / per_index),
                             static_cast<std::uint8_t>(dispatched_ % per_index + 1),
                             Type::unsigned64, Access::read_only, row);
        ++dispatched_;
    }
    void finish_dispatcher_list() {
        for (unsigned n = 0; n < dispatched_; n += per_index) {
            out_.description.add(static_cast<std::uint16_t>(dispatcher_list + n / per_index), 0,
                                 Type::unsigned8, Access::constant,
                                 std::min(dispatched_ - n, per_index), "Object dispatching list");
        }
    }

    void send(std::size_t node, const config::Pdo& pdo) {
        auto sent = std::find_if(out_.sent.begin(), out_.sent.end(),
                                 [&](const Sent& s) { return s.pdo->cob == pdo.cob; });
        if (sent == out_.sent.end()) {
            sent = out_.sent.insert(sent, {&pdo, static_cast<unsigned>(out_.sent.size() + 1), {}});
        }
        unsigned bit = 0;
        for (const config::Object& object : pdo.objects) {
            if (!object.filler) {
                sent->parts.push_back(
                    {position(node, true, object), static_cast<std::uint8_t>(bit), object.bits});
            }
            bit += object.bits;
        }
    }

    /// The plain objects are ours; of the inverted frame only that it is the complement counts.
    void safety(std::size_t node, const config::Pdo& pdo) {
        SrdoDescription s;
        s.direction = pdo.to_node ? SrdoDirection::sends : SrdoDirection::receives;
        s.cycle_ms = static_cast<std::uint16_t>(
            (pdo.to_node ? pdo.safety->refresh : pdo.safety->sct) / millisecond);
        s.validation_ms = static_cast<std::uint8_t>(pdo.safety->srvt / millisecond);
        s.cob = pdo.cob;
        OwnSrdo own{node, &pdo, static_cast<unsigned>(out_.srdos.size() + 1)};
        for (const config::Object& object : pdo.objects) {
            own.placed.push_back(position(node, pdo.to_node, object));
            const Placed& at = out_.placed[own.placed.back()];
            s.mapping.push_back(map_entry(at.index, at.sub, object.bits));
            s.mapping.push_back(map_entry(filler, 0, object.bits));
        }
        out_.srdos.push_back(std::move(own));
        srdos_.push_back(std::move(s));
    }

    void finish(Sent& sent) {
        std::sort(sent.parts.begin(), sent.parts.end(),
                  [](const Sent::Part& a, const Sent::Part& b) { return a.first < b.first; });
        PdoDescription p;
        p.cob = sent.pdo->cob;
        p.transmission = sent.pdo->transmission;
        p.inhibit_100us = sent.pdo->inhibit_100us;
        p.event_ms = sent.pdo->event_ms;
        p.multiplex = sent.pdo->multiplex;
        if (sent.pdo->multiplexed()) return add_tpdo(out_.description, sent.number, p);
        unsigned bit = 0;
        const auto fill = [&](unsigned until) {
            if (until > bit) {
                p.mapping.push_back(map_entry(filler, 0, until - bit));
            }
            bit = until;
        };
        for (const Sent::Part& part : sent.parts) {
            fill(part.first);
            p.mapping.push_back(
                map_entry(out_.placed[part.placed].index, out_.placed[part.placed].sub, part.bits));
            bit += part.bits;
        }
        fill(sent.pdo->bits());
        add_tpdo(out_.description, sent.number, p);
    }

    std::size_t position(std::size_t node, bool to_node, const config::Object& object,
                         Type type = Type::none) {
        for (std::size_t i = 0; i < out_.placed.size(); ++i) {
            if (out_.placed[i].node == node && out_.placed[i].to_node == to_node &&
                out_.placed[i].object->same(object)) {
                return i;
            }
        }
        unsigned& count = to_node ? sent_objects_ : received_objects_;
        const auto index =
            static_cast<std::uint16_t>((to_node ? sent_base : received_base) + count / per_index);
        const auto sub = static_cast<std::uint8_t>(count % per_index + 1);
        ++count;
        const std::string name = config_.nodes[node].name + "." + object.pin;
        out_.description
            .add(index, sub, type != Type::none ? type : own_type(object.type), Access::read_write,
                 0, name)
            .mappable();
        out_.placed.push_back({node, to_node, &object, index, sub});
        return out_.placed.size() - 1;
    }

    const config::MasterConfig& config_;
    OwnNode out_;
    std::vector<SrdoDescription> srdos_;
    unsigned sent_objects_ = 0;
    unsigned received_objects_ = 0;
    unsigned dispatched_ = 0;
};

}  // namespace

OwnNode own_node(const config::MasterConfig& config) { return Maker(config).make(); }

}  // namespace hal::canopen
