// SPDX-License-Identifier: MIT
// A program that misbehaves on a topic, for the tests: dds_rogue TOPIC FIELDS WORD...
//   type=NAME      another name of the type          count=N        samples (default 0: until the end of standard input)
//   rate=HZ        samples per second; 0: a flood    clock=SECONDS  its clock is ahead by this
//   bytes=HEX      sends these bytes instead         value=X        in the first field, a float
//   reliable=0     best effort                       listen         prints received samples instead
//   depth=N        samples kept until they are delivered
//   domain=N, security=FOLDER, server=ADDRESS:PORT, interfaces=…
// Ends with standard input; prints "matched" when it has a peer.
#include <poll.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>

#include "dds/engine.hpp"
#include "dds/schema.hpp"

namespace {

using namespace hal::dds;

struct Options {
    std::string type, bytes;
    double rate = 100;
    double clock = 0;
    double value = 1;
    long count = 0;
    bool listen = false;
    Settings settings;
    Quality quality{.depth = 100};
};

bool option(Options& o, const std::string& word) {
    const auto at = word.find('=');
    const std::string key = word.substr(0, at);
    const std::string value = at == word.npos ? "" : word.substr(at + 1);
    if (key == "type") {
        o.type = value;
    } else if (key == "bytes") {
        o.bytes = value;
    } else if (key == "rate") {
        o.rate = std::atof(value.c_str());
    } else if (key == "clock") {
        o.clock = std::atof(value.c_str());
    } else if (key == "value") {
        o.value = std::atof(value.c_str());
    } else if (key == "count") {
        o.count = std::atol(value.c_str());
    } else if (key == "listen") {
        o.listen = true;
    } else if (key == "reliable") {
        o.quality.reliable = value == "1";
    } else if (key == "depth") {
        o.quality.depth = std::atoi(value.c_str());
    } else if (key == "domain") {
        o.settings.domain = std::atoi(value.c_str());
    } else if (key == "security") {
        o.settings.security = value;
    } else if (key == "server") {
        o.settings.servers = {value};
    } else if (key == "interfaces") {
        o.settings.interfaces = {value};
    } else {
        return false;
    }
    return true;
}

bool input_ended() {
    pollfd p{STDIN_FILENO, POLLIN, 0};
    char c;
    return ::poll(&p, 1, 0) > 0 && ::read(STDIN_FILENO, &c, 1) <= 0;
}

void print(const std::string& line) {
    std::puts(line.c_str());
    std::fflush(stdout);
}

struct Printer final : Listener {
    explicit Printer(const Schema& s) : schema(s) {}
    void on_sample(const Sample& s) noexcept override {
        std::vector<hal_value> v(schema.fields.size());
        if (!decode(schema, s.bytes, v)) {
            print("malformed");
        } else {
            print("sample " + std::to_string(s.sequence) + " " + std::to_string(v[0].real));
        }
    }
    void on_event(Event e, int count, const std::string& text) noexcept override {
        if (e == Event::matched) {
            print("matched " + std::to_string(count));
        }
        if (e == Event::unmatched) {
            print("unmatched " + std::to_string(count));
        }
        if (e == Event::wrong_type || e == Event::wrong_quality) {
            print(text);
        }
    }
    const Schema& schema;
};

std::int64_t real_ns() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
               std::chrono::system_clock::now().time_since_epoch())
        .count();
}

void write_all(Writer& writer, const Options& o, const Schema& schema) {
    std::vector<std::uint8_t> bytes = schema.sample;
    if (schema.places[0].type == HAL_TYPE_FLOAT) {
        std::memcpy(bytes.data() + schema.places[0].offset, &o.value, sizeof o.value);
    }
    if (!o.bytes.empty()) {
        bytes.clear();
        for (std::size_t i = 0; i + 1 < o.bytes.size(); i += 2) {
            bytes.push_back(
                static_cast<std::uint8_t>(std::stoi(o.bytes.substr(i, 2), nullptr, 16)));
        }
    }
    long sent = 0;
    while (!input_ended() && (o.count == 0 || sent < o.count)) {
        if (writer.matched() > 0) {
            const long burst = o.rate > 0 ? 1 : 100;
            for (long i = 0; i < burst; ++i, ++sent) {
                writer.write(bytes, real_ns() + static_cast<std::int64_t>(o.clock * 1e9));
            }
        }
        if (o.rate > 0) {
            std::this_thread::sleep_for(std::chrono::duration<double>(1 / o.rate));
        }
    }
    print("sent " + std::to_string(sent));
    writer.wait_for_acknowledgments(60'000'000'000);
}

}  // namespace

int main(int argc, char** argv) try {
    Options o;
    for (int i = 3; i < argc; ++i) {
        if (!option(o, argv[i])) throw std::runtime_error(std::string("unknown word ") + argv[i]);
    }
    if (argc < 3) throw std::runtime_error("dds_rogue TOPIC FIELDS WORD...");
    const Schema schema = Schema::of_fields(argv[2], o.type);
    const TopicType topic{argv[1], schema.type,
                          std::max<std::size_t>(schema.sample.size(), o.bytes.size())};
    Printer printer(schema);
    const auto participant = open(o.settings);
    if (o.listen) {
        const auto reader = participant->reader(topic, o.quality, &printer);
        print("ready");
        while (!input_ended()) {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
    } else {
        const auto writer = participant->writer(topic, o.quality, &printer);
        print("ready");
        write_all(*writer, o, schema);
    }
    return 0;
} catch (const std::exception& e) {
    std::fprintf(stderr, "dds_rogue: %s\n", e.what());
    return 1;
}
