// A process of a measurement: it sends samples at planned times or receives them, in the same way
// with each rival.
//
//   program send|receive|ping|pong key=value ...
//
//   sender                                                 receiver
//   hello, hello, ... until a line of its standard input   prints `met` when it hears one
//   warm-up, then the samples that count                   keeps each one's time since it was due
//   prints its figures, waits for a line                   after a line writes the times, prints
//   figures
//
// A sample is due at its planned time, whenever the ones before it were sent. `ping` and `pong`
// send one sample there and back, and half of the round trip is the time.
//
// A small sample is loaned and written after it is due. One of 64 KiB and more, such as a camera's
// image, lies ready when it is due: in the loan, or in memory of the sender's own if nothing is
// loaned.

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <stdexcept>
#include <thread>
#include <vector>

#include "rival.h"

namespace {

constexpr size_t LARGE = 64 * 1024;
constexpr uint64_t HELLO = 0;
// The sender wakes up so much before a sample is due, and then looks at the clock without pause.
constexpr uint64_t EARLY_NS = 100'000;

uint64_t clock_ns(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<uint64_t>(now.tv_sec) * 1'000'000'000 + static_cast<uint64_t>(now.tv_nsec);
}

uint64_t now_ns() { return clock_ns(CLOCK_MONOTONIC); }

uint64_t process_ns() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto ns = [](const timeval& time) {
    return static_cast<uint64_t>(time.tv_sec) * 1'000'000'000 +
           static_cast<uint64_t>(time.tv_usec) * 1'000;
  };
  return ns(used.ru_utime) + ns(used.ru_stime);
}

// The words of the command line.
class Words {
 public:
  Words(int count, char** words) {
    for (int at = 2; at < count; ++at) {
      const std::string word = words[at];
      const size_t equals = word.find('=');
      if (equals == std::string::npos) throw std::runtime_error(word + " is not key=value");
      all_[word.substr(0, equals)] = word.substr(equals + 1);
    }
  }
  const std::string& text(const std::string& key) const {
    const auto found = all_.find(key);
    if (found == all_.end()) throw std::runtime_error(key + "= is missing");
    return found->second;
  }
  uint64_t number(const std::string& key) const { return std::stoull(text(key)); }

 private:
  std::map<std::string, std::string> all_;
};

// A sample: number, when it was due, a pattern, and in the last word the number again.
class Image {
 public:
  explicit Image(size_t bytes) : words_(bytes / 8) {
    for (size_t at = 0; at < words_.size(); ++at) words_[at] = 0x9e3779b97f4a7c15 * (at + 1);
  }
  void draw(void* place) const { memcpy(place, words_.data(), 8 * words_.size()); }
  void mark(void* place, uint64_t number, uint64_t due) const {
    auto* words = static_cast<uint64_t*>(place);
    words[0] = number;
    words[1] = due;
    words[words_.size() - 1] = number;
  }
  // Whether these bytes are a sample. `closely` looks at all of them.
  bool is(const void* bytes, size_t size, bool closely) const {
    if (size != 8 * words_.size() || word(bytes, 0) != word(bytes, words_.size() - 1)) return false;
    const size_t inner = 8 * (words_.size() - 3);
    return !closely || memcmp(static_cast<const char*>(bytes) + 16, &words_[2], inner) == 0;
  }
  static uint64_t word(const void* bytes, size_t at) {
    uint64_t word = 0;
    memcpy(&word, static_cast<const char*>(bytes) + 8 * at, 8);
    return word;
  }

 private:
  std::vector<uint64_t> words_;
};

bool is_asked() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  return poll(&input, 1, 0) > 0;
}

void await_line() {
  char byte = 0;
  while (read(STDIN_FILENO, &byte, 1) == 1 && byte != '\n') {
  }
}

void say(const std::string& line) {
  printf("%s\n", line.c_str());
  fflush(stdout);
}

// The samples of a measurement, by their numbers: HELLO, then the warm-up, then those that count.
struct Numbers {
  uint64_t warm;
  uint64_t count;
  uint64_t last() const { return warm + count; }
};

