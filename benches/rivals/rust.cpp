// The bus itself, bare iceoryx2 and Zenoh, which edge.rs shows to C.

#include <stdexcept>

#include "rival.h"

extern "C" {
void* rivals_join(const char* kind, const char* folder, size_t bytes, size_t depth, size_t readers);
void* rivals_sender(const void* member, bool is_back);
void* rivals_receiver(const void* member, bool is_back);
bool rivals_send(void* sender, void (*write)(void*, uint8_t*), void* context);
bool rivals_run(const void* receiver, void (*heard)(void*, const uint8_t*, size_t),
                bool (*is_over)(void*), void* context);
int64_t rivals_told(const void* receiver);
}

namespace {

void* made(void* pointer) {
  if (pointer == nullptr) throw std::runtime_error("see above");
  return pointer;
}

class Publisher : public Sender {
 public:
  explicit Publisher(void* port) : port_(made(port)) {}
  void send(const Write& write) override {
    const auto call = [](void* context, uint8_t* place) {
      (*static_cast<const Write*>(context))(place);
    };
    if (!rivals_send(port_, call, const_cast<Write*>(&write)))
      throw std::runtime_error("see above");
  }

 private:
  void* port_;
};

class Subscriber : public Receiver {
 public:
  explicit Subscriber(void* port) : port_(made(port)) {}
  void run(const Heard& heard, const std::function<bool()>& is_over) override {
    struct Context {
      const Heard& heard;
      const std::function<bool()>& is_over;
    } context{heard, is_over};
    const auto call = [](void* of, const uint8_t* bytes, size_t size) {
      static_cast<Context*>(of)->heard(bytes, size);
    };
    const auto ask = [](void* of) { return static_cast<Context*>(of)->is_over(); };
    if (!rivals_run(port_, call, ask, &context)) throw std::runtime_error("see above");
  }
  int64_t told() override { return rivals_told(port_); }

 private:
  void* port_;
};

class Rust : public Rival {
 public:
  explicit Rust(const Setup& setup)
      : member_(made(rivals_join(setup.kind.c_str(), setup.folder.c_str(), setup.bytes,
                                 static_cast<size_t>(setup.depth),
                                 static_cast<size_t>(setup.readers)))) {}
  std::unique_ptr<Sender> sender(const std::string& topic) override {
    return std::make_unique<Publisher>(rivals_sender(member_, topic == "back"));
  }
  std::unique_ptr<Receiver> receiver(const std::string& topic) override {
    return std::make_unique<Subscriber>(rivals_receiver(member_, topic == "back"));
  }

 private:
  void* member_;
};

}  // namespace

std::unique_ptr<Rival> join(const Setup& setup) { return std::make_unique<Rust>(setup); }
