// The floor: one page of shared memory with a ring of samples, and one futex on which all receivers
// sleep. No middleware that lets its receivers sleep can do much less.

#include <fcntl.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <climits>
#include <ctime>
#include <stdexcept>

#include "rival.h"

namespace {

struct Head {
  std::atomic<uint32_t> published;
};

class Page {
 public:
  Page(const Setup& setup, const std::string& topic)
      : stride_((setup.bytes + 63) / 64 * 64),
        depth_(static_cast<uint32_t>(setup.depth)),
        bytes(setup.bytes) {
    const size_t size = 64 + stride_ * (depth_ + 1);
    const int file = open((setup.folder + "/" + topic).c_str(), O_RDWR | O_CREAT, 0600);
    if (file < 0 || ftruncate(file, static_cast<off_t>(size)) != 0)
      throw std::runtime_error("no page");
    base_ = static_cast<char*>(mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0));
    close(file);
    if (base_ == MAP_FAILED) throw std::runtime_error("no page");
  }
  std::atomic<uint32_t>& published() { return reinterpret_cast<Head*>(base_)->published; }
  char* place(uint32_t number) { return base_ + 64 + stride_ * (number % (depth_ + 1)); }
  long futex(int what, uint32_t value, const timespec* most) {
    return syscall(SYS_futex, base_, what, value, most, nullptr, 0);
  }
  uint32_t depth() const { return depth_; }

 private:
  char* base_;
  size_t stride_;
  uint32_t depth_;

 public:
  const size_t bytes;
};

class Floor : public Sender, public Receiver {
 public:
  Floor(const Setup& setup, const std::string& topic)
      : page_(setup, topic), next_(page_.published()) {}
  void send(const Write& write) override {
    const uint32_t number = page_.published().load(std::memory_order_relaxed);
    write(page_.place(number));
    page_.published().store(number + 1, std::memory_order_release);
    page_.futex(FUTEX_WAKE, INT_MAX, nullptr);
  }
  void run(const Heard& heard, const std::function<bool()>& is_over) override {
    const timespec most{0, 50'000'000};
    while (!is_over()) {
      const uint32_t published = page_.published().load(std::memory_order_acquire);
      if (published == next_) {
        page_.futex(FUTEX_WAIT, published, &most);
        continue;
      }
      if (published - next_ > page_.depth()) {
        lost_ += published - next_ - page_.depth();
        next_ = published - page_.depth();
      }
      heard(page_.place(next_++), page_.bytes);
    }
  }
  int64_t told() override { return lost_; }

 private:
  Page page_;
  uint32_t next_;
  int64_t lost_ = 0;
};

}  // namespace

std::unique_ptr<Rival> join(const Setup& setup) {
  return std::make_unique<Ports<Floor, Floor>>(setup);
}
