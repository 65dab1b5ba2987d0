// SPDX-License-Identifier: MIT
// Writers and readers on Fast DDS 2.9. A sample is plain bytes here: the types have names and no
// fields. Included by the engine only.
#pragma once

#include <atomic>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "dds/engine.hpp"

namespace hal::dds::engine {

namespace fd = eprosima::fastdds::dds;

/// A sample as the library passes it to BytesType.
struct Bytes {
    std::span<const std::uint8_t> out;  // to write; owned by the caller of write()
    std::vector<std::uint8_t> in;   // read
};

/// Forwards the library's callbacks of one writer or reader to its listener, one at a time, until
/// the owner closes it.
class ListenerGate {
public:
    explicit ListenerGate(Listener* listener) : listener_(listener) {}
    void close() {
        const std::lock_guard lock(mutex_);
        listener_ = nullptr;
    }
    void event(Event e, int count, const std::string& text = {}) {
        const std::lock_guard lock(mutex_);
        if (listener_ != nullptr) {
            listener_->on_event(e, count, text);
        }
    }
    template <class F>
    void with(F&& f) {
        const std::lock_guard lock(mutex_);
        if (listener_ != nullptr) {
            f(*listener_);
        }
    }

private:
    std::mutex mutex_;
    Listener* listener_;
};

class ParticipantImpl;

/// What writers and readers have in common. Their participant creates them, and again when it is
/// re-created itself.
class Endpoint {
public:
    Endpoint(std::shared_ptr<ParticipantImpl> owner, const TopicType& t, const Quality& q,
             Listener* l)
        : topic(t), quality(q), gate(std::make_shared<ListenerGate>(l)), owner_(std::move(owner)) {}
    Endpoint(const Endpoint&) = delete;

    virtual const char* kind() const noexcept = 0;  ///< "writer", "reader"
    virtual bool make(fd::Topic*) = 0;  ///< false: Fast DDS created none
    virtual void unmake() noexcept = 0;  ///< does nothing when it is not created

    const TopicType topic;
    const Quality quality;
    const std::shared_ptr<ListenerGate> gate;

protected:
    ~Endpoint() = default;
    void count_matched(int count, int change) {
        matched_.store(count, std::memory_order_relaxed);
        gate->event(change > 0 ? Event::matched : Event::unmatched, count);
    }
    std::shared_ptr<ParticipantImpl> owner_;
    std::atomic<int> matched_{0};
};

class WriterImpl final : public Writer, private Endpoint, private fd::DataWriterListener {
public:
    WriterImpl(std::shared_ptr<ParticipantImpl> owner, const TopicType&, const Quality&, Listener*);
    ~WriterImpl() override;
    bool write(std::span<const std::uint8_t> bytes, std::int64_t source_ns) noexcept override;
    int matched() const noexcept override { return matched_.load(std::memory_order_relaxed); }
    bool wait_for_acknowledgments(std::int64_t timeout_ns) noexcept override;

private:
    const char* kind() const noexcept override { return "writer"; }
    bool make(fd::Topic*) override;
    void unmake() noexcept override;
    void on_publication_matched(fd::DataWriter*, const fd::PublicationMatchedStatus& s) override {
        count_matched(s.current_count, s.current_count_change);
    }
    void on_offered_deadline_missed(fd::DataWriter*,
                                    const fd::OfferedDeadlineMissedStatus& s) override {
        gate->event(Event::deadline_missed, static_cast<int>(s.total_count));
    }
    void on_offered_incompatible_qos(fd::DataWriter*,
                                     const fd::OfferedIncompatibleQosStatus&) override;
    fd::DataWriter* writer_ = nullptr;  // used by the DDS thread only, which also re-creates it
};

class ReaderImpl final : public Reader, private Endpoint, private fd::DataReaderListener {
public:
    ReaderImpl(std::shared_ptr<ParticipantImpl> owner, const TopicType&, const Quality&, Listener*);
    ~ReaderImpl() override;
    int matched() const noexcept override { return matched_.load(std::memory_order_relaxed); }

private:
    const char* kind() const noexcept override { return "reader"; }
    bool make(fd::Topic*) override;
    void unmake() noexcept override;
    void on_data_available(fd::DataReader*) override;
    void on_subscription_matched(fd::DataReader*, const fd::SubscriptionMatchedStatus& s) override {
        count_matched(s.current_count, s.current_count_change);
    }
    void on_requested_deadline_missed(fd::DataReader*,
                                      const fd::RequestedDeadlineMissedStatus& s) override {
        gate->event(Event::deadline_missed, static_cast<int>(s.total_count));
    }
    void on_requested_incompatible_qos(fd::DataReader*,
                                       const fd::RequestedIncompatibleQosStatus&) override;
    void on_liveliness_changed(fd::DataReader*, const fd::LivelinessChangedStatus& s) override {
        gate->event(s.alive_count_change > 0 ? Event::alive : Event::not_alive, s.alive_count);
    }
    Bytes sample_;  // under the gate's lock
    fd::DataReader* reader_ = nullptr;
};

}  // namespace hal::dds::engine
