// LCM: UDP multicast that does not leave the machine, and its own handler loop.

#include <lcm/lcm.h>

#include <stdexcept>
#include <vector>

#include "rival.h"

namespace {

class Publisher : public Sender {
 public:
  Publisher(lcm_t* lcm, std::string topic, size_t bytes)
      : lcm_(lcm), topic_(std::move(topic)), words_(bytes / 8) {}
  void send(const Write& write) override {
    write(words_.data());
    const auto bytes = static_cast<unsigned>(8 * words_.size());
    if (lcm_publish(lcm_, topic_.c_str(), words_.data(), bytes) != 0)
      throw std::runtime_error("lcm_publish failed");
  }

 private:
  lcm_t* lcm_;
  std::string topic_;
  std::vector<uint64_t> words_;
};

class Subscriber : public Receiver {
 public:
  Subscriber(lcm_t* lcm, const std::string& topic, int depth) : lcm_(lcm) {
    const auto handler = [](const lcm_recv_buf_t* got, const char*, void* self) {
      (*static_cast<Subscriber*>(self)->heard_)(got->data, got->data_size);
    };
    lcm_subscription_t* made = lcm_subscribe(lcm, topic.c_str(), handler, this);
    if (made == nullptr) throw std::runtime_error("lcm_subscribe failed");
    lcm_subscription_set_queue_capacity(made, depth);
  }
  void run(const Heard& heard, const std::function<bool()>& is_over) override {
    heard_ = &heard;
    while (!is_over()) {
      if (lcm_handle_timeout(lcm_, 50) < 0) throw std::runtime_error("lcm_handle failed");
    }
  }

 private:
  lcm_t* lcm_;
  const Heard* heard_ = nullptr;
};

class Lcm : public Rival {
 public:
  // A receive buffer as its documentation advises for messages of megabytes.
  explicit Lcm(const Setup& setup)
      : setup_(setup), lcm_(lcm_create("udpm://239.255.76.67:7667?ttl=0&recv_buf_size=8388608")) {
    if (lcm_ == nullptr)
      throw std::runtime_error("lcm_create failed: is there a route for multicast?");
  }
  ~Lcm() override { lcm_destroy(lcm_); }
  std::unique_ptr<Sender> sender(const std::string& topic) override {
    return std::make_unique<Publisher>(lcm_, topic, setup_.bytes);
  }
  std::unique_ptr<Receiver> receiver(const std::string& topic) override {
    return std::make_unique<Subscriber>(lcm_, topic, setup_.depth);
  }

 private:
  Setup setup_;
  lcm_t* lcm_;
};

}  // namespace

std::unique_ptr<Rival> join(const Setup& setup) { return std::make_unique<Lcm>(setup); }
