// iceoryx (the first one, with its daemon iox-roudi): loaned samples, and a WaitSet to sleep on.

#include <unistd.h>

#include <iceoryx_hoofs/log/logmanager.hpp>
#include <iceoryx_posh/popo/untyped_publisher.hpp>
#include <iceoryx_posh/popo/untyped_subscriber.hpp>
#include <iceoryx_posh/popo/wait_set.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>
#include <stdexcept>

#include "rival.h"

namespace {

iox::capro::ServiceDescription service(const std::string& topic) {
  return {"rivals", "measured", iox::capro::IdString_t(iox::cxx::TruncateToCapacity, topic)};
}

class Publisher : public Sender {
 public:
  Publisher(const Setup& setup, const std::string& topic)
      : bytes_(setup.bytes), port_(service(topic)) {}
  void send(const Write& write) override {
    auto loan = port_.loan(static_cast<uint32_t>(bytes_));
    if (loan.has_error()) throw std::runtime_error("iceoryx loans nothing");
    write(loan.value());
    port_.publish(loan.value());
  }

 private:
  size_t bytes_;
  iox::popo::UntypedPublisher port_;
};

class Subscriber : public Receiver {
 public:
  Subscriber(const Setup& setup, const std::string& topic)
      : bytes_(setup.bytes), port_(service(topic), options(setup)) {
    if (set_.attachState(port_, iox::popo::SubscriberState::HAS_DATA).has_error()) {
      throw std::runtime_error("iceoryx's WaitSet is full");
    }
  }
  void run(const Heard& heard, const std::function<bool()>& is_over) override {
    while (!is_over()) {
      set_.timedWait(iox::units::Duration::fromMilliseconds(50));
      while (true) {
        auto taken = port_.take();
        if (taken.has_error()) break;
        // It says that some were lost, but not how many.
        has_lost_ = port_.hasMissedData() || has_lost_;
        heard(taken.value(), bytes_);
        port_.release(taken.value());
      }
    }
  }
  int64_t told() override { return has_lost_ ? LOST_SOME : 0; }

 private:
  static iox::popo::SubscriberOptions options(const Setup& setup) {
    iox::popo::SubscriberOptions options;
    options.queueCapacity = static_cast<uint64_t>(setup.depth);
    return options;
  }
  size_t bytes_;
  bool has_lost_ = false;
  iox::popo::UntypedSubscriber port_;
  iox::popo::WaitSet<> set_;
};

}  // namespace

std::unique_ptr<Rival> join(const Setup& setup) {
  iox::log::LogManager::GetLogManager().SetDefaultLogLevel(iox::log::LogLevel::kError);
  const std::string name = "rivals-" + std::to_string(getpid());
  iox::runtime::PoshRuntime::initRuntime(iox::RuntimeName_t(iox::cxx::TruncateToCapacity, name));
  return std::make_unique<Ports<Publisher, Subscriber>>(setup);
}
