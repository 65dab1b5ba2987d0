// SPDX-License-Identifier: MIT
// Sections to a MasterConfig.
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <set>

#include <sys/stat.h>

#include "node_reader.hpp"

namespace hal::canopen::config {

namespace {

constexpr Choice<AtStop> stops[] = {
    {"nothing", AtStop::nothing}, {"pre-operational", AtStop::pre_operational}, {"stopped", AtStop::stopped}};

void take_sync(Keys& keys, MasterConfig& to) {
    if (const Line* line = keys.find("sync")) {
        const std::string word = lower(line->value.text);
        const auto        words = words_of(line->value);
        const auto        time = duration(word);
        const auto        followed = words.size() == 2 && lower(words[0].text) == "follow" ? duration(words[1].text) : std::nullopt;
        if (word == "none" || word == "no") to.sync = SyncMode::none;
        else if (word == "cycle") to.sync = SyncMode::cycle;
        else if (word == "follow") to.sync = SyncMode::follow;
        else if (followed && *followed > 0) to.sync = SyncMode::follow, to.sync_period = *followed;
        else if (time && *time >= 100 * microsecond && *time <= 60 * second) to.sync = SyncMode::timed, to.sync_period = *time;
        else keys.refuse(*line, "cycle, a time such as 2ms, follow, follow 2ms, or none");
    }
    constexpr Choice<bool> clocks[] = {{"sync", true}, {"own", false}};
    for (const char* key : {"clock", "sync-phase"})
        if (const Line* line = keys.find(key); line != nullptr && to.sync != SyncMode::follow)
            keys.report().error(Topic::value, line->key.at, std::string("'") + key + "' is for those who follow the SYNC of another node",
                                "write sync = follow, or leave it out");
    keys.take_choice("clock", to.sync_clock, clocks);
    keys.take_time("sync-phase", to.sync_phase, 0, 60 * second);
    keys.take_small("sync-counter", to.sync_counter, 2, 240);
    keys.take_time("sync-window", to.sync_window, microsecond, 60 * second);
    keys.take_small("sync-cob-id", to.sync_cob, 1, 0x7ff);
    keys.take_flag("sync-at-boot", to.sync_at_boot);
}

void take_flying(Keys& keys, MasterConfig& to) {
    constexpr Choice<int> priorities[] = {{"no", -1}, {"high", 0}, {"medium", 1}, {"low", 2}};
    FlyingSetup&          f = to.flying;
    const Line* const     flying = keys.find("flying-master");
    int                   priority = flying == nullptr ? -1 : -2;  // -2: it was refused
    keys.take_choice("flying-master", priority, priorities);
    f.enabled = priority >= 0;
    f.id = to.node_id;
    if (f.enabled) f.priority = static_cast<std::uint8_t>(priority);
    for (const char* key :
         {"flying-timeout", "flying-delay", "flying-priority-slot", "flying-device-slot", "flying-detect", "flying-silence"})
        if (const Line* line = keys.find(key); line != nullptr && priority == -1)
            keys.report().error(Topic::value, line->key.at, std::string("'") + key + "' is for flying masters",
                                "write flying-master = medium");
    f.silence = Time{to.heartbeat_ms} * millisecond * 5 / 2;
    keys.take_time("flying-timeout", f.timeout, millisecond, 60 * second);
    keys.take_time("flying-delay", f.delay, 0, 60 * second);
    keys.take_time("flying-priority-slot", f.priority_slot, millisecond, 60 * second);
    keys.take_time("flying-device-slot", f.device_slot, 10 * microsecond, second);
    keys.take_time("flying-detect", f.detect_cycle, 100 * millisecond, 3600 * second);
    keys.take_time("flying-silence", f.silence, millisecond, 60 * second);
    if (f.enabled && to.heartbeat_ms == 0 && flying != nullptr)
        keys.report().error(Topic::value, flying->key.at, "a flying master without a heartbeat would not be missed",
                            "write heartbeat = 100ms");
    for (const std::string& problem : problems_of(f))
        if (flying != nullptr) keys.report().error(Topic::value, flying->key.at, problem);
}

void take_bus(Keys& keys, MasterConfig& to, Report& report) {
    keys.take_text("link", to.link);
    for (const char* key : {"bitrate", "datarate"})
        if (const Line* line = keys.find(key)) {
            const auto bits = rate(line->value.text);
            if (bits) (*key == 'b' ? to.bit_rate : to.data_rate) = *bits;
            else keys.refuse(*line, "bits per second, as in 1M, 500k or 125000");
        }
    keys.take_small("node-id", to.node_id, 1, 127);
    take_sync(keys, to);
    keys.take_time("time", to.time_period, 10 * millisecond, 3600 * second, true);
    Time heartbeat = Time{to.heartbeat_ms} * millisecond;
    if (keys.take_time("heartbeat", heartbeat, millisecond, 65535 * millisecond, true))
        to.heartbeat_ms = static_cast<std::uint16_t>(heartbeat / millisecond);
    keys.take_choice("on-stop", to.at_stop, stops);
    take_flying(keys, to);
    MasterSetup& m = to.master;
    m.id = to.node_id;
    keys.take_time("sdo-timeout", m.sdo.timeout, millisecond, 60 * second);
    keys.take_small("sdo-retries", m.sdo.resends, 0, 20);
    keys.take_time("nmt-inhibit", m.nmt_inhibit, 0, second, true);
    keys.take_small("parallel", m.parallel, 0, 127);
    keys.take_small("resets", m.resets, 0, 1000);
    keys.take_flag("reset-at-start", m.reset_at_start);
    constexpr Choice<bool> starts[] = {{"each", false}, {"together", true}};
    keys.take_choice("start", m.start_all_at_once, starts);
    for (Line* line : keys.rest()) {
        line->used = true;
        const std::vector<std::string> all{"link",        "bitrate",     "datarate", "node-id",   "sync",           "sync-counter",
                                           "sync-window", "sync-cob-id", "sync-at-boot", "time",     "heartbeat", "on-stop",        "sdo-timeout",
                                           "sdo-retries", "nmt-inhibit", "parallel", "resets",    "reset-at-start", "start",
                                           "clock",       "sync-phase",  "flying-master", "flying-timeout", "flying-delay",
                                           "flying-priority-slot", "flying-device-slot", "flying-detect", "flying-silence"};
        const std::string              near = did_you_mean(line->key.text, all);
        report.error(Topic::line, line->key.at, "the bus has no '" + line->key.text + "'",
                     near.empty() ? "there are " + listed(all, 40) : near);
    }
}

/// `0x181 drive 1, status = 8, 2ms, -, 100us`: identifier and name; bytes, period, deadline, jitter.
void take_foreign(const Line& line, MasterConfig& to, Report& report) {
    Foreign f;
    f.at = line.key.at;
    const std::size_t      blank = std::min(line.written.find_first_of(" \t"), line.written.size());
    const std::string_view id_text = std::string_view(line.written).substr(0, blank);
    const auto             id = id_text.starts_with("0x") ? natural(id_text) : std::nullopt;
    if (blank < line.written.size()) f.name = line.written.substr(line.written.find_first_not_of(" \t", blank));
    if (!id || *id > 0x1fffffff)
        return report.error(Topic::value, line.key.at, "'" + std::string(id_text) + "' is no identifier",
                            "write it in hex, 0x181, with eight digits for an extended one");
    f.id = static_cast<std::uint32_t>(*id), f.extended = id_text.size() == 10 || f.id > 0x7ff;
    const auto fields = list_of(line.value);
    if (fields.size() < 2 || fields.size() > 4)
        return report.error(Topic::value, line.value.at, "a message has BYTES, PERIOD, DEADLINE, JITTER",
                            "the last two may be left out: 8, 10ms");
    std::string bytes = lower(fields[0].text);
    if (bytes.ends_with("brs")) f.fd = f.bit_rate_switch = true, bytes.resize(bytes.size() - 3);
    else if (bytes.ends_with("fd")) f.fd = true, bytes.resize(bytes.size() - 2);
    else if (bytes == "r") f.remote = true, bytes = "0";
    const auto length = natural(bytes);
    if (!length || *length > (f.fd ? 64U : 8U))
        return report.error(Topic::value, fields[0].at, "'" + fields[0].text + "' is no length",
                            "write 0 to 8, R for a remote request, or up to 64fd or 64brs for CAN FD");
    f.bytes = static_cast<std::uint8_t>(*length);
    Time* const           times[] = {&f.period, &f.deadline, &f.jitter};
    constexpr const char* names[] = {"period", "deadline", "jitter"};
    for (std::size_t i = 1; i < fields.size(); ++i) {
        if (i > 1 && fields[i].text == "-") continue;
        const auto time = duration(fields[i].text);
        if (!time || *time > 3600 * second || (*time < microsecond && i != 3))
            return report.error(Topic::value, fields[i].at, "'" + fields[i].text + "' is no " + names[i - 1], "write 10ms, 250us or 1s");
        *times[i - 1] = *time;
    }
    to.foreign.push_back(std::move(f));
}

/// PDOs above 4 without an identifier of their own get the lowest that no node has by rule.
void share_out_identifiers(MasterConfig& config, Report& report) {
    std::set<std::uint32_t> taken;
    for (const Node& n : config.nodes) {
        for (unsigned k = 0; k < 8; ++k) taken.insert(0x180 + 0x80 * k + n.setup.id);
        for (const Pdo& p : n.pdos) taken.insert(cob_id(p.cob));
    }
    for (const Foreign& f : config.foreign) taken.insert(f.id);
    for (Node& n : config.nodes)
        for (Pdo& p : n.pdos) {
            if (p.cob != 0 || p.safety) continue;
            for (unsigned base = p.to_node ? 0x200 : 0x180; base < 0x580 && p.cob == 0; base += 0x100)
                for (unsigned id = base + 1; id < base + 0x80 && p.cob == 0; ++id)
                    if (!taken.contains(id)) p.cob = id;
            if (p.cob == 0)
                report.error(Topic::node, p.at, "no identifier is left for this PDO",
                             "give it one of 29 bits: " + std::string(p.to_node ? "rpdo" : "tpdo") + std::to_string(p.number) +
                                 ".cob-id = 0x10000000");
            taken.insert(p.cob);
            configure_pdo(n.setup, p);
        }
}

/// In place of date and time: the same writes have the same number, others most probably another one.
void date_by_content(NodeSetup& node) {
    std::uint64_t sum = 0xcbf29ce484222325;  // FNV-1a
    const auto    add = [&](unsigned byte) { sum = (sum ^ byte) * 0x100000001b3; };
    for (const ObjectWrite& w : node.writes) {
        add(w.index & 0xff), add(w.index >> 8U), add(w.sub), add(w.data.size() & 0xff);
        for (const std::uint8_t byte : w.data) add(byte);
    }
    constexpr std::uint64_t days = 49'000, day_ms = 86'400'000;
    node.configuration_date = static_cast<std::uint32_t>(1 + sum % days);
    node.configuration_time = static_cast<std::uint32_t>((sum >> 20) % day_ms);
}

/// The bits of a PDO that are objects, not gaps.
std::uint64_t used_bits(const Pdo& pdo) {
    std::uint64_t used = 0;
    unsigned      bit = 0;
    for (const Object& o : pdo.objects) {
        if (!o.filler && o.bits != 0 && bit + o.bits <= 64)
            used |= (o.bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << o.bits) - 1) << bit;
        bit += o.bits;
    }
    return used;
}

/// Several nodes may take their parts of one message of the master's.
std::string why_not_shared(const Pdo& a, const Pdo& b) {
    if (a.safety || b.safety) return "an SRDO has its identifiers alone";
    if (!a.to_node || !b.to_node) return "two senders of one identifier destroy each other's frames";
    if (a.multiplexed() || b.multiplexed()) return "a multiplexed PDO has its identifier alone";
    if (a.bits() != b.bits()) return "nodes that share a message have to map the same length; fill it with gap 8, gap 16 or gap 32";
    if ((used_bits(a) & used_bits(b)) != 0)
        return "nodes that share a message have objects at different places in it; put gap 16 or gap 32 before";
    if (a.transmission != b.transmission) return "nodes that share a message have the same transmission";
    return {};
}

void check_whole(const MasterConfig& config, Report& report) {
    struct User {
        const Node* node;
        const Pdo*  pdo;
    };
    constexpr std::size_t              most_multiplexed = 48 * 254;  // rows of 1FD0h to 1FFFh
    std::size_t                        multiplexed = 0;
    std::multimap<std::uint32_t, User> users;
    unsigned                           sent = 0, received = 0, safety = 0;
    const auto                         called = [](const User& u) {
        return std::string(u.pdo->to_node ? "r" : "t") + (u.pdo->safety ? "srdo" : "pdo") + std::to_string(u.pdo->number) + " of '" +
               u.node->name + "'";
    };
    for (const Node& n : config.nodes)
        for (const Pdo& p : n.pdos) {
            const std::uint32_t cob = p.cob & (cob_extended | 0x1fffffff);
            if (p.multiplexed() && !p.to_node) multiplexed += p.objects.size();
            if (p.safety) ++safety;
            else if (!p.to_node) ++received;
            else sent += !users.contains(cob);
            const auto [first, last] = users.equal_range(cob);
            for (auto u = first; u != last; ++u) {
                const std::string why = why_not_shared(*u->second.pdo, p);
                if (why.empty()) continue;
                report.error(Topic::node, p.at,
                             called({&n, &p}) + " has the identifier of " + called(u->second) + ", " +
                                 lower(object_label(static_cast<std::uint16_t>(cob_id(p.cob)), 0, true)),
                             why);
                break;
            }
            users.emplace(cob, User{&n, &p});
        }
    for (std::size_t i = 0; i < config.foreign.size(); ++i)
        for (std::size_t k = 0; k < i; ++k)
            if (config.foreign[i].id == config.foreign[k].id && config.foreign[i].extended == config.foreign[k].extended &&
                config.foreign[i].remote == config.foreign[k].remote)
                report.error(Topic::node, config.foreign[i].at,
                             "this identifier is used in line " + std::to_string(config.foreign[k].at.line) + ", too",
                             "two senders of one identifier destroy each other's frames");
    for (const unsigned count : {sent, received})
        if (count > 512)
            report.error(Topic::node, config.at, "the nodes have " + std::to_string(count) + " PDOs in one direction; a master has 512",
                         "use a second bus, with a configuration of its own");
    if (multiplexed > most_multiplexed)
        report.error(Topic::node, config.at,
                     "the nodes tell " + std::to_string(multiplexed) + " objects by multiplexed PDOs; a master has room for " +
                         std::to_string(most_multiplexed),
                     "use a second bus, with a configuration of its own");
    if (safety > Srdos::most)
        report.error(Topic::node, config.at, "the nodes have " + std::to_string(safety) + " SRDOs; a bus has room for 64");
    if (!std::any_of(report.messages.begin(), report.messages.end(), [](const Message& m) { return m.severity == Severity::error; }))
        for (const std::string& problem : problems_of(config.setup())) report.error(Topic::node, config.at, problem);
}

/// Node sections: where they are, and the type they are of.
class File {
public:
    File(std::string_view text, const std::string& path, const ReadFile& read_file)
        : sections_(split(text, report_)),
          descriptions_(read_file, path.find('/') == path.npos ? "" : path.substr(0, path.rfind('/') + 1)) {}

