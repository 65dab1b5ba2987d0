// SPDX-License-Identifier: MIT
// `hal panel`: from the command line to a running server.
#include <arpa/inet.h>
#include <array>
#include <filesystem>
#include <fmt/format.h>
#include <thread>
#include <unistd.h>

#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "machine/processes/address.hpp"
#include "panel/panel.hpp"
#include "panel/panel_layout.hpp"
#include "panel/recordings.hpp"
#include "panel/server.hpp"
#include "text/characters.hpp"
#include "text/typed_command.hpp"

namespace hal::tools {

namespace {

constexpr const char* loopback = "127.0.0.1";

std::string host_name() {
    std::array<char, 256> name{};
    return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

Access access_for(const PanelOptions& options) {
    Access access{{"localhost", loopback}, false, options.origins,
                  random_token(),          true,  options.write};
    for (const std::string& name : options.hosts) {
        access.hosts.push_back(lower(name));
    }
    if (options.listen.empty()) return access;
    access.any_address = true;
    access.open = false;
    access.hosts.push_back(host_name());
    return access;
}

/// Loads the recordings, and prints what is missing of them. Returns false after a message when one
/// cannot be shown.
bool load(const PanelOptions& options, Recordings& recordings) {
    for (const std::string& path : options.recordings) {
        const Recordings::Added added = recordings.add(path);
        for (const std::string& note : added.notes) {
            write_all(STDERR_FILENO, fmt::format("{}: {}\n", options.program, note));
        }
        if (!added.problem.empty()) {
            fail(options, added.problem);
            return false;
        }
    }
    return true;
}

/// Encodes a text as a value in the query of a URL (RFC 3986).
std::string url_encoded(const std::string& text) {
    std::string encoded;
    for (const char c : text) {
        if (is_alphanumeric(c) || std::string_view("-._~/").find(c) != std::string_view::npos) {
            encoded += c;
        } else {
            encoded += fmt::format("%{:02X}", static_cast<unsigned char>(c));
        }
    }
    return encoded;
}

/// What a start prints. `recordings`: their names.
std::string announcement(const PanelOptions& options, const Access& access,
                         const std::string& instance, int port,
                         const std::vector<std::string>& recordings) {
    std::string text;
    const bool all = options.listen == "0.0.0.0";
    std::string host = options.listen.empty() ? "localhost" : options.listen;
    if (all) {
        host = host_name();
    }
    if (!options.listen.empty()) {
        text += fmt::format(
            "warning: listening on {}, port {}: every computer that reaches it and has the token "
            "can read all values of {}{}.\n"
            "The connection is not encrypted: use it on a network of the machine only, or through "
            "an SSH tunnel without --listen.\n",
            all ? "all network interfaces" : options.listen, port,
            options.only ? fmt::format("instance '{}'", instance) : "the machines of this user",
            options.write ? " and set them" : "");
    }
    const bool token = options.write || !access.open;
    text += fmt::format("http://{}:{}/{}\n", host, port, token ? "#t=" + access.token : "");
    for (const std::string& name : recordings) {
        text += fmt::format(
            "recording {}: choose it as the source of the scope: http://{}:{}/#/scope?recording={}"
            "{}\n",
            name, host, port, url_encoded(name), token ? "&t=" + access.token : "");
    }
    text += fmt::format("programs and Foxglove: ws://{}:{}/?t={}\n", host, port, access.token);
    if (!options.write) {
        text += "read-only; hal panel --write can set values of a running machine\n";
    }
    return text;
}

/// Returns the message about an instance that does not run, with the others to choose from.
std::string not_running(const std::string& instance) {
    std::string text = fmt::format(
        "hal panel: no instance '{}' is running yet; the page shows it as soon as it runs\n",
        instance);
    const std::vector<std::string> running = running_instances();
    if (!running.empty()) {
        text +=
            fmt::format("hal panel: running: {}; to show one of them, type: {} panel --name {}\n",
                        fmt::join(running, ", "), started_as(), running.front());
    }
    return text;
}

}  // namespace

int run_panel(const PanelOptions& options) {
    if (options.words.size() > 1) {
        return fail(options,
                    fmt::format("unexpected argument '{}'; see: hal help panel", options.words[1]));
    }
    in_addr address{};
    if (!options.listen.empty() && ::inet_pton(AF_INET, options.listen.c_str(), &address) != 1) {
        return fail(options, fmt::format("--listen: '{}' is not an IPv4 address; use the address "
                                         "of a network interface, or 0.0.0.0 for all",
                                         options.listen));
    }
    const std::string instance = instance_wanted(options.name);
    if (!good_instance_name(instance)) {
        return fail(options, fmt::format("'{}' is not a valid instance name", instance));
    }
    PanelLayout layout;
    if (!options.words.empty()) {
        std::string errors;
        layout = read_panel_file(options.words[0], options.component, errors);
        if (!errors.empty()) {
            write_all(STDERR_FILENO, errors);
            return fail(options, fmt::format("'{}' has errors", options.words[0]));
        }
    } else if (!options.component.empty()) {
        return fail(options, "--component names the component of a user panel; add its file");
    }
    Recordings recordings;
    if (!load(options, recordings)) return 1;
    const std::vector<std::string> names = recordings.names();
    const Access access = access_for(options);
    StopRequest stop;
    PanelServer server(access, instance);
    server.load(std::move(recordings));
    if (const std::string problem =
            server.open(options.listen.empty() ? loopback : options.listen, options.port);
        !problem.empty()) {
        return fail(options, problem);
    }
    if (!options.words.empty()) {
        server.load(std::move(layout));
    }
    if (!options.only) {
        server.offer_machines();
    }
    if (!std::filesystem::exists(found_socket(instance))) {
        write_all(STDERR_FILENO, not_running(instance));
    }
    if (!print(announcement(options, access, instance, server.port(), names))) return 1;
    std::thread ending([&] {
        stop.wait_ns(options.for_ns);
        server.interrupt();
    });
    server.run();
    stop.request();
    ending.join();
    return 0;
}

}  // namespace hal::tools
