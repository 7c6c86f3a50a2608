// `sixpoint`, the engineer's tool: wiring only.
#include <CLI/CLI.hpp>
#include <iostream>

#include "cli/app.h"
#include "cli/config.h"

int main(int argc, char** argv) {
  using namespace sixpoint::cli;
  Session session;
  // Before the options are added, so that those given on the command line or by the environment come after it.
  session.config_file = ConfigFileOf(argc, argv);
  if (const absl::Status read = ApplyConfig(session.config_file, &session); !read.ok()) {
    std::cerr << FailureToText(read, session.server);
    return kUsage;
  }
  CLI::App app;
  AddCommands(&app, &session);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help and version are no failures; all else is wrong usage.
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  return session.Run();
}