    Reading read() {
        for (Section& s : sections_) sort(s);
        if (bus_ == nullptr)
            report_.error(Topic::line, {1, 1, 0, 0}, "there is no section [bus]",
                          "write [bus] and below it link = can:can0 and bitrate = 1M");
        if (bus_ != nullptr) {
            out_.config.at = bus_->at;
            Keys keys(report_);
            keys.take(*bus_);
            take_bus(keys, out_.config, report_);
        }
        for (Section* s : nodes_) node(*s);
        for (Section* s : foreign_)
            for (const Line& line : s->lines) take_foreign(line, out_.config, report_);
        for (const auto& [name, s] : types_)
            if (!used_types_.contains(name))
                report_.warning(Topic::line, s->at, "no node is of type '" + name + "'",
                                "write type = " + name + " below a [node …], or take the section away");
        if (nodes_.empty() && bus_ != nullptr && foreign_.empty())
            report_.error(Topic::line, bus_->at, "there is no node on this bus", "write [node 5 NAME] and what it is below it");
        share_out_identifiers(out_.config, report_);
        for (Node& n : out_.config.nodes)
            if (n.dated_by_content) date_by_content(n.setup);
        check_whole(out_.config, report_);
        finish();
        return std::move(out_);
    }

private:
    void sort(Section& s) {
        const std::string kind = s.words.empty() ? "" : lower(s.words[0].text);
        const auto        expect = [&](std::size_t words, const char* form) {
            if (s.words.size() == words) return true;
            report_.error(Topic::line, s.at, "the section's name has to be " + std::string(form));
            return false;
        };
        const auto once = [&](Section*& to, const char* form) {
            if (!expect(1, form)) return;
            if (to != nullptr)
                report_.error(Topic::line, s.at, std::string(form) + " is there twice",
                              "line " + std::to_string(to->at.line) + " has it, too", "second time");
            else to = &s;
        };
        if (kind == "bus") once(bus_, "[bus]");
        else if (kind == "defaults") once(defaults_, "[defaults]");
        else if (kind == "type") {
            if (expect(2, "[type NAME]") && !types_.emplace(s.words[1].text, &s).second)
                report_.error(Topic::line, s.words[1].at, "type '" + s.words[1].text + "' is there twice", "", "second time");
        } else if (kind == "node") nodes_.push_back(&s);
        else if (kind == "messages") {
            if (expect(1, "[messages]")) foreign_.push_back(&s);
        } else {
            std::string near = did_you_mean(kind, {"bus", "defaults", "type", "node", "messages"});
            report_.error(Topic::line, s.at, "there is no section '" + (s.words.empty() ? "" : s.words[0].text) + "'",
                          near.empty() ? "there are [bus], [defaults], [type NAME], [node ID NAME], [messages]" : near);
        }
    }

