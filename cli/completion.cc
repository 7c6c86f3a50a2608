// `sixpoint completion bash`: the words that may follow each command, as a script that bash reads once.
#include <CLI/CLI.hpp>
#include <iostream>
#include <set>

#include "cli/app.h"
#include "cli/commands.h"

namespace sixpoint::cli {
namespace {

// What follows a command, and which of all options want a value after them.
struct CompletionWords {
  std::string by_command;  // ["sixpoint scan upload"]="--machine ..."
  std::set<std::string> with_value;
};

std::vector<const CLI::App*> SubcommandsOf(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

void AddOptions(const CLI::App& app, std::string* following, CompletionWords* words) {
  for (const CLI::Option* option : app.get_options()) {
    std::vector<std::string> names;
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
    for (const std::string& name : names) {
      *following += name + " ";
      if (option->get_items_expected_max() > 0) words->with_value.insert(name);
    }
  }
}

void AddCommand(const CLI::App& app, const std::string& path, CompletionWords* words) {
  std::string following;
  for (const CLI::App* command : SubcommandsOf(app)) {
    if (command->get_name().empty()) {  // a group of options
      AddOptions(*command, &following, words);
      continue;
    }
    following += command->get_name() + " ";
    AddCommand(*command, path + " " + command->get_name(), words);
  }
  AddOptions(app, &following, words);
  words->by_command += "  [\"" + path + "\"]=\"" + following + "\"\n";
}

// The longest command that the words before the cursor name decides what may follow. bash itself completes files, where nothing
// does: behind an option that wants a value, and where the words are none of ours.
constexpr char kFunction[] = R"sh(
_sixpoint() {
  local word path=sixpoint current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ -n ${_sixpoint_words["$path $word"]+known} ]] && path="$path $word"
  done
  COMPREPLY=()
  [[ $_sixpoint_with_value == *" $previous "* ]] && return
  local words=${_sixpoint_words["$path"]}
  [[ $current == -* ]] && words+=" ${_sixpoint_words[sixpoint]}"
  COMPREPLY=($(compgen -W "$words" -- "$current"))
}
complete -o default -F _sixpoint sixpoint
)sh";

}  // namespace

std::string BashCompletion(const CLI::App& app) {
  CompletionWords words;
  AddCommand(app, app.get_name(), &words);
  std::string with_value = " ";
  for (const std::string& name : words.with_value) with_value += name + " ";
  return "# For ~/.bashrc: source <(sixpoint completion bash)\ndeclare -A _sixpoint_words=(\n" + words.by_command +
         ")\n_sixpoint_with_value=\"" + with_value + "\"" + kFunction;
}

void AddCompletionCommand(Command* root, Session* session) {
  Command* completion = root->AddCommand("completion", "Prints a script that completes commands and options");
  const auto shell = std::make_shared<std::string>();
  completion->AddOption("SHELL", shell.get(), "bash")->Required()->OneOf({"bash"});
  session->OnCommand(completion, [root, shell] {
    std::cout << BashCompletion(*root->app());
    return absl::OkStatus();
  });
}

}  // namespace sixpoint::cli
