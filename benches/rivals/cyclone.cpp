// Cyclone DDS: a listener that its receiving thread calls, and loans where the daemon of iceoryx
// runs. rivals/build.py writes the settings of both variants.

#include "cyclone.h"

#include <dds/dds.h>
#include <dds/ddsc/dds_loan_api.h>
#include <unistd.h>

#include <stdexcept>
#include <vector>

#include "rival.h"

namespace {

template <class T>
T check(T result) {
  if (result < 0) throw std::runtime_error(dds_strretcode(result));
  return result;
}

using Settings = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

Settings settings(const Setup& setup) {
  Settings all(dds_create_qos(), dds_delete_qos);
  dds_qset_history(all.get(), DDS_HISTORY_KEEP_LAST, setup.depth);
  // A sample of many packets is as good as always lost without repetition.
  const bool is_large = setup.bytes > 65536;
  dds_qset_reliability(all.get(), is_large ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       DDS_SECS(1));
  return all;
}

dds_entity_t topic(dds_entity_t participant, const Setup& setup, const std::string& name) {
  const auto* type = setup.bytes == sizeof(Small) ? &Small_desc : &Large_desc;
  return check(dds_create_topic(participant, type, name.c_str(), settings(setup).get(), nullptr));
}

class Publisher : public Sender {
 public:
  Publisher(dds_entity_t participant, const Setup& setup, const std::string& name)
      : words_(setup.bytes / 8) {
    writer_ = check(dds_create_writer(participant, topic(participant, setup, name),
                                      settings(setup).get(), nullptr));
  }
  void send(const Write& write) override {
    void* place = nullptr;
    if (!dds_is_loan_available(writer_) || dds_loan_sample(writer_, &place) != DDS_RETCODE_OK)
      place = words_.data();
    write(place);
    check(dds_write(writer_, place));
  }

 private:
  std::vector<uint64_t> words_;
  dds_entity_t writer_;
};

class Subscriber : public Receiver {
 public:
  Subscriber(dds_entity_t participant, const Setup& setup, const std::string& name)
      : participant_(participant), setup_(setup), name_(name) {}
  void run(const Heard& heard, const std::function<bool()>& is_over) override {
    heard_ = &heard;
    dds_listener_t* listener = dds_create_listener(this);
    dds_lset_data_available(listener, [](dds_entity_t reader, void* self) {
      static_cast<Subscriber*>(self)->take(reader);
    });
    dds_lset_sample_lost(listener,
                         [](dds_entity_t, const dds_sample_lost_status_t status, void* self) {
                           static_cast<Subscriber*>(self)->lost_ = status.total_count;
                         });
    const auto of = topic(participant_, setup_, name_);
    const auto reader =
        check(dds_create_reader(participant_, of, settings(setup_).get(), listener));
    while (!is_over()) usleep(20'000);
    dds_delete(reader);
    dds_delete_listener(listener);
  }
  int64_t told() override { return lost_; }

 private:
  void take(dds_entity_t reader) {
    constexpr int MOST = 16;
    void* samples[MOST] = {};
    dds_sample_info_t infos[MOST];
    int taken = 0;
    while ((taken = dds_take(reader, samples, infos, MOST, MOST)) > 0) {
      for (int at = 0; at < taken; ++at) {
        if (infos[at].valid_data) (*heard_)(samples[at], setup_.bytes);
      }
      dds_return_loan(reader, samples, taken);
      samples[0] = nullptr;
    }
  }
  dds_entity_t participant_;
  Setup setup_;
  std::string name_;
  const Heard* heard_ = nullptr;
  int64_t lost_ = 0;
};

class Cyclone : public Rival {
 public:
  explicit Cyclone(const Setup& setup)
      : setup_(setup),
        participant_(check(dds_create_participant(DDS_DOMAIN_DEFAULT, nullptr, nullptr))) {}
  ~Cyclone() override { dds_delete(participant_); }
  std::unique_ptr<Sender> sender(const std::string& topic) override {
    return std::make_unique<Publisher>(participant_, setup_, topic);
  }
  std::unique_ptr<Receiver> receiver(const std::string& topic) override {
    return std::make_unique<Subscriber>(participant_, setup_, topic);
  }

 private:
  Setup setup_;
  dds_entity_t participant_;
};

}  // namespace

std::unique_ptr<Rival> join(const Setup& setup) { return std::make_unique<Cyclone>(setup); }