    void node(Section& s) {
        Node n;
        n.at = s.at;
        const auto id = s.words.size() >= 2 ? natural(s.words[1].text) : std::nullopt;
        if (!id || *id < 1 || *id > 127 || s.words.size() > 3)
            return report_.error(Topic::line, s.words.size() >= 2 ? s.words[1].at : s.at,
                                 "a node section is named by the node's id, 1 to 127, and a name of your own", "write [node 5 NAME]");
        n.setup.id = static_cast<std::uint8_t>(*id);
        n.name = s.words.size() == 3 ? dashed(s.words[2].text) : "node-" + std::to_string(*id);
        if (s.words.size() == 3) n.setup.name = n.name;
        for (const Node& other : out_.config.nodes) {
            if (other.setup.id == n.setup.id)
                return report_.error(Topic::node, s.words[1].at, "node-id " + std::to_string(*id) + " is given twice",
                                     "line " + std::to_string(other.at.line) + " has it, too", "second time");
            if (other.name == n.name)
                report_.error(Topic::node, s.words[2].at, "the name '" + n.name + "' is given twice",
                              "line " + std::to_string(other.at.line) + " has it, too", "second time");
        }
        if (n.setup.id == out_.config.node_id)
            report_.error(Topic::node, s.words[1].at, "node-id " + std::to_string(*id) + " is the master's own",
                          "write another node-id = … in [bus]");
        Keys keys(report_);
        Keys own(report_);
        own.take(s);
        if (defaults_ != nullptr) keys.take(*defaults_);
        const Line* type = own.find("type");
        if (type != nullptr) {
            const auto at = types_.find(type->value.text);
            if (at != types_.end()) {
                used_types_.insert(at->first);
                keys.take(*at->second);
            } else {
                std::vector<std::string> names;
                for (const auto& t : types_) names.push_back(t.first);
                const std::string near = did_you_mean(type->value.text, names);
                report_.error(Topic::line, type->value.at, "unknown type '" + type->value.text + "'",
                              !near.empty()   ? near
                              : names.empty() ? "write [type " + type->value.text + "]"
                                              : "there are " + listed(names));
            }
        }
        keys.take(s);
        for (Section* shared : {defaults_, type != nullptr && types_.contains(type->value.text) ? types_[type->value.text] : nullptr})
            if (shared != nullptr)
                for (Line& line : shared->lines) line.used = false;
        if (type != nullptr && !types_.contains(type->value.text)) {  // what follows from that need not be said
            out_.config.nodes.push_back(std::move(n));
            return;
        }
        NodeReader(keys, descriptions_, out_.config, n).read();
        out_.config.nodes.push_back(std::move(n));
    }

