// SPDX-License-Identifier: MIT
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "record/cdr.hpp"
#include "record/joints.hpp"
#include "record/sink.hpp"
#include "recording/mcap/rows.hpp"
#include "recording/mcap/writer.hpp"
#include "text/characters.hpp"

namespace hal::tools {
namespace {

constexpr const char* event_schema =
    R"({"type":"object","properties":{"kind":{"type":"string"},"text":{"type":"string"}},"required":["kind","text"]})";

/// The message of ROS 2 for events.
constexpr const char* log_message = "rcl_interfaces/msg/Log";
constexpr const char* log_schema =
    "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring "
    "function\nuint32 line\n"
    "================================================================================\n"
    "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";

/// Writes an event as `log_message`, with its kind as the name.
void write_log(const ProbeClient::Entry& entry, std::int64_t unix_ns, std::string& to) {
    constexpr std::int64_t second = 1'000'000'000;
    constexpr std::uint32_t info = 20;
    constexpr std::uint32_t error = 40;  // of that message
    Cdr cdr(to);
    cdr.word(static_cast<std::uint32_t>(unix_ns / second));
    cdr.word(static_cast<std::uint32_t>(unix_ns % second));
    cdr.byte(entry.kind == "fault" ? error : info);
    for (const std::string& text : {entry.kind, entry.text, std::string(), std::string()}) {
        cdr.text(text);
    }
    cdr.word(0);
}

/// servo-thread: ServoThread, as ROS names messages.
std::string message_name(const std::string& thread) {
    std::string name;
    bool begins = true;
    for (const char c : thread) {
        if (is_letter(c) || (is_digit(c) && !name.empty())) {
            name += begins ? upper(c) : c;
        }
        begins = !is_letter(c);
    }
    return name.empty() ? "Values" : name;
}

class McapSink final : public Sink {
public:
    /// `own`: nullptr when another one completes the file of `writer`.
    McapSink(std::unique_ptr<mcap::Writer> own, mcap::Writer& writer,
             const std::vector<ProbeColumn>& columns, const Origin& origin)
        : columns_(columns),
          offset_ns_(origin.unix_offset_ns),
          ros_(origin.profile == "ros2"),
          own_(std::move(own)),
          writer_(writer) {
        if (own_) {
            describe(origin);
        }
        const std::uint16_t schema =
            ros_ ? writer_.add_schema(log_message, "ros2msg", log_schema)
                 : writer_.add_schema("halcyon.Event", "jsonschema", event_schema);
        events_ = writer_.add_channel(schema, "/hal/events", ros_ ? "cdr" : "json", {});
    }

    bool layout(const std::vector<ProbeGroup>& groups) override {
        groups_.clear();
        for (const ProbeGroup& group : groups) {
            std::vector<mcap::Column> columns;
            std::vector<ProbeColumn> probed;
            for (const std::size_t i : group.columns) {
                columns.push_back({columns_[i].name, columns_[i].type, columns_[i].unit});
                probed.push_back(columns_[i]);
            }
            mcap::RowWriter rows(columns);
            Joints joints(probed);
            const std::string thread = group.thread.empty() ? "no-thread" : group.thread;
            // a schema never changes: after an edit a thread's rows have another topic
            const int number = ++layouts_[thread];
            const std::string suffix = number == 1 ? "" : "_" + std::to_string(number);
            auto metadata = rows.metadata();
            metadata["thread"] = group.thread;
            metadata["period_ns"] = std::to_string(group.period_ns);
            const auto schema = writer_.add_schema(type_of(thread), "ros2msg", rows.schema());
            const std::string topic = topic_of(thread, suffix);
            groups_.push_back({writer_.add_channel(schema, topic, "cdr", std::move(metadata)),
                               std::move(rows), std::move(joints)});
            if (groups_.back().joints.empty()) continue;
            if (joint_schema_ == 0) {
                joint_schema_ = writer_.add_schema(Joints::message, "ros2msg", Joints::schema());
            }
            groups_.back().joint_channel =
                writer_.add_channel(joint_schema_, topic + "/joints", "cdr", {});
            joint_channels_.push_back(groups_.back().joint_channel);
        }
        return writer_.error() == 0;
    }

