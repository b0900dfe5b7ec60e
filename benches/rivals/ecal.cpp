// eCAL: shared memory without a copy at the receiver, several buffers, and its receive callback.

#include <ecal/config.h>
#include <ecal/core.h>
#include <ecal/pubsub/publisher.h>
#include <ecal/pubsub/subscriber.h>
#include <unistd.h>

#include <stdexcept>

#include "rival.h"

namespace {

// Hands eCAL's shared memory to the writer of a sample.
class Payload : public eCAL::CPayloadWriter {
 public:
  Payload(const Write& write, size_t bytes) : write_(write), bytes_(bytes) {}
  bool WriteFull(void* place, size_t) override {
    write_(place);
    return true;
  }
  size_t GetSize() override { return bytes_; }

 private:
  const Write& write_;
  size_t bytes_;
};

eCAL::Publisher::Configuration settings(const Setup& setup) {
  eCAL::Publisher::Configuration settings;
  settings.layer.shm.zero_copy_mode = true;
  settings.layer.shm.memfile_buffer_count = static_cast<unsigned>(setup.depth);
  settings.layer.udp.enable = false;
  settings.layer.tcp.enable = false;
  return settings;
}

class Publisher : public Sender {
 public:
  Publisher(const Setup& setup, const std::string& topic)
      : bytes_(setup.bytes), port_(topic, eCAL::SDataTypeInformation(), settings(setup)) {}
  void send(const Write& write) override {
    // Before anybody listens it writes nothing.
    Payload payload(write, bytes_);
    port_.Send(payload);
  }

 private:
  size_t bytes_;
  eCAL::CPublisher port_;
};

class Subscriber : public Receiver {
 public:
  Subscriber(const Setup&, const std::string& topic)
      : port_(topic, eCAL::SDataTypeInformation(),
              [this](const eCAL::STopicId&, const eCAL::SSubEventCallbackData& event) {
                // It says that some were lost, but not how many.
                if (event.event_type == eCAL::eSubscriberEvent::dropped) has_lost_ = true;
              }) {}
  void run(const Heard& heard, const std::function<bool()>& is_over) override {
    port_.SetReceiveCallback(
        [&](const eCAL::STopicId&, const eCAL::SDataTypeInformation&,
            const eCAL::SReceiveCallbackData& got) { heard(got.buffer, got.buffer_size); });
    while (!is_over()) usleep(20'000);
    port_.RemoveReceiveCallback();
  }
  int64_t told() override { return has_lost_ ? LOST_SOME : 0; }

 private:
  bool has_lost_ = false;
  eCAL::CSubscriber port_;
};

class Ecal : public Ports<Publisher, Subscriber> {
 public:
  using Ports::Ports;
  ~Ecal() override { eCAL::Finalize(); }
};

}  // namespace

std::unique_ptr<Rival> join(const Setup& setup) {
  if (!eCAL::Initialize("rivals")) throw std::runtime_error("eCAL does not start");
  return std::make_unique<Ecal>(setup);
}
