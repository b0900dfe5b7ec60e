// Fast DDS: a plain type of fixed size, so that it shares its data, loans, and a listener that the
// receiving thread calls.

#include <unistd.h>

#include <cstring>
#include <fastdds/dds/core/LoanableSequence.hpp>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <stdexcept>

#include "rival.h"

namespace {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastdds::rtps;

template <class T>
T* made(T* pointer) {
  if (pointer == nullptr) throw std::runtime_error("Fast DDS made nothing");
  return pointer;
}

// A sample of a fixed size without anything in it that would need another form on the wire.
template <size_t BYTES>
struct Block {
  uint64_t words[BYTES / 8];
};

template <class T>
class Plain : public dds::TopicDataType {
 public:
  explicit Plain(const char* name) {
    set_name(name);
    max_serialized_type_size = HEAD + sizeof(T);
  }
  bool serialize(const void* const data, rtps::SerializedPayload_t& payload,
                 dds::DataRepresentationId_t) override {
    const unsigned char head[HEAD] = {0, 1, 0, 0};
    memcpy(payload.data, head, HEAD);
    memcpy(payload.data + HEAD, data, sizeof(T));
    payload.length = HEAD + sizeof(T);
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t& payload, void* data) override {
    memcpy(data, payload.data + HEAD, sizeof(T));
    return true;
  }
  uint32_t calculate_serialized_size(const void* const, dds::DataRepresentationId_t) override {
    return HEAD + sizeof(T);
  }
  void* create_data() override { return new T(); }
  void delete_data(void* data) override { delete static_cast<T*>(data); }
  bool compute_key(rtps::SerializedPayload_t&, rtps::InstanceHandle_t&, bool) override {
    return false;
  }
  bool compute_key(const void* const, rtps::InstanceHandle_t&, bool) override { return false; }
  bool is_bounded() const override { return true; }
  bool is_plain(dds::DataRepresentationId_t) const override { return true; }
  bool construct_sample(void* memory) const override {
    new (memory) T;
    return true;
  }

 private:
  static constexpr uint32_t HEAD = 4;
};

using Small = Block<64>;
using Large = Block<1 << 20>;

// The history, and where it lies: `qos` is a writer's or a reader's.
template <class Q>
Q settings(Q qos, const Setup& setup) {
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = setup.depth;
  qos.reliability().kind =
      setup.bytes > 65536 ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
  qos.data_sharing().automatic();
  return qos;
}

class Publisher : public Sender {
 public:
  Publisher(dds::DomainParticipant* participant, dds::Topic* topic, const Setup& setup) {
    auto* publisher = made(participant->create_publisher(dds::PUBLISHER_QOS_DEFAULT));
    writer_ =
        made(publisher->create_datawriter(topic, settings(dds::DATAWRITER_QOS_DEFAULT, setup)));
  }
  void send(const Write& write) override {
    void* place = nullptr;
    if (writer_->loan_sample(place) != dds::RETCODE_OK)
      throw std::runtime_error("Fast DDS loans nothing");
    write(place);
    if (writer_->write(place) != dds::RETCODE_OK)
      throw std::runtime_error("Fast DDS does not write");
  }

 private:
  dds::DataWriter* writer_;
};

template <class T>
class Subscriber : public Receiver, public dds::DataReaderListener {
 public:
  Subscriber(dds::DomainParticipant* participant, dds::Topic* topic, const Setup& setup)
      : topic_(topic),
        setup_(setup),
        subscriber_(made(participant->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT))) {}
  void run(const Heard& heard, const std::function<bool()>& is_over) override {
    heard_ = &heard;
    auto* reader = made(subscriber_->create_datareader(
        topic_, settings(dds::DATAREADER_QOS_DEFAULT, setup_), this));
    while (!is_over()) usleep(20'000);
    reader->set_listener(nullptr);
  }
  int64_t told() override { return lost_; }
  void on_data_available(dds::DataReader* reader) override {
    dds::LoanableSequence<T> samples;
    dds::SampleInfoSeq infos;
    while (reader->take(samples, infos) == dds::RETCODE_OK) {
      for (int at = 0; at < infos.length(); ++at) {
        if (infos[at].valid_data) (*heard_)(&samples[at], sizeof(T));
      }
      reader->return_loan(samples, infos);
    }
  }
  void on_sample_lost(dds::DataReader*, const dds::SampleLostStatus& status) override {
    lost_ = status.total_count;
  }

 private:
  dds::Topic* topic_;
  Setup setup_;
  dds::Subscriber* subscriber_;
  const Heard* heard_ = nullptr;
  int64_t lost_ = 0;
};

class Fastdds : public Rival {
 public:
  explicit Fastdds(const Setup& setup) : setup_(setup) {
    auto* factory = dds::DomainParticipantFactory::get_instance();
    participant_ = made(factory->create_participant(0, dds::PARTICIPANT_QOS_DEFAULT));
    type_ = is_small() ? dds::TypeSupport(new Plain<Small>("Small"))
                       : dds::TypeSupport(new Plain<Large>("Large"));
    type_.register_type(participant_);
  }
  // Otherwise its shared memory stays behind.
  ~Fastdds() override {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  std::unique_ptr<Sender> sender(const std::string& name) override {
    return std::make_unique<Publisher>(participant_, topic(name), setup_);
  }
  std::unique_ptr<Receiver> receiver(const std::string& name) override {
    if (is_small()) return std::make_unique<Subscriber<Small>>(participant_, topic(name), setup_);
    return std::make_unique<Subscriber<Large>>(participant_, topic(name), setup_);
  }

 private:
  bool is_small() const { return setup_.bytes == sizeof(Small); }
  dds::Topic* topic(const std::string& name) {
    return made(participant_->create_topic(name, type_.get_type_name(), dds::TOPIC_QOS_DEFAULT));
  }
  Setup setup_;
  dds::DomainParticipant* participant_;
  dds::TypeSupport type_;
};

}  // namespace

std::unique_ptr<Rival> join(const Setup& setup) { return std::make_unique<Fastdds>(setup); }
