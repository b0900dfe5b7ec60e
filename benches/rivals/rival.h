// What a middleware has to do to be measured: the interface between main.cpp, which plans, times
// and counts alike for all, and one thin file for each rival.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

// What a process is told about the measurement.
struct Setup {
  std::string kind;    // Which of the rival's variants, such as "shm"; often empty.
  std::string folder;  // An empty folder that all processes of the measurement share.
  size_t bytes;        // The size of a sample.
  int depth;           // How many samples a receiver may fall behind, where one can say so.
  int readers;         // How many receivers there are.
};

// Writes a sample's bytes into the place that it is given, aligned to 8 bytes.
using Write = std::function<void(void* place)>;
// Is called with each sample that was received; its bytes live until it returns.
using Heard = std::function<void(const void* bytes, size_t size)>;

// The end of a topic that publishes.
class Sender {
 public:
  virtual ~Sender() = default;
  // Publishes one sample. `write` is called once: with memory of the middleware, if it loans any,
  // so that nothing is copied afterwards, or else with memory of the rival's file.
  virtual void send(const Write& write) = 0;
};

// The end of a topic that receives.
class Receiver {
 public:
  virtual ~Receiver() = default;
  // Calls `heard` for each sample, in this thread or one of the middleware, until `is_over()`. It
  // asks `is_over` at least every 0.1 s, in the thread that called.
  virtual void run(const Heard& heard, const std::function<bool()>& is_over) = 0;
  // How many samples the middleware has said to be lost: -1 if it never tells, and LOST_SOME if it
  // says that some were lost but not how many.
  virtual int64_t told() { return -1; }
};

constexpr int64_t LOST_SOME = -2;

// A process's membership.
class Rival {
 public:
  virtual ~Rival() = default;
  // `topic` is a word of a-z.
  virtual std::unique_ptr<Sender> sender(const std::string& topic) = 0;
  virtual std::unique_ptr<Receiver> receiver(const std::string& topic) = 0;
};

// The membership of a process that joins nothing: each of its ports stands by itself.
template <class S, class R>
class Ports : public Rival {
 public:
  explicit Ports(const Setup& setup) : setup_(setup) {}
  std::unique_ptr<Sender> sender(const std::string& topic) override {
    return std::make_unique<S>(setup_, topic);
  }
  std::unique_ptr<Receiver> receiver(const std::string& topic) override {
    return std::make_unique<R>(setup_, topic);
  }

 private:
  Setup setup_;
};

// Each rival's file defines it. Failures are thrown as std::runtime_error, here and in all of the
// above.
std::unique_ptr<Rival> join(const Setup& setup);
