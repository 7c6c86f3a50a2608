// A secret from a file, a descriptor and a terminal, of which nobody sees it.
#include "cli/secret_input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <string>

namespace sixpoint::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kSecret[] = "correct horse battery staple";

TEST(Secret, IsTheFirstLineOfAFileOrDescriptor) {
  const std::string file = ::testing::TempDir() + "secret-" + std::to_string(getpid());
  for (const std::string& content :
       {std::string(kSecret), std::string(kSecret) + "\n", std::string(kSecret) + "\r\nmore\n"}) {
    std::ofstream(file) << content;
    EXPECT_EQ(ReadSecret("password", file, true).value(), kSecret);
  }
  std::FILE* const open = std::fopen(file.c_str(), "r");
  EXPECT_EQ(ReadSecret("password", "fd:" + std::to_string(fileno(open)), true).value(), kSecret);
  std::fclose(open);
  std::ofstream(file) << std::string(2000, 'x');
  EXPECT_TRUE(absl::IsInvalidArgument(ReadSecret("password", file, true).status()));
  std::remove(file.c_str());
  for (const std::string other : {"/nowhere/secret", "fd:", "fd:x", "fd:-1", "fd:9999"})
    EXPECT_TRUE(absl::IsInvalidArgument(ReadSecret("password", other, true).status())) << other;
}

// A terminal of the test's own, at which a child asks: what the terminal showed, and what the child got.
std::string Typed(const std::vector<std::string>& lines, std::string* shown) {
  int terminal = -1;
  const pid_t child = forkpty(&terminal, nullptr, nullptr, nullptr);
  if (child == 0) {
    const absl::StatusOr<std::string> secret = ReadSecret("password", "", true);
    const std::string said =
        secret.ok() ? (*secret == kSecret ? "GOT IT" : "OTHER") : std::string(secret.status().message());
    std::printf("[%s]", said.c_str());
    std::fflush(stdout);
    std::_Exit(0);
  }
  const auto read_to = [&](const std::string& mark) {
    std::string text;
    for (char byte = 0; text.find(mark) == std::string::npos && read(terminal, &byte, 1) == 1;) text += byte;
    *shown += text;
    return text;
  };
  for (const std::string& line : lines) {
    read_to(": ");
    // Echo is off before it is read: what is typed before that is thrown away.
    termios state{};
    while (tcgetattr(terminal, &state) == 0 && (state.c_lflag & ECHO) != 0) usleep(1000);
    usleep(20000);
    if (write(terminal, line.data(), line.size()) < 0) break;
  }
  read_to("[");
  const std::string end = read_to("]");
  int status = 0;
  waitpid(child, &status, 0);
  close(terminal);
  return end.substr(0, end.find(']'));
}

TEST(Secret, IsTypedTwiceAndNotShown) {
  std::string shown;
  EXPECT_EQ(Typed({std::string(kSecret) + "\n", std::string(kSecret) + "\n"}, &shown), "GOT IT");
  EXPECT_THAT(shown, HasSubstr("password, once more: "));
  EXPECT_THAT(shown, Not(HasSubstr("horse")));
  EXPECT_THAT(Typed({std::string(kSecret) + "\n", "another\n"}, &shown), HasSubstr("not the same twice"));
  EXPECT_THAT(shown, Not(HasSubstr("horse")));
}

// And leaves the terminal as it was.
TEST(Secret, IsInterruptedByCtrlC) {
  std::string shown;
  EXPECT_EQ(Typed({"half\x03"}, &shown), "interrupted");
}

}  // namespace
}  // namespace sixpoint::cli
