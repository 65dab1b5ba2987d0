// SPDX-License-Identifier: MIT
#include "control/program_requests.hpp"

#include <algorithm>
#include <optional>
#include <unordered_set>
#include <vector>

#include "commands/json_text.hpp"
#include "commands/shell.hpp"
#include "control/request.hpp"
#include "control/streams.hpp"
#include "machine/processes/programs.hpp"
#include "machine/session.hpp"
#include "text/characters.hpp"
#include "text/netlist_name.hpp"

namespace hal {
namespace {

using Json = nlohmann::json;

constexpr std::size_t max_pins = 100'000;
constexpr std::size_t max_name_size = 200;

struct Direction {
    const char* word;
    hal_dir dir;
    bool read_only;
};
constexpr Direction directions[] = {{"in", HAL_DIR_IN, false},
                                    {"out", HAL_DIR_OUT, false},
                                    {"io", HAL_DIR_IO, false},
                                    {"rw", HAL_DIR_PARAM, false},
                                    {"ro", HAL_DIR_PARAM, true}};

/// Whether only the program itself changes it: then it needs no notification.
bool own(const Pin& pin) { return pin.dir == HAL_DIR_OUT || pin.read_only(); }

hal_value value_of(const Json& value, hal_type type, const std::string& of) {
    if (type == HAL_TYPE_BIT && value.is_boolean()) {
        return {.bit = value.get<bool>()};
    }
    if (type == HAL_TYPE_FLOAT && value.is_number()) {
        return {.real = value.get<double>()};
    }
    const std::string word = value_word(value);
    Parsed parsed;
    if (word.empty()) {
        parsed.problem = "it must be a number, true, false or a string";
    } else if (type == HAL_TYPE_PORT) {
        parsed.problem = "a port has no value";
    } else {
        parsed = parse_value(type, word);
    }
    if (!parsed.problem.empty()) {
        throw RequestError{"the value of '" + of + "': " + parsed.problem};
    }
    return parsed.value;
}

/// Throws when a netlist cannot contain the name of a pin, its prefix, or a stream.
void check_name(const std::string& name, const char* kind) {
    std::string problem = name_problem(name);
    if (problem.empty() && name.size() > max_name_size) {
        problem = "it has more than " + std::to_string(max_name_size) + " bytes";
    }
    if (problem.empty() && name.find_first_of("\"'\\") != name.npos) {
        problem = "a quote or a backslash is not a character of names";
    }
    if (!problem.empty()) {
        throw RequestError{"'" + shown_name(name) + "' is not a valid " + kind + ": " + problem +
                           "; use letters, digits and - _ . :"};
    }
}

ProgramPin pin_of(const Json& given, const std::string& prefix) {
    if (!given.is_object()) {
        throw RequestError{"a pin must be an object with name, type and dir"};
    }
    ProgramPin pin;
    const std::string& name = text_of(member(given, "name"), "the name of a pin");
    check_name(name, "pin name");
    pin.name = prefix + "." + name;
    const auto type = type_named(text_of(member(given, "type"), "the type of a pin"));
    if (!type) {
        throw RequestError{"the type of '" + pin.name +
                           "' must be bit, float, s32, u32, s64, u64 or port"};
    }
    pin.type = *type;
    const std::string& dir = text_of(member(given, "dir"), "the dir of a pin");
    const auto direction = std::find_if(std::begin(directions), std::end(directions),
                                        [&](const Direction& d) { return dir == d.word; });
    if (direction == std::end(directions)) {
        throw RequestError{"the dir of '" + pin.name +
                           "' must be in, out or io, or for a parameter ro or rw"};
    }
    pin.dir = direction->dir;
    pin.read_only = direction->read_only;
    if (pin.type == HAL_TYPE_PORT && pin.dir != HAL_DIR_IN && pin.dir != HAL_DIR_OUT) {
        throw RequestError{"port pin '" + pin.name + "' must be in or out"};
    }
    for (const auto& [key, value] : given.items()) {
        if (key == "value") {
            pin.initial = value_of(value, pin.type, pin.name);
        } else if (key == "safe") {
            pin.safe = value_of(value, pin.type, pin.name);
        } else if (key == "doc") {
            pin.doc = text_of(value, "doc");
        } else if (key == "unit") {
            pin.unit = text_of(value, "unit");
        } else if (key != "name" && key != "type" && key != "dir") {
            throw RequestError{"'" + key.substr(0, 60) + "' is not a valid member of a pin"};
        }
    }
    return pin;
}

Programs::Entry& owned(const Program& by, const std::string& name) {
    Programs::Entry* const entry = by.session.programs().owned(name, by.owner);
    if (!entry) {
        throw RequestError{"this connection has no component '" + name.substr(0, 60) +
                           "'; send {\"component\":…} first"};
    }
    return *entry;
}

/// Returns "float out".
std::string kind_of(hal_type type, hal_dir dir, bool read_only) {
    const auto direction =
        std::find_if(std::begin(directions), std::end(directions),
                     [&](const Direction& d) { return d.dir == dir && d.read_only == read_only; });
    return std::string(row(type).name) + " " +
           (direction == std::end(directions) ? "pin" : direction->word);
}

/// Throws when a dead program's pin that its successor does not have is linked: the link would be
/// lost, and the signal would keep its value.
void check_link(const Pin& of_dead, const std::string& difference) {
    if (of_dead.signal == nullptr) return;
    throw RequestError{"pin '" + of_dead.name + "' is linked to signal '" + of_dead.signal->name +
                       "' since the program before, and this one " + difference +
                       "; declare the pin as before, or type: unlinkp " + of_dead.name};
}

/// The component's pin of that name that a dead program left behind, or a new one.
Pin* add_pin(const Program& by, Transaction& transaction, const Programs::Entry& entry,
             std::unordered_set<const Pin*>& taken, const ProgramPin& wanted) {
    Pin* const there = by.session.model().find_pin(wanted.name);
    const bool left = there && there->name == wanted.name && there->instance &&
                      there->instance->component->process != 0 &&
                      there->instance->component->name == entry.name && !taken.contains(there);
    if (left) {
        if (there->type == wanted.type && there->dir == wanted.dir &&
            there->read_only() == wanted.read_only) {
            transaction.when_committed([there, safe = wanted.safe] {
                there->flags = safe ? there->flags | HAL_PIN_SAFE
                                    : there->flags & ~std::uint32_t{HAL_PIN_SAFE};
                if (safe) {
                    there->safe = *safe;
                }
            });
            return there;
        }
        check_link(*there, "declares it as " + kind_of(wanted.type, wanted.dir, wanted.read_only) +
                               " and not as " +
                               kind_of(there->type, there->dir, there->read_only()));
        by.session.programs().model().remove_pins(transaction, entry.name, {there});
    }
    std::string problem;
    Pin* const made =
        by.session.programs().model().add_pin(transaction, entry.name, wanted, problem);
    if (!made) {
        throw RequestError{problem};
    }
    return made;
}

/// Values for pins that are there: numbers of pins and values in turn.
std::vector<std::pair<Pin*, hal_value>> values_by_number(const Programs::Entry& entry,
                                                         const Json& given) {
    std::vector<std::pair<Pin*, hal_value>> values;
    for (std::size_t i = 0; i < given.size(); i += 2) {
        const auto number = static_cast<std::size_t>(whole(
            given[i], "the number of a pin", 0, static_cast<std::int64_t>(entry.pins.size()) - 1));
        Pin* const pin = entry.pins[number];
        values.emplace_back(pin, value_of(given[i + 1], pin->type, pin->name));
    }
    return values;
}

/// Gives the component all of these pins, or throws and gives it none.
void add_pins(const Program& by, Programs::Entry& entry, const std::vector<ProgramPin>& wanted) {
    if (wanted.empty()) return;
    Transaction transaction = by.session.begin();
    std::unordered_set<const Pin*> taken(entry.pins.begin(), entry.pins.end());
    std::vector<Pin*> made;
    for (const ProgramPin& pin : wanted) {
        made.push_back(add_pin(by, transaction, entry, taken, pin));
        taken.insert(made.back());
    }
    Diagnostics refused;
    if (!transaction.commit(refused)) {
        throw RequestError{render(refused, by.session.sources)};
    }
    entry.pins.insert(entry.pins.end(), made.begin(), made.end());
}

/// What a request {"component":…} declares, checked except for what needs the session.
struct Declaration {
    std::string name;
    std::optional<bool> ready;
    std::optional<std::int64_t> timeout_ns, every_ns;
    std::optional<std::vector<ProgramPin>> pins;
    const Json& safe;  ///< of pins that are there
};

std::optional<std::int64_t> milliseconds(const Json& body, const char* key, std::int64_t min) {
    const Json& given = member(body, key);
    if (given.is_null()) return std::nullopt;
    const std::int64_t ms = whole(given, key, min, 86'400'000);
    return ms < 0 ? -1 : ms * 1'000'000;
}

std::vector<ProgramPin> pins_of(const Json& pins, const std::string& prefix) {
    if (!pins.is_array() || pins.size() > max_pins) {
        throw RequestError{"pins must be an array of at most " + std::to_string(max_pins)};
    }
    std::vector<ProgramPin> all;
    for (const Json& pin : pins) {
        all.push_back(pin_of(pin, prefix));
    }
    return all;
}

Declaration declaration_of(const Json& body) {
    Declaration to{.name = text_of(body["component"], "component"),
                   .ready = {},
                   .timeout_ns = {},
                   .every_ns = {},
                   .pins = {},
                   .safe = member(body, "safe")};
    const Json& prefix = member(body, "prefix");
    const Json& pins = member(body, "pins");
    const Json& ready = member(body, "ready");
    if (!to.safe.is_null() && (!to.safe.is_array() || to.safe.size() % 2 != 0)) {
        throw RequestError{"safe must be an array of alternating pin numbers and declared values"};
    }
    if (!ready.is_null() && !ready.is_boolean()) {
        throw RequestError{"ready must be true or false"};
    }
    const std::string before = prefix.is_null() ? to.name : text_of(prefix, "prefix");
    check_name(before, "prefix");
    if (!ready.is_null()) {
        to.ready = ready.get<bool>();
    }
    to.timeout_ns = milliseconds(body, "timeout_ms", -1);
    to.every_ns = milliseconds(body, "every_ms", 0);
    if (!pins.is_null()) {
        to.pins = pins_of(pins, before);
    }
    return to;
}

/// Throws when a dead program has left a linked pin that this one, which is ready, does not have.
void check_links(const Program& by, const Programs::Entry& entry) {
    const LoadedComponent* const component = by.session.model().find_component(entry.name);
    if (component == nullptr || component->instances.empty()) return;
    const std::unordered_set<const Pin*> own(entry.pins.begin(), entry.pins.end());
    for (const auto& pin : component->instances.front()->pins) {
        if (!own.contains(pin.get())) {
            check_link(*pin, "does not declare it");
        }
    }
}

/// The component that a request names, seen from the program that declares it.
enum class ComponentOrigin {
    own,  ///< the program has declared it before
    fresh,  ///< there was none of this name
    successor,  ///< of one whose program is dead
};

ComponentOrigin origin_of(Programs& programs, const Program& by, const std::string& name) {
    if (programs.owned(name, by.owner)) return ComponentOrigin::own;
    const Programs::Entry* const there = programs.find(name);
    return there && there->dead() ? ComponentOrigin::successor : ComponentOrigin::fresh;
}

/// Gives the component its pins and declared values. When that is rejected, a component that is not
/// the program's own yet ends; that of a dead program keeps its pins and links.
void add_declared(const Program& by, Programs::Entry& entry, const Declaration& wanted,
                  ComponentOrigin origin) {
    Programs& programs = by.session.programs();
    try {
        const auto declared = values_by_number(entry, wanted.safe);
        if (wanted.pins) {
            add_pins(by, entry, *wanted.pins);
        }
        for (const auto& [pin, value] : declared) {
            pin->safe = value;
            pin->flags |= HAL_PIN_SAFE;
        }
        if (wanted.ready.value_or(origin != ComponentOrigin::own)) {
            check_links(by, entry);
        }
    } catch (const RequestError&) {
        switch (origin) {
        case ComponentOrigin::own: break;
        case ComponentOrigin::fresh: programs.leave(entry); break;
        case ComponentOrigin::successor: programs.die(entry, "its pins were rejected"); break;
        }
        throw;
    }
}

void append_values(std::string& reply, const Program& by, const std::vector<Pin*>& pins) {
    const auto values = by.session.values().peek(pins);
    reply += ",\"values\":[";
    for (std::size_t i = 0; i < pins.size(); ++i) {
        if (i > 0) {
            reply += ',';
        }
        json_value(reply, pins[i]->type, values[i]);
    }
    reply += ']';
}

}  // namespace

void declare_component(const Program& by, const Json& body, std::string& reply) {
    if (by.peer <= 0) {
        throw RequestError{
            "no process ID: the program runs outside the PID namespace of the machine"};
    }
    const Declaration wanted = declaration_of(body);
    const auto lock = by.session.lock();
    Programs& programs = by.session.programs();
    const ComponentOrigin origin = origin_of(programs, by, wanted.name);
    if (origin != ComponentOrigin::own) {
        const bool ready = false;  // until it has its pins
        const std::string problem = programs.announce(by.peer, wanted.name, by.owner, ready);
        if (!problem.empty()) {
            throw RequestError{problem};
        }
    }
    Programs::Entry& entry = *programs.owned(wanted.name, by.owner);
    const std::size_t first_new = entry.pins.size();
    add_declared(by, entry, wanted, origin);
    entry.timeout_ns = wanted.timeout_ns.value_or(entry.timeout_ns);
    if (wanted.every_ns) {
        programs.set_rate(entry, *wanted.every_ns);
    } else {
        programs.note_alive(entry);
    }
    if (wanted.pins) {
        const std::vector<Pin*> added(entry.pins.begin() + static_cast<std::ptrdiff_t>(first_new),
                                      entry.pins.end());
        reply += ",\"first\":" + std::to_string(first_new);
        append_values(reply, by, added);
    }
    // without `ready` a component is ready with its first request
    if (wanted.ready || origin != ComponentOrigin::own) {
        programs.set_ready(entry, wanted.ready.value_or(true));
    }
}

namespace {

/// While a component does not respond, its pins keep their declared values; what it writes waits
/// until it responds.
void hold_back(Programs::Entry& entry, std::vector<std::pair<Pin*, hal_value>>& values) {
    if (entry.heartbeat.missing.empty()) return;
    for (auto& [pin, value] : entry.heartbeat.before_timeout) {
        const auto written = std::ranges::find(values, pin, &std::pair<Pin*, hal_value>::first);
        if (written == values.end()) continue;
        value = written->second;
        values.erase(written);
    }
}

/// Returns true for an output that is linked to another pin of the same component.
bool loops_back(const Pin& pin) {
    if (pin.dir == HAL_DIR_IN || !pin.signal) return false;
    return std::ranges::any_of(pin.signal->pins, [&](const Pin* other) {
        return other != &pin && other->instance == pin.instance;
    });
}

}  // namespace

void exchange_values(const Program& by, const Json& body, std::string& reply) {
    const std::string& name = text_of(body["exchange"], "exchange");
    const Json& write = member(body, "write");
    const Json& read = member(body, "read");
    const Json& alive = member(body, "alive");
    if (!alive.is_null() && !alive.is_boolean()) {
        throw RequestError{"alive must be true or false"};
    }
    if (!write.is_null() && (!write.is_array() || write.size() % 2 != 0)) {
        throw RequestError{"write must be an array of alternating pin numbers and values"};
    }
    if (!read.is_null() && !read.is_boolean()) {
        throw RequestError{"read must be true or false"};
    }

    const auto lock = by.session.lock();
    Programs::Entry& entry = owned(by, name);
    auto values = values_by_number(entry, write);
    if (alive.is_null() || alive.get<bool>()) {
        by.session.programs().note_alive(entry);
    }
    hold_back(entry, values);
    by.session.values().write(values);
    if (!read.is_boolean() || !read.get<bool>()) return;
    std::vector<Pin*> requested;
    bool loops = false;
    for (Pin* const pin : entry.pins) {
        if (!own(*pin)) {
            requested.push_back(pin);
        }
        loops = loops || loops_back(*pin);
    }
    append_values(reply, by, requested);
    if (loops) {
        reply += ",\"loops\":true";
    }
}

void leave_component(const Program& by, const Json& body) {
    const std::string& name = text_of(body["exit"], "exit");
    const auto lock = by.session.lock();
    by.session.programs().leave(owned(by, name));
}

// --- byte streams --------------------------------------------------------------------------------

namespace {

std::string bytes_of(const std::string& hex) {
    std::string bytes;
    const auto is_hex = [](char c) { return hex_digit(c) >= 0; };
    if (hex.size() % 2 != 0 || !std::ranges::all_of(hex, is_hex)) {
        throw RequestError{"bytes are written as pairs of hexadecimal digits"};
    }
    for (std::size_t i = 0; i < hex.size(); i += 2) {
        bytes += static_cast<char>(hex_digit(hex[i]) * 16 + hex_digit(hex[i + 1]));
    }
    return bytes;
}

void append_hex(std::string& to, std::uint8_t byte) {
    static constexpr char digits[] = "0123456789abcdef";
    to += digits[byte >> 4];
    to += digits[byte & 15];
}

/// One end of a port. The session's lock makes all requests one reader or one writer; the other
/// end may be a thread at any moment.
class PortEnd {
public:
    explicit PortEnd(hal_port* port) : port_(port) {
        if (!port) return;
        head_ = __atomic_load_n(&port->head, __ATOMIC_ACQUIRE);
        tail_ = __atomic_load_n(&port->tail, __ATOMIC_ACQUIRE);
    }
    std::uint64_t capacity() const { return port_ ? port_->capacity : 0; }
    std::uint64_t readable() const { return head_ - tail_; }
    /// One byte stays free, as LinuxCNC has it.
    std::uint64_t writable() const {
        return readable() + 1 < capacity() ? capacity() - 1 - readable() : 0;
    }
    /// Appends `count` bytes in hexadecimal; removes them unless `peek`. False when there are
    /// fewer.
    bool read(std::uint64_t count, bool peek, std::string& hex) {
        if (!port_ || count > readable()) return false;
        for (std::uint64_t i = 0; i < count; ++i) {
            append_hex(hex, port_->data[(tail_ + i) % capacity()]);
        }
        if (!peek) {
            tail_ += count;
            __atomic_store_n(&port_->tail, tail_, __ATOMIC_RELEASE);
        }
        return true;
    }
    /// Writes all of the bytes, or none and returns false.
    bool write(const std::string& bytes) {
        if (!port_ || bytes.size() > writable()) return false;
        for (std::size_t i = 0; i < bytes.size(); ++i) {
            port_->data[(head_ + i) % capacity()] = static_cast<std::uint8_t>(bytes[i]);
        }
        head_ += bytes.size();
        __atomic_store_n(&port_->head, head_, __ATOMIC_RELEASE);
        return true;
    }

private:
    hal_port* port_;  // nullptr: it has no buffer
    std::uint64_t head_ = 0;
    std::uint64_t tail_ = 0;
};

/// Returns the port pin of a component of this connection, or throws.
Pin& find_port(const Program& by, const std::string& name, bool takes, bool writes) {
    Pin* const pin = by.session.model().find_pin(name);
    if (!pin || !pin->instance) {
        throw RequestError{"unknown pin '" + name.substr(0, 60) + "'"};
    }
    owned(by, pin->instance->component->name);
    if (pin->type != HAL_TYPE_PORT) {
        throw RequestError{"pin '" + name + "' is not a port"};
    }
    if (takes && pin->dir != HAL_DIR_IN) {
        throw RequestError{"port '" + name + "' is an output: use write"};
    }
    if (writes && pin->dir != HAL_DIR_OUT) {
        throw RequestError{"port '" + name + "' is an input: use read or peek"};
    }
    return *pin;
}

}  // namespace

void use_port(const Program& by, const Json& body, std::string& reply) {
    const std::string& name = text_of(body["port"], "port");
    const Json& read = member(body, "read");
    const Json& peek = member(body, "peek");
    const Json& write = member(body, "write");
    if (!read.is_null() + !peek.is_null() + !write.is_null() > 1) {
        throw RequestError{"a request either reads, peeks into or writes a port"};
    }
    const bool takes = !read.is_null() || !peek.is_null();
    const auto lock = by.session.lock();
    const Pin& pin = find_port(by, name, takes, !write.is_null());
    by.session.programs().note_alive(owned(by, pin.instance->component->name));
    PortEnd port(pin.signal ? pin.signal->port.get() : nullptr);
    bool done = false;
    if (takes) {
        const Json& given = read.is_null() ? peek : read;
        const auto count =
            static_cast<std::uint64_t>(whole(given, "the number of bytes", 0, 1 << 30));
        reply += ",\"bytes\":\"";
        done = port.read(count, read.is_null(), reply);
        reply += '"';
    } else if (!write.is_null()) {
        done = port.write(bytes_of(text_of(write, "write")));
    }
    reply += std::string(",\"done\":") + (done ? "true" : "false") +
             ",\"size\":" + std::to_string(port.capacity()) +
             ",\"readable\":" + std::to_string(port.readable()) +
             ",\"writable\":" + std::to_string(port.writable());
}

// --- streams of records ---

namespace {

void create_stream(const Program& by, const std::string& name, const Json& wanted,
                   const Json& owner) {
    if (!wanted.is_object()) {
        throw RequestError{"create must be an object with types and depth"};
    }
    Programs::Entry& entry = owned(by, text_of(owner, "owner"));
    const std::string& letters = text_of(member(wanted, "types"), "types");
    const auto depth =
        static_cast<std::uint32_t>(whole(member(wanted, "depth"), "depth", 1, 1'000'000));
    if (letters.empty() || letters.size() > 100) {
        throw RequestError{"a stream has 1..100 columns"};
    }
    for (const char letter : letters) {
        if (std::none_of(types.begin(), types.end(),
                         [&](const TypeRow& row) { return row.number && row.letter == letter; })) {
            throw RequestError{std::string("'") + letter +
                               "' is not a valid column type; valid types: b f s u l k"};
        }
    }
    check_name(name, "stream name");
    if (by.session.host().find_stream(name) || by.session.programs().find_stream(name)) {
        throw RequestError{"stream '" + name + "' already exists"};
    }
    auto made = std::make_shared<ProgramStream>();
    made->name = name;
    made->types = letters;
    made->memory.resize(std::size_t{depth} * (letters.size() + 1));
    made->stream = {sizeof(hal_stream),
                    static_cast<std::uint32_t>(letters.size()),
                    depth,
                    1,
                    made->types.c_str(),
                    made->memory.data(),
                    0,
                    0,
                    0};
    entry.streams.push_back(std::move(made));
}

/// Returns the stream of a component or of a program, or throws. `feeds`: the request does not take
/// records from it.
hal_stream& find_stream(const Program& by, const std::string& name, bool feeds) {
    if (hal_stream* const stream = by.session.host().find_stream(name)) return *stream;
    if (ProgramStream* const of_program = by.session.programs().find_stream(name)) {
        of_program->stream.to_machine = feeds;  // programs are at both of its ends
        return of_program->stream;
    }
    auto names = by.session.host().stream_names();
    const auto more = by.session.programs().stream_names();
    names.insert(names.end(), more.begin(), more.end());
    std::string help = did_you_mean(name, names);
    if (names.empty()) {
        help = "no loaded component has a stream (sampler and streamer have one)";
    } else if (help.empty()) {
        help = "available: " + listed(names);
    }
    throw RequestError{"unknown stream '" + name.substr(0, 60) + "'; " + help};
}

std::vector<std::vector<std::string>> rows_of(const Json& records) {
    constexpr const char* problem = "records must be an array of arrays";
    if (!records.is_array()) {
        throw RequestError{problem};
    }
    std::vector<std::vector<std::string>> rows;
    for (const Json& record : records) {
        if (!record.is_array()) {
            throw RequestError{problem};
        }
        std::vector<std::string>& row = rows.emplace_back();
        for (const Json& value : record) {
            row.push_back(value_word(value));
        }
    }
    return rows;
}

/// A command waits for the end of this program, and the program for the machine, whose virtual time
/// stands meanwhile: lets time pass until `is_done`, for some cycles at most.
void pass_time_until(const Program& by, auto&& is_done) {
    constexpr int max_cycles = 1000;
    ThreadControl& threads = by.session.threads();
    if (!by.session.options().virtual_clock || !threads.running() || by.session.in_transaction()) {
        return;
    }
    if (is_done() || !by.session.programs().awaits(by.peer)) return;
    for (int i = 0; i < max_cycles && !is_done() && !by.session.ending(); ++i) {
        threads.advance_cycles(1);
    }
}

/// Makes the process the one that uses this end of the stream, or throws.
void claim_stream(const Program& by, const std::string& name, StreamUsers::End end) {
    const std::string why =
        by.session.programs().stream_users().claim(name, end, by.owner, by.peer);
    if (!why.empty()) {
        throw RequestError{why};
    }
}

}  // namespace

void use_stream(const Program& by, const Json& body, std::string& reply) {
    const std::string& name = text_of(body["stream"], "stream");
    const Json& take = member(body, "take");
    const Json& records = member(body, "records");
    const Json& create = member(body, "create");
    if (!take.is_null() + !records.is_null() + !create.is_null() > 1) {
        throw RequestError{
            "a request either reads (take), feeds (records) or creates (create) a stream"};
    }
    const auto lock = by.session.lock();
    if (!create.is_null()) {
        create_stream(by, name, create, member(body, "owner"));
    }
    hal_stream& stream = find_stream(by, name, take.is_null());
    const auto waiting = [&stream] {
        return __atomic_load_n(&stream.head, __ATOMIC_ACQUIRE) -
               __atomic_load_n(&stream.tail, __ATOMIC_ACQUIRE);
    };
    std::string why;
    bool good = true;
    if (!take.is_null()) {
        const auto max_count = static_cast<std::uint64_t>(whole(take, "take", 0, 1'000'000));
        claim_stream(by, name, StreamUsers::End::reads);
        const std::uint64_t wanted = std::min<std::uint64_t>(max_count, stream.depth / 2 + 1);
        pass_time_until(by, [&] { return waiting() >= wanted; });
        good = pop_records(stream, max_count, reply, why);
    } else if (!records.is_null()) {
        const auto rows = rows_of(records);
        claim_stream(by, name, StreamUsers::End::feeds);
        const std::uint64_t wanted = std::min<std::uint64_t>(rows.size(), stream.depth / 2 + 1);
        pass_time_until(by, [&] { return stream.depth - waiting() >= wanted; });
        good = feed_records(stream, rows, reply, why);
    }
    if (!good) {
        throw RequestError{why};
    }
    describe_stream(stream, reply);
}

}  // namespace hal
