// One command line in this process, with what it printed.
#pragma once

#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "cli/app.h"

namespace sixpoint::cli {

struct Ended {
  int exit_code = -1;  // -1: the line is wrong, and `err` says how
  std::string out, err;
  nlohmann::json json() const { return nlohmann::json::parse(out, nullptr, false); }
};

// `prepare` sees the session before the line is read.
inline Ended RunCommand(const std::string& words, const std::function<void(Session*)>& prepare = nullptr) {
  Session session;
  if (prepare) prepare(&session);
  CommandLine line;
  AddCommands(line.root(), &session);
  Ended ended;
  ended.err = line.Parse(words);
  if (!ended.err.empty()) return ended;
  std::ostringstream out, err;
  std::streambuf* const cout_before = std::cout.rdbuf(out.rdbuf());
  std::streambuf* const cerr_before = std::cerr.rdbuf(err.rdbuf());
  ended.exit_code = session.Run();
  std::cout.rdbuf(cout_before);
  std::cerr.rdbuf(cerr_before);
  ended.out = out.str();
  ended.err = err.str();
  return ended;
}

}  // namespace sixpoint::cli