    void finish() {
        // A type's line is read once for each node of it.
        auto& all = report_.messages;
        std::stable_sort(all.begin(), all.end(), [](const Message& a, const Message& b) { return a.at.offset < b.at.offset; });
        for (Message& m : all)
            if (std::none_of(out_.messages.begin(), out_.messages.end(),
                             [&](const Message& o) { return o.at.offset == m.at.offset && o.sentence == m.sentence; }))
                out_.messages.push_back(std::move(m));
    }

    Report                          report_;
    std::vector<Section>            sections_;
    Descriptions                    descriptions_;
    Section *                       bus_ = nullptr, *defaults_ = nullptr;
    std::map<std::string, Section*> types_;
    std::set<std::string>           used_types_;
    std::vector<Section*>           nodes_, foreign_;
    Reading                         out_;
};

}  // namespace

unsigned Pdo::bits() const {
    unsigned sum = 0;
    for (const Object& o : objects) sum += o.bits;
    return sum;
}

MasterSetup MasterConfig::setup() const {
    MasterSetup out = master;
    out.id = node_id;
    out.start_self = false;  // we listen before all are there: what a node sends once, when it starts, must not be lost
    for (const Node& n : nodes) out.nodes.push_back(n.setup);
    return out;
}

bool Reading::good() const {
    return std::none_of(messages.begin(), messages.end(), [](const Message& m) { return m.severity == Severity::error; });
}

