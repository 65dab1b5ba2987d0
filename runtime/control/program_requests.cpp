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
#include "machine/programs.hpp"
#include "machine/session.hpp"

namespace hal {
namespace {

using Json = nlohmann::json;

constexpr std::size_t most_pins = 100'000;
constexpr std::size_t longest_name = 200;

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

bool good_pin_name(const std::string& name) {
    return !name.empty() && name.size() <= longest_name &&
           std::all_of(name.begin(), name.end(), [](unsigned char c) {
        return c > ' ' && c != 127 && c != '"' && c != '\\';
    });
}

ProgramPin pin_of(const Json& given, const std::string& prefix) {
    if (!given.is_object()) {
        throw RequestError{"a pin must be an object with name, type and dir"};
    }
    ProgramPin pin;
    const std::string& name = text_of(member(given, "name"), "the name of a pin");
    if (!good_pin_name(name)) {
        throw RequestError{"'" + name.substr(0, 60) + "' is not a valid pin name"};
    }
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
        by.session.programs().remove_pins(transaction, entry.name, {there});
    }
    std::string problem;
    Pin* const made = by.session.programs().add_pin(transaction, entry.name, wanted, problem);
    if (!made) {
        throw RequestError{problem};
    }
    return made;
}

/// Declared values for pins that are there: numbers and values in turn.
std::vector<std::pair<Pin*, hal_value>> declared_values(const Programs::Entry& entry,
                                                        const Json& safe) {
    std::vector<std::pair<Pin*, hal_value>> values;
    for (std::size_t i = 0; i < safe.size(); i += 2) {
        const auto number = static_cast<std::size_t>(whole(
            safe[i], "the number of a pin", 0, static_cast<std::int64_t>(entry.pins.size()) - 1));
        Pin* const pin = entry.pins[number];
        values.emplace_back(pin, value_of(safe[i + 1], pin->type, pin->name));
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

}  // namespace

void declare_component(const Program& by, const Json& body, std::string& reply) {
    if (by.peer <= 0) {
        throw RequestError{
            "no process ID: the program runs outside the PID namespace of the machine"};
    }
    const std::string& name = text_of(body["component"], "component");
    const Json &prefix = member(body, "prefix"), &pins = member(body, "pins"),
               &ready = member(body, "ready"), &timeout = member(body, "timeout_ms"),
               &every = member(body, "every_ms"), &safe = member(body, "safe");
    if (!safe.is_null() && (!safe.is_array() || safe.size() % 2 != 0)) {
        throw RequestError{"safe must be an array of alternating pin numbers and declared values"};
    }
    if (!ready.is_null() && !ready.is_boolean()) {
        throw RequestError{"ready must be true or false"};
    }
    const std::string before = prefix.is_null() ? name : text_of(prefix, "prefix");
    if (!good_pin_name(before)) {
        throw RequestError{"'" + before.substr(0, 60) + "' is not a valid prefix"};
    }
    const std::int64_t timeout_ms =
        timeout.is_null() ? 0 : whole(timeout, "timeout_ms", -1, 86'400'000);
    const std::int64_t every_ms = every.is_null() ? 0 : whole(every, "every_ms", 0, 86'400'000);
    std::vector<ProgramPin> wanted;
    if (!pins.is_null()) {
        if (!pins.is_array() || pins.size() > most_pins) {
            throw RequestError{"pins must be an array of at most " + std::to_string(most_pins)};
        }
        for (const Json& pin : pins) {
            wanted.push_back(pin_of(pin, before));
        }
    }

    const auto lock = by.session.lock();
    Programs& programs = by.session.programs();
    Programs::Entry* entry = programs.owned(name, by.owner);
    const bool fresh = !entry;
    const Programs::Entry* const there = programs.find(name);
    const bool was_dead = there && there->dead();
    if (fresh) {
        if (const std::string why = programs.announce(by.peer, name, by.owner, false);
            !why.empty()) {
            throw RequestError{why};
        }
        entry = programs.owned(name, by.owner);
    }
    const std::size_t first = entry->pins.size();
    try {
        const auto declared = declared_values(*entry, safe);
        add_pins(by, *entry, wanted);
        for (const auto& [pin, value] : declared) {
            pin->safe = value;
            pin->flags |= HAL_PIN_SAFE;
        }
    } catch (const RequestError&) {
        // it keeps the pins and links it had
        if (fresh && was_dead) {
            programs.die(*entry, "its pins were rejected");
        } else if (fresh) {
            programs.leave(*entry);
        }
        throw;
    }
    if (!timeout.is_null()) {
        entry->timeout_ns = timeout_ms < 0 ? -1 : timeout_ms * 1'000'000;
    }
    if (!every.is_null()) {
        programs.set_rate(*entry, every_ms * 1'000'000);
    } else {
        programs.note_alive(*entry);
    }
    if (!pins.is_null()) {
        const std::vector<Pin*> added(entry->pins.begin() + static_cast<std::ptrdiff_t>(first),
                                      entry->pins.end());
        const auto values = by.session.values().peek(added);
        reply += ",\"first\":" + std::to_string(first) + ",\"values\":[";
        for (std::size_t i = 0; i < added.size(); ++i) {
            if (i > 0) {
                reply += ',';
            }
            json_value(reply, added[i]->type, values[i]);
        }
        reply += ']';
    }
    if (!ready.is_null() || fresh) {
        programs.set_ready(*entry, ready.is_null() || ready.get<bool>());
    }
}

void exchange_values(const Program& by, const Json& body, std::string& reply) {
    const std::string& name = text_of(body["exchange"], "exchange");
    const Json &write = member(body, "write"), &read = member(body, "read"),
               &alive = member(body, "alive");
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
    std::vector<std::pair<Pin*, hal_value>> values;
    for (std::size_t i = 0; i < write.size(); i += 2) {
        const auto number = static_cast<std::size_t>(whole(
            write[i], "the number of a pin", 0, static_cast<std::int64_t>(entry.pins.size()) - 1));
        Pin* const pin = entry.pins[number];
        values.emplace_back(pin, value_of(write[i + 1], pin->type, pin->name));
    }
    if (alive.is_null() || alive.get<bool>()) {
        by.session.programs().note_alive(entry);
    }
    if (!entry.unresponsive
             .empty()) {  // its pins keep their declared values; what it writes waits until it responds
        for (auto& [pin, value] : entry.before_timeout) {
            const auto written =
                std::find_if(values.begin(), values.end(),
                             [&, p = pin](const auto& one) { return one.first == p; });
            if (written == values.end()) continue;
            value = written->second;
            values.erase(written);
        }
    }
    by.session.values().write(values);
    if (!read.is_boolean() || !read.get<bool>()) return;
    std::vector<Pin*> asked;
    bool loops = false;
    for (Pin* const pin : entry.pins) {
        if (!own(*pin)) {
            asked.push_back(pin);
        }
        if (pin->dir != HAL_DIR_IN && pin->signal) {
            loops = loops || std::any_of(pin->signal->pins.begin(), pin->signal->pins.end(),
                                         [&](const Pin* other) {
                return other != pin && other->instance == pin->instance;
            });
        }
    }
    const auto readings = by.session.values().peek(asked);
    reply += ",\"values\":[";
    for (std::size_t i = 0; i < asked.size(); ++i) {
        if (i > 0) {
            reply += ',';
        }
        json_value(reply, asked[i]->type, readings[i]);
    }
    reply += ']';
    if (loops) {
        reply += ",\"loops\":true";
    }
}

void leave_component(const Program& by, const Json& body) {
    const std::string& name = text_of(body["exit"], "exit");
    const auto lock = by.session.lock();
    by.session.programs().leave(owned(by, name));
}

// --- byte streams ----------------------------------------------------------------------------------------------------------

namespace {

std::string bytes_of(const std::string& hex) {
    std::string bytes;
    const auto digit = [&](char c) -> int {
        if (c >= '0' && c <= '9') return c - '0';
        if (c >= 'a' && c <= 'f') return c - 'a' + 10;
        if (c >= 'A' && c <= 'F') return c - 'A' + 10;
        throw RequestError{"bytes are written as pairs of hexadecimal digits"};
    };
    if (hex.size() % 2 != 0) {
        throw RequestError{"bytes are written as pairs of hexadecimal digits"};
    }
    for (std::size_t i = 0; i < hex.size(); i += 2) {
        bytes += static_cast<char>(digit(hex[i]) * 16 + digit(hex[i + 1]));
    }
    return bytes;
}

void append_hex(std::string& to, std::uint8_t byte) {
    static constexpr char digits[] = "0123456789abcdef";
    to += digits[byte >> 4];
    to += digits[byte & 15];
}

}  // namespace

// The session's lock makes all requests one reader or one writer; the other end may be a thread at
// any moment.
void use_port(const Program& by, const Json& body, std::string& reply) {
    const std::string& name = text_of(body["port"], "port");
    const Json &read = member(body, "read"), &peek = member(body, "peek"),
               &write = member(body, "write");
    if (!read.is_null() + !peek.is_null() + !write.is_null() > 1) {
        throw RequestError{"a request either reads, peeks into or writes a port"};
    }
    const bool takes = !read.is_null() || !peek.is_null();
    const auto lock = by.session.lock();
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
    if (!write.is_null() && pin->dir != HAL_DIR_OUT) {
        throw RequestError{"port '" + name + "' is an input: use read or peek"};
    }
    hal_port* const port = pin->signal ? pin->signal->port.get() : nullptr;
    const std::uint64_t capacity = port ? port->capacity : 0;
    std::uint64_t head = port ? __atomic_load_n(&port->head, __ATOMIC_ACQUIRE) : 0;

    std::uint64_t tail = port ? __atomic_load_n(&port->tail, __ATOMIC_ACQUIRE) : 0;
    // one byte stays free, as LinuxCNC has it
    const auto room = [&] {
        return capacity > 0 && head - tail < capacity - 1 ? capacity - 1 - (head - tail) : 0;
    };
    bool done = false;
    if (takes) {
        const auto count = static_cast<std::uint64_t>(
            whole(read.is_null() ? peek : read, "the number of bytes", 0, 1 << 30));
        reply += ",\"bytes\":\"";
        if (done = port && count <= head - tail; done) {
            for (std::uint64_t i = 0; i < count; ++i) {
                append_hex(reply, port->data[(tail + i) % capacity]);
            }
            if (!read.is_null()) {
                __atomic_store_n(&port->tail, tail += count, __ATOMIC_RELEASE);
            }
        }
        reply += '"';
    } else if (!write.is_null()) {
        const std::string bytes = bytes_of(text_of(write, "write"));
        if (done = port && bytes.size() <= room(); done) {
            for (std::size_t i = 0; i < bytes.size(); ++i) {
                port->data[(head + i) % capacity] = static_cast<std::uint8_t>(bytes[i]);
            }
            __atomic_store_n(&port->head, head += bytes.size(), __ATOMIC_RELEASE);
        }
    }
    reply += std::string(",\"done\":") + (done ? "true" : "false") +
             ",\"size\":" + std::to_string(capacity) +
             ",\"readable\":" + std::to_string(head - tail) +
             ",\"writable\":" + std::to_string(room());
}

// --- streams of records ----------------------------------------------------------------------------------------------------

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
    if (!good_pin_name(name)) {
        throw RequestError{"'" + name.substr(0, 60) + "' is not a valid stream name"};
    }
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

}  // namespace

void use_stream(const Program& by, const Json& body, std::string& reply) {
    const std::string& name = text_of(body["stream"], "stream");
    const Json &take = member(body, "take"), &records = member(body, "records"),
               &create = member(body, "create");
    if (!take.is_null() + !records.is_null() + !create.is_null() > 1) {
        throw RequestError{
            "a request either reads (take), feeds (records) or creates (create) a stream"};
    }
    const auto lock = by.session.lock();
    if (!create.is_null()) {
        create_stream(by, name, create, member(body, "owner"));
    }
    hal_stream* stream = by.session.host().find_stream(name);
    if (ProgramStream* const of_program =
            stream ? nullptr : by.session.programs().find_stream(name)) {
        stream = &of_program->stream;
        stream->to_machine = take.is_null();  // programs are at both of its ends
    }
    if (!stream) {
        auto names = by.session.host().stream_names();
        const auto more = by.session.programs().stream_names();
        names.insert(names.end(), more.begin(), more.end());
        const std::string meant = did_you_mean(name, names);
        throw RequestError{"unknown stream '" + name.substr(0, 60) + "'; " +
                           (names.empty()
                                ? "no loaded component has a stream (sampler and streamer have one)"
                            : meant.empty() ? "available: " + listed(names)
                                            : meant)};
    }
    std::string why;
    if (!take.is_null()) {
        const auto most = static_cast<std::uint64_t>(whole(take, "take", 0, 1'000'000));
        if (!take_records(*stream, most, reply, why)) {
            throw RequestError{why};
        }
    } else if (!records.is_null()) {
        if (!records.is_array()) {
            throw RequestError{"records must be an array of arrays"};
        }
        std::vector<std::vector<std::string>> words;
        for (const Json& record : records) {
            if (!record.is_array()) {
                throw RequestError{"records must be an array of arrays"};
            }
            std::vector<std::string> row;
            for (const Json& value : record) {
                row.push_back(value_word(value));
            }
            words.push_back(std::move(row));
        }
        if (!feed_records(*stream, words, reply, why)) {
            throw RequestError{why};
        }
    }
    describe_stream(*stream, reply);
}

}  // namespace hal
