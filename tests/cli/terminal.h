// What is told on a terminal alone.
#pragma once

#include <pty.h>
#include <unistd.h>

#include <functional>
#include <string>

namespace sixpoint::cli {

// What the work wrote to a terminal that stands in for stderr.
inline std::string OnATerminal(const std::function<void()>& work) {
  int terminal = -1, keyboard = -1;
  if (openpty(&terminal, &keyboard, nullptr, nullptr, nullptr) != 0) return "no terminal";
  const int before = dup(STDERR_FILENO);
  dup2(keyboard, STDERR_FILENO);
  work();
  dup2(before, STDERR_FILENO);
  // A terminal hands on what was written piece by piece, some of it later: it is read to this mark.
  constexpr char kEnd = '\0';
  std::string seen;
  if (write(keyboard, &kEnd, 1) != 1) return "no terminal";
  for (char byte = 0; read(terminal, &byte, 1) == 1 && byte != kEnd;) seen += byte;
  for (const int handle : {terminal, keyboard, before}) close(handle);
  return seen;
}

}  // namespace sixpoint::cli