bool read_from_disk(const std::string& path, std::string& bytes) {
    constexpr std::size_t most = 16'000'000;
    struct stat about{};  // opening a FIFO would block
    if (::stat(path.c_str(), &about) == 0 && !S_ISREG(about.st_mode)) return bytes = "it is not a regular file", false;
    errno = 0;
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    if (!file) return bytes = std::strerror(errno != 0 ? errno : EIO), false;
    const auto size = file.tellg();
    if (size < 0 || static_cast<std::size_t>(size) > most) return bytes = size < 0 ? "it is no file" : "it is larger than 16 MB", false;
    bytes.resize(static_cast<std::size_t>(size));
    file.seekg(0);
    if (!file.read(bytes.data(), size)) return bytes = "it is no file", false;
    return true;
}

Reading read(std::string_view text, const std::string& path, const ReadFile& read_file) { return File(text, path, read_file).read(); }

std::string to_string(const Reading& reading, const std::string& path) {
    std::string out;
    for (const Message& m : reading.messages)
        if (m.severity == Severity::error)
            out += (out.empty() ? "" : "\n") + path + ":" + std::to_string(m.at.line) + ":" + std::to_string(m.at.column) + ": " +
                   m.sentence + (m.help.empty() ? "" : "; " + m.help);
    return out;
}

