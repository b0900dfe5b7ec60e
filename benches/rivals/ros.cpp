// ROS 2 through rcl, the C library below rclcpp: geometry_msgs/Pose (56 bytes, of fixed size) as
// the small sample and std_msgs/UInt8MultiArray as the large one, with the profile for sensor data.
//
// Loaned messages are not used: with them nothing was delivered. rcl_wait is how every executor
// waits.

#include <geometry_msgs/msg/pose.h>
#include <rcl/error_handling.h>
#include <rcl/event.h>
#include <rcl/rcl.h>
#include <rosidl_runtime_c/primitives_sequence_functions.h>
#include <std_msgs/msg/u_int8_multi_array.h>

#include <cstring>
#include <stdexcept>

#include "rival.h"

namespace {

using Small = geometry_msgs__msg__Pose;
using Large = std_msgs__msg__UInt8MultiArray;

void check(rcl_ret_t result) {
  if (result == RCL_RET_OK) return;
  const std::string text = rcl_get_error_string().str;
  rcl_reset_error();
  throw std::runtime_error(text);
}

// At a process's end nobody mends what fails.
void ended(rcl_ret_t result) {
  if (result != RCL_RET_OK) rcl_reset_error();
}

// A message of one of the two types. The numbers of a pose are only carried, so they may be any
// bits.
class Message {
 public:
  explicit Message(const Setup& setup) : bytes_(setup.bytes) {
    std_msgs__msg__UInt8MultiArray__init(&large_);
    if (!is_small()) rosidl_runtime_c__uint8__Sequence__init(&large_.data, bytes_);
  }
  ~Message() { std_msgs__msg__UInt8MultiArray__fini(&large_); }
  Message(const Message&) = delete;
  Message& operator=(const Message&) = delete;
  void* message() { return is_small() ? static_cast<void*>(&small_) : &large_; }
  void* bytes() { return is_small() ? static_cast<void*>(&small_) : large_.data.data; }
  size_t size() const { return is_small() ? sizeof small_ : large_.data.size; }
  const rosidl_message_type_support_t* type() const {
    return is_small() ? ROSIDL_GET_MSG_TYPE_SUPPORT(geometry_msgs, msg, Pose)
                      : ROSIDL_GET_MSG_TYPE_SUPPORT(std_msgs, msg, UInt8MultiArray);
  }

 private:
  bool is_small() const { return bytes_ == sizeof small_; }
  size_t bytes_;
  Small small_{};
  Large large_{};
};

rmw_qos_profile_t settings(const Setup& setup) {
  rmw_qos_profile_t settings = rmw_qos_profile_sensor_data;
  settings.depth = static_cast<size_t>(setup.depth);
  // A sample of many packets is as good as always lost without repetition.
  if (setup.bytes > 65536) settings.reliability = RMW_QOS_POLICY_RELIABILITY_RELIABLE;
  return settings;
}

class Publisher : public Sender {
 public:
  Publisher(rcl_node_t* node, const Setup& setup, const std::string& topic)
      : node_(node), message_(setup) {
    auto options = rcl_publisher_get_default_options();
    options.qos = settings(setup);
    check(rcl_publisher_init(&port_, node, message_.type(), topic.c_str(), &options));
  }
  ~Publisher() override { ended(rcl_publisher_fini(&port_, node_)); }
  void send(const Write& write) override {
    write(message_.bytes());
    check(rcl_publish(&port_, message_.message(), nullptr));
  }

 private:
  rcl_node_t* node_;
  Message message_;
  rcl_publisher_t port_ = rcl_get_zero_initialized_publisher();
};

class Subscriber : public Receiver {
 public:
  Subscriber(rcl_context_t* context, rcl_node_t* node, const Setup& setup, const std::string& topic)
      : node_(node), message_(setup) {
    auto options = rcl_subscription_get_default_options();
    options.qos = settings(setup);
    check(rcl_subscription_init(&port_, node, message_.type(), topic.c_str(), &options));
    check(rcl_subscription_event_init(&lost_event_, &port_, RCL_SUBSCRIPTION_MESSAGE_LOST));
    check(rcl_wait_set_init(&set_, 1, 0, 0, 0, 0, 1, context, rcl_get_default_allocator()));
  }
  ~Subscriber() override {
    ended(rcl_wait_set_fini(&set_));
    ended(rcl_event_fini(&lost_event_));
    ended(rcl_subscription_fini(&port_, node_));
  }
  void run(const Heard& heard, const std::function<bool()>& is_over) override {
    while (!is_over()) {
      check(rcl_wait_set_clear(&set_));
      check(rcl_wait_set_add_subscription(&set_, &port_, nullptr));
      check(rcl_wait_set_add_event(&set_, &lost_event_, nullptr));
      const rcl_ret_t woken = rcl_wait(&set_, RCL_MS_TO_NS(50));
      if (woken == RCL_RET_TIMEOUT) {
        rcl_reset_error();
        continue;
      }
      check(woken);
      if (set_.events[0] != nullptr) {
        rmw_message_lost_status_t status{};
        if (rcl_take_event(&lost_event_, &status) == RCL_RET_OK)
          lost_ = static_cast<int64_t>(status.total_count);
      }
      if (set_.subscriptions[0] == nullptr) continue;
      rmw_message_info_t info{};
      while (rcl_take(&port_, message_.message(), &info, nullptr) == RCL_RET_OK) {
        heard(message_.bytes(), message_.size());
      }
      rcl_reset_error();
    }
  }
  int64_t told() override { return lost_; }

 private:
  rcl_node_t* node_;
  Message message_;
  int64_t lost_ = 0;
  rcl_subscription_t port_ = rcl_get_zero_initialized_subscription();
  rcl_event_t lost_event_ = rcl_get_zero_initialized_event();
  rcl_wait_set_t set_ = rcl_get_zero_initialized_wait_set();
};

class Ros : public Rival {
 public:
  explicit Ros(const Setup& setup) : setup_(setup) {
    auto options = rcl_get_zero_initialized_init_options();
    check(rcl_init_options_init(&options, rcl_get_default_allocator()));
    check(rcl_init(0, nullptr, &options, &context_));
    const auto defaults = rcl_node_get_default_options();
    check(rcl_node_init(&node_, "measured", "", &context_, &defaults));
  }
  // Otherwise its shared memory stays behind.
  ~Ros() override {
    ended(rcl_node_fini(&node_));
    ended(rcl_shutdown(&context_));
    ended(rcl_context_fini(&context_));
  }
  std::unique_ptr<Sender> sender(const std::string& topic) override {
    return std::make_unique<Publisher>(&node_, setup_, topic);
  }
  std::unique_ptr<Receiver> receiver(const std::string& topic) override {
    return std::make_unique<Subscriber>(&context_, &node_, setup_, topic);
  }

 private:
  Setup setup_;
  rcl_context_t context_ = rcl_get_zero_initialized_context();
  rcl_node_t node_ = rcl_get_zero_initialized_node();
};

}  // namespace

std::unique_ptr<Rival> join(const Setup& setup) { return std::make_unique<Ros>(setup); }
