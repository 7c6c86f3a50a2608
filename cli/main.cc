// `sixpoint`, the engineer's tool: wiring only.
#include <cstdlib>
#include <iostream>

#include "cli/app.h"
#include "cli/config.h"

int main(int argc, char** argv) {
  using namespace sixpoint::cli;
  // What gRPC says on stderr of a connection that fails is said in our own words (GRPC_VERBOSITY=info shows it).
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  Session session;
  // Before the options are added, so that those given on the command line or by the environment come after it.
  session.config_file = ConfigFileOf(argc, argv);
  if (const absl::Status read = ApplyConfig(session.config_file, &session); !read.ok()) {
    std::cerr << FailureToText(read, session.server);
    return kUsage;
  }
  CommandLine line;
  AddCommands(line.root(), &session);
  // Help and version are no failures; all else is wrong usage.
  if (const std::optional<int> ended = line.Parse(argc, argv)) return *ended == 0 ? kDone : kUsage;
  return session.Run();
}
