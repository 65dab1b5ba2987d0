// SPDX-License-Identifier: MIT
// What comes to EtherCAT from outside, chosen by the first byte: frames into a line of emulated
// slaves, SII images, mailbox messages to a device with all protocols, device descriptions,
// configurations of both formats, descriptions of lines, replies to every request of the master,
// requests to its gateway, and a bus that is not what the master expects.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "components/ethercat/config/config.hpp"
#include "components/ethercat/config/event_texts.hpp"
#include "components/ethercat/config/plan.hpp"
#include "components/ethercat/devices/registry.hpp"
#include "components/ethercat/esc/line.hpp"
#include "components/ethercat/esi/esi.hpp"
#include "components/ethercat/master/gateway.hpp"
#include "components/ethercat/master/master.hpp"
#include "components/ethercat/master/request_queue.hpp"
#include "components/ethercat/wire/aoe.hpp"
#include "components/ethercat/wire/coe.hpp"
#include "components/ethercat/wire/eoe.hpp"
#include "components/ethercat/wire/foe.hpp"
#include "components/ethercat/wire/frames.hpp"
#include "components/ethercat/wire/registers.hpp"
#include "components/ethercat/wire/soe.hpp"
#include "tests/fuzz/driver/require.hpp"
#include "tests/unit/ethercat/mailbox_slave.hpp"

namespace {

using namespace hal::ethercat;
using hal::fuzz::require;
using Bytes = std::vector<std::uint8_t>;

/// A line, as a process on a real interface serves it.
struct Line {
    std::vector<devices::Device> slaves;
    esc::Line line;
    std::int64_t now_ns = 1'000'000;

