// A program's log as supervisord keeps it: FILE, and what FILE was before it had grown too great as FILE.1, FILE.2, ... Read from the
// oldest on, over the moments at which it is moved on; nothing more than one line is held.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/log_line.h"
#include "cli/plant_folder.h"

namespace sixpoint::cli {

// Where to begin.
struct LogStart {
  std::optional<std::chrono::system_clock::time_point> since;  // older files are not looked into
  std::optional<std::int64_t> last_bytes;                      // so many from the end
};

// Reads files of `owner` alone, themselves and no links.
class LogFile {
 public:
  LogFile(std::filesystem::path file, std::string source, uid_t owner, LogStart start);
  // The next whole line; none: there is no more for now. A line without a time has that of the line before it.
  std::optional<LogLine> Next();
  // What stands at the end without an end of line: of a program that is writing, or was killed at it.
  std::optional<LogLine> HalfLine();
  // Whether a file was moved out of reach before it was read to its end.
  bool has_lost() const { return has_lost_; }
  const std::string& source() const { return source_; }

 private:
  struct Place {
    std::filesystem::path file;
    ino_t inode;
    std::int64_t size_bytes;
    std::chrono::system_clock::time_point changed;
  };
  std::vector<Place> Places() const;  // newest first
  bool OpenFirst();
  bool Open(const Place& place);
  bool MoveOn();
  std::optional<std::string> NextText();
  LogLine Timed(LogLine line);

  const std::filesystem::path file_;
  const std::string source_;
  const uid_t owner_;
  const LogStart start_;
  std::optional<Descriptor> opened_;
  ino_t inode_ = 0;
  std::int64_t read_bytes_ = 0;  // of the opened file
  bool is_drained_ = false;      // read to its end after it was moved on
  bool cuts_ = false;            // what follows up to the end of the line is not kept
  bool has_lost_ = false;
  std::string buffer_;
  std::size_t begin_ = 0;  // of what is not given yet
  std::optional<std::chrono::system_clock::time_point> last_time_;
  std::string last_level_;
  std::deque<LogLine> waiting_;  // before the first that says its time
};

// All that there are in the folder.
std::vector<LogFile> LogFilesIn(const std::filesystem::path& folder, const std::vector<std::string>& sources,
                                uid_t owner, const LogStart& start);

// Each line of all files in the order of their times, as far as they are written; `take` gives false to end.
void ForEachLogLine(std::vector<LogFile>* files, bool half_lines, const std::function<bool(const LogLine&)>& take);

}  // namespace sixpoint::cli
