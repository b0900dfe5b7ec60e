// nng: PUB and SUB over `ipc://`, with messages that are written in place.

#include <nng/nng.h>
#include <nng/protocol/pubsub0/pub.h>
#include <nng/protocol/pubsub0/sub.h>

#include <stdexcept>

#include "rival.h"

namespace {

void check(int error) {
  if (error != 0) throw std::runtime_error(nng_strerror(error));
}

std::string address(const Setup& setup, const std::string& topic) {
  return "ipc://" + setup.folder + "/" + topic;
}

class Publisher : public Sender {
 public:
  Publisher(const Setup& setup, const std::string& topic) : bytes_(setup.bytes) {
    check(nng_pub0_open(&socket_));
    check(nng_socket_set_int(socket_, NNG_OPT_SENDBUF, setup.depth));
    check(nng_listen(socket_, address(setup, topic).c_str(), nullptr, 0));
  }
  ~Publisher() override { nng_close(socket_); }
  void send(const Write& write) override {
    nng_msg* message = nullptr;
    check(nng_msg_alloc(&message, bytes_));
    write(nng_msg_body(message));
    check(nng_sendmsg(socket_, message, 0));
  }

 private:
  nng_socket socket_{};
  size_t bytes_;
};

class Subscriber : public Receiver {
 public:
  Subscriber(const Setup& setup, const std::string& topic) {
    check(nng_sub0_open(&socket_));
    check(nng_socket_set(socket_, NNG_OPT_SUB_SUBSCRIBE, "", 0));
    check(nng_socket_set_int(socket_, NNG_OPT_RECVBUF, setup.depth));
    check(nng_socket_set_size(socket_, NNG_OPT_RECVMAXSZ, 0));
    check(nng_socket_set_ms(socket_, NNG_OPT_RECVTIMEO, 50));
    check(nng_socket_set_ms(socket_, NNG_OPT_RECONNMINT, 10));
    // The publisher may bind later.
    check(nng_dial(socket_, address(setup, topic).c_str(), nullptr, NNG_FLAG_NONBLOCK));
  }
  ~Subscriber() override { nng_close(socket_); }
  void run(const Heard& heard, const std::function<bool()>& is_over) override {
    while (!is_over()) {
      nng_msg* message = nullptr;
      const int error = nng_recvmsg(socket_, &message, 0);
      if (error == NNG_ETIMEDOUT) continue;
      check(error);
      heard(nng_msg_body(message), nng_msg_len(message));
      nng_msg_free(message);
    }
  }

 private:
  nng_socket socket_{};
};

}  // namespace

std::unique_ptr<Rival> join(const Setup& setup) {
  return std::make_unique<Ports<Publisher, Subscriber>>(setup);
}
