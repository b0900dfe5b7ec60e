// ZeroMQ: PUB and SUB over `ipc://`, with messages that are written in place. Its queues keep their
// usual 1000 messages: with 16, even a single message on its way was dropped now and then, since a
// sender learns late what has been read.

#include <zmq.h>

#include <stdexcept>

#include "rival.h"

namespace {

void* context() {
  static void* const all = zmq_ctx_new();
  return all;
}

void check(int result) {
  if (result < 0) throw std::runtime_error(zmq_strerror(zmq_errno()));
}

class Socket {
 public:
  explicit Socket(int type) : socket_(zmq_socket(context(), type)) {
    if (socket_ == nullptr) check(-1);
    set(ZMQ_LINGER, 0);
  }
  ~Socket() { zmq_close(socket_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  void set(int option, int value) { check(zmq_setsockopt(socket_, option, &value, sizeof value)); }
  void* operator*() const { return socket_; }

 private:
  void* socket_;
};

std::string address(const Setup& setup, const std::string& topic) {
  return "ipc://" + setup.folder + "/" + topic;
}

class Publisher : public Sender {
 public:
  Publisher(const Setup& setup, const std::string& topic) : socket_(ZMQ_PUB), bytes_(setup.bytes) {
    check(zmq_bind(*socket_, address(setup, topic).c_str()));
  }
  void send(const Write& write) override {
    zmq_msg_t message;
    check(zmq_msg_init_size(&message, bytes_));
    write(zmq_msg_data(&message));
    check(zmq_msg_send(&message, *socket_, 0));
  }

 private:
  Socket socket_;
  size_t bytes_;
};

class Subscriber : public Receiver {
 public:
  Subscriber(const Setup& setup, const std::string& topic) : socket_(ZMQ_SUB) {
    check(zmq_setsockopt(*socket_, ZMQ_SUBSCRIBE, "", 0));
    socket_.set(ZMQ_RCVTIMEO, 50);
    socket_.set(ZMQ_RECONNECT_IVL, 10);
    check(zmq_connect(*socket_, address(setup, topic).c_str()));
  }
  void run(const Heard& heard, const std::function<bool()>& is_over) override {
    zmq_msg_t message;
    check(zmq_msg_init(&message));
    while (!is_over()) {
      if (zmq_msg_recv(&message, *socket_, 0) >= 0) {
        heard(zmq_msg_data(&message), zmq_msg_size(&message));
      } else if (zmq_errno() != EAGAIN && zmq_errno() != EINTR) {
        check(-1);
      }
    }
    zmq_msg_close(&message);
  }

 private:
  Socket socket_;
};

}  // namespace

std::unique_ptr<Rival> join(const Setup& setup) {
  return std::make_unique<Ports<Publisher, Subscriber>>(setup);
}