// Waits until a time, and knows how much of the processor the waiting took.
class Waiting {
 public:
  void until(uint64_t due) {
    const uint64_t began = clock_ns(CLOCK_THREAD_CPUTIME_ID);
    if (now_ns() + EARLY_NS < due) {
      const uint64_t early = due - EARLY_NS;
      timespec wake{static_cast<time_t>(early / 1'000'000'000),
                    static_cast<long>(early % 1'000'000'000)};
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, nullptr);
    }
    while (now_ns() < due) {
    }
    spent_ns += clock_ns(CLOCK_THREAD_CPUTIME_ID) - began;
  }
  uint64_t spent_ns = 0;
};

void send_all(const Setup& setup, const Words& words) {
  const auto rival = join(setup);
  const auto sender = rival->sender("there");
  const Image image(setup.bytes);
  const bool is_large = setup.bytes >= LARGE;
  const Numbers numbers{words.number("warm"), words.number("count")};
  const uint64_t period = 1'000'000'000 / words.number("rate");
  say("up");
  while (!is_asked()) {
    sender->send([&](void* place) {
      image.draw(place);
      image.mark(place, HELLO, now_ns());
    });
    usleep(20'000);
  }
  await_line();
  Waiting waiting;
  uint64_t due = now_ns() + 50'000'000, number = 0, longest = 0, sent_at = 0;
  const Write write = [&](void* place) {
    image.draw(place);
    if (is_large) {
      waiting.until(due);
      sent_at = now_ns();
    }
    image.mark(place, number, due);
  };
  uint64_t process = 0;
  for (number = 1; number <= numbers.last(); ++number, due += period) {
    if (number == numbers.warm + 1) {
      // What the warm-up was late does not count.
      due = now_ns() + period;
      process = process_ns();
      waiting.spent_ns = longest = 0;
    }
    if (!is_large) {
      waiting.until(due);
      sent_at = now_ns();
    }
    sender->send(write);
    longest = std::max(longest, now_ns() - sent_at);
  }
  // What the middleware's own threads still do for the last samples counts as well.
  usleep(20'000);
  const uint64_t used = process_ns() - process - waiting.spent_ns;
  say("{\"sent\": " + std::to_string(numbers.count) + ", \"cpu_ns\": " + std::to_string(used) +
      ", \"longest_send_ns\": " + std::to_string(longest) + "}");
  await_line();
}

void write_times(const std::string& path, const std::vector<uint64_t>& times) {
  FILE* file = fopen(path.c_str(), "wb");
  if (file == nullptr || fwrite(times.data(), 8, times.size(), file) != times.size() ||
      fclose(file) != 0) {
    throw std::runtime_error(path + " cannot be written");
  }
}

// The end of this process that listens: hears until a line of the standard input.
class Ear {
 public:
  explicit Ear(bool closely)
      : closely_(closely), asks_([this] {
          await_line();
          over_ = true;
        }) {}
  ~Ear() { asks_.join(); }
  std::function<bool()> is_over() {
    return [this] { return over_.load(std::memory_order_relaxed); };
  }
  // Whether it is one of the numbered samples, whole and newer than those before.
  bool counts(const Image& image, const void* bytes, size_t size) {
    if (!image.is(bytes, size, closely_)) {
      ++broken;
      return false;
    }
    if (!has_met_) {
      has_met_ = true;
      say("met");
    }
    const uint64_t number = Image::word(bytes, 0);
    if (number == HELLO) return false;
    if (number <= last) {
      ++disordered;
      return false;
    }
    last = number;
    return true;
  }
  uint64_t broken = 0, disordered = 0;
  std::atomic<uint64_t> last{0};

 private:
  bool closely_;
  bool has_met_ = false;
  std::atomic<bool> over_{false};
  std::thread asks_;
};

void receive_all(const Setup& setup, const Words& words) {
  const Image image(setup.bytes);
  const Numbers numbers{words.number("warm"), words.number("count")};
  std::vector<uint64_t> times;
  times.reserve(numbers.count);
  const auto rival = join(setup);
  const auto receiver = rival->receiver("there");
  say("up");
  Ear ear(words.number("closely") != 0);
  int64_t told_before = 0;
  receiver->run(
      [&](const void* bytes, size_t size) {
        const uint64_t now = now_ns();
        const uint64_t last = ear.last;
        if (!ear.counts(image, bytes, size)) return;
        // What was lost before the first numbered sample is nobody's loss.
        if (last == 0) told_before = std::max<int64_t>(receiver->told(), 0);
        if (ear.last > numbers.warm) times.push_back(now - Image::word(bytes, 1));
      },
      ear.is_over());
  write_times(words.text("out"), times);
  const int64_t told = receiver->told();
  say("{\"received\": " + std::to_string(times.size()) +
      ", \"last\": " + std::to_string(ear.last.load()) +
      ", \"told\": " + std::to_string(told < 0 ? told : told - told_before) + ", \"broken\": " +
      std::to_string(ear.broken) + ", \"disordered\": " + std::to_string(ear.disordered) + "}");
}

void ping(const Setup& setup, const Words& words) {
  // So long no answer to a hello can still be on its way.
  constexpr uint64_t QUIET_NS = 300'000'000;
  const Image image(setup.bytes);
  const Numbers numbers{words.number("warm"), words.number("count")};
  std::vector<uint64_t> times;
  times.reserve(numbers.count);
  const auto rival = join(setup);
  // In this order, so that the two processes do not wait for each other.
  const auto there = rival->sender("there");
  const auto back = rival->receiver("back");
  uint64_t number = HELLO;
  const Write write = [&](void* place) {
    image.draw(place);
    image.mark(place, number, now_ns());
  };
  say("up");
  Ear ear(words.number("closely") != 0);
  std::atomic<uint64_t> met_at{0};
  const auto heard = [&](const void* bytes, size_t size) {
    const uint64_t now = now_ns();
    const bool counts = ear.counts(image, bytes, size);
    if (met_at == 0) met_at = now;
    if (!counts) return;
    if (ear.last > numbers.warm) times.push_back((now - Image::word(bytes, 1)) / 2);
    if (ear.last >= numbers.last()) return;
    number = ear.last + 1;
    there->send(write);
  };
  // Says hello until the other process answers, and then sends the first sample.
  const auto is_over = ear.is_over();
  back->run(heard, [&] {
    if (number == HELLO && (met_at == 0 || now_ns() - met_at > QUIET_NS)) {
      number = met_at == 0 ? HELLO : 1;
      there->send(write);
    }
    return ear.last >= numbers.last() || is_over();
  });
  write_times(words.text("out"), times);
  say("{\"received\": " + std::to_string(times.size()) + ", \"broken\": " +
      std::to_string(ear.broken) + ", \"disordered\": " + std::to_string(ear.disordered) + "}");
}

void pong(const Setup& setup) {
  const auto rival = join(setup);
  const auto there = rival->receiver("there");
  const auto back = rival->sender("back");
  say("up");
  Ear ear(false);
  there->run([&](const void* bytes,
                 size_t size) { back->send([&](void* place) { memcpy(place, bytes, size); }); },
             ear.is_over());
  say("{}");
}

}  // namespace

int main(int count, char** values) {
  try {
    if (count < 2) throw std::runtime_error("usage: send|receive|ping|pong key=value ...");
    const std::string role = values[1];
    const Words words(count, values);
    const Setup setup{words.text("kind"), words.text("folder"), words.number("bytes"),
                      static_cast<int>(words.number("depth")),
                      static_cast<int>(words.number("readers"))};
    prctl(PR_SET_TIMERSLACK, 1);
    if (role == "send") {
      send_all(setup, words);
    } else if (role == "receive") {
      receive_all(setup, words);
    } else if (role == "ping") {
      ping(setup, words);
    } else if (role == "pong") {
      pong(setup);
    } else {
      throw std::runtime_error(role + " is no role");
    }
    return 0;
  } catch (const std::exception& error) {
    fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
