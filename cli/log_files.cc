#include "cli/log_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;
using std::chrono::system_clock;

constexpr int kMostFiles = 20;
constexpr std::size_t kChunk_bytes = 65536;
// Lines without a time at a file's beginning wait for one that has it.
constexpr std::size_t kMostWaiting = 100;

}  // namespace

LogFile::LogFile(fs::path file, std::string source, uid_t owner, LogStart start)
    : file_(std::move(file)), source_(std::move(source)), owner_(owner), start_(start) {}

std::vector<LogFile::Place> LogFile::Places() const {
  std::vector<Place> places;
  for (int i = 0; i < kMostFiles; ++i) {
    const fs::path file = i == 0 ? file_ : fs::path(file_.string() + "." + std::to_string(i));
    struct stat found {};
    if (lstat(file.c_str(), &found) != 0) {
      if (i == 0) continue;  // between two files
      break;
    }
    if (!S_ISREG(found.st_mode) || found.st_uid != owner_) continue;
    places.push_back({file, found.st_ino, found.st_size, system_clock::from_time_t(found.st_mtime)});
  }
  return places;
}

bool LogFile::Open(const Place& place) {
  Descriptor opened(open(place.file.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct stat found {};
  if (opened.number() < 0 || fstat(opened.number(), &found) != 0 || !S_ISREG(found.st_mode) || found.st_uid != owner_ ||
      found.st_ino != place.inode)
    return false;
  opened_.emplace(std::move(opened));
  inode_ = place.inode;
  read_bytes_ = 0;
  is_drained_ = false;
  return true;
}

bool LogFile::OpenFirst() {
  const std::vector<Place> places = Places();
  if (places.empty()) return false;
  std::size_t first = 0;
  std::int64_t behind_bytes = places[0].size_bytes;
  const auto is_wanted = [&](const Place& place) {
    if (start_.last_bytes && behind_bytes >= *start_.last_bytes) return false;
    return !start_.since || place.changed >= *start_.since;
  };
  while (first + 1 < places.size() && is_wanted(places[first + 1])) behind_bytes += places[++first].size_bytes;
  if (!Open(places[first])) return false;
  if (start_.last_bytes && behind_bytes > *start_.last_bytes) {
    read_bytes_ = std::min(behind_bytes - *start_.last_bytes, places[first].size_bytes);
    lseek(opened_->number(), read_bytes_, SEEK_SET);
    cuts_ = read_bytes_ > 0;  // begins within a line
  }
  return true;
}

// True: there may be more to read.
bool LogFile::MoveOn() {
  if (!opened_) return OpenFirst();
  const std::vector<Place> places = Places();
  const auto own =
      std::find_if(places.begin(), places.end(), [this](const Place& place) { return place.inode == inode_; });
  if (own == places.begin() && !places.empty()) {
    // As logrotate's copytruncate does: the file begins anew.
    if (own->size_bytes >= read_bytes_) return false;
    lseek(opened_->number(), 0, SEEK_SET);
    read_bytes_ = 0;
    buffer_.clear();
    begin_ = 0;
    return true;
  }
  if (places.empty()) return false;
  if (!is_drained_) {
    is_drained_ = true;  // what was written before it was moved on
    return true;
  }
  if (own == places.end()) {
    has_lost_ = true;
    buffer_.clear();
    begin_ = 0;
    return Open(places.back());
  }
  return Open(*std::prev(own));
}

std::optional<std::string> LogFile::NextText() {
  for (;;) {
    const std::size_t end = buffer_.find('\n', begin_);
    if (end != std::string::npos) {
      std::string text = buffer_.substr(begin_, std::min(end - begin_, kLongestLine_bytes));
      begin_ = end + 1;
      if (std::exchange(cuts_, false)) continue;
      return text;
    }
    buffer_.erase(0, begin_);
    begin_ = 0;
    if (buffer_.size() >= kLongestLine_bytes) {
      std::string text = buffer_.substr(0, kLongestLine_bytes);
      buffer_.clear();
      if (std::exchange(cuts_, true)) continue;
      return text;
    }
    char chunk[kChunk_bytes];
    const ssize_t got = opened_ ? read(opened_->number(), chunk, sizeof chunk) : 0;
    if (got < 0 && errno == EINTR) continue;
    if (got > 0) {
      buffer_.append(chunk, static_cast<std::size_t>(got));
      read_bytes_ += got;
    } else if (!MoveOn()) {
      return std::nullopt;
    }
  }
}

// What goes on from the line before has its time and level.
LogLine LogFile::Timed(LogLine line) {
  const bool goes_on = !line.time;
  if (goes_on) line.time = last_time_;
  last_time_ = line.time;
  if (line.level.empty() && (goes_on || source_ == "postgres")) line.level = last_level_;
  last_level_ = line.level;
  return line;
}

std::optional<LogLine> LogFile::Next() {
  while (waiting_.empty() || (!last_time_ && waiting_.size() < kMostWaiting)) {
    const std::optional<std::string> text = NextText();
    if (!text) break;
    if (text->empty()) continue;
    LogLine line = ParseLogLine(source_, *text);
    if (!last_time_ && line.time) last_time_ = line.time;
    waiting_.push_back(std::move(line));
  }
  if (waiting_.empty()) return std::nullopt;
  LogLine line = Timed(std::move(waiting_.front()));
  waiting_.pop_front();
  return line;
}

std::optional<LogLine> LogFile::HalfLine() {
  std::string text = buffer_.substr(begin_);
  buffer_.clear();
  begin_ = 0;
  if (text.empty() || cuts_) return std::nullopt;
  return Timed(ParseLogLine(source_, text));
}

std::vector<LogFile> LogFilesIn(const fs::path& folder, const std::vector<std::string>& sources, uid_t owner,
                                const LogStart& start) {
  std::vector<LogFile> files;
  for (const std::string& source : sources) files.emplace_back(folder / (source + ".log"), source, owner, start);
  return files;
}

void ForEachLogLine(std::vector<LogFile>* files, bool half_lines, const std::function<bool(const LogLine&)>& take) {
  const std::size_t count = files->size();
  std::vector<std::optional<LogLine>> next(count);
  std::vector<bool> ended(count, false);
  const auto is_before = [](const LogLine& a, const LogLine& b) { return a.time < b.time; };
  for (;;) {
    std::optional<std::size_t> first;
    for (std::size_t i = 0; i < count; ++i) {
      if (!next[i] && !ended[i]) {
        next[i] = (*files)[i].Next();
        if (!next[i] && half_lines) next[i] = (*files)[i].HalfLine();
        ended[i] = !next[i];
      }
      if (next[i] && (!first || is_before(*next[i], *next[*first]))) first = i;
    }
    if (!first || !take(*next[*first])) return;
    next[*first].reset();
  }
}

}  // namespace sixpoint::cli