    /// `image` is written over the EEPROM of the first slave.
    explicit Line(std::string_view text, std::span<const std::uint8_t> image = {})
        : slaves(devices::make_line(devices::read_line(text))) {
        std::copy_n(image.begin(), std::min(image.size(), slaves[0].sii.size()),
                    slaves[0].sii.begin());
        for (devices::Device& d : slaves) {
            line.add({.controller = {.dc = d.dc}, .sii = d.sii, .application = d.firmware.get()});
        }
        line.power_on(0);
    }
    void process(Bytes frame) {
        now_ns += 200'000;
        line.process(frame, esc::End::primary, now_ns);
        line.advance(now_ns + 100'000);
    }
    void write(std::uint16_t address, const Bytes& data) {
        std::array<std::uint8_t, max_frame_bytes> buffer{};
        FrameWriter frame(buffer, {});
        if (std::uint8_t* to = frame.add(Command::apwr, 0, at_position(0, address),
                                         static_cast<std::uint16_t>(data.size()))) {
            std::copy(data.begin(), data.end(), to);
        }
        const auto bytes = frame.finish();
        process({bytes.begin(), bytes.end()});
    }
};

void frames(std::span<const std::uint8_t> in) {
    Line line("coupler\nservo\ndigital_out\nmailbox_device\n");
    while (in.size() > 2) {  // each with its length before it
        const std::size_t length =
            std::min<std::size_t>(get<std::uint16_t>(in.data()) % 1600U, in.size() - 2);
        Bytes frame(in.begin() + 2, in.begin() + 2 + static_cast<std::ptrdiff_t>(length));
        FrameReader reader(frame);
        while (const auto d = reader.next()) {
            require(
                d->data >= frame.data() && d->data + d->length + 2 <= frame.data() + frame.size(),
                "a datagram lies in its frame");
        }
        line.process(frame);
        in = in.subspan(2 + length);
    }
}

void image(std::span<const std::uint8_t> in) {
    const sii::Contents once = sii::parse(in);
    const Bytes built = sii::build(once);
    const sii::Contents again = sii::parse(built);
    require(again.vendor == once.vendor && again.product == once.product, "the identity survives");
    sii::bytes_needed(in);
}

void mailbox(std::span<const std::uint8_t> in) {
    Line line("mailbox_device\n");
    const sii::Mailboxes areas = sii::parse(line.slaves[0].sii).mailboxes;
    const auto area = [&](unsigned n, const sii::Area& a, std::uint8_t control) {
        Bytes b(8);
        put(&b[0], a.start);
        put(&b[2], a.size);
        b[4] = control;
        b[6] = 1;
        line.write(registers::sync_manager_at(n), b);
    };
    area(0, areas.receive, 0x26);
    area(1, areas.send, 0x22);
    line.write(registers::al_control, {static_cast<std::uint8_t>(State::preop), 0});
    require(line.slaves[0].firmware->state() == State::preop, "the device takes messages");
    while (in.size() > 3) {  // protocol, length, payload
        const std::size_t length =
            std::min({std::size_t{get<std::uint16_t>(in.data() + 1)} % areas.receive.size,
                      in.size() - 3, std::size_t{areas.receive.size} - mailbox_header_bytes});
        Bytes message(areas.receive.size);
        write_mailbox_header(message.data(), length, 0, static_cast<MailboxType>(in[0] & 15),
                             in[0] >> 4 & 7);
        std::copy_n(in.begin() + 3, length, message.begin() + mailbox_header_bytes);
        line.write(areas.receive.start, message);
        std::array<std::uint8_t, max_frame_bytes> buffer{};
        FrameWriter frame(buffer, {});
        frame.add(Command::aprd, 0, at_position(0, areas.send.start), areas.send.size);
        const auto bytes = frame.finish();
        line.process({bytes.begin(), bytes.end()});
        in = in.subspan(3 + length);
    }
}

template <class Messages>
void check(const Messages& messages, std::string_view text) {
    for (const auto& m : messages) {
        require(m.at.offset + std::size_t{m.at.length} <= text.size(), "a place lies in the text",
                text);
        require(!m.sentence.empty(), "a message is not empty", text);
    }
}

void description(std::string_view text) {
    const esi::File file = esi::read(text);
    for (const esi::Device& d : file.devices) {
        sii::parse(esi::sii_image(d));
    }
}

void configuration(std::string_view text) {
    constexpr std::string_view esi =
        "<EtherCATInfo><Vendor><Id>#x1</Id></Vendor><Descriptions><Devices><Device><Type "
        "ProductCode=\"#x2\" "
        "RevisionNo=\"#x3\">D</Type><Sm StartAddress=\"#x1100\" ControlByte=\"#x64\" "
        "Enable=\"1\">Outputs</Sm>"
        "<RxPdo "
        "Sm=\"0\"><Index>#x1600</Index><Entry><Index>#x7000</Index><SubIndex>1</"
        "SubIndex><BitLen>8</BitLen>"
        "<Name>A</Name><DataType>USINT</DataType></Entry></RxPdo></Device></Devices></"
        "Descriptions></EtherCATInfo>";
    const config::ReadResult reading =
        config::read(text, "m.ethercat", [&](const std::string&, std::string& bytes) {
        bytes = esi;
        return true;
    });
    check(reading.messages, text);
    config::to_string(reading, "m.ethercat");
    if (!reading.good()) return;
    for (const config::Bus& bus : reading.buses) {
        require(bus.slaves.size() == bus.setup.slaves.size(),
                "what the user sees is what the master has");
    }
}

void devices_of(std::string_view text) {
    const devices::LineDescription line = devices::read_line(text);
    check(line.messages, text);
    if (line.slaves.size() < 20) {
        devices::make_line(line);
    }
}

/// Kind of the request and size of its buffer; then replies: protocol and flags, length, payload.
/// Flags: 10h the reply belongs to the same request as the one before it, 20h its length field is
/// wrong, 40h the protocol is that of the request.
void replies(std::span<const std::uint8_t> in) {
    using Kind = master::MailboxRequest::Kind;
    if (in.size() < 2) return;
    tests::MailboxSlave slave(128);
    slave.bus.timeouts.mailbox_response = 20;
    master::Mailboxes mailboxes{1};
    master::RequestServer server{mailboxes, [&](std::uint16_t) { return &slave.bus; }, 1};
    const std::array<master::EoePort, 1> with_eoe{};
    master::EoeSwitch frames(mailboxes, with_eoe);
    server.set_switch(&frames);
    server.set_poll_interval(5'000'000);
    master::EmergencyQueue emergencies;
    emergencies.attach(mailboxes);
    master::RequestPort& port = server.open();
    auto rest = in.subspan(2);
    slave.on_request = [&](const MailboxMessage& m) {
        do {
            if (rest.size() < 3) return;
            const unsigned flags = rest[0];
            const std::size_t length =
                std::min<std::size_t>({get<std::uint16_t>(rest.data() + 1), rest.size() - 3, 122});
            Bytes payload(rest.begin() + 3, rest.begin() + 3 + static_cast<std::ptrdiff_t>(length));
            slave.reply((flags & 0x40) != 0 ? m.type : static_cast<MailboxType>(flags & 15),
                        payload);
            if ((flags & 0x20) != 0) {
                slave.outbox.back()[0] = static_cast<std::uint8_t>(flags ^ length);
            }
            rest = rest.subspan(3 + length);
        } while (rest.size() >= 3 && (rest[0] & 0x10) != 0);
    };
    Bytes buffer(in[1] * std::size_t{8});
    master::MailboxRequest request;
    request.kind = static_cast<Kind>(in[0] % (static_cast<unsigned>(Kind::message) + 1));
    request.complete = (in[0] & 0x80) != 0;
    request.index = 0x2000;
    request.sub = 1;
    request.data = buffer;
    request.name = "firmware";
    request.foe.timeout_ms = 20;
    request.foe.busy_ms = 200;
    if (request.kind == Kind::message) {
        request.length = std::min<std::size_t>(buffer.size(), 16);
        if (buffer.size() >= 16) {
            write_mailbox_header(buffer.data(), 10, 0x1001, MailboxType::coe, 0);
        }
    }
    require(port.submit(request), "a request is taken");
    unsigned cycles = 0;
    for (; cycles < 30'000 && !port.finished(request); ++cycles) {
        frames.pump();
        server.step(slave.now_ns);
        slave.step(server.channel(0));
    }
    require(port.finished(request), "every request ends");
    if (request.result && (request.kind == Kind::sdo_upload || request.kind == Kind::foe_read ||
                           request.kind == Kind::soe_read)) {
        require(request.result.length <= buffer.size(), "what was read lies in the buffer");
    }
    // what comes without a request
    for (unsigned n = 0; n < 40; ++n) {
        server.step(slave.now_ns);
        slave.step(server.channel(0));
    }
    master::EmergencyEvent event;
    while (emergencies.pop(event)) {
        require(event.slave == 0, "an emergency has a sender");
    }
    for (const auto* frame = frames.to_host().front(); frame != nullptr;
         frames.to_host().drop(), frame = frames.to_host().front()) {
        require(frame->length <= frame->bytes.size(), "a frame lies in its place");
    }
    server.stop();
}

void to_master(std::span<const std::uint8_t> in) {
    const std::array<master::GatewaySlave, 2> slaves{
        {{0x1001, 0, 2, 0x1234, 0x10000, 7}, {0x1002, 1, 2, 0x1234, 0x10000, 8}}};
    Bytes message(in.begin(), in.end());
    const std::size_t length = std::min<std::size_t>(in.size(), max_mailbox);
    message.resize(max_mailbox);
    require(master::answer_for_master(slaves, message, length) <= message.size(),
            "an answer lies in its buffer");
}

/// A line behind a port. What the port does to each frame is in the input: 0 nothing, 1 lost, 2
/// twice, 3 cut, 4 a byte changed, 5 other bytes.
struct DamagedPort final : hal::ethernet::Port {
    Line& line;
    std::span<const std::uint8_t> damage;
    std::deque<Bytes> arrived;
    Bytes current;
    hal::ethernet::Address mine{2, 0, 0, 0, 0, 1};
    hal::ethernet::Description about;
    DamagedPort(Line& l, std::span<const std::uint8_t> d) : line(l), damage(d) {}
    std::uint8_t next() {
        if (damage.empty()) return 0;
        const std::uint8_t byte = damage.front();
        damage = damage.subspan(1);
        return byte;
    }
    const hal::ethernet::Address& address() const noexcept override { return mine; }
    hal::ethernet::Sent send(std::span<const std::uint8_t> frame, const hal::ethernet::Launch&,
                             std::int64_t now_ns) noexcept override {
        Bytes copy(frame.begin(), frame.end());
        line.line.process(copy, esc::End::primary, now_ns);
        switch (next() % 6) {
        case 1: return hal::ethernet::Sent::queued;
        case 2: arrived.push_back(copy); break;
        case 3: copy.resize(copy.size() * next() / 256); break;
        case 4: {
            const std::size_t at = copy.size() * next() / 256;
            copy[at] ^= next();
            break;
        }
        case 5:
            for (std::size_t at = 16U + next(); at < copy.size() && !damage.empty(); ++at) {
                copy[at] = next();
            }
            break;
        default: break;
        }
        arrived.push_back(std::move(copy));
        return hal::ethernet::Sent::queued;
    }
    std::optional<hal::ethernet::Arrival> receive(std::int64_t now_ns) noexcept override {
        if (arrived.empty()) return std::nullopt;
        current = std::move(arrived.front());
        arrived.pop_front();
        return hal::ethernet::Arrival{current, now_ns};
    }
    bool wait(std::int64_t) noexcept override { return false; }
    hal::ethernet::Statistics statistics() const noexcept override { return {}; }
    const hal::ethernet::Description& description() const noexcept override { return about; }
};

/// Forms the sentence of every event.
struct Nobody final : master::Events {
    explicit Nobody(const master::Setup& s) : setup(s) {}
    void on_event(master::Event event, std::uint32_t slave, std::int64_t first,
                  std::int64_t second) noexcept override {
        config::event_text({event, slave, first, second}, setup, "sim:a", "");
    }
    const master::Setup& setup;
};

/// What is written over the EEPROM of the first slave, with its length before it; then the damage
/// to the frames.
void bus(std::span<const std::uint8_t> in) {
    if (in.empty()) return;
    const std::size_t length = std::min<std::size_t>(2U * in[0], in.size() - 1);
    Line line("servo\ndigital_out\n", in.subspan(1, length));
    config::ReadResult reading = config::read(
        "[bus]\nlink = sim:a\ncycle = 1ms\n[slave 0 x]\ndevice = cia402\noutputs = 6040 607A\n"
        "inputs = 6041 6064\ndc = sync0\n[slave 1 io]\noutputs = 7000:1 bit\n",
        "m.ethercat");
    require(reading.good(), "the configuration is valid");
    master::Setup& setup = reading.buses[0].setup;
    setup.max_slaves = 4;
    Nobody events(setup);
    master::Mailboxes mailboxes{4};
    master::CoeClient client(mailboxes);
    DamagedPort port(line, in.subspan(1 + length));
    master::Master bus(setup, port.mine, events, client);
    bus.attach(port);
    for (unsigned cycle = 0; cycle < 400; ++cycle) {
        line.now_ns += 1'000'000;
        line.line.advance(line.now_ns);
        bus.receive(line.now_ns);
        bus.transmit(line.now_ns);
    }
    require(bus.found() <= 4, "no more slaves than there is space for");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::span<const std::uint8_t> bytes(data + 1, size - 1);
    const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
    switch (data[0] - '0') {
    case 0: frames(bytes); break;
    case 1: image(bytes); break;
    case 2: mailbox(bytes); break;
    case 3: description(text); break;
    case 4: configuration(text); break;
    case 5: devices_of(text); break;
    case 6: replies(bytes); break;
    case 7: to_master(bytes); break;
    case 8: bus(bytes); break;
    default: break;
    }
    return 0;
}
