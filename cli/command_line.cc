#include "cli/command_line.h"

#include <CLI/CLI.hpp>
#include <utility>

namespace sixpoint::cli {

Option* Option::Required() {
  option_->required();
  return this;
}
Option* Option::List() {
  option_->delimiter(',')->allow_extra_args(false);
  return this;
}
Option* Option::Repeat() {
  option_->allow_extra_args(false);
  return this;
}
Option* Option::Count(int values) {
  option_->expected(values);
  return this;
}
Option* Option::OneOf(const std::vector<std::string>& words) {
  option_->check(CLI::IsMember(words));
  return this;
}
Option* Option::OneOfAnyCase(const std::vector<std::string>& words) {
  option_->transform(CLI::IsMember(words, CLI::ignore_case));
  return this;
}
Option* Option::Within(int least, int greatest) {
  option_->check(CLI::Range(least, greatest));
  return this;
}
Option* Option::Within(double least, double greatest) {
  option_->check(CLI::Range(least, greatest));
  return this;
}
Option* Option::Positive() {
  option_->check(CLI::PositiveNumber);
  return this;
}
Option* Option::Numbers() {
  option_->check(CLI::Number);
  return this;
}
Option* Option::ShowDefault() {
  option_->capture_default_str();
  return this;
}
Option* Option::FromEnvironment(const std::string& variable) {
  option_->envname(variable);
  return this;
}
Option* Option::Needs(const Option* other) {
  option_->needs(other->option_);
  return this;
}
Option* Option::Excludes(const Option* other) {
  option_->excludes(other->option_);
  return this;
}
bool Option::given() const { return option_->count() > 0; }

Command* Command::AddCommand(const std::string& name, const std::string& help) {
  return &commands_.emplace_back(app_->add_subcommand(name, help));
}

Command* Command::AddChoice(const std::string& name) {
  CLI::Option_group* const group = app_->add_option_group(name);
  group->require_option(1);
  return &commands_.emplace_back(group);
}

template <typename Value>
Option* Command::Add(const std::string& names, Value* value, const std::string& help) {
  return &options_.emplace_back(app_->add_option(names, *value, help));
}
Option* Command::AddOption(const std::string& names, std::string* value, const std::string& help) {
  return Add(names, value, help);
}
Option* Command::AddOption(const std::string& names, int* value, const std::string& help) {
  return Add(names, value, help);
}
Option* Command::AddOption(const std::string& names, std::int64_t* value, const std::string& help) {
  return Add(names, value, help);
}
Option* Command::AddOption(const std::string& names, double* value, const std::string& help) {
  return Add(names, value, help);
}
Option* Command::AddOption(const std::string& names, std::optional<int>* value, const std::string& help) {
  return Add(names, value, help);
}
Option* Command::AddOption(const std::string& names, std::optional<double>* value, const std::string& help) {
  return Add(names, value, help);
}
Option* Command::AddOption(const std::string& names, std::vector<std::string>* values, const std::string& help) {
  return Add(names, values, help);
}
Option* Command::AddOption(const std::string& names, std::vector<double>* values, const std::string& help) {
  return Add(names, values, help);
}
Option* Command::AddFlag(const std::string& names, bool* value, const std::string& help) {
  return &options_.emplace_back(app_->add_flag(names, *value, help));
}

void Command::RequireCommand() { app_->require_subcommand(1); }

void Command::RequireAlso(const std::function<std::string()>& missing) {
  app_->parse_complete_callback([missing] {
    if (const std::string option = missing(); !option.empty()) throw CLI::RequiredError(option);
  });
}

void Command::OnChosen(std::function<void()> action) { app_->callback(std::move(action)); }

CommandLine::CommandLine() : app_(std::make_unique<CLI::App>()), root_(app_.get()) {}
CommandLine::~CommandLine() = default;

std::optional<int> CommandLine::Parse(int argc, const char* const* argv) {
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app_->exit(error);
  }
  return std::nullopt;
}

std::string CommandLine::Parse(const std::string& words) {
  try {
    app_->parse(words);
  } catch (const CLI::ParseError& error) {
    return error.what();
  }
  return "";
}

}  // namespace sixpoint::cli