    bool row(std::size_t group, std::uint64_t cycle, std::int64_t time_ns,
             const std::uint64_t* words) override {
        Group& to = groups_[group];
        const std::int64_t unix_ns = time_ns + offset_ns_;
        to.rows.write(words, payload_);
        if (!writer_.message(to.channel, static_cast<std::uint32_t>(cycle),
                             static_cast<std::uint64_t>(unix_ns), payload_)) {
            return false;
        }
        if (to.joints.empty() || time_ns < to.joints_due_ns) return true;
        to.joints_due_ns = time_ns + Joints::every_ns;
        to.joints.write(words, unix_ns, payload_);
        return writer_.message(to.joint_channel, static_cast<std::uint32_t>(cycle),
                               static_cast<std::uint64_t>(unix_ns), payload_);
    }

    bool event(const ProbeClient::Entry& entry) override {
        const std::int64_t unix_ns = entry.time_ns + offset_ns_;
        const nlohmann::json object{{"kind", entry.kind}, {"text", entry.text}};
        std::string text = object.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
        if (ros_) {
            write_log(entry, unix_ns, text);
        }
        return writer_.message(events_, number_++, static_cast<std::uint64_t>(unix_ns), text);
    }

    bool flush() override { return writer_.flush(); }
    bool close() override { return own_ ? writer_.close() : writer_.flush(); }
    std::uint64_t bytes() const override { return writer_.bytes(); }
    int error() const override { return writer_.error(); }
    std::string problem() const override {
        if (!writer_.problem().empty()) return writer_.problem();
        if (writer_.error() != 0) return std::strerror(writer_.error());
        return "";
    }
    std::string kept() const override { return writer_.kept(); }
    std::string where() const override { return writer_.where(); }
    bool removed() const override { return writer_.removed(); }
    std::uint64_t rows() const override {
        std::uint64_t rows = writer_.messages() - writer_.messages(events_);
        for (const std::uint16_t channel : joint_channels_) {
            rows -= writer_.messages(channel);
        }
        return rows;
    }

private:
    /// Writes where the recording comes from.
    void describe(const Origin& origin) {
        std::map<std::string, std::string> about{
            {"instance", origin.instance},
            {"version", origin.version},
            {"unix_offset_ns", std::to_string(origin.unix_offset_ns)}};
        if (!origin.cause.empty()) {
            about["cause"] = origin.cause;
        }
        writer_.metadata("halcyon", about);
        if (!origin.netlist.empty()) {
            writer_.attachment("netlist.hal", "text/plain", origin.netlist, 0);
        }
    }

    /// Returns a topic of its own for a thread: ROS allows no dash in it, and two threads may
    /// differ in that only.
    std::string topic_of(const std::string& thread, const std::string& suffix) {
        const std::string base = "/hal/" + (ros_ ? mcap::ros_name(thread) : thread) + suffix;
        std::string topic = base;
        for (int n = 2; !topics_.insert(topic).second; ++n) {
            topic = base + "_" + std::to_string(n);
        }
        return topic;
    }

    /// Returns the name of another type of message: a reader has one definition for each.
    std::string type_of(const std::string& thread) {
        const std::string base = "halcyon_msgs/msg/" + message_name(thread);
        std::string type = base;
        for (int n = 2; !types_.insert(type).second; ++n) {
            type = base + "V" + std::to_string(n);
        }
        return type;
    }

    struct Group {
        std::uint16_t channel;
        mcap::RowWriter rows;
        Joints joints;
        std::uint16_t joint_channel = 0;
        std::int64_t joints_due_ns = 0;
    };
    const std::vector<ProbeColumn> columns_;
    const std::int64_t offset_ns_;
    const bool ros_;
    std::set<std::string> topics_{"/hal/events"}, types_;
    const std::unique_ptr<mcap::Writer> own_;
    mcap::Writer& writer_;
    std::vector<Group> groups_;
    std::map<std::string, int> layouts_;
    std::uint16_t events_ = 0;
    std::uint16_t joint_schema_ = 0;
    std::vector<std::uint16_t> joint_channels_;
    std::uint32_t number_ = 0;
    std::string payload_;
};

}  // namespace

std::unique_ptr<Sink> make_mcap_sink(const std::string& path,
                                     const std::vector<ProbeColumn>& columns,
                                     const Origin& origin) {
    auto writer = std::make_unique<mcap::Writer>(path, origin.profile);
    mcap::Writer& of_file = *writer;
    return std::make_unique<McapSink>(std::move(writer), of_file, columns, origin);
}

std::unique_ptr<Sink> make_mcap_sink(mcap::Writer& writer, const std::vector<ProbeColumn>& columns,
                                     const Origin& origin) {
    return std::make_unique<McapSink>(nullptr, writer, columns, origin);
}

}  // namespace hal::tools