Reading read(const ByIndex& wish, const ReadFile& read_file) {
    // Other instances may have their nodes on the same bus, so those are not reset.
    std::string text = "[bus]\nsync = cycle\nreset-at-start = no\nnode-id = " + std::to_string(wish.master);
    text += "\n[node " + std::to_string(wish.slave) + "]\n";
    if (!wish.eds.empty()) text += "eds = " + wish.eds + "\n";
    Reading                                                       out;
    if (wish.slave == wish.master)
        out.messages.push_back({Severity::error,
                                Topic::node,
                                {},
                                "slavenodeid= and masternodeid= are both " + std::to_string(wish.slave),
                                "",
                                "every node on a bus has an id of its own",
                                "slavenodeid"});
    std::map<std::pair<std::uint16_t, std::uint8_t>, std::string> names;
    const Catalog                                                 drive("cia402", 1), lines("cia401", 1);
    const auto                                                    take = [&](const std::string& list, bool to_node) {
        unsigned number = 0;
        for (const Word& word : list_of({list, {}})) {
            const std::string item = lower(word.text);
            const std::size_t slash = std::min(item.find('/'), item.size()), colon = std::min(item.find(':'), slash);
            const auto        index = natural(std::string_view(item).substr(0, colon));
            const auto        sub =
                colon < slash ? natural(std::string_view(item).substr(colon + 1, slash - colon - 1)) : std::optional<std::uint64_t>(0);
            const auto bits = slash < item.size() ? natural(std::string_view(item).substr(slash + 1)) : std::nullopt;
            if (!index || !sub || *index < 0x1000 || *index > 0xffff || *sub > 255 ||
                (slash < item.size() && (!bits || (*bits != 8 && *bits != 16 && *bits != 32)))) {
                out.messages.push_back({Severity::error,
                                        Topic::value,
                                        {},
                                        std::string(to_node ? "inputs=" : "outputs=") + list + ": '" + word.text + "' is no object",
                                        "",
                                        "write its index, INDEX:SUB, or with another length in bits INDEX/16",
                                        to_node ? "inputs" : "outputs"});
                continue;
            }
            const auto        i = static_cast<std::uint16_t>(*index);
            const auto        s = static_cast<std::uint8_t>(*sub);
            const Known*      known = drive.find(i, s) != nullptr ? drive.find(i, s) : lines.find(i, s);
            const bool        is_natural = known != nullptr && known->type != Type::none && !is_signed(known->type);
            const unsigned usual = known != nullptr && bits_of(known->type) >= 8 ? bits_of(known->type) : 32;
            const unsigned length = bits ? static_cast<unsigned>(*bits) : usual;
            const std::string pdo = (to_node ? "rpdo" : "tpdo") + std::to_string(++number);
            const std::string label = lower(object_label(i, s));
            text += pdo + " = " + label + (wish.eds.empty() || bits ? (is_natural ? " u" : " i") + std::to_string(length) : "") + "\n";
            text += pdo + ".transmission = " + (to_node ? "event" : "sync") + "\n" + label + ".name = " + item.substr(0, colon) +
                    (*sub != 0 ? "-" + std::to_string(*sub) : "") + "\n";
            if (i == 0x6000 || i == 0x6200) text += label + ".bits = no\n";
        }
    };
    if (!wish.inputs.empty()) take(wish.inputs, true);
    if (!wish.outputs.empty()) take(wish.outputs, false);
    if (!out.messages.empty()) return out;
    return read(text, "", read_file);
}

}  // namespace hal::canopen::config
