#include "cli/subprocess.h"

#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>

namespace sixpoint::cli {
namespace {

Finished Run(const std::vector<std::string>& command, bool with_errors, std::size_t most_bytes) {
  int pipe_ends[2];
  if (pipe(pipe_ends) != 0) return {127, "cannot make a pipe"};
  const pid_t child = fork();
  if (child == 0) {
    dup2(pipe_ends[1], STDOUT_FILENO);
    if (with_errors) dup2(pipe_ends[1], STDERR_FILENO);
    close(pipe_ends[0]);
    close(pipe_ends[1]);
    std::vector<char*> arguments;
    for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    execvp(arguments[0], arguments.data());
    _exit(127);
  }
  close(pipe_ends[1]);
  Finished finished;
  char buffer[4096];
  for (;;) {
    const ssize_t got = read(pipe_ends[0], buffer, sizeof buffer);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    if (finished.output.size() < most_bytes) finished.output.append(buffer, static_cast<std::size_t>(got));
  }
  close(pipe_ends[0]);
  if (child < 0) return {127, "cannot start " + command.front()};
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  finished.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return finished;
}

}  // namespace

Finished RunProgram(const std::vector<std::string>& command) { return Run(command, true, 65536); }

Finished RunTelling(const std::vector<std::string>& command) { return Run(command, false, 64 << 20); }

}  // namespace sixpoint::cli
