// The command line as a whole: its help, and what bash completes.
#include "cli/app.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <functional>
#include <iterator>
#include <set>
#include <sstream>

#include "cli/subprocess.h"

namespace sixpoint::cli {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class AppTest : public ::testing::Test {
 protected:
  AppTest() { AddCommands(line_.root(), &session_); }

  // What bash offers for the last of these words.
  std::set<std::string> Completed(const std::string& words) const {
    const std::string file = ::testing::TempDir() + "/sixpoint_completion";
    std::ofstream(file) << BashCompletion(app_) << "COMP_WORDS=(" << words
                        << ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n_sixpoint\necho \"${COMPREPLY[@]}\"\n";
    const Finished finished = RunProgram({"bash", file});
    EXPECT_EQ(finished.exit_code, 0) << finished.output;
    std::istringstream in(finished.output);
    return {std::istream_iterator<std::string>(in), std::istream_iterator<std::string>()};
  }

  Session session_;
  CommandLine line_;
  CLI::App& app_ = *line_.root()->app();
};

TEST_F(AppTest, ShowsCommandsInGroupsAndExamplesWithEach) {
  const std::string help = app_.help();
  EXPECT_LT(help.find("A plant on this machine"), help.find("Calibration:"));
  EXPECT_THAT(help, Not(HasSubstr("\nSubcommands:")));  // every command stands in a group
  EXPECT_THAT(app_.get_subcommand("scan")->get_subcommand("upload")->help(),
              AllOf(HasSubstr("Examples:\n  sixpoint scan upload cloud.ply"), HasSubstr("--json")));
}

// Every example is a command line that the parser takes.
TEST_F(AppTest, GivesExamplesThatAreRight) {
  int count = 0;
  const std::function<void(CLI::App*)> check = [&](CLI::App* command) {
    std::istringstream lines(command->get_footer());
    std::string whole;
    for (std::string line; std::getline(lines, line);) {
      if (line.rfind("  ", 0) != 0) continue;
      whole += line;
      if (whole.back() == '\\') {
        whole.pop_back();
        continue;
      }
      const std::size_t at = whole.find("sixpoint ");
      std::string words = whole.substr(at + 9);
      whole.clear();
      words = words.substr(0, words.find_first_of("|)"));
      Session session;
      CommandLine example;
      AddCommands(example.root(), &session);
      EXPECT_EQ(example.Parse(words), "") << words;
      ++count;
    }
    for (CLI::App* below : command->get_subcommands([](const CLI::App*) { return true; })) check(below);
  };
  for (CLI::App* command : app_.get_subcommands([](const CLI::App*) { return true; })) check(command);
  EXPECT_GT(count, 40);
}

// One word means one thing, whatever the command.
TEST_F(AppTest, EveryListHasALimitAndEveryOutIsAFile) {
  int lists = 0, outs = 0;
  const std::function<void(CLI::App*)> check = [&](CLI::App* command) {
    if (command->get_name() == "list") {
      ++lists;
      EXPECT_NE(command->get_option_no_throw("--limit"), nullptr) << command->get_parent()->get_name();
    }
    if (const CLI::Option* out = command->get_option_no_throw("--out"); out != nullptr) {
      ++outs;
      EXPECT_THAT(out->get_description(), HasSubstr("; - is standard output")) << command->get_name();
    }
    for (CLI::App* below : command->get_subcommands([](const CLI::App*) { return true; })) check(below);
  };
  check(&app_);
  EXPECT_GT(lists, 20);
  EXPECT_GT(outs, 10);
}

TEST_F(AppTest, NamesTheKindsOfTheRecord) {
  for (const CLI::App* command : {app_.get_subcommand("recall"), app_.get_subcommand("events"),
                                  app_.get_subcommand("webhook")->get_subcommand("add")})
    EXPECT_THAT(command->get_option("--kinds")->get_description(),
                AllOf(HasSubstr(" inspection "), HasSubstr(" machining_pass "), HasSubstr(" registration ")))
        << command->get_name();
}

TEST_F(AppTest, CompletesCommandsAndOptions) {
  EXPECT_EQ(Completed("sixpoint regist"), (std::set<std::string>{"register", "registration"}));
  EXPECT_EQ(Completed("sixpoint certs re"), (std::set<std::string>{"renew", "revoke"}));
  EXPECT_EQ(Completed("sixpoint scan delete"), (std::set<std::string>{"delete-points"}));
  EXPECT_EQ(Completed("sixpoint scan list --li"), (std::set<std::string>{"--limit"}));
  EXPECT_EQ(Completed("sixpoint --json scan list --serv"), (std::set<std::string>{"--server"}));
  EXPECT_EQ(Completed("sixpoint store retention set airfoil --keep"), (std::set<std::string>{"--keep-days"}));
  // Files: bash's own.
  EXPECT_EQ(Completed("sixpoint correct --template ''"), (std::set<std::string>{}));
}

}  // namespace
}  // namespace sixpoint::cli
