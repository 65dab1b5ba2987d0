// SPDX-License-Identifier: MIT
// Processes for `hal-bench dds`: 64 doubles per sample on loopback.
//   dds_peer write COUNT DOMAIN         a bare Fast DDS writer, 1 kHz, SCHED_FIFO
//   dds_peer read COUNT DOMAIN          a bare Fast DDS reader
//   dds_peer halcyon-read COUNT DOMAIN  what dds_subscribe does: decoded and in the mailbox
// Readers print "ready", and at the end: samples, lost, p50, p99 and greatest time in us from when
// the sample's cycle was due by the writer's clock. Both writers stamp the time at which their
// cycle was due.
#include <sched.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <functional>
#include <string>
#include <vector>

#include "dds/engine.hpp"
#include "dds/schema.hpp"
#include "hal/queue.hpp"

namespace {

namespace fd = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::types::ReturnCode_t;

constexpr const char *topic_name = "bench/pins", *type_name = "bench::Pins";
constexpr std::size_t pins = 64;
struct Sample64 {
    double values[pins];
};

std::int64_t now(clockid_t clock) {
    timespec t{};
    clock_gettime(clock, &t);
    return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

class Type64 : public fd::TopicDataType {
public:
    Type64() {
        setName(type_name);
        m_typeSize = 4 + sizeof(Sample64);
        auto_fill_type_object(false);
        auto_fill_type_information(false);
    }
    bool serialize(void* data, rtps::SerializedPayload_t* to) override {
        const std::uint8_t header[4] = {0, 1, 0, 0};
        std::memcpy(to->data, header, 4);
        std::memcpy(to->data + 4, data, sizeof(Sample64));
        to->length = m_typeSize;
        to->encapsulation = CDR_LE;
        return true;
    }
    bool deserialize(rtps::SerializedPayload_t* from, void* data) override {
        if (from->length < m_typeSize) return false;
        std::memcpy(data, from->data + 4, sizeof(Sample64));
        return true;
    }
    std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
        return [this] { return m_typeSize; };
    }
    void* createData() override { return new Sample64; }
    void deleteData(void* data) override { delete static_cast<Sample64*>(data); }
    bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

/// Times of samples, and the line at the end.
class Figures {
public:
    explicit Figures(long wanted) : wanted_(wanted) {
        us_.reserve(static_cast<std::size_t>(wanted));
    }
    void add(std::uint64_t sequence, std::int64_t source_ns, std::int64_t here_ns) {
        if (count_.load(std::memory_order_relaxed) >= wanted_ || ++seen_ <= settling) return;
        if (last_ != 0) {
            lost_ += sequence - last_ - 1;
        }
        last_ = sequence;
        us_.push_back(static_cast<double>(here_ns - source_ns) / 1000);
        count_.fetch_add(1, std::memory_order_release);
    }
    void wait() {
        long before = -1;
        for (int idle = 0; count_.load(std::memory_order_acquire) < wanted_ && idle < 100;) {
            usleep(50'000);
            const long have = count_.load();
            idle = have == before && have > 0 ? idle + 1 : 0;
            before = have;
        }
    }
    void print() {
        std::sort(us_.begin(), us_.end());
        const auto at = [this](double share) {
            return us_.empty()
                       ? 0
                       : us_[static_cast<std::size_t>(share * static_cast<double>(us_.size() - 1))];
        };
        std::printf("%zu %llu %.1f %.1f %.1f\n", us_.size(), static_cast<unsigned long long>(lost_),
                    at(0.5), at(0.99), at(1));
        std::fflush(stdout);
    }

private:
    static constexpr long settling = 200;  // both sides have just found each other

    const long wanted_;
    long seen_ = 0;
    std::vector<double> us_;
    std::uint64_t last_ = 0;
    std::uint64_t lost_ = 0;
    std::atomic<long> count_{0};
};

class Bare : public fd::DataReaderListener {
public:
    explicit Bare(std::uint32_t domain) {
        fd::DomainParticipantQos qos = fd::PARTICIPANT_QOS_DEFAULT;
        const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
        udp->interfaceWhiteList.emplace_back("127.0.0.1");
        qos.transport().use_builtin_transports = false;
        qos.transport().user_transports.push_back(udp);
        participant_ =
            fd::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
        fd::TypeSupport(new Type64).register_type(participant_);
        topic_ = participant_->create_topic(topic_name, type_name, fd::TOPIC_QOS_DEFAULT);
    }
    ~Bare() override {
        participant_->delete_contained_entities();
        fd::DomainParticipantFactory::get_instance()->delete_participant(participant_);
    }
    void write(long count) {
        fd::DataWriterQos qos = fd::DATAWRITER_QOS_DEFAULT;
        qos.reliability().kind = fd::RELIABLE_RELIABILITY_QOS;
        qos.history().depth = 16;
        qos.data_sharing().off();
        auto* writer = participant_->create_publisher(fd::PUBLISHER_QOS_DEFAULT)
                           ->create_datawriter(topic_, qos);
        fd::PublicationMatchedStatus matched;
        do {
            usleep(10'000);
            writer->get_publication_matched_status(matched);
        } while (matched.current_count == 0);
        usleep(300'000);
        const sched_param fifo{98};
        sched_setscheduler(0, SCHED_FIFO, &fifo);
        Sample64 sample{};
        std::int64_t due = now(CLOCK_MONOTONIC) + 1'000'000;
        for (long i = 0; i < count + 300; ++i, due += 1'000'000) {
            const timespec at{due / 1'000'000'000, due % 1'000'000'000};
            clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr);
            sample.values[0] = static_cast<double>(i);
            const std::int64_t stamp = now(CLOCK_REALTIME) - (now(CLOCK_MONOTONIC) - due);
            const eprosima::fastrtps::Time_t source(
                static_cast<std::int32_t>(stamp / 1'000'000'000),
                static_cast<std::uint32_t>(stamp % 1'000'000'000));
            writer->write_w_timestamp(&sample, fd::HANDLE_NIL, source);
        }
        writer->wait_for_acknowledgments({2, 0});
    }
    void read(Figures& figures) {
        figures_ = &figures;
        fd::DataReaderQos qos = fd::DATAREADER_QOS_DEFAULT;
        qos.reliability().kind = fd::RELIABLE_RELIABILITY_QOS;
        qos.history().depth = 16;
        qos.data_sharing().off();
        participant_->create_subscriber(fd::SUBSCRIBER_QOS_DEFAULT)
            ->create_datareader(topic_, qos, this);
    }

private:
    void on_data_available(fd::DataReader* reader) override {
        fd::SampleInfo info;
        Sample64 sample;
        while (reader->take_next_sample(&sample, &info) == ReturnCode_t::RETCODE_OK) {
            if (info.valid_data) {
                figures_->add(info.sample_identity.sequence_number().to64long(),
                              info.source_timestamp.to_ns(), now(CLOCK_REALTIME));
            }
        }
    }
    fd::DomainParticipant* participant_;
    fd::Topic* topic_;
    Figures* figures_ = nullptr;
};

struct Message {
    std::vector<hal_value> values;
};

class Subscribed final : public hal::dds::Listener {
public:
    Subscribed(const hal::dds::Schema& schema, Figures& figures)
        : schema_(schema),
          figures_(figures),
          message_{std::vector<hal_value>(pins)},
          mailbox_(message_) {}
    void on_sample(const hal::dds::Sample& s) noexcept override {
        if (!hal::dds::decode(schema_, s.bytes, message_.values)) return;
        mailbox_.put(message_);
        figures_.add(s.sequence, s.source_ns, now(CLOCK_REALTIME));
    }

private:
    const hal::dds::Schema& schema_;
    Figures& figures_;
    Message message_;
    hal::Mailbox<Message> mailbox_;
};

}  // namespace

int main(int argc, char** argv) {
    if (argc != 4) return 2;
    const std::string word = argv[1];
    const long count = std::atol(argv[2]);
    const auto domain = static_cast<std::uint32_t>(std::atoi(argv[3]));
    setenv("SKIP_DEFAULT_XML_FILE", "1", 0);
    if (word == "write") {
        Bare(domain).write(count);
        return 0;
    }
    Figures figures(count);
    const auto measure = [&figures] {
        std::puts("ready");
        std::fflush(stdout);
        figures.wait();
        figures.print();
    };
    if (word == "read") {
        Bare bare(domain);
        bare.read(figures);
        measure();
    } else {
        const auto schema = hal::dds::Schema::of_fields("v:float*64", type_name);
        Subscribed subscribed(schema, figures);
        hal::dds::Settings settings;
        settings.domain = static_cast<int>(domain);
        const auto reader = hal::dds::open(settings)->reader(
            {topic_name, type_name, schema.sample.size()}, {.depth = 16}, &subscribed);
        measure();
    }
    return 0;
}
