#include "cli/secret_input.h"

#include <fcntl.h>
#include <signal.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>

#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

constexpr std::size_t kLongest_bytes = 1024;
constexpr char kOption[] = "--password-file";

// Ctrl-C, where the terminal makes a character of it.
constexpr char kInterrupt = 3;

// The first line, byte by byte: what follows is others' to read.
absl::StatusOr<std::string> FirstLine(int descriptor, const std::string& field, bool of_terminal = false) {
  std::string line;
  for (char byte = 0;;) {
    const ssize_t count = read(descriptor, &byte, 1);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return runtime::Refuse(field, "not readable", "a file, or a descriptor open to be read");
    if (count == 0 || byte == '\n') break;
    if (of_terminal && byte == kInterrupt) return absl::CancelledError("interrupted");
    if (line.size() == kLongest_bytes) return runtime::Refuse(field, "longer", "a first line of at most 1024 bytes");
    line += byte;
  }
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return line;
}

absl::StatusOr<std::string> ReadFrom(const std::string& file) {
  if (file == "-") return FirstLine(STDIN_FILENO, kOption);
  if (file.rfind("fd:", 0) == 0) {
    int number = -1;
    const auto [end, error] = std::from_chars(file.data() + 3, file.data() + file.size(), number);
    if (error != std::errc() || end != file.data() + file.size() || number < 0)
      return runtime::Refuse(kOption, file, "fd: and the number of a descriptor");
    return FirstLine(number, kOption);
  }
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return runtime::Refuse(kOption, file, "a file that can be read");
  absl::StatusOr<std::string> line = FirstLine(descriptor, kOption);
  close(descriptor);
  return line;
}

// The terminal shows nothing that is typed while this lives. Signals wait for its end, and Ctrl-C is a character that ends the line, so
// that nobody is left with a shell that shows nothing.
class WithoutEcho {
 public:
  explicit WithoutEcho(int terminal) : terminal_(terminal) {
    sigset_t waiting;
    sigemptyset(&waiting);
    for (const int signal : {SIGINT, SIGTERM, SIGTSTP, SIGQUIT}) sigaddset(&waiting, signal);
    pthread_sigmask(SIG_BLOCK, &waiting, &signals_before_);
    is_changed_ = tcgetattr(terminal_, &before_) == 0;
    if (!is_changed_) return;
    termios silent = before_;
    silent.c_lflag &= ~static_cast<tcflag_t>(ECHO | ISIG);
    silent.c_cc[VEOL] = kInterrupt;
    is_changed_ = tcsetattr(terminal_, TCSAFLUSH, &silent) == 0;
  }
  ~WithoutEcho() {
    if (is_changed_) tcsetattr(terminal_, TCSAFLUSH, &before_);
    pthread_sigmask(SIG_SETMASK, &signals_before_, nullptr);
  }
  WithoutEcho(const WithoutEcho&) = delete;
  WithoutEcho& operator=(const WithoutEcho&) = delete;
  bool works() const { return is_changed_; }

 private:
  const int terminal_;
  termios before_{};
  sigset_t signals_before_{};
  bool is_changed_ = false;
};

void Say(int terminal, const std::string& text) {
  if (write(terminal, text.data(), text.size()) < 0) return;  // who does not see it types all the same
}

absl::StatusOr<std::string> Asked(const std::string& prompt) {
  const int terminal = open("/dev/tty", O_RDWR | O_CLOEXEC | O_NOCTTY);
  if (terminal < 0) return runtime::Refuse(kOption, "", "a file with the password, or a terminal to type it at");
  Say(terminal, prompt + ": ");
  absl::StatusOr<std::string> line = [&]() -> absl::StatusOr<std::string> {
    const WithoutEcho silent(terminal);
    if (!silent.works()) return runtime::Refuse(kOption, "", "a terminal that can hide what is typed");
    return FirstLine(terminal, "password", /*of_terminal=*/true);
  }();
  Say(terminal, "\n");
  close(terminal);
  return line;
}

}  // namespace

absl::StatusOr<std::string> ReadSecret(const std::string& prompt, const std::string& file, bool twice) {
  if (!file.empty()) return ReadFrom(file);
  absl::StatusOr<std::string> first = Asked(prompt);
  if (!first.ok() || !twice) return first;
  const absl::StatusOr<std::string> second = Asked(prompt + ", once more");
  if (!second.ok()) return second;
  if (*first != *second) return runtime::Refuse("password", "not the same twice", "the same");
  return first;
}

}  // namespace sixpoint::cli
