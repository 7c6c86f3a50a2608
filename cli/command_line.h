// Commands, their options, and what is done when one is given: a face of CLI11, which is included in few sources only since it
// takes seconds to compile in each.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace sixpoint::cli {

// One option, or one word that a command takes by its place. Each setter gives the option back.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}
  Option* Required();
  Option* List();    // VALUE,VALUE,... in one word
  Option* Repeat();  // one value a word, the option as often as wanted
  Option* Count(int values);
  Option* OneOf(const std::vector<std::string>& words);
  Option* OneOfAnyCase(const std::vector<std::string>& words);  // what is kept is written as here
  Option* Within(int least, int greatest);
  Option* Within(double least, double greatest);
  Option* Positive();
  Option* Numbers();      // of an option that keeps their texts
  Option* ShowDefault();  // in the help
  Option* FromEnvironment(const std::string& variable);
  Option* Needs(const Option* other);
  Option* Excludes(const Option* other);
  bool given() const;

 private:
  CLI::Option* const option_;
};

class Command {
 public:
  explicit Command(CLI::App* app) : app_(app) {}
  Command(const Command&) = delete;

  Command* AddCommand(const std::string& name, const std::string& help);
  // Of its options exactly one is wanted.
  Command* AddChoice(const std::string& name);
  // names: "--machine", "-o,--out", or "FILE" for a word by its place.
  Option* AddOption(const std::string& names, std::string* value, const std::string& help);
  Option* AddOption(const std::string& names, int* value, const std::string& help);
  Option* AddOption(const std::string& names, std::int64_t* value, const std::string& help);
  Option* AddOption(const std::string& names, double* value, const std::string& help);
  Option* AddOption(const std::string& names, std::optional<int>* value, const std::string& help);
  Option* AddOption(const std::string& names, std::optional<double>* value, const std::string& help);
  Option* AddOption(const std::string& names, std::vector<std::string>* values, const std::string& help);
  Option* AddOption(const std::string& names, std::vector<double>* values, const std::string& help);
  Option* AddFlag(const std::string& names, bool* value, const std::string& help);
  // One of its commands is wanted.
  void RequireCommand();
  // Called once its options are read: names the option that is missing, or nothing.
  void RequireAlso(const std::function<std::string()>& missing);
  void OnChosen(std::function<void()> action);
  CLI::App* app() const { return app_; }

 private:
  template <typename Value>
  Option* Add(const std::string& names, Value* value, const std::string& help);

  CLI::App* const app_;
  std::deque<Command> commands_;  // their addresses stay
  std::deque<Option> options_;
};

// A whole line, from its root.
class CommandLine {
 public:
  CommandLine();
  ~CommandLine();
  Command* root() { return &root_; }
  // What the process ends with where nothing is to be done: help was asked for (0), or the line is wrong, which is said on stderr.
  std::optional<int> Parse(int argc, const char* const* argv);
  // Without the program's name; gives what is wrong with the line, or nothing.
  std::string Parse(const std::string& words);

 private:
  const std::unique_ptr<CLI::App> app_;
  Command root_;
};

}  // namespace sixpoint::cli
