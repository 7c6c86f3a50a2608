#include "cli/progress.h"

#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <utility>

#include "cli/number_format.h"

namespace sixpoint::cli {
namespace {

using std::chrono::steady_clock;

// A log is read afterwards: some lines tell as much as many.
constexpr std::chrono::seconds kBetweenLines{5};
constexpr std::chrono::milliseconds kBetweenCounts{100};
constexpr std::chrono::seconds kTick{1};
constexpr char kClearLine[] = "\r\x1b[K";

}  // namespace

ProgressLine::ProgressLine(bool quiet)
    : quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0), printed_(steady_clock::now()) {}

void ProgressLine::Show(const std::string& text) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto now = steady_clock::now();
  if (quiet_ || (!terminal_ && now < printed_ + kBetweenLines)) return;
  printed_ = now;
  std::cerr << (terminal_ ? kClearLine + text : text + "\n") << std::flush;
  shown_ = terminal_;
}

void ProgressLine::Clear() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (shown_) std::cerr << kClearLine << std::flush;
  shown_ = false;
}

void ProgressLine::Keep(const std::string& text) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (quiet_) return;
  std::cerr << (shown_ ? kClearLine : "") << text << "\n" << std::flush;
  shown_ = false;
}

Progress::Progress(std::string label, std::string unit, std::int64_t total, bool quiet)
    : label_(std::move(label)),
      unit_(std::move(unit)),
      total_(total),
      start_(steady_clock::now()),
      told_(start_),
      line_(quiet) {}

Progress::~Progress() { line_.Keep(ToText()); }

void Progress::Add(std::int64_t count) {
  const std::lock_guard<std::mutex> lock(mutex_);
  count_ += count;
  const auto now = steady_clock::now();
  if (now < told_ + kBetweenCounts) return;
  told_ = now;
  line_.Show(ToText());
}

std::string Progress::ToText() const {
  const double seconds = std::chrono::duration<double>(steady_clock::now() - start_).count();
  const double share = total_ > 0 ? std::min(1.0, static_cast<double>(count_) / static_cast<double>(total_)) : 1.0;
  constexpr int kWidth = 24;
  const int filled = static_cast<int>(share * kWidth);
  const double rate = seconds > 0 ? static_cast<double>(count_) / seconds : 0;
  return label_ + " [" + std::string(filled, '#') + std::string(kWidth - filled, '.') + "] " + Fixed(100 * share, 0) +
         " %  " + Grouped(count_) + " of " + Grouped(total_) + " " + unit_ + ", " + Fixed(rate / 1e6, 2) + " M" +
         unit_ + "/s";
}

Elapsed::Elapsed(std::string label, bool quiet) : line_(quiet) {
  if (quiet) return;
  ticking_ = std::thread([this, label = std::move(label)] {
    const auto start = steady_clock::now();
    std::unique_lock<std::mutex> lock(mutex_);
    while (!ended_.wait_for(lock, kTick, [this] { return over_; })) {
      const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(steady_clock::now() - start);
      line_.Show(label + ", " + Grouped(seconds.count()) + " s");
    }
  });
}

Elapsed::~Elapsed() {
  if (!ticking_.joinable()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    over_ = true;
  }
  ended_.notify_one();
  ticking_.join();
}

}  // namespace sixpoint::cli
